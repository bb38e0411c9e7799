"""The loss of one robot's search, term by term, and its gradient.

    L = w_E E + Σ_j w_j mean(u_j²) + w_b Σ (way outside the box) + w_end |x_T − x_end|²

(README of PlanetaryRobotics' ergodic-search; all its weights are the defaults.) A hard end has no weight: it is met.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.ergodic.metric import ErgodicMetric
from planner.errors import PlannerError
from planner.single.model import Model


@dataclass(frozen=True)
class LossWeights:
    """Weights of the terms.

    Attributes:
        ergodic: of E. effort: of the mean square of each control, one number a control.
        boundary: of the way [m] outside the box, summed over steps and axes.
        end: of the squared distance of the last state from the end; None: the end is hard.
    """

    ergodic: float = 1.0
    effort: tuple[float, ...] = (0.1, 0.05)
    boundary: float = 1000.0
    end: float | None = 0.5


class Loss(NamedTuple):
    """The terms with their weights; a hard end counts nothing."""

    ergodic: float
    effort: float
    boundary: float
    end: float

    @property
    def total(self) -> float:
        """Their sum."""
        return self.ergodic + self.effort + self.boundary + self.end


@dataclass(frozen=True)
class Task:
    """What is asked for.

    Attributes:
        model: who moves. metric: information and box, of as many axes as positions have. weights: of the loss.
        end: (n,) last state, NaN where it does not matter; None: anywhere.
    """

    model: Model
    metric: ErgodicMetric
    weights: LossWeights = LossWeights()
    end: tuple[float, ...] | None = None

    def __post_init__(self) -> None:
        controls = len(self.model.scale)
        if len(self.weights.effort) != controls:
            raise PlannerError(f"got {len(self.weights.effort)} effort weights; allowed: {controls}, one a control")
        states = self.model.states(np.zeros((self.model.steps, controls))).shape[1]
        if self.end is not None and len(self.end) != states:
            raise PlannerError(f"got an end of {len(self.end)} numbers; allowed: {states}, as a state has")

    def on(self, phi_k: Array) -> Task:
        """The same on another map, by its coefficients (n,)*ν."""
        return replace(self, metric=replace(self.metric, phi_k=phi_k))

    @property
    def hard(self) -> bool:
        """Whether there is an end that has to be met."""
        return self.end is not None and self.weights.end is None

    def guess(self) -> Array:
        """(T, m) the model's first guess: towards the end, or the middle of the box."""
        basis = self.metric.basis
        middle = 0.5 * (basis.lower + basis.upper)
        if self.end is None:
            return self.model.guess(middle)
        end = np.array(self.end)[: basis.dimension]
        target: Array = np.where(np.isnan(end), middle, end)
        return self.model.guess(target)

    def miss(self, states: Array) -> Array:
        """(n,) by how much the last state misses the end; zero where that does not matter."""
        if self.end is None:
            return np.zeros(states.shape[1])
        return np.asarray(np.nan_to_num(states[-1] - np.array(self.end)))

    def loss(self, u: Array) -> Loss:
        """The terms for controls (T, m)."""
        return self._forward(u)[0]

    def evaluate(
        self, u: Array, *, wall: float, multipliers: Array | None = None, penalty: float = 0.0
    ) -> tuple[float, Array]:
        """A smooth stand-in for the loss that is equal to it inside the box, and its gradient (T, m) by controls.

        Outside, Σ wall d² takes the place of the boundary term: searches get stuck at the edge of Σ d.

        Args:
            u: (T, m) controls.
            wall: how steep it is outside [1/m²].
            multipliers: (n,) of a hard end: its augmented Lagrangian is added.
            penalty: μ of that.
        """
        loss, states, to_q, outside = self._forward(u)
        to_states = np.zeros_like(states)
        to_states[:, : to_q.shape[1]] = self.weights.ergodic * to_q + 2.0 * wall * outside
        value = loss.total - loss.boundary + wall * float(np.vdot(outside, outside))
        if self.end is not None:
            miss = self.miss(states)
            if self.weights.end is not None:
                to_states[-1] += 2.0 * self.weights.end * miss
            elif multipliers is not None:
                value += float(multipliers @ miss + 0.5 * penalty * miss @ miss)
                to_states[-1] += np.where(np.isnan(self.end), 0.0, multipliers + penalty * miss)
        to_u = self.model.pull(u, states, to_states)
        to_u += u * (np.array(self.weights.effort) * (2.0 / len(u)))
        return value, to_u

    def _forward(self, u: Array) -> tuple[Loss, Array, Array, Array]:
        """Terms, states, gradient of E by positions (T, ν), signed ways outside the box (T, ν)."""
        weights, basis = self.weights, self.metric.basis
        states = self.model.states(u)
        q = states[:, : basis.dimension]
        E, to_q = self.metric.evaluate(q[:, None])
        outside = np.maximum(q - basis.upper, 0.0) + np.minimum(q - basis.lower, 0.0)
        miss = self.miss(states)
        loss = Loss(
            ergodic=weights.ergodic * E,
            effort=float(np.array(weights.effort) @ np.square(u).mean(axis=0)),
            boundary=weights.boundary * float(np.abs(outside).sum()),
            end=0.0 if weights.end is None else weights.end * float(miss @ miss),
        )
        return loss, states, to_q[:, 0], outside
