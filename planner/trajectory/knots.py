"""Where pieces begin and end: short ones where the error is, long ones where little happens.

The first guess comes from the plan (the acceleration's bends), every later one from the error that was measured: the
knots move until all pieces err alike, which is where a given number of pieces errs least.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from missions.arrays import Array
from planner.plan import Plan

SHORTEST = 0.06  # [s]; shorter pieces say nothing at the commander's 100 Hz

_REACH = 0.15  # [s] how far around a bend of the acceleration pieces get shorter
_FLOOR = 0.5  # share of the knots, against the bends', that is spread evenly
_NOTHING = 0.02  # of the worst piece's error, below which a piece does not get longer for erring less


def most_pieces(end: float, shortest: float = SHORTEST) -> int:
    """How many pieces ``end`` seconds are cut into at most: half of what would make all of them the shortest."""
    return max(1, int(end / shortest / 2))


def place_knots(plan: Plan, robot: int, pieces: int, shortest: float = SHORTEST) -> Array:
    """First guess of the knots (M+1,) [s] of one robot, on whole milliseconds, from 0 to the end of the plan.

    The knot density follows the square root of the acceleration's second difference: with pieces of length h a bend of
    size J costs about J h² of position, so this spreads the error evenly. The plan is taken to hover before and
    after, so a plan that starts with full acceleration gets short pieces there.

    Args:
        plan: the plan.
        robot: its index.
        pieces: M; fewer come back if there are more than :func:`most_pieces`.
        shortest: shortest length of a piece [s].
    """
    end, dt = float(plan.t[-1]), plan.dt
    pieces = min(pieces, most_pieces(end, shortest))
    u = np.diff(plan.v[:, robot], axis=0) / dt  # mean acceleration of every step
    hover = np.zeros((2, u.shape[1]))
    bend = np.abs(np.diff(np.concatenate([hover, u, hover]), n=2, axis=0)).sum(axis=1)  # at the middle of steps -1..T
    t = np.linspace(0.0, end, 4 * len(u) + 1)
    density = np.sqrt(_spread((t[1:] + t[:-1]) / 2, bend, dt))
    mean = float(density.mean())
    density = density / mean + _FLOOR if mean > 1e-9 else np.ones_like(density)
    return _distribute(t, density, pieces, shortest)


def move_knots(knots: Array, errors: Array, pieces: int, order: float, shortest: float = SHORTEST) -> Array:
    """Knots (M'+1,) [s] that spread the error of a fit evenly over M' pieces.

    Args:
        knots: (M+1,) of the fit [s].
        errors: (M,) largest error on each of its pieces.
        pieces: M', as for :func:`place_knots`.
        order: a piece of length h is taken to err like h^order: the higher, the less the knots move.
        shortest: shortest length of a piece [s].
    """
    pieces = min(pieces, most_pieces(float(knots[-1]), shortest))
    worst = float(errors.max())
    if worst <= 0.0:
        return _distribute(knots, np.ones(len(errors)), pieces, shortest)
    density = (errors / worst + _NOTHING) ** (1.0 / order) / np.diff(knots)
    calm = density.copy()
    calm[1:-1] = 0.25 * density[:-2] + 0.5 * density[1:-1] + 0.25 * density[2:]
    return _distribute(knots, calm, pieces, shortest)


def through(knots: Array, joints: Sequence[float]) -> Array:
    """Knots of which each of ``joints`` [s] is one: the nearest one each, and the others move with them.

    So that pieces beside one another stay of about the same length, which rounded ones have to be.
    """
    if not joints:
        return knots
    nearest = [int(np.abs(knots - joint).argmin()) for joint in joints]
    if len(set(nearest) - {0, len(knots) - 1}) < len(joints):  # fewer pieces than that: they are cut
        return np.union1d(knots, joints)
    moved: Array = np.round(np.interp(knots, knots[[0, *nearest, -1]], [knots[0], *joints, knots[-1]]), 3)
    moved[[0, *nearest, -1]] = [knots[0], *joints, knots[-1]]
    return moved


def _distribute(edges: Array, density: Array, pieces: int, shortest: float) -> Array:
    """Knots with the same share of a density, constant between edges, in every piece."""
    share = np.concatenate([[0.0], np.cumsum(density * np.diff(edges))])
    knots = np.interp(np.linspace(0.0, 1.0, pieces + 1), share / share[-1], edges)
    h = np.diff(knots)
    spare = np.maximum(h - shortest, 0.0)  # what is stretched to the shortest length is taken from the others
    if spare.sum() > 0.0:
        h = shortest + spare * (edges[-1] - shortest * pieces) / spare.sum()
    knots = np.round(np.concatenate([[0.0], np.cumsum(h)]), 3)
    knots[-1] = edges[-1]
    return knots


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
