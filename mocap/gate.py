"""Which reported poses can be true, and whose they are: the last look before a drone is told where it is.

A drone that is told a wrong place flies away at once; one that is told nothing flies on by its gyroscopes for a second
or two, and its flight lands. So nothing is passed on that cannot be:

================  =========================================  ==================================================
what              how it is told                             what follows
================  =========================================  ==================================================
outlier,          farther from the last believed place than  nothing is said of the robot, however long it lasts;
teleport          motion allows                              who comes back has to be where it says itself to be
swapped bodies    each is where another of them was          each robot gets the pose that is its own by motion
                  expected, and nobody is left over
jump of the       nobody is where anybody was expected       as teleports, told in one word
system's frame
frozen body       the same numbers again                     no news
flipped attitude  turned faster than a drone can             position only
================  =========================================  ==================================================

Two witnesses are heard. *Motion*, as long as a robot is believed at least every ``GAP``: constant velocity, and what
full thrust adds to it. After a longer gap that says too little, and the robot's *own word* decides: its estimate, which
inertia has carried on. Where a pose is nearly as likely to be another robot's, nothing is said of either.

Before :meth:`Gate.close` names are as the system gives them: on the ground the pads tell who is who (pre-flight).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

import numpy as np

from missions.arrays import Array
from mocap.source import MocapFrame, Pose
from mocap.track import Track, Word, carried_on, reach
from mocap.tracking.assignment import assign

GAP = 0.1  # s; up to here motion tells, beyond it the robot's own word
_WORD = 0.5  # s; an older word says nothing
_AGREEMENT, _DRIFT = 0.2, 0.4  # m, m/s: between a word that inertia has carried on and the truth
_FORGOTTEN = 2.0  # s; who has not been believed for so long may be anywhere
_TRUST = 0.25  # squared distance that a reported name is worth: the other pose has to be twice as near
_MATCHED = 1.0e6  # m²; worth of a match, more than any distance


@dataclass(frozen=True)
class Incident:
    """Something that the gate noticed; once, when it begins or ends.

    Attributes:
        kind: which row of the table, or that a robot is believed again. robots: whom it is about.
        text: for people. value: how far off [m], [rad], or how long [s].
    """

    kind: Literal["teleport", "jump", "swap", "frozen", "attitude", "again"]
    robots: tuple[str, ...]
    text: str
    value: float


@dataclass(frozen=True)
class Admitted:
    """What is left of a frame: believed poses by robot, and what was noticed."""

    poses: Mapping[str, Pose]
    incidents: tuple[Incident, ...] = ()


class _Body:
    """The numbers a body was last reported with."""

    def __init__(self) -> None:
        self.pose: Pose | None = None
        self.since = -math.inf
        self.told = False


class Gate:
    """Admits the poses of a mission's robots.

    Args:
        bodies: rigid body by robot.
        word: what a robot says of itself; None if it says nothing.
    """

    def __init__(self, bodies: Mapping[str, str], word: Callable[[str], Word | None]) -> None:
        self._named, self._word = dict(bodies), word
        self._bodies = {body: _Body() for body in bodies.values()}
        self._tracks: dict[str, Track] = {}
        self._t = -math.inf
        self._closed = False

    @property
    def refused(self) -> tuple[str, ...]:
        """Robots whose newest poses were not believed."""
        return tuple(robot for robot, track in self._tracks.items() if track.refused)

    def close(self) -> None:
        """From now on motion and the robots' own words decide; everybody was seen where he should be."""
        self._closed = True

    def admit(self, frame: MocapFrame) -> Admitted:
        """Take a frame; one that is not newer than the one before says nothing."""
        if frame.t <= self._t:
            return Admitted({})
        self._t = frame.t
        seen = {robot: frame.bodies[body] for robot, body in self._named.items() if _is_seen(frame, body)}
        if not self._closed:
            for robot, pose in seen.items():
                self._tracks[robot] = Track(frame.t, pose.position, attitude=pose.quaternion, turned=frame.t)
            return Admitted(seen)
        incidents: list[Incident] = []
        fresh = {robot: pose for robot, pose in seen.items() if self._changes(robot, pose, incidents)}
        ghosts = {robot for robot, pose in fresh.items() if self._haunts(robot, pose)}
        believed = {robot: p for robot, p in fresh.items() if robot not in ghosts and self._continues(robot, p)}
        if sought := [robot for robot in fresh if robot not in believed]:
            believed |= self._recognise(sought, fresh, ghosts, incidents)
        self._refuse(fresh, believed, incidents)
        poses = {robot: self._take(robot, pose, incidents) for robot, pose in believed.items()}
        return Admitted(MappingProxyType(poses), tuple(incidents))

    # ------------------------------------------------------------------------------------------------ whose

    def _changes(self, robot: str, pose: Pose, incidents: list[Incident]) -> bool:
        """Whether a pose is new: measurements have noise, so the same numbers again are the same measurement."""
        body = self._bodies[self._named[robot]]
        if pose != body.pose:
            body.pose, body.since, body.told = pose, self._t, False
            return True
        if (age := self._t - body.since) > GAP and not body.told:
            body.told = True
            incidents.append(Incident("frozen", (robot,), "motion capture repeats one pose: it is frozen", age))
        return False

    def _continues(self, robot: str, pose: Pose) -> bool:
        """Whether motion alone says that a pose is the robot's."""
        track = self._tracks.get(robot)
        if track is None or self._t - track.t > GAP:
            return False
        return math.dist(pose.position, track.predicted(self._t)) <= reach(self._t - track.t)

    def _haunts(self, robot: str, pose: Pose) -> bool:
        """Whether a pose goes on from one that jumped there: it was wrong, and does not become right by lasting."""
        track = self._tracks.get(robot)
        if track is None or track.ghost is None or self._t - track.ghost[0] > GAP:
            return False
        return math.dist(pose.position, track.ghost[1]) <= reach(self._t - track.ghost[0])

    def _recognise(
        self, sought: Sequence[str], fresh: Mapping[str, Pose], ghosts: Collection[str], incidents: list[Incident]
    ) -> dict[str, Pose]:
        """Poses of those whom motion alone does not tell; changes names where bodies were taken for each other.

        A ghost is not the robot whose name it has, but may be another one.
        """
        # Who is not seen at all competes as well: what returns under another's name may be his.
        absent = [r for r, track in self._tracks.items() if r not in fresh and self._t - track.t <= _FORGOTTEN]
        rows = [*sought, *absent]
        z = np.array([fresh[robot].position for robot in sought])  # (M, 3)
        squared = np.stack([self._squared(robot, z) for robot in rows])  # (N, M); infinite: cannot be
        for k, robot in enumerate(sought):
            if robot in ghosts:
                squared[k, k] = math.inf
        by_motion = {m.row: m.column for m in assign(squared - _MATCHED)}
        np.fill_diagonal(squared, _TRUST * squared.diagonal())
        by_name = {m.row: m.column for m in assign(squared - _MATCHED)}
        certain = {row: column for row, column in by_name.items() if by_motion.get(row) == column}
        poses, named = {}, dict(self._named)
        for cycle in _cycles(certain):
            for row in cycle:
                poses[rows[row]] = fresh[sought[certain[row]]]
                named[rows[row]] = self._named[sought[certain[row]]]
            if len(cycle) > 1:
                incidents.append(_swap([rows[row] for row in cycle], named))
        self._named = named
        return poses

    def _squared(self, robot: str, z: Array) -> Array:
        """Squared distances of places (M, 3) [m] from where a robot should be [m²]; infinite beyond what can be."""
        track, word = self._tracks.get(robot), self._fresh_word(robot)
        gap = self._t - track.t if track else math.inf
        if word is not None and gap > GAP:
            expected = carried_on(word.position, word.velocity, self._t - word.t)
            far = _AGREEMENT + _DRIFT * min(gap, _FORGOTTEN)
        elif track is not None and track.t > -math.inf:
            expected, far = track.predicted(self._t), reach(gap)
        else:
            return np.full(len(z), math.inf)
        squared: Array = ((z - np.array(expected)) ** 2).sum(axis=1)
        return np.where(squared <= far * far, squared, math.inf)

    def _fresh_word(self, robot: str) -> Word | None:
        word = self._word(robot)
        return word if word is not None and self._t - word.t <= _WORD else None

    # ------------------------------------------------------------------------------------------------ what follows

    def _refuse(self, fresh: Mapping[str, Pose], believed: Mapping[str, Pose], incidents: list[Incident]) -> None:
        refused = [robot for robot in fresh if robot not in believed]
        new = {}
        for robot in refused:
            track = self._tracks.setdefault(robot, Track(-math.inf, fresh[robot].position))
            if self._t - track.t <= GAP or self._haunts(robot, fresh[robot]):
                track.ghost = self._t, fresh[robot].position
            if not track.refused:
                new[robot] = math.dist(track.predicted(self._t), fresh[robot].position) if track.t > -math.inf else 0.0
            track.refused += 1
        if len(new) > 1 and len(new) == len(fresh):
            off = min(new.values())
            text = f"everybody seen {off:.2f} m or more from where they can be: has the capture system's frame changed?"
            incidents.append(Incident("jump", tuple(new), text, off))
            return
        for robot, off in new.items():
            text = f"seen {off:.2f} m from where it can be: not told to it"
            incidents.append(Incident("teleport", (robot,), text, off))

    def _take(self, robot: str, pose: Pose, incidents: list[Incident]) -> Pose:
        """Note a believed pose; returns it, without an attitude that cannot be."""
        track = self._tracks.setdefault(robot, Track(-math.inf, pose.position))
        if track.refused and track.t > -math.inf:
            text = f"believed again after {self._t - track.t:.2f} s, {track.refused} poses not told"
            incidents.append(Incident("again", (robot,), text, self._t - track.t))
        if self._t - track.t <= GAP:
            track.move(pose.position, self._t)
        else:
            word = self._fresh_word(robot)
            track.restart(pose.position, word.velocity if word else (0.0, 0.0, 0.0), self._t)
        return self._upright(robot, track, pose, incidents)

    def _upright(self, robot: str, track: Track, pose: Pose, incidents: list[Incident]) -> Pose:
        if pose.quaternion is None:
            return pose
        off = track.turn_off(pose.quaternion, self._t, lambda: self._fresh_word(robot))
        if not off:
            track.attitude, track.turned, track.askew = pose.quaternion, self._t, False
            return pose
        if not track.askew:
            track.askew = True
            text = f"attitude off by {math.degrees(off):.0f}° at once: only its position is told to it"
            incidents.append(Incident("attitude", (robot,), text, off))
        return Pose(pose.position)


def _is_seen(frame: MocapFrame, body: str) -> bool:
    pose = frame.bodies.get(body)
    # A sum of finite numbers is finite; one that overflows is of no pose.
    return pose is not None and math.isfinite(sum(pose.position) + sum(pose.quaternion or ()))


def _swap(robots: Sequence[str], named: Mapping[str, str]) -> Incident:
    seen = ", ".join(f"{robot} is seen as '{named[robot]}'" for robot in robots)
    return Incident("swap", tuple(robots), f"motion capture has changed names: {seen}; each is told its own pose", 0.0)


def _cycles(successor: Mapping[int, int]) -> list[list[int]]:
    """Closed cycles of a one-to-one map, those of one among them; what leads nowhere is left out."""
    cycles, visited = [], set()
    for first in successor:
        cycle: list[int] = []
        at: int | None = first
        while at is not None and at not in visited:
            visited.add(at)
            cycle.append(at)
            at = successor.get(at)
        if cycle and at == first:
            cycles.append(cycle)
    return cycles
