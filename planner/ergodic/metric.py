"""The ergodic metric E = Σ_k Λ_k (c_k − φ_k)² and its gradient."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis


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
