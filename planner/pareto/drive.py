"""One differential-drive robot and several maps: the problem that SLES was published with, for many weights at once.

The robot moves before it turns, and only forwards: x' = x + |v| cos θ, y' = y + |v| sin θ, θ' = θ + 10 ω (the authors'
code, without a time step). The objective of each map is E_i + 0.03 mean(u²) + mean((q − ½)⁸), on the unit square.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from missions.arrays import Array, frozen

TURN = 10.0  # rad a unit of ω
CONTROL_WEIGHT = 0.03
WALL_EXPONENT = 8
CENTRE = 0.5


class Motion(NamedTuple):
    """B trajectories: positions (2, B, T), speeds (B, T), cos θ and sin θ (B, T)."""

    q: Array
    speed: Array
    cos: Array
    sin: Array


@dataclass(frozen=True)
class DriveProblem:
    """The maps, the weights of their coefficients, the robot.

    Coefficients are sums of cos(k π x) cos(l π y), without the norms h_k: those are in ``Lambda``.

    Attributes:
        phi: (m, n, n) of the maps, φ_0 = 1. Lambda: (n, n) Λ_k / h_k².
        start: (x, y, θ). steps: T; the trajectory is the states before each step.
    """

    phi: Array
    Lambda: Array
    start: tuple[float, float, float] = (CENTRE, CENTRE, 0.0)
    steps: int = 50

    def __post_init__(self) -> None:
        object.__setattr__(self, "phi", frozen(self.phi))
        object.__setattr__(self, "Lambda", frozen(self.Lambda))

    @cached_property
    def distances(self) -> Array:
        """(m, m) √E(i, j) between maps: SLES Eq. 6 under a root, which makes it a metric."""
        apart = self.phi[:, None] - self.phi[None]
        return frozen(np.sqrt((self.Lambda * apart**2).sum(axis=(2, 3))))

    def roll(self, z: Array) -> Motion:
        """Trajectories of controls z (B, 2 T): speeds, then turns."""
        T = self.steps
        speed, heading = np.abs(z[:, :T]), np.empty((len(z), T))
        heading[:, 0] = self.start[2]
        np.cumsum(TURN * z[:, T:-1], axis=1, out=heading[:, 1:])
        heading[:, 1:] += self.start[2]
        cos, sin = np.cos(heading), np.sin(heading)
        q = np.empty((2, len(z), T))
        for axis, part in enumerate((cos, sin)):
            q[axis, :, 0] = self.start[axis]
            np.cumsum(part[:, :-1] * speed[:, :-1], axis=1, out=q[axis, :, 1:])
            q[axis, :, 1:] += self.start[axis]
        return Motion(q, speed, cos, sin)

    def evaluate(self, z: Array, phi: Array) -> tuple[Array, Array]:
        """Objectives (B,) and gradients (B, 2 T) of controls z (B, 2 T), each with its own map ``phi`` (B, n, n)."""
        motion = self.roll(z)
        tables = self._tables(motion.q)
        cosine = np.ascontiguousarray(tables[:, 0].transpose(1, 2, 0, 3))  # (axis, B, n, T)
        error = cosine[0] @ cosine[1].swapaxes(1, 2) / self.steps - phi
        weighted = self.Lambda * error
        to_q = self._pull(cosine, tables[:, 1].transpose(1, 2, 0, 3), weighted)
        off = motion.q - CENTRE
        cube = off ** (WALL_EXPONENT - 1)
        to_q += cube * (WALL_EXPONENT / (2 * self.steps))
        value = np.einsum("bij,bij->b", weighted, error) + CONTROL_WEIGHT * np.einsum("bn,bn->b", z, z) / z.shape[1]
        value += np.einsum("abt,abt->b", cube, off) / (2 * self.steps)
        return value, self._to_controls(z, motion, to_q)

    def vectors(self, z: Array) -> Array:
        """(B, m) objectives of controls z (B, 2 T) for each map."""
        q = self.roll(z).q
        cosine = self._tables(q)[:, 0].transpose(1, 2, 0, 3)
        c_k = cosine[0] @ cosine[1].swapaxes(1, 2) / self.steps
        E = np.einsum("ij,bmij->bm", self.Lambda, (c_k[:, None] - self.phi) ** 2)
        shared = CONTROL_WEIGHT * (z**2).mean(axis=1) + ((q - CENTRE) ** WALL_EXPONENT).mean(axis=(0, 2))
        result: Array = E + shared[:, None]
        return result

    def _tables(self, q: Array) -> Array:
        """cos(k π q) and sin(k π q), (n, 2, 2, B, T), by the Chebyshev recurrence."""
        theta = np.pi * q
        tables = np.empty((self.phi.shape[1], 2, *q.shape))
        tables[0, 0], tables[0, 1] = 1.0, 0.0
        np.cos(theta, out=tables[1, 0])
        np.sin(theta, out=tables[1, 1])
        twice = 2.0 * tables[1, 0]
        for k in range(2, len(tables)):
            np.multiply(twice, tables[k - 1], out=tables[k])
            tables[k] -= tables[k - 2]
        return tables

    def _pull(self, cosine: Array, sine: Array, weighted: Array) -> Array:
        """Gradient (2, B, T) of E with respect to positions."""
        G = weighted * (2.0 / self.steps)
        k = -np.pi * np.arange(len(self.Lambda))[:, None]
        to_x = ((k * G @ cosine[1]) * sine[0]).sum(axis=1)
        to_y = ((k * G.swapaxes(1, 2) @ cosine[0]) * sine[1]).sum(axis=1)
        return np.stack((to_x, to_y))

    def _to_controls(self, z: Array, motion: Motion, to_q: Array) -> Array:
        """Gradient (B, 2 T) with respect to controls: each moves all positions after it."""
        T = self.steps
        later = _after(to_q)
        gradient = np.empty_like(z)
        gradient[:, :T] = (motion.cos * later[0] + motion.sin * later[1]) * np.sign(z[:, :T])
        gradient[:, T:] = TURN * _after((motion.cos * later[1] - motion.sin * later[0]) * motion.speed)
        gradient += (2.0 * CONTROL_WEIGHT / z.shape[1]) * z
        return gradient


def _after(values: Array) -> Array:
    """Sums over all later times, along the last axis."""
    sums = np.zeros_like(values)
    sums[..., :-1] = np.cumsum(values[..., :0:-1], axis=-1)[..., ::-1]
    return sums
