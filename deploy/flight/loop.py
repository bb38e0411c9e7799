"""The flight loop: one tick of everything.

Everything that takes flight time happens in :meth:`Flight.tick`, a hundred times a second: poses flow, telemetry is
written down, the operator is heard, and every fifth time the watch looks. Manoeuvres are straight-line code that ticks
while it waits.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection
from functools import reduce
from typing import TypeVar, Unpack

from deploy.aside import Aside
from deploy.clock import Clock
from deploy.flight.courses import Courses
from deploy.flight.deadlines import Deadline, planned
from deploy.flight.journal import Journal
from deploy.flight.lights import Lights
from deploy.flight.lookout import Lookout
from deploy.flight.picture import Picture
from deploy.flight.poses import Poses
from deploy.flight.reactions import Reaction, asked, joined
from deploy.flight.records import Ready
from deploy.flight.rescue import Rescue
from deploy.flight.timing import Timing
from deploy.flight.whereabouts import Whereabouts
from deploy.flightlog.events import Details, Level
from deploy.flightlog.writer import FlightLog
from deploy.operator import Operator
from deploy.phases import Phase, Phases
from deploy.radio.fleet import Fleet
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
        where: where everybody is, also who is not seen.
        doing: how the flight ends early, when it does; it only ever becomes a stronger reaction.
        on_worse: called with what made it stronger, at once.
        ready: what drones said of themselves when they were connected.
        left_behind: who did not take off, and why.
        turned: when the loop turned last [s]. timing: delays. picture: what those who watch see.
        lights: what LED rings show.
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
        observer: Callable[[Flight], None] | None,
    ) -> None:
        mission = plan.mission
        self.plan, self.fleet, self.clock, self.operator = plan, fleet, clock, operator
        self.phases, self.journal = Phases(), Journal(log, mission.flight.log_rate)
        self.courses = Courses(plan.trajectories)
        bodies = {robot.name: robot.rigid_body or robot.name for robot in mission.robots}
        source = None if mocap is None else in_world(mocap, mission, self.reference)
        self.poses = Poses(source, bodies, pose_rates(mission), fleet, log)
        self.lookout = Lookout(mission, fleet, self.poses, self.courses, self._tell)
        self.watching = False
        self.notes = dict.fromkeys(fleet, "")
        self.where = Whereabouts(fleet, self.poses, self.courses, clock)
        self.doing: Reaction | None = None
        self.on_worse: Callable[[Reaction], None] = lambda reaction: None
        self.ready: dict[str, Ready] = {}
        self.left_behind: dict[str, str] = {}
        self.picture = Picture(log, plan, self.courses.references, clock.now())  # rays around an object take seconds
        self.turned, self.timing = clock.now(), Timing()
        self.lights = Lights(mission, fleet, log)
        self.on_return: Callable[[str], None] = lambda robot: None
        self.replanner: Replanner | None = None
        self.new_map: Callable[[], str | None] = lambda: None
        self._rescue = Rescue(fleet, clock, mission.flight.log_rate)
        self._observer = observer
        self._deadline = Deadline()
        self._turns = itertools.count()

    # ------------------------------------------------------------------------------------------------ telling

    def enter(self, phase: Phase) -> None:
        """Go to a phase and say so. Raises IllegalTransition."""
        self.phases.enter(phase)
        self.event("phase", phase.value)
        self.allow(planned(self.plan, phase, self.courses.duration))

    def allow(self, takes: float, *, like: Phase | None = None) -> None:
        """Another step of the phase begins, which takes so long [s]; with the allowance of that phase, or another's."""
        self._deadline.begin(self.clock.now(), self.phases.now, takes, like=like)

    @property
    def left(self) -> float:
        """How long what is under way may take yet [s]."""
        return self._deadline.left(self.clock.now())

    def event(self, name: str, text: str, **details: Unpack[Details]) -> None:
        """Write down something that happens now."""
        self.journal.event(self.clock.now(), self.phases.now, name, text, **details)

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
            EmergencyStop: the operator stops the motors. Reaction: the mission has to end, with the reason, or its end
                has to be another one; an Overdue one, if what is under way takes too long.
        """
        self.clock.sleep_until(self.clock.now() + TICK)
        self.turned = now = self.clock.now()
        turn = next(self._turns)
        reactions = self._sense(now, look=turn % WATCH_EVERY == 0)
        if turn % 10 == 0:
            self._show(now, count=turn % 20 == 0)
        if turn % 50 == 0:
            self._record_health(now)
        if self.phases.over:
            return
        if self.operator.stop_requested():
            raise EmergencyStop
        if said := asked(self.operator, now, aborting=self.phases.now is Phase.ABORTING):
            reactions.insert(0, said)
        if reactions:
            self._react(reduce(joined, reactions))
        self._deadline.check(now)
        self._shine(now)

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

    def reference(self, robot: str, now: float) -> Vec3 | None:
        """Where the certified trajectory is at a flight time [m]; None outside the search and the hover after it."""
        return self.courses.reference(robot, now) if self.searching else None

    @property
    def searching(self) -> bool:
        """Whether trajectories are followed, or their ends kept."""
        return self.courses.search.begun and self.phases.now in (Phase.ON_MISSION, Phase.HOLDING)

    @property
    def moving(self) -> bool:
        """Whether the plan's moves between pads and search are flown, or their ends kept; not while they climb."""
        return self.phases.now in (Phase.TRANSFERRING, Phase.SETTLING, Phase.RETURNING)

    # ------------------------------------------------------------------------------------------------ inside

    def _react(self, reaction: Reaction) -> None:
        """Raise what ends the mission, or changes how it ends; remember what cannot change it yet."""
        if self.doing is None:
            if self.watching or not self.phases.airborne:
                raise reaction
            return
        worse = joined(self.doing, reaction)
        if worse is self.doing:
            return
        self.doing = worse
        self.event("worse", f"{reaction} ({reaction.policy})", level="fault")
        self.on_worse(reaction)
        if self.watching:
            raise worse

    def _sense(self, now: float, look: bool) -> list[Reaction]:
        """Poses, telemetry, watch; returns why the flight has to end, and how, if it has to."""
        found: list[Reaction | None] = []
        try:
            found.append(self.lookout.odd(now, self.poses.pump(now)))
        except MocapError as error:
            found.append(Reaction(f"motion capture: {error}"))
        for name, drone in self.fleet.items():
            for record in drone.poll():
                self.journal.telemetry(name, record)
        if self.phases.now is Phase.ON_MISSION and self.courses.search.begun:
            self.journal.references(now, self.courses, self.fleet)
        if self.phases.airborne:
            for name, silent in self._rescue.turn(now).items():
                self.event("link", f"back after {silent:.1f} s", robot=name, level="warning", value=silent)
                self.on_return(name)
            if look:
                aborting = self.doing is not None
                found.append(self.lookout.look(now, self.searching, moving=self.moving, aborting=aborting))
        else:
            found.append(self._lost_on_the_ground())
        return [reaction for reaction in found if reaction is not None]

    def _lost_on_the_ground(self) -> Reaction | None:
        if self.phases.now is not Phase.ARMED:
            return None  # whoever gets everybody ready looks, and may try again or go on without
        lost = {name: drone.lost for name, drone in self.fleet.items() if drone.lost}
        return Reaction("; ".join(f"{name}: link lost: {why}" for name, why in lost.items())) if lost else None

    def _tell(self, name: str, text: str, robot: str, level: Level, value: float, kind: str = "") -> None:
        self.event(name, text, robot=robot, level=level, value=value, kind=kind)
        if level != "info" and robot in self.notes:
            self.notes[robot] = text

    def _show(self, now: float, count: bool) -> None:
        located = {name: seen for name in self.fleet if (seen := self.poses.located(name)) is not None}
        self.picture.show(now, located)
        if count and self.courses.search.begun and self.phases.now is Phase.ON_MISSION:
            self.picture.cover(now, located)
        if self._observer is not None:
            self._observer(self)

    def _shine(self, now: float) -> None:
        """Let LED rings show what is seen of the floor, unless there is anything else to say."""
        over = self.phases.now in (Phase.RETURNING, Phase.LANDING)
        if self.doing is None and (self.searching or over):
            self.lights.turn(now, self._position, self.searching)

    def _position(self, robot: str) -> Vec3 | None:
        seen = self.poses.located(robot)
        return None if seen is None else seen.pose.position

    def _record_health(self, now: float) -> None:
        self.journal.log_state(now, self.phases.now)
        self.poses.record_health(now)
        for drone in self.fleet.values():
            drone.ping()
            if self.phases.now is not Phase.IDLE:
                self.journal.link(now, drone)
