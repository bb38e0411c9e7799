"""From a coarse time grid to a fine one, or from a point mass to a dearer model: most of a search needs no more.

Controls are interpolated by their cosine series, which is exact for the modes plans are made of. Multipliers are
forces spread over time: stretched where the fine grid has more samples, and smaller by as much.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.dynamics import Dynamics, Motion
from planner.dynamics.casadi_model import CasadiDynamics
from planner.dynamics.follow import controls_along
from planner.models import has_mass


def carried_controls(motion: Motion, dynamics: Dynamics) -> Array:
    """Controls for ``dynamics`` of a motion on a coarser grid; of a point mass's, where searches begin with one."""
    if isinstance(dynamics, CasadiDynamics) and has_mass(dynamics):
        return controls_along(dynamics, motion)
    return refined_controls(motion.u, dynamics.controls_shape[0])


def refined_controls(u: Array, steps: int) -> Array:
    """Controls (steps, ...) at the middles of finer steps, from (T, ...) at the middles of coarse ones."""
    coarse = len(u)
    k = np.arange(coarse)
    forward = np.cos(np.pi / coarse * np.outer(k, np.arange(coarse) + 0.5)) * (2.0 / coarse)
    forward[0] *= 0.5
    back = np.cos(np.pi / steps * np.outer(np.arange(steps) + 0.5, k))
    fine: Array = np.tensordot(back @ forward, u, axes=1)
    return fine


def refined_multipliers(multipliers: Array, shape: tuple[int, ...]) -> Array:
    """Multipliers of the fine problem's residual of ``shape``; zero if the two have nothing to do with each other."""
    if multipliers.ndim != len(shape):
        return np.zeros(shape)
    for axis, (coarse, fine) in enumerate(zip(multipliers.shape, shape, strict=True)):
        if coarse != fine and min(coarse, fine) > 0:
            nearest = np.round(np.linspace(0.0, coarse - 1, fine)).astype(np.intp)
            multipliers = multipliers.take(nearest, axis=axis) * (coarse / fine)
    return multipliers if multipliers.shape == shape else np.zeros(shape)
