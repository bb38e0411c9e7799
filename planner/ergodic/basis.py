"""The cosine basis of the ergodic metric, on a box.

F_k(w) = Π_d cos(k_d π w_d) / h_k with w = (q − lower)/(upper − lower), h_k = Π_d (1 if k_d = 0 else √½), k in
{0..n−1}^ν,
and weights Λ_k = (1 + |k|²)^(−(ν+1)/2) (Mathew and Mezić 2011; IMEC section III-B). E depends neither on units nor
on the size of the box.

Coefficient arrays keep the basis' product structure: shape (n,)*ν, index [k_1, .., k_ν].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import DTypeLike

from missions.arrays import Array, frozen


class Tables(NamedTuple):
    """Basis factors at M points, each (n, ν, M): cos(kθ) and sin(kθ), θ = π w."""

    cosine: Array
    sine: Array


@dataclass(frozen=True)
class CosineBasis:
    """Cosine functions on a box.

    Attributes:
        lower: (ν,) lower corner [m]. upper: (ν,) upper corner [m].
        n: number of functions an axis, k = 0..n−1.
        exponent: of 1 + |k|² in Λ_k; None: −(ν+1)/2.
    """

    lower: Array
    upper: Array
    n: int = 10
    exponent: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "lower", frozen(self.lower))
        object.__setattr__(self, "upper", frozen(self.upper))
        if self.lower.ndim != 1 or self.lower.shape != self.upper.shape or not (self.upper > self.lower).all():
            raise ValueError(f"a box needs lower < upper on every axis; got {self.lower} and {self.upper}")

    @property
    def dimension(self) -> int:
        """ν."""
        return len(self.lower)

    @cached_property
    def k(self) -> Array:
        """Frequencies, (n,)*ν + (ν,)."""
        axes = np.meshgrid(*[np.arange(self.n)] * self.dimension, indexing="ij")
        return frozen(np.stack(axes, axis=-1))

    @cached_property
    def h_k(self) -> Array:
        """Norms of the basis functions, (n,)*ν."""
        return frozen(np.where(self.k == 0, 1.0, np.sqrt(0.5)).prod(axis=-1))

    @cached_property
    def Lambda_k(self) -> Array:
        """Sobolev weights, (n,)*ν."""
        exponent = -(self.dimension + 1) / 2 if self.exponent is None else self.exponent
        return frozen((1.0 + (self.k**2).sum(axis=-1)) ** exponent)

    def tables(self, points: Array, dtype: DTypeLike = np.float64) -> Tables:
        """Factors cos(kθ) and sin(kθ) at ``points`` (M, ν) [m], by the Chebyshev recurrence from one sincos."""
        theta = np.ascontiguousarray(points.T) - self.lower[:, None]  # (ν, M)
        theta *= (np.pi / (self.upper - self.lower))[:, None]
        theta = theta.astype(dtype, copy=False)
        factors = np.empty((self.n, 2, *theta.shape), dtype)
        factors[0, 0], factors[0, 1] = 1.0, 0.0
        np.cos(theta, out=factors[1, 0])
        np.sin(theta, out=factors[1, 1])
        twice = factors[1, 0] + factors[1, 0]
        for k in range(2, self.n):
            np.multiply(twice, factors[k - 1], out=factors[k])
            factors[k] -= factors[k - 2]
        return Tables(factors[:, 0], factors[:, 1])

    def statistics(self, cosine: Array) -> Array:
        """c_k = mean over points of F_k, (n,)*ν, from :attr:`Tables.cosine` (n, ν, M)."""
        points = cosine.shape[2]
        product = cosine[:, 0]  # (n^d, M), grown axis by axis
        for d in range(1, self.dimension - 1):
            product = (product[:, None] * cosine[None, :, d]).reshape(-1, points)
        sums = product @ cosine[:, -1].T
        c_k: Array = sums.reshape((self.n,) * self.dimension) / (points * self.h_k)
        return c_k

    def functions(self, points: Array) -> Array:
        """f_k = F_k at each of ``points`` (M, ν): (M,) + (n,)*ν. For plots and tests; the metric never builds it."""
        cosine = self.tables(points).cosine
        letters = "abc"[: self.dimension]
        spec = ",".join(f"{letter}m" for letter in letters) + f"->m{letters}"
        f_k: Array = np.einsum(spec, *(cosine[:, d] for d in range(self.dimension))) / self.h_k
        return f_k

    def pull_statistics(self, tables: Tables, weights: Array) -> Array:
        """Gradient (M, ν) [1/m] of Σ_k weights_k c_k with respect to the points."""
        nu, points = self.dimension, tables.cosine.shape[2]
        G = weights / self.h_k
        gradient = np.empty((nu, points))
        for d in range(nu):
            others = [tables.cosine[:, axis] for axis in range(nu) if axis != d]
            contracted = _contract(np.moveaxis(G * self.k[..., d], d, 0), others)  # (n, M)
            contracted *= tables.sine[:, d]
            np.sum(contracted, axis=0, out=gradient[d])
        scale = -np.pi / (self.upper - self.lower) / points
        result: Array = (gradient * scale[:, None]).T
        return result


def _contract(G: Array, factors: list[Array]) -> Array:
    """Sum G[k, a(, b)] over the trailing axes with factors (n, M): (n, M)."""
    last = factors[-1]
    out = G.reshape(-1, G.shape[-1]) @ last  # (n^(ν−1), M)
    if len(factors) == 1:
        return out
    result: Array = np.einsum("kam,am->km", out.reshape(G.shape[0], G.shape[1], -1), factors[0])
    return result
