"""What a model of motion is, to the planner."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from missions.arrays import Array


class Motion(NamedTuple):
    """What the robots do.

    Attributes:
        q: (T+1, N, ν) positions at the steps [m].
        v: (T+1, N, ν) velocities at the steps [m/s].
        u: (T, N, m) controls, constant over a step, in the model's units: accelerations [m/s²] for the double
            integrator, velocities [m/s] for the single integrator.
        q_fine: (sT+1, N, ν) positions at the steps and at s−1 equally spaced instants between them [m].
    """

    q: Array
    v: Array
    u: Array
    q_fine: Array


class Cotangent(NamedTuple):
    """Gradient of a scalar with respect to a motion; terms add to it in place. Shapes as in :class:`Motion`."""

    q: Array
    v: Array
    u: Array
    q_fine: Array

    @classmethod
    def zeros_like(cls, motion: Motion) -> Cotangent:
        """The cotangent of a constant."""
        return cls(*(np.zeros_like(part) for part in motion))


class Linearisation(NamedTuple):
    """δẋ = A δx + B δu along a motion.

    Attributes:
        A: (T, N, n, n) or, if the model is linear and the robots alike, (1, 1, n, n).
        B: (T, N, n, m) or (1, 1, n, m).
    """

    A: Array
    B: Array


class StateGradient(NamedTuple):
    """Gradient of a scalar by the states and controls at steps 0 to T−1, as if they were independent.

    Attributes:
        alpha: (T, N, n). beta: (T, N, m).
    """

    alpha: Array
    beta: Array


class Dynamics(Protocol):
    """A model of motion: controls in, motion out, and the transpose of that map."""

    @property
    def controls_shape(self) -> tuple[int, int, int]:
        """(T, N, m): steps, robots, controls a robot."""

    @property
    def substeps(self) -> int:
        """s, positions a step that :attr:`Motion.q_fine` holds."""

    @property
    def rests(self) -> bool:
        """Whether a motion starts and has to end at rest and without acceleration, as what hands over to hovering."""

    @property
    def control_scale(self) -> tuple[Array, Array]:
        """Origin and unit (m,) each: the controls a search starts around, and by how much they typically vary."""

    def rollout(self, u: Array) -> Motion:
        """Motion under controls u."""

    def pull(self, motion: Motion, cotangent: Cotangent) -> Array:
        """Transpose of the rollout's derivative at ``motion``: gradient with respect to u."""

    def linearise(self, motion: Motion) -> Linearisation:
        """Sensitivities of the rate of the model's state; the state begins with the position."""

    def state_gradient(self, motion: Motion, cotangent: Cotangent) -> StateGradient:
        """A cotangent of q, v and u in terms of states; samples between the steps do not count."""
