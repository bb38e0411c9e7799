"""The search for one robot's controls: L-BFGS on the loss, in units of the controls.

Walls begin soft and get steeper until nothing is left outside; a hard end is met by multipliers.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from missions.arrays import Array, frozen
from planner.errors import PlannerError
from planner.single.loss import Loss, Task
from planner.solver.lbfgs import Memory, Point, minimise

ITERATIONS = 2000  # at most, of every round
HARD_END = 1e-4  # |x_T − x_end| at which a hard end counts as met, in the state's units
_INSIDE = 1e-6  # of the boundary term
_ROUNDS, _STIFFER = 12, 5.0
_WALL, _PENALTY = 10.0, 1.0  # to begin with
_MEMORY = 20


@dataclass(frozen=True)
class Found:
    """Where a search ended.

    Attributes:
        u: (T, m) controls. states: (T, n) after each of them. loss: its terms.
        miss: |x_T − x_end|. evaluations: of loss and gradient. seconds: of CPU.
    """

    u: Array
    states: Array
    loss: Loss
    miss: float
    evaluations: int
    seconds: float


class _Descent:
    """The loss of the controls that are free, in their units; knows when it is good enough, or too late."""

    def __init__(self, task: Task, u: Array, first: int, enough: float, deadline: float) -> None:
        self.task, self._first, self._enough, self._deadline = task, first, enough, deadline
        self.u = u.astype(np.float64)
        self.multipliers, self.penalty, self.wall = np.zeros(task.model.states(self.u).shape[1]), _PENALTY, _WALL
        self.evaluations, self._lowest = 0, np.inf

    def __call__(self, z: Array) -> tuple[float, Array]:
        """Value and gradient at z."""
        self.evaluations += 1
        self._place(z)
        value, to_u = self.task.evaluate(self.u, wall=self.wall, multipliers=self.multipliers, penalty=self.penalty)
        self._lowest = min(self._lowest, value)
        return value, (to_u[self._first :] * self.task.model.scale).ravel()

    def run(self, iterations: int) -> None:
        """Descend from where it is."""
        self._lowest = np.inf
        z = (self.u[self._first :] / self.task.model.scale).ravel()
        start = Point(z, *self(z))
        memory = Memory(_MEMORY)
        self._place(
            minimise(
                self, start, memory, max_iterations=iterations, gradient_tolerance=1e-9, keep_going=self._keep_going
            ).z
        )

    @property
    def late(self) -> bool:
        """Whether there is no time left."""
        return time.monotonic() >= self._deadline

    def settled(self) -> bool:
        """Whether walls and a hard end are kept."""
        return self.task.loss(self.u).boundary <= _INSIDE and (not self.task.hard or self.miss <= HARD_END)

    @property
    def miss(self) -> float:
        """|x_T − x_end|."""
        return float(np.linalg.norm(self.task.miss(self.task.model.states(self.u))))

    def stiffen(self) -> None:
        """Steeper walls, and what the end was missed by held against it."""
        if self.task.hard:
            self.multipliers = self.multipliers + self.penalty * self.task.miss(self.task.model.states(self.u))
            self.penalty *= _STIFFER
        self.wall *= _STIFFER

    def _place(self, z: Array) -> None:
        scale = self.task.model.scale
        self.u[self._first :] = z.reshape(-1, len(scale)) * scale

    def _keep_going(self) -> bool:
        return self._lowest > self._enough and not self.late


def search(
    task: Task,
    *,
    initial: Array | None = None,
    first: int = 0,
    enough: float = -np.inf,
    time_limit: float = np.inf,
    iterations: int = ITERATIONS,
) -> Found:
    """Lower the loss.

    Deterministic unless ``time_limit`` ends it.

    Args:
        task: what is asked for.
        initial: (T, m) controls to begin with, e.g. of a plan whose map has changed; None: the model's guess.
        first: controls at the beginning that are kept, because they were carried out already; what was seen on the
            way counts in E.
        enough: loss that is low enough to end.
        time_limit: wall time after which it ends [s].
        iterations: at most, of every round.

    Raises:
        PlannerError: initial controls of another shape, or none left to choose.
    """
    began = time.process_time()
    u = task.guess() if initial is None else np.asarray(initial)
    shape = (task.model.steps, len(task.model.scale))
    if u.shape != shape or not 0 <= first < shape[0]:
        raise PlannerError(f"got controls of shape {u.shape}, {first} of them kept; allowed: {shape}, some free")
    descent = _Descent(task, u, first, enough, time.monotonic() + time_limit)
    descent.run(iterations)
    for _ in range(_ROUNDS):
        if descent.settled() or descent.late:
            break
        descent.stiffen()
        descent.run(iterations)
    u = frozen(descent.u)
    states = frozen(task.model.states(u))
    return Found(u, states, task.loss(u), descent.miss, descent.evaluations, time.process_time() - began)
