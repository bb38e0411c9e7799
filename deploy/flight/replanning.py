"""The map changes while everybody flies: the rest is planned anew, uploaded, and taken over by all at a joint.

::

    change known ──► planned, for `replanning.budget` ──► offered: uploaded, read back ──► joint: all take over
                     │ no plan, not certified, late       │ somebody has not got it 0.5 s before the joint
                     └────────────────────────────────────┴──► the old plan goes on, uploaded as ever

Planning is charged its budget: what is ready sooner is offered when it is over, what is not ready then never is.
So a rehearsal, whose clock stands while there is planning, flies the same flight every time, and hardware the same one.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from deploy.aside import Aside
from deploy.flight.legs import Chains
from deploy.flight.loop import Flight
from deploy.flightlog.attachments import FLEET, attachments
from deploy.replanner import Replanner
from missions.errors import MissionError
from missions.replanning import with_information, with_information_text
from missions.schema import Mission
from planner.certificate.certify import verify
from planner.certificate.errors import CertificateError
from planner.certificate.switching import READY_BEFORE
from planner.errors import PlannerError
from planner.flightplan import FlightPlan
from planner.indicators import ergodic_metric
from planner.trajectory.errors import TrajectoryError

Files = Mapping[str, bytes]


@dataclass(frozen=True)
class _Work:
    """A plan that is being made: for which joint, of which mission, until when, E of the old one on the new map."""

    joint: int
    mission: Mission
    until: float
    before: float
    aside: Aside[tuple[FlightPlan, Files]]


@dataclass(frozen=True)
class _Offered:
    """A plan that is being uploaded, for which joint, E before, its files for the log."""

    plan: FlightPlan
    joint: int
    before: float
    files: Files


class Replanning:
    """Follows the map of one flight.

    Args:
        flight: in its search. chains: everybody's legs.
    """

    def __init__(self, flight: Flight, chains: Chains) -> None:
        self._flight, self._chains = flight, chains
        self._changes = list(flight.plan.mission.replanning.changes)
        self._work: _Work | None = None
        self._offered: _Offered | None = None
        self._told = False  # that everybody has what is offered

    def turn(self) -> None:
        """Do what is due; call it after every tick."""
        now = self._flight.clock.now()
        if self._offered is not None:
            self._decide(self._offered, now)
        elif self._work is not None:
            self._collect(self._work, now)
        else:
            self._listen(now)

    # ------------------------------------------------------------------------------------------------ a change

    def _listen(self, now: float) -> None:
        """See whether the map has changed; of several changes at once the last one counts."""
        flight, mission = self._flight, self._flight.plan.mission
        told, changed = flight.new_map(), None
        try:
            while self._changes and flight.courses.search.start + self._changes[0].time <= now + 1e-9:
                changed = with_information(mission, self._changes.pop(0).information)
            if told is not None:
                changed = with_information_text(mission, told)
        except (MissionError, ValueError) as error:
            flight.event("map_change", f"a map that cannot be flown: {error}", level="warning")
            return
        if changed is not None:
            self._begin(changed, now)

    def _begin(self, mission: Mission, now: float) -> None:
        flight, budget = self._flight, mission.replanning.budget
        joint = self._next_joint(now + budget)
        before = _ergodicity(flight, mission)
        flight.event("map_change", f"the map has changed: E of the plan is {before:.3g} on it", value=before)
        if flight.replanner is None or joint is None:
            why = "nobody plans anew" if flight.replanner is None else "it is too late for any joint"
            self._keep(why)
            return
        current, replanner = flight.plan, flight.replanner
        aside = Aside(lambda: _planned(replanner, current, mission, joint), flight.clock, "replanning")
        aside.start()
        self._work = _Work(joint, mission, now + budget, before, aside)

    def _next_joint(self, earliest: float) -> int | None:
        """The first joint that a plan of this time [s, flight clock] may still be uploaded for."""
        for joint in range(len(self._flight.plan.mission.replanning.joints)):
            if self._chains.due(joint + 1) - READY_BEFORE > earliest:
                return joint
        return None

    # ------------------------------------------------------------------------------------------------ a plan

    def _collect(self, work: _Work, now: float) -> None:
        """The plan, when its budget is over."""
        if now < work.until - 1e-9:
            return
        self._work = None
        if not work.aside.done:
            self._keep(f"no plan within {work.mission.replanning.budget:g} s")
            return
        try:
            plan, files = work.aside.outcome()
            _check(self._flight.plan, plan, work.joint)
        except (PlannerError, CertificateError, TrajectoryError) as error:
            self._keep(str(error))
            return
        after = plan.certificate.indicators.ergodicity
        text = (
            f"planned anew from joint {work.joint + 1} on, {work.mission.replanning.budget:g} s charged: E {after:.3g}"
        )
        self._flight.event("replanned", text, value=after)
        self._chains.offer(plan.trajectories, work.joint + 1)
        self._told = False
        self._offered = _Offered(plan, work.joint, work.before, files)

    # ------------------------------------------------------------------------------------------------ at the joint

    def _decide(self, offered: _Offered, now: float) -> None:
        """Half a second before the joint: everybody or nobody."""
        number, flight = offered.joint + 1, self._flight
        if not self._told and not self._chains.unready():
            self._told, ahead = True, self._chains.due(number) - now
            flight.event("replan_uploaded", f"all have it, {ahead:.1f} s before joint {number}", value=ahead)
        if now < self._chains.due(number) - READY_BEFORE:
            return
        self._offered = None
        if unready := self._chains.unready():
            self._chains.withdraw()
            self._keep("; ".join(f"{name}: {why}" for name, why in unready.items()))
            return
        self._chains.take_over(offered.plan.trajectories)
        flight.take_over(offered.plan)
        for name, data in offered.files.items():
            flight.journal.log.attach(name, now, data)
        after = offered.plan.certificate.indicators.ergodicity
        text = f"all take new trajectories over at joint {number}: E {offered.before:.3g} before, {after:.3g} after"
        flight.event("take_over", text, value=after)

    def _keep(self, why: str) -> None:
        self._flight.event("old_plan", f"the old plan goes on: {why}", level="warning")


def _planned(replanner: Replanner, current: FlightPlan, mission: Mission, joint: int) -> tuple[FlightPlan, Files]:
    """A plan, and what the log will hold of it."""
    plan = replanner(current, mission, joint)
    files = attachments(plan, {})
    return plan, {name: data for name, data in files.items() if name != FLEET}


def _check(current: FlightPlan, plan: FlightPlan, joint: int) -> None:
    """That a plan may be flown, whoever made it.

    Raises:
        CertificateError: it is not certified, is not what has been flown so far, or would be written over what flies.
    """
    if not plan.certificate.passed:
        failed = ", ".join(check.name for check in plan.certificate.failures)
        raise CertificateError(f"the new plan's certificate fails: {failed}")
    verify(plan.certificate, plan.trajectories, plan.mission, plan.transfers)
    if plan.transfers is None:
        raise CertificateError("the new plan says nothing of the way back")
    for name, old in current.trajectories.items():
        new = plan.trajectories[name]
        if new.legs[: joint + 1] != old.legs[: joint + 1]:
            raise CertificateError(f"{name}: the new plan's beginning is not what is flown")
        leg_there = old.legs[joint : joint + 2]  # flown, and next
        if any(new.legs[joint + 1].offset < leg.end and leg.offset < new.legs[joint + 1].end for leg in leg_there):
            raise CertificateError(f"{name}: leg {joint + 2} of the new plan lies where there is a leg of the old one")


def _ergodicity(flight: Flight, mission: Mission) -> float:
    """E of the plan that flies on a mission's map."""
    t = np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt
    references = [flight.courses.references[robot.name] for robot in mission.robots]
    q = np.stack([reference.evaluate(t)[:, : mission.dimension] for reference in references], axis=1)
    return ergodic_metric(mission).value(q)
