"""Figures as words: the same figure reads the same everywhere on the page."""

from __future__ import annotations

import math


def number(value: float | None, digits: int = 2, unit: str = "") -> str:
    """A figure, or a dash when there is none."""
    if value is None or not math.isfinite(value):
        return "–"
    return f"{value:.{digits}f}{' ' + unit if unit else ''}"


def scientific(value: float) -> str:
    """A figure like 1.9e-3, or a dash."""
    return "–" if not math.isfinite(value) else f"{value:.2e}".replace("e-0", "e-").replace("e+0", "e")
