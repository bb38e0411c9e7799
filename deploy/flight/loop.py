"""The flight loop: one tick of everything, and commands with answers.

Everything that takes flight time happens in :meth:`Flight.tick`, a hundred times a second: poses flow, telemetry is
written down, the operator is heard, and every fifth time the watch looks. Manoeuvres are straight-line code that ticks
while it waits.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Collection, Mapping
from functools import partial
from typing import TypeVar

from deploy.aside import Aside
from deploy.clock import Clock
from deploy.flight.courses import Courses
from deploy.flight.journal import Journal, Level
from deploy.flight.lookout import Lookout
from deploy.flight.picture import Picture
from deploy.flight.poses import Poses
from deploy.flight.reactions import Reaction
from deploy.flight.records import FlightStatus, Ready, RobotStatus
from deploy.flight.rescue import Rescue
from deploy.flight.timing import Timing
from deploy.flight.watch import POSE_OLD
from deploy.flightlog.writer import FlightLog
from deploy.operator import Operator
from deploy.phases import Phase, Phases
from deploy.radio import highlevel
from deploy.radio.fleet import Fleet
from deploy.radio.requests import Reply, Request
from deploy.replanner import Replanner
from missions.radio import pose_rates
from mocap.errors import MocapError
from mocap.setup import in_world
from mocap.source import MocapSource
from planner.flightplan import FlightPlan

T = TypeVar("T")
Vec3 = tuple[float, float, float]
TICK = 0.01  # s
WATCH_EVERY = 5  # ticks
RETRY = 0.1  # s until an unanswered command is repeated
_ABOVE = 0.1  # m above the ground: whoever is higher flies
BUSY_RETRY = 0.05  # s until a command refused with EBUSY is repeated; the supervisor runs at 25 Hz


class EmergencyStop(Exception):
    """The operator stopped the motors."""


class Flight:
    """A flight in progress.

    Args:
        plan: what flies. fleet: who flies. mocap: where they are seen; None if they position themselves.
        clock: of everything. log: where everything is written. operator: who may end it.
        observer: called ten times a second.

    Attributes:
        phases: where the flight is. journal: what happened. poses: where everybody is.
        courses: where everybody should be. lookout: what the watch is told.
        watching: whether findings of the watch end the mission now. notes: what is wrong, by robot.
        ground: height of the pads [m].
        ready: what drones said of themselves when they were connected.
        left_behind: who did not take off, and why.
        turned: when the loop turned last [s]. timing: delays. picture: what those who watch see.
        on_return: called with a robot whose lost link is back, in flight.
        replanner: who plans anew when the map changes; None: nobody.
        new_map: a map that somebody has told, as text, once; None: nothing new.
    """

    def __init__(
        self,
        plan: FlightPlan,
        fleet: Fleet,
        mocap: MocapSource | None,
        clock: Clock,
        log: FlightLog,
        operator: Operator,
        observer: Callable[[FlightStatus], None] | None,
    ) -> None:
        mission = plan.mission
        self.plan, self.fleet, self.clock, self.operator = plan, fleet, clock, operator
        self.phases, self.journal = Phases(), Journal(log)
        self.courses = Courses(plan.trajectories)
        bodies = {robot.name: robot.rigid_body or robot.name for robot in mission.robots}
        source = None if mocap is None else in_world(mocap, mission, self.reference)
        self.poses = Poses(source, bodies, pose_rates(mission), fleet, log)
        self.lookout = Lookout(mission, fleet, self.poses, self.courses, self._tell)
        self.watching = False
        self.notes = dict.fromkeys(fleet, "")
        self.ground = 0.0
        self.ready: dict[str, Ready] = {}
        self.left_behind: dict[str, str] = {}
        self.turned, self.timing = clock.now(), Timing()
        self.picture = Picture(log, plan, self.courses.references, clock.now())
        self.on_return: Callable[[str], None] = lambda robot: None
        self.replanner: Replanner | None = None
        self.new_map: Callable[[], str | None] = lambda: None
        self._rescue = Rescue(fleet, clock, mission.flight.log_rate)
        self._observer = observer
        self._turns = itertools.count()
        self._reference_due = math.inf

    # ------------------------------------------------------------------------------------------------ telling

    def enter(self, phase: Phase) -> None:
        """Go to a phase and say so. Raises IllegalTransition."""
        self.phases.enter(phase)
        self.event("phase", phase.value)

    def event(
        self,
        name: str,
        text: str,
        *,
        robot: str = "",
        level: Level = "info",
        value: float | None = None,
        kind: str = "",
    ) -> None:
        """Write down something that happens now."""
        now, phase = self.clock.now(), self.phases.now
        self.journal.event(now, phase, name, text, robot=robot, level=level, value=value, kind=kind)

    def fault(self, name: str, robot: str, text: str) -> None:
        """Write down a fault; it is the drone's note from now on."""
        self.event(name, text, robot=robot, level="fault")
        if robot in self.notes:
            self.notes[robot] = text

    def go_on_without(self, plan: FlightPlan, leaving: Collection[str]) -> None:
        """Fly another plan, of the others. On the ground only; the links of those who leave are closed before."""
        self.plan = plan
        for name in leaving:
            self.fleet.leave_behind(name)
            self.poses.send_no_more(name)
            self.courses.forget(name)
            for record in (self.lookout.largest_error, self.notes):
                record.pop(name)
        self.picture = Picture(self.journal.log, plan, self.courses.references, self.clock.now())

    def take_over(self, plan: FlightPlan) -> None:
        """Fly another plan from its next leg on, in the air; what has been flown is part of it."""
        self.plan = plan
        self.courses.take_over(plan.trajectories)
        self.picture = self.picture.after(plan, self.courses.references, self.clock.now())

    # ------------------------------------------------------------------------------------------------ time

    def tick(self) -> None:
        """One turn of the loop.

        Raises:
            EmergencyStop: the operator stops the motors. Reaction: the mission has to end, with the reason.
        """
        self.clock.sleep_until(self.clock.now() + TICK)
        self.turned = now = self.clock.now()
        turn = next(self._turns)
        reaction = self._sense(now, look=turn % WATCH_EVERY == 0)
        if turn % 10 == 0:
            self._show(now, count=turn % 20 == 0)
        if turn % 50 == 0:
            self._record_health(now)
        if self.operator.stop_requested() and not self.phases.over:
            raise EmergencyStop
        reaction = self._asked() or reaction
        if reaction and (self.watching or not (self.phases.airborne or self.phases.over)):
            raise reaction

    def wait(self, seconds: float) -> None:
        """Let flight time pass."""
        self.wait_until(lambda: False, seconds)

    def wait_until(self, condition: Callable[[], bool], deadline: float) -> bool:
        """Tick until a condition holds, for at most ``deadline`` seconds of flight time; whether it held.

        The condition is looked at right after a tick only: before, it may depend on how far the radio's threads are,
        and a rehearsal would not repeat.
        """
        end = self.clock.now() + deadline
        while self.clock.now() < end - 1e-9:
            self.tick()
            if condition():
                return True
        return False

    def aside(self, work: Callable[[], T]) -> T:
        """Compute something that takes a while in a thread of its own: poses and commands do not wait for it.

        Raises:
            Whatever the work or a tick raises; after an error of a tick nobody waits for the work.
        """
        aside = Aside(work, self.clock, "aside")
        aside.start()
        while True:
            self.tick()
            if aside.done:
                return aside.outcome()

    # ------------------------------------------------------------------------------------------------ who is where

    @property
    def alive(self) -> tuple[str, ...]:
        """Drones whose link is up."""
        return tuple(name for name, drone in self.fleet.items() if drone.connected)

    def position(self, robot: str) -> Vec3 | None:
        """Where a robot is [m], if it was ever seen; by its own word while motion capture does not see it."""
        located, estimate = self.poses.located(robot), self.fleet[robot].estimate
        if located is None:
            return None
        unseen = self.clock.now() - located.t > POSE_OLD
        return estimate.position if unseen and estimate and estimate.t > located.t + POSE_OLD else located.pose.position

    def strays(self) -> dict[str, Callable[[float], Vec3]]:
        """Who flies and cannot be told anything: where each will be so many seconds from now [m], as far as known.

        Whoever is lost in the search flies it to its end and hovers there.
        """
        return {
            name: partial(self._astray, name, self.clock.now())
            for name, drone in self.fleet.items()
            if not drone.connected and (position := self.position(name)) and position[2] > self.ground + _ABOVE
        }

    def _astray(self, name: str, now: float, later: float) -> Vec3:
        located = self.poses.located(name)
        then = self.courses.at(name, now if located is None else located.t)
        there = self.courses.at(name, now + later)
        if located is None or then is None or there is None:
            return self.position(name) or self.courses.start(name)
        x, y, z = (p + b - a for p, a, b in zip(located.pose.position, then, there, strict=True))
        return x, y, z

    def reference(self, robot: str, now: float) -> Vec3 | None:
        """Where the certified trajectory is at a flight time [m]; None outside the search and the hover after it."""
        return self.courses.reference(robot, now) if self.searching else None

    @property
    def searching(self) -> bool:
        """Whether trajectories are followed, or their ends kept."""
        return self.courses.search.begun and self.phases.now in (Phase.ON_MISSION, Phase.HOLDING)

    def note_ground(self) -> None:
        """Remember the height of the pads: where the drones stand now."""
        heights = [position[2] for name in self.fleet if (position := self.position(name)) is not None]
        self.ground = min(heights, default=0.0)

    def status(self) -> FlightStatus:
        """The whole flight now."""
        now = self.clock.now()
        robots = []
        for name, drone in self.fleet.items():
            position, target = self.position(name), self.reference(name, now)
            error = math.dist(position, target) if position and target else math.nan
            said, link = drone.status, drone.link
            robots.append(
                RobotStatus(
                    name=name,
                    position=position,
                    error=error,
                    voltage=said.voltage if said else math.nan,
                    latency=link.latency,
                    note=self.notes[name] or link.lost,
                    target=target,
                    state=said.supervisor.word if said else "",
                    level=said.level if said else math.nan,
                    quality=link.quality,
                )
            )
        return FlightStatus(
            t=now,
            phase=self.phases.now,
            mission_time=now - self.courses.search.start,
            duration=self.courses.duration,
            robots=tuple(robots),
            message=self.journal.message,
            ergodicity=self.picture.ergodicity,
            certified=self.plan.certificate.indicators.ergodicity,
        )

    # ------------------------------------------------------------------------------------------------ commands

    def command(self, requests: Mapping[str, Request], *, patience: float = 1.0) -> dict[str, int | None]:
        """Give one command to each of several drones, back to back, and see who accepts.

        Unanswered commands and those refused because the supervisor is busy are repeated: only for commands that may
        arrive twice.

        Args:
            requests: command by drone.
            patience: how long to repeat [s].

        Returns:
            Return code by drone; None from those that never answered.
        """
        replies = {name: self.fleet[name].send(request) for name, request in requests.items()}
        codes: dict[str, int | None] = dict.fromkeys(requests)
        end = self.clock.now() + patience
        while (waiting := [name for name, code in codes.items() if code in (None, highlevel.BUSY)]) and (
            self.clock.now() < end - 1e-9
        ):
            self.tick()
            for name in waiting:
                replies[name], codes[name] = self._follow_up(name, replies[name])
        return codes

    def refusals(self, codes: Mapping[str, int | None]) -> str:
        """Who did not accept, as one line; empty if everybody did."""
        return "; ".join(
            f"{name}: {'no answer' if code is None else highlevel.meaning(code)}"
            for name, code in codes.items()
            if code != 0
        )

    # ------------------------------------------------------------------------------------------------ inside

    def _follow_up(self, name: str, reply: Reply) -> tuple[Reply, int | None]:
        since = self.clock.now() - reply.sent
        if not reply.here:
            if since >= RETRY - 1e-9:
                self.event("repeat", f"{reply.request.what}: no answer, repeated", robot=name, level="warning")
                self.fleet[name].resend(reply)
            return reply, None
        self.timing.answered(name, reply)
        code = highlevel.return_code(reply.payload)
        if code == highlevel.REFUSED and reply.repeated:
            # The first copy was heard and only its answer lost: the drone is already doing it.
            return reply, 0
        if code == highlevel.BUSY and since >= BUSY_RETRY - 1e-9:
            return self.fleet[name].send(reply.request), code
        return reply, code

    def _asked(self) -> Reaction | None:
        """What the operator wants; to land whatever else is under way, to hold or go back once."""
        if self.operator.land_requested():
            return Reaction("the operator asked to land", since=self.turned)
        if self.phases.now is Phase.ABORTING:
            return None
        if self.operator.return_requested():
            return Reaction("the operator called everybody back", "return", since=self.turned)
        if self.operator.hold_requested():
            return Reaction("the operator asked to hold", "hold", since=self.turned)
        return None

    def _sense(self, now: float, look: bool) -> Reaction | None:
        """Poses, telemetry, watch; returns how the flight has to end, if it has to."""
        try:
            reaction = self.lookout.odd(now, self.poses.pump(now))
        except MocapError as error:
            reaction = Reaction(f"motion capture: {error}")
        for name, drone in self.fleet.items():
            for record in drone.poll():
                self.journal.telemetry(name, record)
        self._record_references(now)
        if self.phases.airborne:
            for name, silent in self._rescue.turn(now).items():
                self.event("link", f"back after {silent:.1f} s", robot=name, level="warning", value=silent)
                self.on_return(name)
            return (self.lookout.look(now, self.searching) if look else None) or reaction
        return self._lost_on_the_ground() or reaction

    def _lost_on_the_ground(self) -> Reaction | None:
        if self.phases.now is not Phase.ARMED:
            return None  # whoever gets everybody ready looks, and may try again or go on without
        lost = {name: drone.lost for name, drone in self.fleet.items() if drone.lost}
        return Reaction("; ".join(f"{name}: link lost: {why}" for name, why in lost.items())) if lost else None

    def _tell(self, name: str, text: str, robot: str, level: Level, value: float, kind: str = "") -> None:
        self.event(name, text, robot=robot, level=level, value=value, kind=kind)
        if level != "info" and robot in self.notes:
            self.notes[robot] = text

    def _record_references(self, now: float) -> None:
        if self.phases.now is not Phase.ON_MISSION or not self.courses.search.begun:
            self._reference_due = -math.inf
            return
        if now < self._reference_due - 1e-9:
            return
        self._reference_due = now + 1.0 / self.plan.mission.flight.log_rate
        for name in self.fleet:
            point, velocity = self.courses.reference(name, now), self.courses.velocity(name, now)
            self.journal.log.reference(name, now, point, velocity)

    def _show(self, now: float, count: bool) -> None:
        located = {name: seen for name in self.fleet if (seen := self.poses.located(name)) is not None}
        self.picture.show(now, located)
        if count and self.courses.search.begun and self.phases.now is Phase.ON_MISSION:
            self.picture.cover(now, located)
        if self._observer is not None:
            self._observer(self.status())

    def _record_health(self, now: float) -> None:
        self.journal.log_state(now, self.phases.now)
        self.poses.record_health(now)
        for drone in self.fleet.values():
            drone.ping()
            if self.phases.now is not Phase.IDLE:
                self.journal.link(now, drone)
