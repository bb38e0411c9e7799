"""Policy ``guaranteed``: pairs are in contact for at least a given time in every sub-period.

Either in one contact, or in contacts that sum up to the time. The residual is pessimistic: g ≤ 0 proves contact at
every step that counts. Between the steps the certificate decides, exactly.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from missions.arrays import Array
from planner.connectivity.distances import distances, pull_squares
from planner.constraints.base import Evaluation, Place
from planner.constraints.meeting import SHARPNESS, softmin
from planner.constraints.pairwise import Rows, pair_and_sub_period
from planner.dynamics import Cotangent, Motion

MAX_SHARPNESS = 0.02  # τ / R² of the soft maximum: g overestimates by at most τ log n / (2 R), about 1 cm at R = 0.5 m
MOST_SAMPLES = 12  # of a contact that the search looks at
MOST_CONTACTS = 60  # of a sub-period that the search looks at


@dataclass(frozen=True)
class ContactTime:
    """g = (D² − R²)/(2 R), in metres to first order at the limit, D being how close they stay for the time asked for.

    A single contact: D² = softmin over windows of softmax over the window of d². Total: D² = softmax over the k
    closest steps of d². The soft maximum is never below the maximum, the soft minimum never below the minimum.

    Attributes:
        range: (pairs,) R [m].
        pairs: (pairs, 2) robot indices.
        nodes: steps of each sub-period, from its beginning to its end.
        steps: k, how many consecutive (or, in total, closest) steps have to be in contact.
        contact: whether one contact or several make up the time.
        names: of all robots.
    """

    range: Array
    pairs: NDArray[np.intp]
    nodes: tuple[NDArray[np.intp], ...]
    steps: int
    contact: Literal["single", "total"]
    names: tuple[str, ...]
    name: str = "contact"
    unit: str = "m"
    tolerance: float = 1e-3

    def evaluate(self, motion: Motion) -> Evaluation:
        """Residual (pairs, sub-periods)."""
        R = self.range[:, None]
        found = [distances(motion.q, self.pairs, nodes[None]) for nodes in self.nodes]
        soft = _soft_single if self.contact == "single" else _soft_total
        parts = [soft(part.squares[:, 0], self.steps, R) for part in found]

        def pull(weights: Array, cotangent: Cotangent) -> None:
            for p, (part, (_, slope)) in enumerate(zip(found, parts, strict=True)):
                force = slope * weights[:, p : p + 1] / (2.0 * R)
                pull_squares(part, self.pairs, self.nodes[p][None], force[:, None], cotangent.q)

        return Evaluation((np.stack([value for value, _ in parts], axis=-1) - R**2) / (2.0 * R), pull)

    def violation(self, motion: Motion) -> Array:
        """How much closer they would have to stay for the time asked for [m], (pairs, sub-periods)."""
        squares = [distances(motion.q, self.pairs, nodes[None]).squares[:, 0] for nodes in self.nodes]
        if self.contact == "single":
            windows = [np.lib.stride_tricks.sliding_window_view(part, self.steps, axis=-1) for part in squares]
            closest = [window.max(axis=-1).min(axis=-1) for window in windows]
        else:
            closest = [np.partition(part, self.steps - 1, axis=-1)[:, self.steps - 1] for part in squares]
        distance: Array = np.sqrt(np.stack(closest, axis=-1))
        return distance - self.range[:, None]

    def place(self, index: tuple[int, ...]) -> Place:
        """The pair, the sub-period (counted from 1)."""
        return pair_and_sub_period(self.names, self.pairs, index)

    def of(self, rows: Rows) -> ContactTime:
        """The same for some of the pairs."""
        return replace(self, pairs=self.pairs[rows], range=self.range[rows])


def _soft_single(squares: Array, steps: int, R: Array) -> tuple[Array, Array]:
    """D² (pairs,) of the best window of ``steps`` steps, and its derivative in ``squares`` (pairs, n)."""
    last = squares.shape[1] - steps
    begin = np.unique(np.linspace(0, last, min(last + 1, MOST_CONTACTS)).round().astype(np.intp))
    inside = np.unique(np.linspace(0, steps - 1, min(steps, MOST_SAMPLES)).round().astype(np.intp))
    windows = begin[:, None] + inside  # (W, L)
    farthest, share = softmax(squares[:, windows], MAX_SHARPNESS * R[..., None] ** 2)
    value, slope = softmin(farthest, SHARPNESS * R**2)
    out = np.zeros_like(squares)
    np.add.at(out, (np.arange(len(out))[:, None, None], windows[None]), share * slope[..., None])
    return value, out


def _soft_total(squares: Array, steps: int, R: Array) -> tuple[Array, Array]:
    """D² (pairs,) of the ``steps`` closest steps, and its derivative in ``squares`` (pairs, n)."""
    closest = np.argsort(squares, axis=-1, kind="stable")[:, :steps]
    value, share = softmax(np.take_along_axis(squares, closest, axis=-1), MAX_SHARPNESS * R**2)
    out = np.zeros_like(squares)
    np.put_along_axis(out, closest, share, axis=-1)
    return value, out


def softmax(values: Array, tau: Array) -> tuple[Array, Array]:
    """τ log Σ e^(value/τ) over the last axis, never below the maximum, and its derivative (as values).

    Args:
        values: (..., n).
        tau: temperature in the values' unit, broadcast against them.
    """
    top = values.max(axis=-1, keepdims=True)
    share = np.exp((values - top) / tau)
    total = share.sum(axis=-1, keepdims=True)
    return (top + tau * np.log(total))[..., 0], share / total
