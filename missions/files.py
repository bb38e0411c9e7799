"""Reading a mission's files: bounded, from regular files, and not from outside the mission's folder."""

from __future__ import annotations

import os
from pathlib import Path

from missions.errors import MissionError
from missions.maps import MAX_FILE_BYTES

MAX_MISSION_BYTES = 5_000_000


def read_text(path: Path) -> str:
    """Read a mission file.

    Raises:
        MissionError: absent, not a file, unreadable, too large, or not UTF-8 (with the line).
    """
    try:
        if path.is_dir():
            raise MissionError("a directory; allowed: a mission file", file=str(path))
        data = _read(path, MAX_MISSION_BYTES)
    except FileNotFoundError:
        raise MissionError("no such file", file=str(path)) from None
    except MissionError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL
        raise MissionError(f"cannot read: {_reason(error)}", file=str(path)) from None
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise MissionError(
            f"not UTF-8 text (byte 0x{data[error.start]:02X}); save the file as UTF-8", file=str(path), line=line
        ) from None


def read_map_file(folder: Path, name: str) -> bytes:
    """Read a file that a mission names.

    Args:
        folder: the mission's folder; relative names are looked up in it and may not lead out of it, neither by
            ``..`` nor by a symbolic link. Absolute names are taken as the user's explicit wish.
        name: as written in the mission.

    Raises:
        MissionError: outside the folder, absent, not a regular file, unreadable, or too large. Names no place: the
            caller knows the line.
    """
    path = folder / name
    try:
        if not Path(name).is_absolute() and not path.resolve().is_relative_to(folder.resolve()):
            raise MissionError(f"{name!r} leads out of the mission's folder; allowed: inside it, or an absolute path")
        if not path.exists():
            raise MissionError(f"no such file: {os.fspath(path)!r}")
        if not path.is_file():
            raise MissionError(f"not a regular file: {os.fspath(path)!r}")
        return _read(path, MAX_FILE_BYTES)
    except MissionError:
        raise
    except (OSError, RuntimeError, ValueError) as error:  # RuntimeError: a loop of symbolic links (Python < 3.13)
        raise MissionError(f"cannot read {name!r}: {_reason(error)}") from None


def _read(path: Path, limit: int) -> bytes:
    with path.open("rb") as stream:
        data = stream.read(limit + 1)
    if len(data) > limit:
        raise MissionError(f"file of more than {limit} bytes; allowed: at most that", file=str(path))
    return data


def _reason(error: Exception) -> str:
    return (error.strerror if isinstance(error, OSError) else None) or str(error) or type(error).__name__
