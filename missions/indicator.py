"""Smooth connection indicators Γ (IMEC, Eq. 27 and 28), as logarithms, which pull from afar.

With s = |a − b|²/R_c² and steepness r_Γ:

    Gaussian  Γ = exp(−½ r_Γ s)
    sigmoid   Γ = 1/(1 + exp(r_Γ (s − 1)))
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np

from missions.arrays import Array


class LogIndicator(NamedTuple):
    """log Γ at s, and its derivative with respect to s; both as the shape of s."""

    value: Array
    slope: Array


class Indicator(NamedTuple):
    """Which indicator.

    Attributes:
        shape: Gaussian or sigmoid. steepness: r_Γ.
    """

    shape: Literal["gaussian", "sigmoid"] = "gaussian"
    steepness: float = 1.0

    def log(self, s: Array) -> LogIndicator:
        """Log Γ and its slope at squared distances s in units of R_c²."""
        return _SHAPES[self.shape](s, self.steepness)

    def __call__(self, distance: Array, R_c: float) -> Array:
        """Γ at distances [m]."""
        value: Array = np.exp(self.log((distance / R_c) ** 2).value)
        return value


def _gaussian(s: Array, steepness: float) -> LogIndicator:
    return LogIndicator(-0.5 * steepness * s, np.full_like(s, -0.5 * steepness))


def _sigmoid(s: Array, steepness: float) -> LogIndicator:
    x = steepness * (s - 1.0)
    tail = np.exp(-np.abs(x))
    value = -np.maximum(x, 0.0) - np.log1p(tail)  # −log(1 + eˣ) without overflow
    return LogIndicator(value, -steepness * np.where(x >= 0.0, 1.0, tail) / (1.0 + tail))


_SHAPES: dict[str, Callable[[Array, float], LogIndicator]] = {"gaussian": _gaussian, "sigmoid": _sigmoid}
