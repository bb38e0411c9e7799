"""Numbers and texts into a page: small, exact enough to draw, and unable to become markup."""

from __future__ import annotations

import base64
import json
import math

import numpy as np

from missions.arrays import Array

_STEPS = 65534  # that a range is divided into; 65535 is a value that is not known


def packed(values: Array) -> dict[str, object]:
    """Numbers as base64 of little-endian 16-bit steps between the least and the largest: 20 times finer than a screen.

    ``{"lo", "hi", "data"}``; NaN stays NaN.
    """
    values = np.asarray(values, dtype=np.float64)
    known = np.isfinite(values)
    low, high = (float(values[known].min()), float(values[known].max())) if known.any() else (0.0, 0.0)
    scale = _STEPS / (high - low) if high > low else 0.0
    steps = np.where(known, np.round((np.where(known, values, low) - low) * scale), _STEPS + 1)
    return {"lo": low, "hi": high, "data": base64.b64encode(steps.astype("<u2").tobytes()).decode()}


def script_json(value: object) -> str:
    """JSON that may stand inside a script element, whatever texts are in it."""
    text = json.dumps(_plain(value), allow_nan=False, separators=(",", ":"))
    # "</script>" and "<!--" are what an HTML parser looks for inside a script; without "<" there is neither.
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def thin(t: Array, y: Array, points: int, keep: str = "every") -> tuple[Array, Array]:
    """At most ``points`` samples of a curve: every n-th, or of each n the ``largest`` or ``smallest``.

    Limits are judged by extremes: a curve with a limit keeps them.
    """
    n = math.ceil(len(t) / points)
    if n <= 1:
        return t, y
    whole = len(t) // n * n
    if keep == "every":
        return t[:whole:n], y[:whole:n]
    blocks = y[:whole].reshape(-1, n)
    worst = np.where(np.isnan(blocks), -np.inf, blocks if keep == "largest" else -blocks).argmax(axis=1)
    rows = np.arange(len(blocks))
    return t[:whole].reshape(-1, n)[rows, worst], blocks[rows, worst]


def _plain(value: object) -> object:
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value
