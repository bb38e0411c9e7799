"""Any model written as CasADi expressions: ``pip install ergoflie[casadi]``."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from missions.arrays import Array, frozen
from planner.dynamics.casadi_model import Model as Expressions


@dataclass(frozen=True)
class ExpressionModel:
    """A model of :func:`planner.dynamics.casadi_model.build_model`, step after step from a state.

    Attributes:
        model: its expressions, for the length of a step. start: (n,) state before the first step. steps: T.
        scale: (m,) how much each control typically varies.
        first: (m,) controls of a first guess; not where the model has no slope.
    """

    model: Expressions
    start: Array
    steps: int
    scale: Array
    first: Array

    def __post_init__(self) -> None:
        for name in ("start", "scale", "first"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    def guess(self, target: Array) -> Array:
        """The same controls all the time, wherever they lead."""
        del target  # Unused: which controls lead there is what the search is for.
        return np.tile(self.first, (self.steps, 1))

    def states(self, u: Array) -> Array:
        """(T, n) after each of the controls (T, m)."""
        states: Array = self._roll(self.start, u.T).full().T
        return states

    def pull(self, u: Array, states: Array, to_states: Array) -> Array:
        """Gradient (T, m) by controls, by CasADi's own reverse mode."""
        _, to_u = self._reverse(self.start, u.T, states.T, to_states.T)
        gradient: Array = to_u.full().T
        return gradient

    @cached_property
    def _roll(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.step.mapaccum(self.steps)

    @cached_property
    def _reverse(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self._roll.reverse(1)
