"""Many searches side by side, each in a lane of a stack, so that they share every evaluation.

A search is a few rounds of the augmented Lagrangian method. Lanes need not be in step: one may be in a line search
while its neighbour begins a round; and when a search is done, the next in the queue takes its lane.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from missions.arrays import Array
from planner.dynamics import Motion
from planner.solver.augmented_lagrangian import Schedule, State
from planner.solver.lbfgs import Asking, Memory, Point, descend
from planner.solver.misses import METRE_TOLERANCE
from planner.solver.stack import Stack, StackValue

GRADIENT_TOLERANCE = 1e-6


class Runner(NamedTuple):
    """A search between two of its rounds.

    Attributes:
        state: of the augmented Lagrangian method. memory: of L-BFGS.
        merit: objective plus penalty without multipliers, comparable between searches after as many rounds.
    """

    state: State
    memory: Memory
    merit: float = math.inf


class Closed(NamedTuple):
    """Where lanes stand that have just closed a round: the one that misses the least.

    Attributes:
        E: ergodicity. worst: miss of any constraint [m equivalent]. evaluations: of the heat so far.
    """

    E: float
    worst: float
    evaluations: int


class Lane:
    """One search: what it asks for next, and how many rounds are left.

    Attributes:
        number: of the search. z: where it wants to be evaluated. turn: whether that closes a round.
    """

    def __init__(self, number: int, state: State, memory: Memory, rounds: int, schedule: Schedule) -> None:
        self.number, self.state, self.memory, self.left, self.schedule = number, state, memory, rounds, schedule
        self.z, self.turn = state.z, False
        self.descent: Asking[Point] | None = None

    def answer(self, f: float, g: Array) -> bool:
        """Go on with the objective and its gradient at z; False when the last round is over."""
        try:
            if self.descent is not None:
                self.z, self.turn = self.descent.send((f, g)), False
                return True
            if self.left == 0:
                return False
            self.left -= 1
            self.descent = descend(
                Point(self.z, f, g),
                self.memory,
                max_iterations=self.schedule.iterations,
                gradient_tolerance=GRADIENT_TOLERANCE,
                keep_going=_always,
            )
            self.z, self.turn = next(self.descent), False
        except StopIteration as end:
            self.z, self.turn, self.descent = end.value.z, True, None
        return True


def _always() -> bool:
    """Lanes are stopped together, between evaluations."""
    return True


def run_lanes(
    stack: Stack,
    field: Sequence[Runner],
    rounds: int,
    schedule: Schedule,
    keep_going: Callable[[], bool],
    closed: Callable[[Closed], None] | None = None,
) -> tuple[list[Runner], int]:
    """``rounds`` rounds of every search; those that were done when it was told to stop, and the evaluations.

    ``closed`` is called after every evaluation that closes a round of some lane, which is some twenty times a second.
    """
    waiting = list(enumerate(field))[::-1]
    lanes: list[Lane | None] = [None] * stack.swarms
    z = np.tile(field[0].state.z, (stack.swarms, 1))
    done: dict[int, Runner] = {}
    evaluations = 0

    def load(swarm: int) -> None:
        lanes[swarm] = None
        if waiting:
            number, (state, memory, _) = waiting.pop()
            stack.load(swarm, state.multipliers, state.mu)
            lanes[swarm] = Lane(number, state, memory, rounds, schedule)
            z[swarm] = state.z

    for swarm in range(stack.swarms):
        load(swarm)
    while any(lane is not None for lane in lanes) and keep_going():
        turn = np.array([lane is not None and lane.turn for lane in lanes])
        value = stack.evaluate(z.copy(), turn, schedule.growth, schedule.largest)
        for swarm, lane in enumerate(lanes):
            if lane is None:
                continue
            evaluations += 1
            if lane.answer(float(value.L[swarm]), value.gradient[swarm]):
                z[swarm] = lane.z
            else:
                done[lane.number] = _ran(stack, value, swarm, lane, rounds)
                load(swarm)
        if closed is not None and turn.any():
            leader = int(np.argmin(np.where(turn, value.worst, math.inf)))
            closed(Closed(float(value.E[leader]), METRE_TOLERANCE * float(value.worst[leader]), evaluations))
    return [done[number] for number in sorted(done)], evaluations


def _ran(stack: Stack, value: StackValue, swarm: int, lane: Lane, rounds: int) -> Runner:
    """A search whose rounds are over."""
    E, worst = float(value.E[swarm]), METRE_TOLERANCE * float(value.worst[swarm])
    robots = value.motion.u.shape[1] // stack.swarms
    mine = slice(swarm * robots, (swarm + 1) * robots)
    state = replace(
        lane.state,
        z=lane.z.copy(),
        motion=Motion(*(np.ascontiguousarray(part[:, mine]) for part in value.motion)),
        E=E,
        violation=worst,
        preference=worst,
        multipliers=stack.saved(swarm, lane.state.multipliers),
        mu=float(stack.mu[swarm]),
        round=lane.state.round + rounds,
        recent=(*lane.state.recent, E),
        misses=(*lane.state.misses, worst),
    )
    return Runner(state, lane.memory, float(value.merit[swarm]))
