"""Information that is used up by looking: a sensing model lowers the map where somebody has been.

Somebody at q sees information at x at the rate r exp(−|x − q|²/(2 σ²)); after a time dt so much of it is left:

    φ(x) ← φ(x) exp(−r dt Σ_i exp(−|x − q_i|²/(2 σ²)))
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.errors import PlannerError

_AT_ONCE = 512  # positions whose views are worked out at once


@dataclass(frozen=True)
class Sensing:
    """How looking uses information up.

    Attributes:
        radius: σ, how far a look reaches [m]. rate: r, share that is seen in the middle of a look [1/s].
    """

    radius: float
    rate: float

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.rate >= 0.0):
            raise PlannerError(f"sensing: got radius {self.radius:g}, rate {self.rate:g}; allowed: above 0, 0 or more")


def consumed(density: Array, lower: Array, upper: Array, q: Array, dt: float, sensing: Sensing) -> Array:
    """What is left of a map after robots have been at positions for a time each.

    Args:
        density: information by cell, (X, Y) or (X, Y, Z), as array maps have it.
        lower: (ν,) lower corner of the box that the cells tile [m].
        upper: (ν,) upper corner [m].
        q: (K, N, ν) positions [m].
        dt: how long at each [s].
        sensing: what a look does.

    Returns:
        A new map of the same shape, nowhere higher. It can be all but zero: then there is nothing left to search for.

    Raises:
        PlannerError: positions of another dimension than the map.
    """
    nu = density.ndim
    if q.shape[-1] != nu or len(lower) != nu:
        raise PlannerError(f"a map of {nu} axes and positions of {q.shape[-1]}; allowed: as many")
    points = q.reshape(-1, nu)
    looked = np.zeros(density.shape)
    letters = "abc"[:nu]
    spec = ",".join(f"m{letter}" for letter in letters) + f"->{letters}"
    for begin in range(0, len(points), _AT_ONCE):  # a Gaussian is separable: one factor an axis
        part = points[begin : begin + _AT_ONCE]
        factors = []
        for axis, cells in enumerate(density.shape):
            centre = lower[axis] + (np.arange(cells) + 0.5) / cells * (upper[axis] - lower[axis])
            factors.append(np.exp(-((centre - part[:, axis, None]) ** 2) / (2.0 * sensing.radius**2)))
        looked += np.einsum(spec, *factors, optimize=True)
    left: Array = density * np.exp(-sensing.rate * dt * looked)
    return left
