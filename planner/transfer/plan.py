"""Stage 4c: the way to the search and back, from the mission and the ends of the trajectories.

Everybody rises at once to the height of his start, over his pad; flies to his start; searches; flies back over his pad
if the mission says so; and everybody lands at once. Rising and landing together needs no order, for pads are apart; the
moves between are straight and shared where that is safe, else delayed, else in waves.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfer.delays import Way, delays
from planner.transfer.errors import TransferError
from planner.transfer.scene import survey
from planner.transfer.waves import together, waves, ways_around, ways_past_all
from planner.transfers import Move, Passage, Transfers

PEAK_SPEED, PEAK_ACCELERATION = 2.1875, 7.5132  # of a rest-to-rest move: × d/T and × d/T² (protocol notes B1)
SHORTEST = 1.5  # [s] of a move
PAUSE = 0.5  # [s] between waves: for tracking to catch up
_NEAR = 5e-4  # [m] what the bytes may round: nobody moves for it


def plan_transfers(mission: Mission, flown: Mapping[str, PiecewisePolynomial]) -> Transfers:
    """All moves of a flight.

    Args:
        mission: whose.
        flown: what the bytes fly, by robot name.

    Raises:
        TransferError: there is no safe way for a robot; one line that names it and what is in its way.
    """
    names = [robot.name for robot in mission.robots]
    starts = np.stack([flown[name].evaluate(np.zeros(1))[0, :3] for name in names])
    ends = np.stack([flown[name].evaluate(np.array([flown[name].duration]))[0, :3] for name in names])
    approach = plan_approach(mission, starts)
    over = np.column_stack([fleet.pads(mission), ends[:, 2]]) if mission.flight.return_to == "pads" else ends
    try:
        back = plan_moves(mission, ends, over)
    except TransferError as error:
        raise TransferError(f"on the way back, {error}; 'flight.return_to: none' lands where the search ends") from None
    return Transfers(
        take_off=_together(
            names, np.column_stack([fleet.pads(mission), starts[:, 2]]), mission.flight.takeoff_duration
        ),
        approach=approach,
        back=back,
        landing=_together(names, over * np.array([1.0, 1.0, 0.0]), mission.flight.landing_duration),
    )


def plan_approach(mission: Mission, starts: Array) -> Passage:
    """Moves from above the pads to the starts (N, 3) [m]; known before the search is planned. Raises TransferError."""
    return plan_moves(mission, np.column_stack([fleet.pads(mission), starts[:, 2]]), starts)


def plan_moves(mission: Mission, begin: Array, goal: Array, *, hurried: bool = False) -> Passage:
    """Moves of robots that hover at (N, 3) and go to (N, 3) [m].

    Args:
        mission: what is in the way.
        begin: where they hover.
        goal: where they go.
        hurried: after an abort: whatever distances they have are accepted.

    Raises:
        TransferError: no safe way was found.
    """
    goal = np.where(np.linalg.norm(goal - begin, axis=1)[:, None] < _NEAR, begin, goal)
    scene = survey(mission, begin, goal, hurried=hurried)
    if np.array_equal(begin, goal):
        return {}
    if together(scene, begin, goal):
        return _in_waves(mission, begin, [goal])
    around = ways_around(scene, begin, goal)
    for routes in (around, ways_past_all(scene, begin, goal, around)):
        ways = [_at_own_pace(mission, k, np.stack([begin[k], *route])) for k, route in enumerate(routes)]
        leaves = delays(scene, ways)
        if leaves is not None:
            break
    if leaves is None:
        return _in_waves(mission, begin, waves(scene, begin, goal, around))
    return {
        robot.name: tuple(
            Move(_vec3(point), round(leave + start, 3), lasting)
            for point, start, lasting in zip(way.points[1:], way.begins.tolist(), way.durations.tolist(), strict=True)
        )
        for robot, way, leave in zip(mission.robots, ways, leaves, strict=True)
        if len(way.begins)
    }


def _at_own_pace(mission: Mission, robot: int, points: Array) -> Way:
    steps = np.diff(points, axis=0)
    durations = np.array([_duration(mission, step[None], [robot]) for step in steps])
    return Way(
        points, np.concatenate([[0.0], np.cumsum(durations + PAUSE)[:-1]]) if len(steps) else durations, durations
    )


def _in_waves(mission: Mission, begin: Array, flown: Sequence[Array]) -> Passage:
    """Waves one after another, each as fast as the mission allows the one who flies farthest."""
    moves: dict[str, list[Move]] = {robot.name: [] for robot in mission.robots}
    clock, here = 0.0, begin
    for there in flown:
        moving = np.flatnonzero((there != here).any(axis=1))
        lasting = _duration(mission, there - here, range(len(here)))
        for k in moving.tolist():
            moves[mission.robots[k].name].append(Move(_vec3(there[k]), clock, lasting))
        clock, here = clock + lasting + PAUSE, there
    return {name: tuple(items) for name, items in moves.items() if items}


def _duration(mission: Mission, way: Array, robots: Sequence[int]) -> float:
    """Whole milliseconds [s] that straight moves (N, 3) [m] need to keep mean speed, peak speed, acceleration."""
    distance = np.linalg.norm(way, axis=1)
    needed = [
        SHORTEST,
        *(distance / mission.flight.transfer_speed),
        *(PEAK_SPEED * distance / fleet.speeds(mission)[list(robots)]),
        *np.sqrt(PEAK_ACCELERATION * np.abs(way).max(axis=1) / fleet.accelerations(mission)[list(robots)]),
    ]
    return math.ceil(1000.0 * float(max(needed))) / 1000.0


def _together(names: Iterable[str], targets: Array, lasting: float) -> Passage:
    return {name: (Move(_vec3(target), 0.0, lasting),) for name, target in zip(names, targets, strict=True)}


def _vec3(point: Array) -> tuple[float, float, float]:
    x, y, z = point.tolist()
    return x, y, z
