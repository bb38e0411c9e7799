"""Many minimisations at once: L-BFGS over a stack of problems of one size, each with its own memory and step.

What one evaluation of a small problem costs in NumPy is calls; a hundred share them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array

MEMORY = 10
SUFFICIENT = 1e-4  # share of the promised decrease that a step has to bring (Armijo)
SHORTER = 0.3  # a step that did not is tried again with this share of its length
FIRST_STEP = 0.05  # largest component of the first step; scaled by curvature from then on
PATIENCE, SETTLED = 50, 0.02  # settled: not lower by this share after so many iterations
_TINY = 1e-14

Objective = Callable[[Array], tuple[Array, Array]]


@dataclass
class _Memory:
    """The last pairs of step and change of gradient of every lane."""

    lanes: int
    size: int
    pairs: int = 0
    s: Array = field(init=False)
    y: Array = field(init=False)
    rho: Array = field(init=False)
    scale: Array = field(init=False)

    def __post_init__(self) -> None:
        self.s = np.zeros((MEMORY, self.lanes, self.size))
        self.y = np.zeros_like(self.s)
        self.rho = np.zeros((MEMORY, self.lanes))
        self.scale = np.ones(self.lanes)

    def add(self, s: Array, y: Array, accepted: NDArray[np.bool_]) -> None:
        """A pair for each lane; lanes without a step, or with one along which the slope did not grow, add nothing."""
        curvature = np.einsum("bn,bn->b", s, y)
        good = accepted & (curvature > _TINY)
        slot = self.pairs % MEMORY
        self.s[slot] = np.where(good[:, None], s, 0.0)
        self.y[slot] = np.where(good[:, None], y, 0.0)
        self.rho[slot] = np.where(good, 1.0 / np.where(good, curvature, 1.0), 0.0)
        squares = np.einsum("bn,bn->b", y, y)
        self.scale = np.where(good, curvature / np.where(good, squares, 1.0), self.scale)
        self.pairs += 1

    def direction(self, gradient: Array) -> Array:
        """−H g by the two-loop recursion, and −g where that would lead uphill."""
        recent = [(self.pairs - 1 - age) % MEMORY for age in range(min(self.pairs, MEMORY))]
        r, alpha = gradient.copy(), np.zeros_like(self.rho)
        for slot in recent:
            alpha[slot] = self.rho[slot] * np.einsum("bn,bn->b", self.s[slot], r)
            r -= alpha[slot, :, None] * self.y[slot]
        r *= self.scale[:, None]
        for slot in reversed(recent):
            beta = self.rho[slot] * np.einsum("bn,bn->b", self.y[slot], r)
            r += (alpha[slot] - beta)[:, None] * self.s[slot]
        uphill = np.einsum("bn,bn->b", r, gradient) <= 0.0
        return -np.where(uphill[:, None], gradient, r)


class Minimum(NamedTuple):
    """Points (B, n), their values (B,), none above where it began, and the iterations it took."""

    z: Array
    value: Array
    iterations: int


def minimise(objective: Objective, z: Array, iterations: int, enough: float = -math.inf) -> Minimum:
    """Lower each lane's objective.

    Args:
        objective: values (B,) and gradients (B, n) at points (B, n); no lane depends on another.
        z: (B, n) where to begin.
        iterations: at most; evaluations, one for all lanes each.
        enough: value at which a lane is good enough; the search ends when all are, or as good as settled.
    """
    value, gradient = objective(z)
    memory = _Memory(*z.shape)
    steepest = np.abs(gradient).max(axis=1, keepdims=True)
    direction = -gradient * (FIRST_STEP / np.maximum(steepest, _TINY))
    length = np.ones(len(z))
    spent, before = 0, value
    while spent < iterations and value.max() > enough:
        if enough > -math.inf and spent % PATIENCE == PATIENCE - 1:
            if ((value > enough) & (before - value > SETTLED * value)).sum() == 0:
                break
            before = value
        spent += 1
        moved = z + length[:, None] * direction
        new_value, new_gradient = objective(moved)
        slope = np.einsum("bn,bn->b", gradient, direction)
        accepted = new_value <= value + SUFFICIENT * length * slope
        memory.add(moved - z, new_gradient - gradient, accepted)
        lane = accepted[:, None]
        z, gradient = np.where(lane, moved, z), np.where(lane, new_gradient, gradient)
        value = np.where(accepted, new_value, value)
        direction = np.where(lane, memory.direction(gradient), direction)
        length = np.where(accepted, 1.0, SHORTER * length)
    return Minimum(z, value, spent)
