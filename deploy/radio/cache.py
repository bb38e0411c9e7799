"""Where drones' tables of contents are kept between flights; they take most of a connection's time."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def toc_cache(kind: str) -> Path | None:
    """Folder for the tables of one kind of drone; None if none can be made (then nothing is kept).

    Simulated and real drones never share a folder: a table is found by its checksum alone, and a wrong one would send
    parameters to wrong numbers.

    Args:
        kind: ``hardware`` or ``simulated``.
    """
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or Path.home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = Path.home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = base / "ergoflie" / "toc" / kind
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return None
    return folder if os.access(folder, os.W_OK) else None
