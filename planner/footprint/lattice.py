"""The paper's samples of a disc: a square lattice whose spacing grows with the disc (FEO, Eq. 22–25, Example 2).

For comparison with the paper, whose footprints stay inside the workspace: what a sample sees beyond the edge counts at
its mirror image.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from missions.arrays import Array, frozen
from planner.ergodic.basis import CosineBasis
from planner.footprint.base import Look, step_by_step, weighted_statistics
from planner.footprint.outline import Disc


@dataclass(frozen=True)
class LatticeFootprint:
    """A disc by samples.

    Attributes:
        disc: its size. spacing: of the lattice, in radii; 0.35 gives 25 samples.
    """

    disc: Disc
    spacing: float = 0.35

    @cached_property
    def offsets(self) -> Array:
        """(S, 2) of the samples from the centre, in radii."""
        reach = int(1.0 / self.spacing)
        steps = np.arange(-reach, reach + 1) * self.spacing
        offsets = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
        return frozen(offsets[np.hypot(*offsets.T) <= 1.0])

    def look(self, basis: CosineBasis, x: Array) -> Look:
        """See :class:`~planner.footprint.base.Footprint`."""
        flat = x.reshape(-1, 3)
        size = self.disc.size(flat[:, 2])
        points = flat[:, None, :2] + size[:, None, None] * self.offsets
        samples = points.shape[0] * points.shape[1]
        c_k, field = weighted_statistics(basis, points.reshape(-1, 2), np.full(samples, 1.0 / samples))

        def pull(weights: Array) -> Array:
            by_point = field(weights).gradient.reshape(points.shape) / samples
            by_height = np.einsum("msd,sd->m", by_point, self.offsets) * self.disc.growth(flat[:, 2])
            return np.concatenate((by_point.sum(axis=1), by_height[:, None]), axis=-1).reshape(x.shape)

        return Look(c_k, pull)

    def each(self, basis: CosineBasis, x: Array) -> Array:
        """See :class:`~planner.footprint.base.Footprint`."""
        return step_by_step(self, basis, x)
