"""Any model of motion written as CasADi expressions: rollout and sensitivities by CasADi, adjoint in NumPy.

CasADi is an optional package: ``pip install ergoflie[casadi]``.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from missions.arrays import Array, frozen
from missions.dynamics import CasadiModel
from planner.dynamics.base import Cotangent, Linearisation, Motion, StateGradient
from planner.dynamics.expressions import Expression, casadi, translate


@dataclass(frozen=True)
class Model:
    """dx/dt = f(x, u) and the position q(x), as CasADi functions over all robots and instants at once.

    Attributes:
        states: n. controls: m. axes: ν.
        step: (x, u) → x after one substep (Runge-Kutta 4), u held.
        sensitivities: (x, u) → ∂step/∂x, ∂step/∂u.
        rate: (x, u) → ∂f/∂x, ∂f/∂u.
        output: (x, u) → q, dq/dt.
        output_sensitivities: (x, u) → ∂q/∂x, ∂(dq/dt)/∂x, ∂(dq/dt)/∂u.
    """

    states: int
    controls: int
    axes: int
    step: Any
    sensitivities: Any
    rate: Any
    output: Any
    output_sensitivities: Any


def build_model(x: Expression, u: Expression, derivative: Expression, position: Expression, dt: float) -> Model:
    """A model from expressions.

    Args:
        x: (n,) symbol of the state.
        u: (m,) symbol of the controls.
        derivative: (n,) expression dx/dt [state/s].
        position: (ν,) expression of the position [m].
        dt: length of one substep [s].

    Raises:
        PlannerError: CasADi is not installed.
    """
    ca = casadi()
    f = ca.Function("f", [x, u], [derivative])
    k1 = f(x, u)
    k2 = f(x + 0.5 * dt * k1, u)
    k3 = f(x + 0.5 * dt * k2, u)
    k4 = f(x + dt * k3, u)
    after = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    velocity = ca.jtimes(position, x, derivative)
    q_x, v_x, v_u = (ca.densify(ca.jacobian(a, b)) for a, b in ((position, x), (velocity, x), (velocity, u)))
    jacobians = [ca.densify(ca.jacobian(after, x)), ca.densify(ca.jacobian(after, u))]
    return Model(
        states=x.numel(),
        controls=u.numel(),
        axes=position.numel(),
        step=ca.Function("step", [x, u], [ca.densify(after)]),
        sensitivities=ca.Function("sensitivities", [x, u], jacobians),
        rate=ca.Function(
            "rate", [x, u], [ca.densify(ca.jacobian(derivative, x)), ca.densify(ca.jacobian(derivative, u))]
        ),
        output=ca.Function("output", [x, u], [ca.densify(position), ca.densify(velocity)]),
        output_sensitivities=ca.Function("output_sensitivities", [x, u], [q_x, v_x, v_u]),
    )


@dataclass(frozen=True)
class CasadiDynamics:
    """Robots of one model.

    Attributes:
        model: theirs, for substeps of dt / s.
        start: (N, n) states at t = 0.
        lower: (m,) least controls. upper: (m,) largest.
        steps: T. dt: step [s].
        substeps: s, positions a step that :attr:`Motion.q_fine` holds; also the integrator's substeps.
    """

    model: Model
    start: Array
    lower: Array
    upper: Array
    steps: int
    dt: float
    substeps: int = 2

    def __post_init__(self) -> None:
        for name in ("start", "lower", "upper"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def controls_shape(self) -> tuple[int, int, int]:
        """(T, N, m)."""
        return self.steps, len(self.start), self.model.controls

    @property
    def rests(self) -> bool:
        """A model's own business."""
        return False

    @property
    def control_scale(self) -> tuple[Array, Array]:
        """The middle of the bounds, and half their range."""
        return 0.5 * (self.lower + self.upper), 0.5 * (self.upper - self.lower)

    def rollout(self, u: Array) -> Motion:
        """Motion under controls u (T, N, m)."""
        return self._outputs(self._states(u), u)

    def pull(self, motion: Motion, cotangent: Cotangent) -> Array:
        """Gradient (T, N, m) with respect to u: the sensitivities' transposes, backwards in time."""
        to_x, to_u = self._to_states(motion, cotangent, between=True)
        states, held = self._states(motion.u), self._held(motion.u)
        A, B = self._evaluated(self._sensitivity, states[:-1], held[:-1])
        At, Bt = np.swapaxes(A, -1, -2), np.swapaxes(B, -1, -2)
        adjoint = to_x[-1][..., None]
        for k in reversed(range(len(A))):
            to_u[k // self.substeps] += (Bt[k] @ adjoint)[..., 0]
            adjoint = At[k] @ adjoint + to_x[k][..., None]
        return to_u

    def _to_states(self, motion: Motion, cotangent: Cotangent, *, between: bool) -> tuple[Array, Array]:
        """Gradient by the states at the substeps (sT+1, N, n) and by the controls (T, N, m)."""
        s = self.substeps
        q_x, v_x, v_u = self._evaluated(self._output_sensitivity, self._states(motion.u), self._held(motion.u))
        to_q = np.zeros((*q_x.shape[:2], self.model.axes))
        to_q[::s] += cotangent.q
        if between:
            to_q += cotangent.q_fine
        to_x: Array = np.einsum("tnqx,tnq->tnx", q_x, to_q)
        to_x[::s] += np.einsum("tnqx,tnq->tnx", v_x[::s], cotangent.v)
        by_v = np.einsum("tnqu,tnq->tnu", v_u[::s], cotangent.v)
        to_u = cotangent.u + by_v[:-1]
        to_u[-1] += by_v[-1]
        return to_x, to_u

    def linearise(self, motion: Motion) -> Linearisation:
        """∂f/∂x and ∂f/∂u at the steps."""
        A, B = self._evaluated(self._rate, self._states(motion.u)[: -1 : self.substeps], motion.u)
        return Linearisation(A, B)

    def state_gradient(self, motion: Motion, cotangent: Cotangent) -> StateGradient:
        """By x and u."""
        to_x, to_u = self._to_states(motion, cotangent, between=False)
        return StateGradient(to_x[: -1 : self.substeps], to_u)

    def _held(self, u: Array) -> Array:
        """Control in force at every substep, and after the last one the last."""
        return np.concatenate([np.repeat(u, self.substeps, axis=0), u[-1:]])

    def _states(self, u: Array) -> Array:
        """(sT+1, N, n)."""
        held = np.repeat(u, self.substeps, axis=0)
        states = np.empty((len(held) + 1, len(self.start), self.model.states))
        states[0] = self.start
        for i, start in enumerate(self.start):
            states[1:, i] = self._roll(start, held[:, i].T).full().T
        return states

    def _outputs(self, states: Array, u: Array) -> Motion:
        q, v = self._evaluated(self._output, states, self._held(u))
        q, v, s = q[..., 0], v[..., 0], self.substeps
        return Motion(q[::s].copy(), v[::s].copy(), u, q)

    @cached_property
    def _roll(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.step.mapaccum(self.steps * self.substeps)

    @cached_property
    def _output(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.output.map((self.steps * self.substeps + 1) * len(self.start))

    @cached_property
    def _sensitivity(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.sensitivities.map(self.steps * self.substeps * len(self.start))

    @cached_property
    def _rate(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.rate.map(self.steps * len(self.start))

    @cached_property
    def _output_sensitivity(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.output_sensitivities.map((self.steps * self.substeps + 1) * len(self.start))

    @staticmethod
    def _evaluated(mapped: Any, x: Array, u: Array) -> list[Array]:  # noqa: ANN401 - a CasADi function
        """Outputs (S, N, rows, columns) of a mapped function at every instant and robot."""
        instants, robots = x.shape[:2]
        count = instants * robots
        outputs = []
        for result in mapped(x.reshape(count, -1).T, u.reshape(count, -1).T):
            flat = result.full()  # (rows, columns of every instant and robot side by side)
            split: Array = flat.reshape(len(flat), instants, robots, -1)
            outputs.append(split.transpose(1, 2, 0, 3))
        return outputs


def casadi_dynamics(model: CasadiModel, positions: Array, steps: int, dt: float, substeps: int = 2) -> CasadiDynamics:
    """The dynamics of a mission's model.

    Args:
        model: as written in the mission.
        positions: (N, ν) positions at t = 0 [m]; the states beyond them start at ``model.initial``.
        steps: T.
        dt: step [s].
        substeps: of the integrator, and of the samples between the steps.

    Raises:
        PlannerError: CasADi is not installed.
    """
    ca = casadi()
    n, nu = len(model.states), positions.shape[1]
    x, u = ca.SX.sym("x", n), ca.SX.sym("u", len(model.controls))
    symbols = {name: x[k] for k, name in enumerate(model.states)}
    symbols |= {name: u[k] for k, name in enumerate(model.controls)}
    derivative = ca.vertcat(*[translate(text, symbols) for text in model.derivative])
    initial = np.asarray(model.initial or (0.0,) * (n - nu), dtype=np.float64)
    start = np.concatenate([positions, np.broadcast_to(initial, (len(positions), n - nu))], axis=1)
    built = build_model(x, u, derivative, x[:nu], dt / substeps)
    return CasadiDynamics(built, start, np.array(model.lower), np.array(model.upper), steps, dt, substeps)
