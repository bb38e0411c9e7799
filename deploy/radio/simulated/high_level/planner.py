"""The planner: which trajectory is being followed, and in which state (firmware planner.c)."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import NamedTuple

import numpy as np

from deploy.radio.simulated.high_level.compressed import CompressedTrajectory
from deploy.radio.simulated.high_level.evaluation import Evaluation, Float32, normalize_angle
from deploy.radio.simulated.high_level.trajectory import PlannedPiece, PolynomialTrajectory, Trajectory
from deploy.radio.simulated.interface import PERIOD, ZERO, Vec3
from missions.arrays import Array

OK, REFUSED = 0, 1
_AHEAD = PERIOD * np.arange(50)  # [s] what is evaluated together


class PlannerState(IntEnum):
    """States; values as in the firmware (bit 0: producing setpoints)."""

    IDLE = 0
    FLYING = 1
    LANDING = 3
    DISABLED = 4


def _state(position: Vec3, yaw: float, velocity: Vec3 = ZERO, yaw_rate: float = 0.0, acc: Vec3 = ZERO) -> Float32:
    """(3, 4) float32: value, rate and second derivative of x, y, z, yaw; yaw has no second derivative here."""
    return np.array([[*position, yaw], [*velocity, yaw_rate], [*acc, 0.0]], np.float32)


class Foresight(NamedTuple):
    """Goals of the ticks to come, see :mod:`.evaluation`: ``goals`` (16, K) at ``times``, :data:`PERIOD` apart.

    Attributes:
        begin: time of the first [s] since boot. times: all, as the firmware's float32 numbers.
        version: of the trajectory that they are of. finite: whether all are numbers.
    """

    begin: float
    times: list[float]
    goals: Array
    version: int
    finite: bool


class Planner:
    """Follows one trajectory at a time. Times are float32 seconds since boot, positions [m], angles [rad]."""

    def __init__(self) -> None:
        self.state = PlannerState.IDLE
        self._trajectory: Trajectory | None = None
        self._foreseen: Foresight | None = None

    def stop(self) -> None:
        """Follow nothing: null setpoints."""
        self.state = PlannerState.IDLE

    def disable(self) -> None:
        """Give no setpoints at all, not even null ones."""
        self.state = PlannerState.DISABLED

    def is_finished(self, t: np.float32) -> bool:
        """Whether the latest trajectory has ended, whatever the state; True before the first."""
        return self._trajectory is None or self._trajectory.is_finished(t)

    def goal(self, t: np.float32) -> Evaluation | None:
        """The goal at ``t``, None without one. A landing that has ended becomes idle; that call still has a goal."""
        trajectory = self._followed(t)
        if trajectory is None:
            return None
        with np.errstate(all="ignore"):  # clients may have sent anything
            return _valid(Evaluation.of(trajectory.evaluate_all(np.array([t], np.float32))))

    def follow(self, now: float) -> tuple[Foresight | None, Evaluation | None]:
        """:meth:`goal` of the tick at ``now`` seconds, and what it is part of: goals from this or an earlier tick on.

        They hold until the next command or the next write to the trajectory's memory, and no longer than a landing.
        """
        foreseen = self._foresee(now)
        if foreseen is None:
            return None, None
        return foreseen, _valid(Evaluation.of(foreseen.goals, round((now - foreseen.begin) / PERIOD)))

    def _foresee(self, now: float) -> Foresight | None:
        t = np.float32(now)
        trajectory = self._followed(t)
        if trajectory is None:
            return None
        seen = self._foreseen
        if seen is not None and seen.version == trajectory.version:
            k = round((now - seen.begin) / PERIOD)
            if 0 <= k < len(seen.times) and seen.times[k] == t:
                return seen
        times = (now + _AHEAD).astype(np.float32)
        if self.state is PlannerState.LANDING:  # which ends in idleness: until then only
            times = times[: next((k for k, at in enumerate(times) if trajectory.is_finished(at)), len(times))]
        with np.errstate(all="ignore"):
            goals = trajectory.evaluate_all(times)
        finite = bool(np.isfinite(goals).all())
        self._foreseen = Foresight(now, times[: goals.shape[1]].tolist(), goals, trajectory.version, finite)
        return self._foreseen

    def _followed(self, t: np.float32) -> Trajectory | None:
        """What is followed at ``t``; a landing that has ended is left, for the last time here."""
        if self._trajectory is None or self.state not in (PlannerState.FLYING, PlannerState.LANDING):
            return None
        if self.state is PlannerState.LANDING and self._trajectory.is_finished(t):
            self.state = PlannerState.IDLE
        return self._trajectory

    def takeoff(
        self, t: np.float32, position: Vec3, yaw: float, height: float, goal_yaw: float, duration: float
    ) -> int:
        """Straight up to ``height``, from idle only."""
        if self.state is not PlannerState.IDLE:
            return REFUSED
        self._vertical(t, position, yaw, height, goal_yaw, duration)
        self.state = PlannerState.FLYING
        return OK

    def land(self, t: np.float32, position: Vec3, yaw: float, height: float, goal_yaw: float, duration: float) -> int:
        """Straight down to ``height``; refused only while landing."""
        if self.state is PlannerState.LANDING:
            return REFUSED
        self._vertical(t, position, yaw, height, goal_yaw, duration)
        self.state = PlannerState.LANDING
        return OK

    def go_to(
        self,
        t: np.float32,
        start: Evaluation,
        position: Vec3,
        yaw: float,
        duration: float,
        relative: bool = False,
        linear: bool = False,
    ) -> int:
        """From ``start`` to rest at ``position``; linear keeps the mean velocity throughout and stops by a jump."""
        if relative:
            position = _add(position, start.position)
            yaw += start.yaw
        heading = normalize_angle(start.yaw)
        turn = normalize_angle(normalize_angle(yaw) - heading)
        T = np.float32(duration)
        if linear:
            with np.errstate(all="ignore"):
                mean = (_state(position, heading + turn) - _state(start.position, heading))[0] / T
            velocity, rate = (float(mean[0]), float(mean[1]), float(mean[2])), float(mean[3])
            begin = _state(start.position, heading, velocity, rate)
            end = _state(position, heading + turn, velocity, rate)
        else:
            begin = _state(start.position, heading, start.velocity, start.omega[2], start.acceleration)
            end = _state(position, heading + turn)
        self._fly(PlannedPiece(t, T, begin, end))
        return OK

    def spiral(
        self,
        t: np.float32,
        start: Evaluation,
        angle: float,
        radius: float,
        end_radius: float,
        ascent: float,
        duration: float,
        sideways: bool = False,
        clockwise: bool = False,
    ) -> int:
        """A spiral segment, fitted at its ends by one piece; angles beyond a turn and negative radii saturate."""
        angle = min(max(angle, -2.0 * math.pi), 2.0 * math.pi)
        radius, end_radius = max(radius, 0.0), max(end_radius, 0.0)
        T = np.float32(duration)
        with np.errstate(all="ignore"):
            rate, climb, widening = (float(np.float32(v) / T) for v in (angle, ascent, end_radius - radius))
        sense = 1.0 if clockwise else -1.0
        heading = normalize_angle(start.yaw)
        # The drone sits on the circle at the side of its nose (sideways) or at its left or right hand.
        offset, side = (0.0, -sense) if sideways else (math.pi / 2.0, sense)
        first = _on_spiral(heading + offset, side, radius, widening, -sense * rate)
        last = _on_spiral(heading - sense * angle + offset, side, end_radius, widening, -sense * rate)
        centre = (start.position[0] - first[0][0], start.position[1] - first[0][1])
        end = (centre[0] + last[0][0], centre[1] + last[0][1], start.position[2] + ascent)
        turn_rate = -sense * rate
        begin_state = _state(start.position, heading, (*first[1], climb), turn_rate, (*first[2], 0.0))
        end_state = _state(end, heading - sense * angle, (*last[1], climb), turn_rate, (*last[2], 0.0))
        self._fly(PlannedPiece(t, T, begin_state, end_state))
        return OK

    def start(self, trajectory: PolynomialTrajectory | CompressedTrajectory) -> int:
        """Follow an uploaded trajectory, whatever the state."""
        self._fly(trajectory)
        return OK

    def _fly(self, trajectory: Trajectory) -> None:
        self._take(trajectory)
        self.state = PlannerState.FLYING

    def _take(self, trajectory: Trajectory) -> None:
        self._trajectory = trajectory
        self._foreseen = None

    def _vertical(
        self, t: np.float32, position: Vec3, yaw: float, height: float, goal_yaw: float, duration: float
    ) -> None:
        heading = normalize_angle(yaw)
        turn = normalize_angle(normalize_angle(goal_yaw) - heading)
        end = _state((position[0], position[1], height), heading + turn)
        self._take(PlannedPiece(t, np.float32(duration), _state(position, heading), end))


def _valid(goal: Evaluation) -> Evaluation | None:
    return goal if goal.is_valid() else None


def _add(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


_Plane = tuple[tuple[float, float], tuple[float, float], tuple[float, float]]


def _on_spiral(phi: float, side: float, r: float, dr: float, omega: float) -> _Plane:
    """Position, velocity and acceleration of side · r(t) · (cos φ(t), sin φ(t)) in the plane; dr and ω constant."""
    c, s = math.cos(phi), math.sin(phi)
    return (
        (side * r * c, side * r * s),
        (side * (dr * c - r * omega * s), side * (dr * s + r * omega * c)),
        (side * (-2.0 * dr * omega * s - r * omega**2 * c), side * (2.0 * dr * omega * c - r * omega**2 * s)),
    )
