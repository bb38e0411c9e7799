"""The ergodic metric of looks at a surface: E = Σ_k Λ_k (c_γ,k − φ_k)² (FEO, Eq. 24 to 26).

Information and looks both live on the J points of the surface, so the sum over k is a quadratic form of what the points
are short of: |B (m − p)|² with B_kj = √Λ_k F_k(r_j), of which the singular vectors that say anything are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array, frozen
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import MetricValue
from planner.surface.views import Blends, Grid

KEPT = 1e-7  # least singular value that is kept, of the largest: E is then exact to 1e-12


@dataclass(frozen=True, eq=False)
class Views:
    """Looks of one camera from every viewpoint of a grid.

    Attributes:
        grid: the viewpoints.
        density: (G, J) what is seen from each.
    """

    grid: Grid
    density: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", frozen(self.density))


@dataclass(frozen=True, eq=False)
class SurfaceMetric:
    """Distance between what robots look at and where the information is, on a surface.

    Attributes:
        basis: cosine basis on the box around the surface, three axes.
        points: (J, 3) of the surface [m]. share: (J,) of the information on them, 1 in all.
        views: one a robot.
    """

    basis: CosineBasis
    points: Array
    share: Array
    views: tuple[Views, ...]

    @cached_property
    def phi_k(self) -> Array:
        """(n, n, n) coefficients of the information, φ_0 = 1."""
        return self._coefficients(self.share)

    @cached_property
    def features(self) -> Array:
        """(J, r) transpose of B, in the basis of its singular vectors."""
        B = (np.sqrt(self.basis.Lambda_k).reshape(-1, 1) * self._functions).T  # (J, K)
        values, vectors = np.linalg.eigh(B @ B.T)
        kept = values > (KEPT**2) * values[-1]
        return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))

    @cached_property
    def _functions(self) -> Array:
        """(K, J) of F_k(r_j)."""
        c_x, c_y, c_z = self.basis.tables(self.points).cosine.swapaxes(0, 1)
        products = np.einsum("aj,bj,cj->abcj", c_x, c_y, c_z)
        return np.asarray(products / self.basis.h_k[..., None]).reshape(-1, len(self.points))

    @cached_property
    def _wanted(self) -> Array:
        """(r,) features of the information."""
        return np.asarray(self.share @ self.features)

    @cached_property
    def _seen(self) -> tuple[Array, ...]:
        """(G, r) features of the looks of each group of robots."""
        return tuple(views.density @ self.features for views, _ in self._groups)

    @cached_property
    def _groups(self) -> Sequence[tuple[Views, list[int]]]:
        """Robots by camera: those with the same one are looked at together."""
        groups: dict[Views, list[int]] = {}
        for robot, views in enumerate(self.views):
            groups.setdefault(views, []).append(robot)
        return list(groups.items())

    def statistics(self, q: Array) -> Array:
        """c_k of what robots at q (T, N, 3) [m] look at, (n, n, n): every robot and step counts alike (FEO, Eq. 26)."""
        return self._coefficients(self.looked_at(q))

    def statistics_each(self, q: Array) -> Array:
        """The same of every step by itself, (T, n, n, n)."""
        seen = np.stack([self.looked_at(step[None]) for step in q])
        return np.asarray(seen @ self._functions.T).reshape(-1, *(self.basis.n,) * 3)

    def looked_at(self, q: Array) -> Array:
        """(J,) share of all looks from q (T, N, 3) [m] that each point gets."""
        out = np.zeros(len(self.points))
        for views, robots in self._groups:
            shares = views.grid.blends(q[:, robots].reshape(-1, 3)).gathered(1, len(views.density))[0]
            near = np.flatnonzero(shares)
            out += shares[near] @ views.density[near] / (q.shape[0] * q.shape[1])
        return out

    def value(self, q: Array) -> float:
        """E for positions q (T, N, 3) [m]."""
        error = (self.looked_at(q) - self.share) @ self.features
        return float(error @ error)

    def evaluate(self, q: Array) -> MetricValue:
        """E and dE/dq (T, N, 3) [1/m]."""
        E, gradient = self._evaluate(q[None])
        return MetricValue(float(E[0]), gradient[0])

    def evaluate_each(self, points: Array) -> tuple[Array, Array]:
        """E (B,) of each of B swarms' positions (B, T·N, 3) [m], and the gradient (B, T·N, 3) [1/m]."""
        E, gradient = self._evaluate(points.reshape(len(points), -1, len(self.views), 3))
        return E, gradient.reshape(points.shape)

    def _evaluate(self, q: Array) -> tuple[Array, Array]:
        """E (B,) and its gradient (B, T, N, 3) of swarms at q (B, T, N, 3)."""
        swarms, steps, count, _ = q.shape
        error = np.broadcast_to(-self._wanted, (swarms, len(self._wanted))).copy()
        near: list[tuple[Blends, NDArray[np.intp], Array]] = []
        for (views, robots), seen in zip(self._groups, self._seen, strict=True):
            blends = views.grid.blends(q[:, :, robots].reshape(-1, 3))
            shares = blends.gathered(swarms, len(seen))
            nodes = np.flatnonzero(shares.any(axis=0))  # robots are near few of all viewpoints
            near.append((blends, nodes, seen[nodes]))
            error += shares[:, nodes] @ near[-1][2] / (steps * count)
        gradient = np.empty(q.shape)
        for (views, robots), (blends, nodes, seen) in zip(self._groups, near, strict=True):
            field = np.zeros((swarms, len(views.density)))
            field[:, nodes] = error @ seen.T * (2.0 / (steps * count))
            gradient[:, :, robots] = blends.gradient(field).reshape(swarms, steps, len(robots), 3)
        return np.einsum("br,br->b", error, error), gradient

    def _coefficients(self, share: Array) -> Array:
        return np.asarray(self._functions @ share).reshape((self.basis.n,) * 3)
