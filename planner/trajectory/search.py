"""The fewest pieces: knots and their number, driven by the error that is measured.

First without the bound, which costs a tenth of a bounded fit, to learn where pieces have to be short and about how many
there are; then with it. How many pieces are too few is a matter of luck with the knots, so the count grows until the
aim is met and shrinks until it is not.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable

from missions.arrays import Array
from planner.trajectory.knots import SHORTEST, move_knots
from planner.trajectory.regression import Fit

Attempt = Callable[[Array, float | None], Fit]  # knots, error too large to go on for (None: without the bound)

_FREE, _BOUNDED = 4, 10  # fits of either kind
_ORDER = 3.5  # measured: errors fall with this power of the number of pieces
_SHARE = 0.6  # of the aim, for fits without the bound
_BOLD, _CAREFUL = 6.0, 8.0  # orders that knots are moved with, without and with the bound
_GROWTH = 1.25
_STEP = 5.0  # order by which the number of pieces grows
_FULL = 3  # fits with as many pieces as there may be


def fewest_pieces(attempt: Attempt, knots: Array, aim: float, most: int, shortest: float = SHORTEST) -> Fit:
    """The fit with the fewest pieces found whose error is at most the aim.

    Args:
        attempt: fits on given knots.
        knots: to begin with [s].
        aim: largest error.
        most: largest number of pieces.
        shortest: shortest length of a piece [s].

    Returns:
        If none met the aim, the one with the smallest error; if none met the bound, the one that missed it least.
    """
    knots = _learn(attempt, knots, aim, most, shortest)
    worth = functools.partial(_worth, aim=aim)
    fits: list[Fit] = []
    too_few, full = 0, 0
    for trial in range(_BOUNDED):
        last = len(knots) - 1 == most or trial == _BOUNDED - 1  # to be seen to the end, however it ends
        fit = attempt(knots, math.inf if last else aim)
        fits.append(fit)
        best = min(fits, key=worth)
        if fit.excess > 0.0 or fit.error > aim:
            too_few, full = max(too_few, fit.pieces), full + (fit.pieces == most)
        reached = best.excess <= 0.0 and best.error <= aim
        if full == _FULL or (reached and best.pieces - 1 <= too_few):
            break
        if reached:
            count = (best.pieces + too_few) // 2 if too_few else best.pieces - 1
        elif trial == 0:
            count = fit.pieces  # its knots have not seen the bound yet
        else:
            ratio = (fit.error / aim) ** (1.0 / _STEP) if fit.error > aim else _GROWTH  # else it misses the bound
            count = max(fit.pieces + 1, round(fit.pieces * min(_GROWTH, ratio)))
        knots = move_knots(fit.spline.knots, fit.errors, min(count, most), _CAREFUL, shortest)
    return min(fits, key=worth)


def _worth(fit: Fit, aim: float) -> tuple[float, float, int, float]:
    """Smaller is better: first the bound, then the aim, then the number of pieces, then the error."""
    met = fit.error <= aim
    return fit.excess, 0.0 if met else fit.error, fit.pieces if met else 0, fit.error


def _learn(attempt: Attempt, knots: Array, aim: float, most: int, shortest: float) -> Array:
    """Knots of about the right number at about the right places, from fits without the bound."""
    for _ in range(_FREE):
        fit = attempt(knots, None)
        level = float((fit.errors**0.25).mean()) ** 4  # what all pieces would err if they erred alike
        ratio = (level / (_SHARE * aim)) ** (1.0 / _ORDER)
        count = max(2, min(most, round(fit.pieces * min(2.0, max(0.5, ratio)))))
        knots = move_knots(fit.spline.knots, fit.errors, count, _BOLD, shortest)
    return knots
