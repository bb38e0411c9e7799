"""Before and after the search: up from the pads, over to the starts, back, and down.

Sees the moves as data, not how they were planned: the polynomials the firmware's commander will make of them are worked
out here, and are held against the mission in continuous time as the search is. Who rises or lands has the column of
air over his place for himself, whatever the heights; between, distances are those of the downwash ellipsoid.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from missions import fleet
from missions.airframes import airframe
from missions.arrays import Array
from missions.schema import Mission, Workspace
from planner.certificate import motion, obstacles, workspace
from planner.certificate.checks import DISTANCE_TOLERANCE, check, names_of, room, worst
from planner.certificate.errors import CertificateError
from planner.certificate.record import Check
from planner.certificate.separation import closest_approaches
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfers import Move, Passage, Transfers

SHARE_TOLERANCE = 0.01  # of speed and acceleration limits
FENCE_SHARE = 0.5  # of the geofence margin moves may use; the rest is for tracking
_SAME_TIME = 1e-9  # [s]
_SMOOTH = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])  # planner.c: position over u = t/T, rest to rest
_ALONE = np.array([1.0, 1.0, 0.0])  # how distances count where everybody has a column for himself


@dataclass(frozen=True)
class _Leg:
    """A passage as it will be flown: polynomials by robot, whether it is straight up or down, whether anybody moves."""

    name: str
    vertical: bool
    moves: bool
    flown: Mapping[str, PiecewisePolynomial]

    @property
    def ends(self) -> Array:
        """(N, 3) last points [m]."""
        return np.stack([f.evaluate(np.array([f.duration]))[0, :3] for f in self.flown.values()])


def transition_checks(mission: Mission, transfers: Transfers, flown: Mapping[str, PiecewisePolynomial]) -> list[Check]:
    """Everything about the moves around the search.

    Args:
        mission: what is allowed.
        transfers: the moves.
        flown: the search, by robot name, in the mission's order.

    Raises:
        CertificateError: the moves are not those of this mission's robots, or overlap in time.
    """
    names = list(flown)
    on_pads = np.column_stack([fleet.pads(mission), np.zeros(len(names))])
    starts = np.stack([trajectory.evaluate(np.zeros(1))[0, :3] for trajectory in flown.values()])
    ends = np.stack([trajectory.evaluate(np.array([trajectory.duration]))[0, :3] for trajectory in flown.values()])
    up = _leg("take-off", transfers.take_off, on_pads, names, vertical=True)
    over = _leg("transfer", transfers.approach, up.ends, names)
    back = _leg("return", transfers.back, ends, names)
    down = _leg("landing", transfers.landing, back.ends, names, vertical=True)
    places = on_pads if mission.flight.return_to == "pads" else ends * _ALONE
    checks = [item for leg in (up, over, back, down) if leg.moves for item in _leg_checks(mission, leg)]
    for name, found, wanted in (("transfer end", over.ends, starts), ("landing place", down.ends, places)):
        off = np.linalg.norm(found - wanted, axis=1)
        k = int(off.argmax())
        checks.append(check(name, float(off[k]), 0.0, "m", "<=", names[k], tolerance=DISTANCE_TOLERANCE))
    return checks


def flown_by(moves: Sequence[Move], begin: Array, lasting: float) -> PiecewisePolynomial:
    """What the commander flies when it gets these moves while it hovers at a point (3,) [m].

    Args:
        moves: in order of time.
        begin: where it hovers.
        lasting: until when it is looked at [s]; longer than zero.

    Raises:
        CertificateError: a move begins before the one before it is over.
    """
    here, clock = np.asarray(begin, dtype=np.float64), 0.0
    durations: list[float] = []
    pieces: list[Array] = []

    def add(duration: float, target: Array) -> None:
        piece = np.zeros((4, 8))
        piece[:3] = np.outer(target - here, _SMOOTH * duration ** -np.arange(8.0))
        piece[:3, 0] += here
        durations.append(duration)
        pieces.append(piece)

    for move in moves:
        if move.begin < clock - _SAME_TIME:
            raise CertificateError(f"a move begins at {move.begin:g} s, before the one before it ends at {clock:g} s")
        if move.begin > clock + _SAME_TIME:
            add(move.begin - clock, here)
        target = np.array(move.target)
        add(move.duration, target)
        here, clock = target, move.end
    if lasting > clock + _SAME_TIME:
        add(lasting - clock, here)
    return PiecewisePolynomial(np.array(durations), np.stack(pieces))


# ------------------------------------------------------------------------------------------------ inside


def _leg(name: str, passage: Passage, begin: Array, names: Sequence[str], *, vertical: bool = False) -> _Leg:
    if unknown := sorted(set(passage) - set(names)):
        raise CertificateError(f"moves of {', '.join(unknown)}; the mission flies {', '.join(names)}")
    lasting = max((moves[-1].end for moves in passage.values() if moves), default=0.0)
    if vertical:
        for robot, point in zip(names, begin, strict=True):
            moves = passage.get(robot, ())
            if len(moves) != 1 or moves[0].begin != 0.0 or moves[0].duration != lasting:
                raise CertificateError(f"{name}: everybody makes one move, together; {robot} does not")
            if not np.linalg.norm(np.array(moves[0].target[:2]) - point[:2]) <= DISTANCE_TOLERANCE:
                raise CertificateError(f"{name}: {robot} does not go straight up or down")
    hover = lasting or 1.0  # nobody moves: everybody is where he is
    flown = {robot: flown_by(passage.get(robot, ()), p, hover) for robot, p in zip(names, begin, strict=True)}
    return _Leg(name, vertical, lasting > 0.0, flown)


def _leg_checks(mission: Mission, leg: _Leg) -> Iterator[Check]:
    names = list(leg.flown)
    if len(names) > 1:
        scale = _ALONE if leg.vertical else np.array([1.0, 1.0, fleet.transfer_scale(mission)])
        whole = np.array([0.0, max(f.duration for f in leg.flown.values())])
        found = closest_approaches(list(leg.flown.values()), whole, scale)
        k = int(found.bound[:, 0].argmin())
        where = f"{names_of(found.pairs[k], names)}, {found.time[k, 0]:.1f} s after its begin"
        yield room(f"{leg.name} separation", float(found.bound[k, 0]), where, limit=mission.limits.separation)
    each = [_robot_checks(mission, leg, k, flown) for k, flown in enumerate(leg.flown.values())]
    yield from worst(item for checks in each for item in checks)


def _robot_checks(mission: Mission, leg: _Leg, robot: int, flown: PiecewisePolynomial) -> Iterator[Check]:
    name = mission.robots[robot].name
    for label, thing in obstacles.in_the_way(mission, name):
        gap = obstacles.clearance(flown, thing)
        yield room(
            f"{leg.name} obstacles", float(gap.bound[0]), f"{name}, {label}, {gap.time[0]:.1f} s after its begin"
        )
    lower, upper = fleet.fence(mission)
    margin = FENCE_SHARE * mission.flight.geofence_margin
    side = workspace.inside(flown, Workspace(tuple(lower - margin), tuple(upper + margin)))
    yield room(f"{leg.name} geofence", float(side.bound[0]), f"{name}, {side.time[0]:.1f} s after its begin")
    frame = airframe(mission.flight.airframe)
    # Durations of take-off and landing are the mission's own; its limits are those of the search and of moves.
    v = frame.speed_limit if leg.vertical else float(fleet.speeds(mission)[robot])
    u = frame.acceleration_limit if leg.vertical else float(fleet.accelerations(mission)[robot])
    fastest, hardest = motion.largest_speed(flown), motion.largest_acceleration(flown)
    yield check(f"{leg.name} speed", fastest.value, v, "m/s", "<=", name, tolerance=SHARE_TOLERANCE * v)
    yield check(f"{leg.name} acceleration", hardest.value, u, "m/s²", "<=", name, tolerance=SHARE_TOLERANCE * u)
