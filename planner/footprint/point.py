"""The point below the robot: what ergodic search ordinarily counts (FEO's first baseline)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Look, step_by_step


@dataclass(frozen=True)
class Point:
    """A footprint without size: Dirac's delta below the robot."""

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        tables = basis.tables(x[..., :2].reshape(-1, 2))

        def pull(weights: Array) -> Array:
            gradient = np.zeros(x.shape)
            gradient[..., :2] = basis.pull_statistics(tables, weights).reshape(*x.shape[:-1], 2)
            return gradient

        return Look(basis.statistics(tables.cosine), pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`."""
        return step_by_step(self, basis, x)
