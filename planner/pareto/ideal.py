"""What no plan can be better than, and where a front is thin.

Statistics c are as far from each map as |c − φ_i|² = E_i says (norm weighted by Λ_k). The weighted sum of objectives is
then Σ w_i E_i = |c − Σ w_i φ_i|² + Σ w_i |φ_i − Σ w_j φ_j|²: scalarising the *maps* (SLES, Eq. 5) is scalarising the
*objectives* up to a constant. The constant is the ideal: what c = Σ w_i φ_i would reach. No plan's vector is below any
of these hyperplanes, so the front's shape is known before any search, and how far a plan is from its hyperplane is what
is left to be gained there.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from planner.pareto.hypervolume import exclusive

MARGIN = 1.1
NEAREST = 3  # found points that a forecast leans on


@dataclass(frozen=True)
class Gap:
    """Where the front is thin: the weights to try next, and the hyper-volume that is expected there."""

    weights: Array
    gain: float


def ideal_vectors(weights: Array, distances: Array) -> Array:
    """(n, m) ergodic vectors of the scalarised maps themselves, for ``weights`` (n, m), ``distances`` (m, m)."""
    squared = np.asarray(distances) ** 2
    mixed = weights @ squared  # Σ_j w_j |φ_i − φ_j|²
    spread = 0.5 * (mixed * weights).sum(axis=1, keepdims=True)  # Σ_j w_j |φ_j − φ̄|²
    result: Array = mixed - spread
    return result


def nadir(distances: Array) -> Array:
    """(m,) the worst each objective gets on the ideal front, and a little more, so that the ends count as well."""
    worst: Array = MARGIN * (np.asarray(distances) ** 2).max(axis=1)
    return worst


def forecast(weights: Array, found_weights: Array, found: Array, distances: Array) -> Array:
    """(n, m) vectors to expect at ``weights`` (n, m): the ideal plus what found points nearby miss it by.

    Args:
        weights: where.
        found_weights: (k, m) of the found points.
        found: (k, m) their ergodic vectors.
        distances: (m, m) between maps.
    """
    missed = found - ideal_vectors(found_weights, distances)
    squared = np.asarray(distances) ** 2
    apart = weights[:, None] - found_weights[None]  # (n, k, m); they sum to 0, so this is a distance of mixtures
    away = np.sqrt(np.maximum(-0.5 * np.einsum("nki,ij,nkj->nk", apart, squared, apart), 0.0))
    near = np.argsort(away, axis=1, kind="stable")[:, :NEAREST]
    closeness = 1.0 / (np.take_along_axis(away, near, axis=1) + 1e-9)
    closeness /= closeness.sum(axis=1, keepdims=True)
    result: Array = ideal_vectors(weights, distances) + np.einsum("nk,nkm->nm", closeness, missed[near])
    return result


def gaps(
    candidates: Array,
    found_weights: Array,
    found: Array,
    distances: Array,
    count: int,
    reference: Array | None = None,
) -> list[Gap]:
    """The ``count`` weightings of ``candidates`` (n, m) that promise most, best first, each knowing of those before it.

    A candidate's gain is the hyper-volume that its forecast adds to what is there and to the forecasts chosen before,
    up to ``reference`` (m,), by default (1, …, 1).
    """
    expected = forecast(candidates, found_weights, found, distances)
    front, chosen = found, []
    bound = np.full(len(candidates), np.inf)  # gains only shrink as the front grows: most need no second look
    for _ in range(min(count, len(candidates))):
        best, gain = -1, -np.inf
        for index in np.argsort(-bound, kind="stable"):
            if bound[index] <= gain:
                break
            bound[index] = exclusive(expected[index], front, reference)
            if bound[index] > gain:
                best, gain = int(index), float(bound[index])
        chosen.append(Gap(candidates[best], gain))
        bound[best] = -np.inf
        front = np.vstack((front, expected[best]))
    return chosen
