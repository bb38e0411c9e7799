"""Any model of motion written as CasADi expressions: rollout and adjoint by CasADi, on NumPy's memory.

CasADi is an optional package: ``pip install ergoflie[casadi]``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from missions.arrays import Array, frozen
from missions.dynamics import CasadiModel
from planner.dynamics.base import Cotangent, Linearisation, Motion, StateGradient
from planner.dynamics.expressions import Expression, casadi, evaluated, translate


@dataclass(frozen=True)
class Model:
    """dx/dt = f(x, u) and the position q(x), as CasADi functions of one robot and instant.

    Attributes:
        states: n. controls: m. axes: ν.
        step: (x, u) → x after one substep (Runge-Kutta 4), u held.
        adjoint: (a, x, u, w) → (∂step/∂x)ᵀ a + w, (∂step/∂u)ᵀ a.
        sensitivities: (x, u) → ∂step/∂x, ∂step/∂u.
        rate: (x, u) → ∂f/∂x, ∂f/∂u.
        output: (x, u) → q, dq/dt.
        output_slopes: (x, u) → ∂(q, dq/dt)/∂x.
        output_adjoint: (x, u, a, b) → by x and by u the gradient of a·q + b·dq/dt.
        massive: whether dq/dt does not depend on u: controls change velocities, they do not set them.
    """

    states: int
    controls: int
    axes: int
    step: Any
    adjoint: Any
    sensitivities: Any
    rate: Any
    output: Any
    output_slopes: Any
    output_adjoint: Any
    massive: bool


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
    nu = position.numel()
    a, w, to_q, to_v = (
        ca.SX.sym(name, size) for name, size in (("a", x.numel()), ("w", x.numel()), ("q", nu), ("v", nu))
    )

    def function(name: str, arguments: list[Expression], results: list[Expression]) -> Any:  # noqa: ANN401
        return ca.Function(name, arguments, [ca.densify(result) for result in results])

    def transposed(by: Expression) -> Expression:
        return ca.jtimes(position, by, to_q, True) + ca.jtimes(velocity, by, to_v, True)

    return Model(
        states=x.numel(),
        controls=u.numel(),
        axes=nu,
        step=function("step", [x, u], [after]),
        adjoint=function("adjoint", [a, x, u, w], [ca.jtimes(after, x, a, True) + w, ca.jtimes(after, u, a, True)]),
        sensitivities=function("sensitivities", [x, u], [ca.jacobian(after, x), ca.jacobian(after, u)]),
        rate=function("rate", [x, u], [ca.jacobian(derivative, x), ca.jacobian(derivative, u)]),
        output=function("output", [x, u], [position, velocity]),
        output_slopes=function("output_slopes", [x, u], [ca.jacobian(ca.vertcat(position, velocity), x)]),
        output_adjoint=function("output_adjoint", [x, u, to_q, to_v], [transposed(x), transposed(u)]),
        massive=not ca.depends_on(velocity, u),
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
    _last: dict[str, tuple[Array, Array]] = field(default_factory=dict, init=False, repr=False, compare=False)

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
        """Gradient (T, N, m) with respect to u: the adjoint state, backwards in time."""
        states, held = self._states(motion.u), self._held(motion.u)
        to_x, to_u = self._to_states(states, held, cotangent, between=True)
        s = self.substeps
        for i in range(len(self.start)):
            backwards = (states[-2::-1, i], held[-2::-1, i], to_x[-2::-1, i])
            _, by_u = evaluated(self._back, to_x[-1, i], *backwards)
            to_u[:, i] += by_u[::-1, :, 0].reshape(self.steps, s, -1).sum(axis=1)
        return to_u

    def _to_states(self, states: Array, held: Array, cotangent: Cotangent, *, between: bool) -> tuple[Array, Array]:
        """Gradient by the states at the substeps (sT+1, N, n) and by the controls (T, N, m)."""
        s, shape = self.substeps, (*states.shape[:2], self.model.axes)
        to_q, to_v = (cotangent.q_fine.copy() if between else np.zeros(shape)), np.zeros(shape)
        to_q[::s] += cotangent.q
        to_v[::s] += cotangent.v
        to_x, by_u = (part[..., 0] for part in self._at_all(self._output_adjoint, states, held, to_q, to_v))
        to_u = cotangent.u + by_u[:-1].reshape(self.steps, s, *by_u.shape[1:]).sum(axis=1)
        to_u[-1] += by_u[-1]
        return to_x, to_u

    def linearise(self, motion: Motion) -> Linearisation:
        """∂f/∂x and ∂f/∂u at the steps."""
        A, B = self._at_all(self._rate, self.at_steps(motion.u)[:-1], motion.u)
        return Linearisation(A, B)

    def sensitivities(self, u: Array) -> tuple[Array, Array]:
        """What a state (T, N, n, n) and a control (T, N, n, m) do to the state a step later."""
        A, B = self._at_all(
            self.model.sensitivities.map(u.size // u.shape[2] * self.substeps), self._states(u)[:-1], self._held(u)[:-1]
        )
        s = self.substeps
        over, by = A[::s], B[::s]
        for j in range(1, s):
            over, by = A[j::s] @ over, A[j::s] @ by + B[j::s]
        return over, by

    def at_steps(self, u: Array) -> Array:
        """States (T+1, N, n) under controls u (T, N, m)."""
        return self._states(u)[:: self.substeps]

    def advance(self, x: Array, u: Array) -> Array:
        """States (N, n) a step after x (N, n), controls u (N, m) held."""
        step = self.model.step.map(len(x))
        for _ in range(self.substeps):
            x = evaluated(step, x, u)[0][..., 0]
        return x

    def outputs(self, x: Array, u: Array) -> tuple[Array, Array]:
        """Positions and velocities (T+1, N, ν) at states x (T+1, N, n), controls u (T, N, m)."""
        q, v = self._at_all(self.model.output.map(x.shape[0] * x.shape[1]), x, np.concatenate([u, u[-1:]]))
        return q[..., 0], v[..., 0]

    def output_slopes(self, x: Array, u: Array) -> Array:
        """What states do to positions and velocities, (T+1, N, 2ν, n)."""
        (slopes,) = self._at_all(self.model.output_slopes.map(x.shape[0] * x.shape[1]), x, np.concatenate([u, u[-1:]]))
        return slopes

    def state_gradient(self, motion: Motion, cotangent: Cotangent) -> StateGradient:
        """By x and u."""
        states, held = self._states(motion.u), self._held(motion.u)
        to_x, to_u = self._to_states(states, held, cotangent, between=False)
        return StateGradient(to_x[: -1 : self.substeps], to_u)

    def _held(self, u: Array) -> Array:
        """Control in force at every substep, and after the last one the last."""
        return np.concatenate([np.repeat(u, self.substeps, axis=0), u[-1:]])

    def _states(self, u: Array) -> Array:
        """(sT+1, N, n), read-only; for nothing if these very controls came last, as a gradient's do."""
        last = self._last.get("states")
        if last is not None and np.array_equal(last[0], u):
            return last[1]
        states = frozen(self._rolled(u))
        self._last["states"] = u.copy(), states
        return states

    def _rolled(self, u: Array) -> Array:
        held = np.repeat(u, self.substeps, axis=0)
        states = np.empty((len(held) + 1, len(self.start), self.model.states))
        states[0] = self.start
        for i, start in enumerate(self.start):
            states[1:, i] = evaluated(self._roll, start, held[:, i])[0][..., 0]
        return states

    def _outputs(self, states: Array, u: Array) -> Motion:
        q, v = (part[..., 0] for part in self._at_all(self._output, states, self._held(u)))
        s = self.substeps
        return Motion(q[::s].copy(), v[::s].copy(), u, q)

    @staticmethod
    def _at_all(mapped: Any, x: Array, *others: Array) -> list[Array]:  # noqa: ANN401 - a CasADi function
        """Outputs (S, N, rows, columns) of a mapped function at every instant and robot."""
        count = x.shape[0] * x.shape[1]
        results = evaluated(mapped, *(value.reshape(count, -1) for value in (x, *others)))
        return [result.reshape(*x.shape[:2], *result.shape[1:]) for result in results]

    @cached_property
    def _roll(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.step.mapaccum(self.steps * self.substeps)

    @cached_property
    def _back(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.adjoint.mapaccum(self.steps * self.substeps)

    @cached_property
    def _output(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.output.map((self.steps * self.substeps + 1) * len(self.start))

    @cached_property
    def _output_adjoint(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.output_adjoint.map((self.steps * self.substeps + 1) * len(self.start))

    @cached_property
    def _rate(self) -> Any:  # noqa: ANN401 - a CasADi function
        return self.model.rate.map(self.steps * len(self.start))


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
