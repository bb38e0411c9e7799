"""Where pieces begin and end: many where the acceleration bends, few where it is smooth."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.plan import Plan

_REACH = 0.15  # [s] how far around a bend of the acceleration pieces get shorter
_FLOOR = 0.5  # share of the knots, against the bends', that is spread evenly
_SHORTEST = 0.06  # [s]; shorter pieces say nothing at the commander's 100 Hz


def place_knots(plan: Plan, robot: int, pieces: int, *, even: bool = False) -> Array:
    """Knots (M+1,) [s] of one robot, on whole milliseconds; the first is 0, the last the end of the plan.

    The knot density follows the square root of the acceleration's second difference: with pieces of length h a bend of
    size J costs about J h² of position, so this spreads the error evenly. The plan is taken to hover before and
    after, so a plan that starts with full acceleration gets short pieces there.

    Args:
        plan: the plan.
        robot: its index.
        pieces: M; fewer come back if they would be shorter than 60 ms.
        even: spread the knots evenly.
    """
    end = float(plan.t[-1])
    pieces = max(1, min(pieces, int(end / _SHORTEST / 2)))
    if even:
        return _whole_milliseconds(np.linspace(0.0, end, pieces + 1))
    dt = plan.dt
    u = np.diff(plan.v[:, robot], axis=0) / dt  # mean acceleration of every step
    hover = np.zeros((2, u.shape[1]))
    bend = np.abs(np.diff(np.concatenate([hover, u, hover]), n=2, axis=0)).sum(axis=1)  # at the middle of steps -1..T
    t = np.linspace(0.0, end, 4 * len(u) + 1)
    middle = (t[1:] + t[:-1]) / 2
    density = np.sqrt(_spread(middle, bend, dt))
    mean = float(density.mean())
    density = density / mean + _FLOOR if mean > 1e-9 else np.ones_like(middle)
    share = np.concatenate([[0.0], np.cumsum(density)])
    return _whole_milliseconds(_keep_apart(np.interp(np.linspace(0.0, 1.0, pieces + 1), share / share[-1], t)))


def _spread(t: Array, bend: Array, dt: float) -> Array:
    """Bends, smeared over their neighbourhood by a Gaussian."""
    reach = max(_REACH, dt)
    half = int(np.ceil(4 * reach / dt)) + 1
    at = (np.arange(len(bend)) - 0.5) * dt
    out = np.zeros_like(t)
    nearest = np.floor(t / dt).astype(int)
    for offset in range(-half, half + 1):
        k = nearest + offset
        inside = (k >= 0) & (k < len(bend))
        out[inside] += bend[k[inside]] * np.exp(-0.5 * ((t[inside] - at[k[inside]]) / reach) ** 2)
    return out


def _keep_apart(knots: Array) -> Array:
    """Stretch pieces below the shortest length, at the cost of the others."""
    h = np.diff(knots)
    spare = np.maximum(h - _SHORTEST, 0.0)
    h = _SHORTEST + spare * (knots[-1] - _SHORTEST * len(h)) / spare.sum()
    return np.concatenate([[0.0], np.cumsum(h)])


def _whole_milliseconds(knots: Array) -> Array:
    """Joints on whole milliseconds; the end stays what it is."""
    rounded = np.round(knots, 3)
    rounded[-1] = knots[-1]
    return rounded
