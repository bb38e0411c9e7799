"""The published two- and three-map cases of SLES, with the constants as the authors coded them and as the textbook has
them."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.pareto.drive import DriveProblem

GOLDEN = Path(__file__).parents[1] / "golden" / "moes.npz"
FUNCTIONS = 10


def published(maps: int, *, coded: bool = True) -> DriveProblem:
    """The case with so many maps (2 or 3)."""
    with np.load(GOLDEN) as stored:
        densities = stored["maps"][:maps].astype(np.float64)  # [map, x, y], corner to corner
    cells = np.linspace(0.0, 1.0, densities.shape[1])
    cosine = np.cos(np.pi * np.outer(cells, np.arange(FUNCTIONS)))
    sums = np.einsum("mxy,xa,yb->mab", densities, cosine, cosine)
    basis = CosineBasis(np.zeros(2), np.ones(2), FUNCTIONS)
    h_k, Lambda_k = as_coded(basis) if coded else (basis.h_k, basis.Lambda_k)
    return DriveProblem(sums / sums[:, :1, :1], Lambda_k / h_k**2)


def as_coded(basis: CosineBasis) -> tuple[Array, Array]:
    """h_k with cos(k x) where cos(k π x) is meant, and Λ_k with the exponent −2 instead of −3/2."""
    k = np.arange(basis.n)
    norm = np.where(k > 0, np.sqrt((2 * k + np.sin(2 * k)) / (4 * np.maximum(k, 1))), 1.0)
    return np.outer(norm, norm), (1.0 + (basis.k**2).sum(axis=-1)) ** -2.0
