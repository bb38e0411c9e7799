"""The ergodic metric E = Σ_k Λ_k (c_k − φ_k)² and its gradient."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis, Tables


class MetricValue(NamedTuple):
    """A metric's value and its gradient with respect to the positions, (T, N, ν) [1/m]."""

    value: float
    gradient: Array


class Metric(Protocol):
    """A functional of all robots' time-averaged statistics."""

    def value(self, q: Array) -> float:
        """Value for positions q (T, N, ν) [m]."""

    def evaluate(self, q: Array) -> MetricValue:
        """Value and gradient for positions q (T, N, ν) [m]."""


@runtime_checkable
class SwarmMetric(Protocol):
    """A metric that measures several swarms at once."""

    def evaluate_each(self, points: Array) -> tuple[Array, Array]:
        """Values (B,) for each of B swarms' positions (B, T·N, ν) [m], and the gradient (B, T·N, ν) [1/m]."""


@runtime_checkable
class SquaresMetric(Protocol):
    """A metric that is a sum of squares."""

    def squares(self, q: Array, most: int) -> NDArray[np.float32]:
        """Gradients (k, N, ν, T) [1/m] of what is squared, the ``most`` weightiest, at positions q (T, N, ν) [m]."""


@dataclass(frozen=True)
class ErgodicMetric:
    """Distance between where the robots spend their time and where the information is (IMEC, Eq. 2).

    Attributes:
        basis: cosine basis on the workspace.
        phi_k: (n,)*ν coefficients of the information map, φ_0 = 1.
    """

    basis: CosineBasis
    phi_k: Array

    def statistics(self, q: Array) -> Array:
        """c_k: mean of F_k over all robots and steps, (n,)*ν, for q (T, N, ν) [m]."""
        return self.basis.statistics(self.basis.tables(q.reshape(-1, self.basis.dimension)).cosine)

    def statistics_each(self, q: Array) -> Array:
        """The same of every step by itself, (T,) + (n,)*ν."""
        return np.stack([self.statistics(step) for step in q])

    def value(self, q: Array) -> float:
        """E for positions q (T, N, ν) [m]."""
        return float(np.sum(self.basis.Lambda_k * (self.statistics(q) - self.phi_k) ** 2))

    def evaluate(self, q: Array) -> MetricValue:
        """E and dE/dq (T, N, ν) [1/m]."""
        tables = self.basis.tables(q.reshape(-1, self.basis.dimension))
        error = self.basis.statistics(tables.cosine) - self.phi_k
        weighted = self.basis.Lambda_k * error
        gradient = self.basis.pull_statistics(tables, 2.0 * weighted)
        return MetricValue(float(np.vdot(weighted, error)), gradient.reshape(q.shape))

    def squares(self, q: Array, most: int) -> NDArray[np.float32]:
        """√Λ_k ∂c_k/∂q (k, N, ν, T) [1/m] of the ``most`` largest Λ_k but the first, whose c_k never changes."""
        basis, (T, N, nu) = self.basis, q.shape
        chosen = np.argsort(-basis.Lambda_k, axis=None, kind="stable")[1 : most + 1]
        k = basis.k.reshape(-1, nu)[chosen].astype(np.intp)
        cosine, sine = basis.tables(q.swapaxes(0, 1).reshape(-1, nu), np.float32)  # (n, ν, N·T)
        scale = np.sqrt(basis.Lambda_k.ravel()[chosen]) * (-np.pi / (T * N)) / basis.h_k.ravel()[chosen]
        rows = np.empty((len(k), N, nu, T), np.float32)
        for d in range(nu):
            slope = (scale * k[:, d] / (basis.upper - basis.lower)[d]).astype(np.float32)
            along = sine[k[:, d], d] * slope[:, None]
            for other in (axis for axis in range(nu) if axis != d):
                along *= cosine[k[:, other], other]
            rows[:, :, d] = along.reshape(-1, N, T)
        return rows

    def evaluate_each(self, points: Array) -> tuple[Array, Array]:
        """E (B,) of each of B swarms' positions (B, M, ν) [m], and the gradient (B, M, ν) [1/m].

        In two axes from single-precision tables, for half the price: good to choose among searches, not to end one.
        """
        swarms, M, nu = points.shape
        if nu == 2:
            return self._evaluate_planar(self.basis.tables(points.reshape(-1, nu), np.float32), swarms)
        tables = self.basis.tables(points.reshape(-1, nu))
        E, gradient = np.empty(swarms), np.empty(points.shape)
        for swarm in range(swarms):
            mine = slice(swarm * M, (swarm + 1) * M)
            own = Tables(tables.cosine[..., mine], tables.sine[..., mine])
            weighted, E[swarm] = self._weighted(self.basis.statistics(own.cosine))
            gradient[swarm] = self.basis.pull_statistics(own, 2.0 * weighted)
        return E, gradient

    def _weighted(self, c_k: Array) -> tuple[Array, Array]:
        """Λ_k (c_k − φ_k) and E, of statistics (..., n)."""
        error = c_k - self.phi_k
        weighted = self.basis.Lambda_k * error
        return weighted, (weighted * error).sum(axis=tuple(range(-self.basis.dimension, 0)))

    def _evaluate_planar(self, tables: Tables, swarms: int) -> tuple[Array, Array]:
        """The same in two axes, with one product of matrices a swarm and axis."""
        basis = self.basis
        n, nu, total = tables.cosine.shape
        cosine, sine = (part.reshape(n, nu, swarms, -1).transpose(1, 2, 0, 3) for part in tables)  # (2, B, n, M)
        M = total // swarms
        weighted, E = self._weighted(cosine[0] @ cosine[1].swapaxes(-1, -2) / (M * basis.h_k))
        G = (weighted * (-2.0 * math.pi / (M * basis.h_k))).astype(cosine.dtype)
        side = basis.upper - basis.lower
        gradient = np.empty((swarms, M, nu))
        k = np.arange(n, dtype=cosine.dtype)[:, None]
        for axis, pulled in enumerate((k * G @ cosine[1], (k.T * G).swapaxes(-1, -2) @ cosine[0])):
            pulled *= sine[axis]
            gradient[..., axis] = pulled.sum(axis=1) / side[axis]
        return E, gradient
