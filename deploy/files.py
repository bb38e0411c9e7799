"""Writing files whole or not at all."""

from __future__ import annotations

import os
import secrets
from pathlib import Path


def write_whole(path: Path, data: bytes, *, replace: bool = True) -> None:
    """Write a file under another name and move it into place, so that nobody ever sees half of it.

    Args:
        path: the file; its folder has to exist.
        data: all of it.
        replace: whether a file that is there may go.

    Raises:
        FileExistsError: there is a file and it may not go.
        OSError: the folder cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}")
    try:
        with temporary.open("xb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        if replace:
            temporary.replace(path)
        else:
            os.link(temporary, path)  # fails where a file is, also one that appeared just now
    finally:
        temporary.unlink(missing_ok=True)
