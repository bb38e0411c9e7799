"""Frames from a recording. Nothing here opens files: hand in an iterable."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from mocap.source import MocapFrame


class ReplayMocap:
    """A source that plays recorded frames back at their times.

    Args:
        frames: in rising order of time; read only as far as time has come.
        now: the flight clock's time [s]; a frame appears when its ``t`` is reached.
    """

    def __init__(self, frames: Iterable[MocapFrame], now: Callable[[], float]) -> None:
        self._frames, self._now = iter(frames), now
        self._next: MocapFrame | None = next(self._frames, None)

    def poll(self) -> Sequence[MocapFrame]:
        """Frames up to the present, oldest first; a recording that is over, or closed, is silent."""
        due: list[MocapFrame] = []
        while self._next is not None and self._next.t <= self._now():
            due.append(self._next)
            self._next = next(self._frames, None)
        return due

    def close(self) -> None:
        """Forget the rest of the recording."""
        self._frames, self._next = iter(()), None
