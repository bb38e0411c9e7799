"""What the watch is told, and what its findings lead to: twenty looks a second at all who fly."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from functools import partial

from deploy.flight.courses import Courses
from deploy.flight.poses import Poses
from deploy.flight.reactions import Reaction, policy_for, strongest
from deploy.flight.seen import Finding, Limits, Seen, Vec3
from deploy.flight.separations import AHEAD, ahead
from deploy.flight.watch import Watch, tilt
from deploy.flightlog.events import Level
from deploy.radio.fleet import Fleet
from missions.schema import Mission
from mocap.gate import Incident

Tell = Callable[[str, str, str, Level, float, str], None]  # event: name, text, robot, level, value, kind


class Lookout:
    """Looks after everybody in the air.

    Args:
        mission: what is allowed, and what follows when it is not kept.
        fleet: who flies. poses: where they are. courses: where they should be.
        tell: writes an event.

    Attributes:
        down: who is known to have landed, and is left alone. largest_error: in the search [m], by robot.
    """

    def __init__(self, mission: Mission, fleet: Fleet, poses: Poses, courses: Courses, tell: Tell) -> None:
        self._safety, self._watch = mission.safety, Watch(Limits.of(mission))
        self._fleet, self._poses, self._courses, self._tell = fleet, poses, courses, tell
        self.down: set[str] = set()
        self.largest_error = dict.fromkeys(fleet, 0.0)

    def look(self, now: float, searching: bool, *, moving: bool = False, aborting: bool = False) -> Reaction | None:
        """Look at everybody; what the flight has to do about it, if anything.

        Args:
            now: flight time [s].
            searching: whether trajectories are followed, or their ends kept.
            moving: whether the plan's moves to the search or back are, or their ends.
            aborting: whether the flight ends early already.
        """
        due: list[Finding] = []
        for finding in self._watch.look(now, self._seen(now, searching, moving)):
            level: Level = "fault" if finding.level == "abort" else "warning"
            self._tell(finding.kind, finding.text, finding.robot, level, finding.value, "")
            lost = finding.name == "link"
            # Who positions himself and has but one leg to fly is safest flown beside: see watch.py.
            carries_on = (
                lost and not self._poses.external and searching and self._courses.timelines[finding.robot].legs == 1
            )
            if finding.level == "abort" and not carries_on:
                due.append(finding)
        if not due:
            return None
        policies = [policy_for(self._safety, finding.kind, aborting=aborting) for finding in due]
        strong = strongest(policies)
        about = [name for f, policy in zip(due, policies, strict=True) if policy == strong for name in f.robots]
        text = "; ".join(f"{finding.robot}: {finding.text}" for finding in due)
        return Reaction(text, strong, about, since=min(map(self._watch.since, due)))

    def odd(self, now: float, incidents: Collection[Incident]) -> Reaction | None:
        """Write down what is odd about motion capture; what changed names lead to is the mission's to say."""
        policy, swaps = self._safety.identity, [item for item in incidents if item.kind == "swap"]
        for incident in incidents:
            level: Level = "info" if incident.kind == "again" else "warning"
            who = "" if incident.kind == "jump" else "–".join(incident.robots)
            self._tell("mocap", incident.text, who, level, incident.value, incident.kind)
        if not swaps or policy == "go_on":
            return None
        about = [robot for swap in swaps for robot in swap.robots]
        return Reaction("; ".join(swap.text for swap in swaps), policy, about, since=now)

    # ------------------------------------------------------------------------------------------------ inside

    def _seen(self, now: float, searching: bool, moving: bool) -> list[Seen]:
        return [self._one(name, now, searching, moving) for name in self._fleet if name not in self.down]

    def _one(self, name: str, now: float, searching: bool, moving: bool) -> Seen:
        drone, located = self._fleet[name], self._poses.located(name)
        status, estimate = drone.status, drone.estimate
        position = None if located is None else located.pose.position
        # Where it should have been when it was seen: an old pose is late, not off its trajectory.
        then = now if located is None else located.t
        reference = self._courses.reference(name, then) if searching else None
        if position is not None and reference is not None:
            self.largest_error[name] = max(self.largest_error[name], math.dist(position, reference))
        velocity = estimate.velocity if estimate else (0.0, 0.0, 0.0)
        return Seen(
            name,
            position,
            math.inf if located is None else now - located.t,
            self._courses.at(name, then) if moving else reference,
            status.supervisor if status else None,
            status.battery_low if status else False,
            now - drone.heard,
            drone.lost,
            velocity,
            tuple if position is None else partial(self._ahead, name, now, position, velocity, reference),
            tilt(*estimate.rpy[:2]) if estimate else math.nan,
            status.voltage if status else math.nan,
            now - estimate.t if estimate else 0.0,
        )

    def _ahead(self, name: str, now: float, position: Vec3, velocity: Vec3, reference: Vec3 | None) -> tuple[Vec3, ...]:
        if reference is None:  # moves brake before they end: only the near future is as straight as the present
            x, y, z = (p + v * AHEAD[0] for p, v in zip(position, velocity, strict=True))
            return ((x, y, z),)
        later = [self._courses.reference(name, now + t) for t in AHEAD]
        return ahead(position, velocity, reference, self._courses.velocity(name, now), later)
