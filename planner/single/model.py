"""What a model is to a search for one robot: controls in, states out, and the transpose of that map."""

from __future__ import annotations

from typing import Protocol

from missions.arrays import Array


class Model(Protocol):
    """A robot and its horizon."""

    @property
    def steps(self) -> int:
        """T."""

    @property
    def scale(self) -> Array:
        """(m,) how much each control typically varies; the search works in these units."""

    def guess(self, target: Array) -> Array:
        """(T, m) controls to begin a search with: towards a position (ν,) [m], never where the model has no slope."""

    def states(self, u: Array) -> Array:
        """(T, n) states after each of the controls u (T, m); the first axes are the position [m]."""

    def pull(self, u: Array, states: Array, to_states: Array) -> Array:
        """Transpose of the derivative of :meth:`states` at u: gradient (T, m) of a gradient (T, n) by the states."""
