"""Errors of mission files.

::

    MissionError          anything wrong with a mission file; str() is one line: file:line: path: reason
"""

from __future__ import annotations


class MissionError(ValueError):
    """A mission file cannot be used.

    Args:
        reason: what is wrong, what was found, what is allowed.
        where: path of the value inside the file, e.g. ``robots[2].uri``.
        file: the file, as the user named it.
        line: 1-based line in the file.
    """

    def __init__(self, reason: str, *, where: str = "", file: str = "", line: int | None = None) -> None:
        self.reason, self.where, self.file, self.line = reason, where, file, line
        place = f"{file}:{line}" if file and line is not None else file
        super().__init__(": ".join(part for part in (place, where, reason) if part))
