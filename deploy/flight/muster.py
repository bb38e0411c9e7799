"""Who flies: everybody is brought as far as take-off; who fails is tried again, then left behind if that is safe.

On the ground, steps are taken by all drones at once, each with failures of its own::

    connect ──► settle the estimator ──► check ──► upload ──► check again ──► arm

Who fails a step takes all steps up to it again, after a pause that doubles: a drone that was restarted has forgotten
everything. Who fails for good is left behind if ``safety.min_robots`` allows it and the certificate of the others,
computed anew from their bytes, passes; else nobody flies.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Collection, Mapping
from typing import TypeAlias

from deploy.errors import DeployError, FlightAborted, LinkError, UploadError
from deploy.flight import ground
from deploy.flight.ground import Failures
from deploy.flight.loop import Flight
from deploy.flightlog.events import Level
from deploy.phases import Phase
from deploy.preflight import (
    PASSING,
    PreflightCheck,
    PreflightReport,
    check_left,
    check_limits,
    check_log,
    check_plan,
    check_same,
    failed_before,
)
from deploy.radio.fleet import FleetError
from planner.errors import PlannerError
from planner.flightplan import FlightPlan
from planner.subset import without

_CONNECT, _SETTLE, _CHECK, _LOAD, _AGAIN = range(5)
Step: TypeAlias = Callable[[Flight, Collection[str]], Failures]
_LOOK = 0.3  # s of the last look: whoever is not seen any more is old by then


class ChecksFailed(DeployError):
    """One drone's pre-flight checks failed.

    Attributes:
        passing: whether all that failed may well pass in a moment.
    """

    def __init__(self, failed: Collection[PreflightCheck]) -> None:
        super().__init__("; ".join(f"{check.name}: {check.value}" for check in failed))
        self.passing = {check.name for check in failed} <= PASSING


class Muster:
    """The way to take-off.

    Args:
        flight: not yet begun.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self._checks: dict[str, tuple[PreflightCheck, ...]] = {}
        self._failed: Failures = {}
        self._refusals: tuple[PreflightCheck, ...] = ()
        self._steps: tuple[tuple[Phase, Step], ...] = (
            (Phase.IDLE, ground.connect),
            (Phase.CONNECTED, ground.settle_estimators),
            (Phase.CONNECTED, self._check),
            (Phase.CHECKED, ground.load),
            (Phase.UPLOADED, self._check_again),
        )

    def check(self) -> PreflightReport:
        """Connect and check everybody, whatever fails; nothing is uploaded. Returns every check."""
        flight = self._flight
        flight.event("phase", flight.phases.now.value)
        self._take(_CONNECT)
        if len(self._failed) < len(flight.fleet):
            flight.enter(Phase.CONNECTED)
        self._take(_SETTLE)
        self._take(_CHECK)
        for name, error in self._failed.items():
            if not isinstance(error, ChecksFailed):
                self._note(name, (failed_before(name, str(error)),))
        log = flight.journal.log
        general = (
            *check_plan(flight.plan),
            *check_limits(flight.plan),
            *check_log(log.failure, shutil.disk_usage(log.path.parent).free / 1e6),
            check_same({name: ready.firmware for name, ready in flight.ready.items()}),
        )
        self._note("", general)
        return PreflightReport((*general, *(item for name in flight.fleet for item in self._checks[name])))

    def make_ready(self) -> PreflightReport:
        """Everything before take-off, with those who pass; returns every check.

        Raises:
            PreflightError: with every failure. FleetError: an upload failed. FlightAborted: somebody did not get ready.
        """
        flight, report = self._flight, self.check()
        if not any(check.result == "failure" and not check.robot for check in report.checks):
            self._go_on_without({name: str(error) for name, error in self._failed.items()})
        checks = (*report.checks, *self._refusals)
        remaining = PreflightReport(tuple(check for check in checks if check.robot not in flight.left_behind))
        for item in remaining.failures:
            flight.event("preflight", item.text, robot=item.robot, level="fault")
        remaining.require()
        flight.poses.close_gate()
        flight.enter(Phase.CHECKED)
        self._upload()
        flight.where.note_ground()
        self._arm()
        return report

    # ------------------------------------------------------------------------------------------------ inside

    def _upload(self) -> None:
        flight, total = self._flight, len(self._flight.fleet)
        self._failed = {}
        self._take(_LOAD)
        if not self._go_on_without({name: str(error) for name, error in self._failed.items()}):
            raise FleetError("uploading", self._failed, total)
        size = sum(trajectory.size for trajectory in flight.plan.trajectories.values())
        flight.event("upload", "all trajectories read back equal", value=float(size))
        flight.enter(Phase.UPLOADED)

    def _arm(self) -> None:
        flight = self._flight
        self._failed = {}
        self._take(_AGAIN)
        self._leave({name: str(error) for name, error in self._failed.items()})
        flight.allow(0.0)
        if waiting := ground.arm(flight):
            ground.disarm(flight, waiting)
            self._leave(waiting)
        flight.enter(Phase.ARMED)

    def _leave(self, failing: Mapping[str, str]) -> None:
        """Go on without these, if there are any. Raises FlightAborted."""
        if failing and not self._go_on_without(failing):
            raise FlightAborted("; ".join(f"{name}: {why}" for name, why in failing.items()))

    def _take(self, step: int) -> None:
        """One step by everybody who is still fine; again, from the first step, by those for whom it may help."""
        flight, safety = self._flight, self._flight.plan.mission.safety
        names = [name for name in flight.fleet if name not in self._failed]
        failures = self._step(step, names) if names else {}
        for attempt in range(safety.retries):
            again = [name for name, error in failures.items() if _may_pass(error)]
            if not again:
                break
            pause = safety.retry_pause * 2**attempt
            for name in again:
                flight.event("retry", f"{failures.pop(name)}; again in {pause:g} s", robot=name, level="warning")
            flight.allow(pause)
            flight.wait(pause)
            failures |= self._from_the_start(again, step)
        self._failed |= failures

    def _from_the_start(self, names: list[str], last: int) -> Failures:
        flight, failures = self._flight, Failures()
        # On the ground a farewell packet drops nobody, and a link that is half gone cannot be asked whether it flies.
        flight.fleet.attempt(lambda drone: drone.close(force=True), flight.tick, among=names)
        for step in range(last + 1):
            if here := [name for name in names if name not in failures]:
                failures |= self._step(step, here)
        return failures

    def _step(self, step: int, names: Collection[str]) -> Failures:
        """One try of one step, in the time of the phase in which it is taken first."""
        phase, take = self._steps[step]
        self._flight.allow(0.0, like=phase)
        return take(self._flight, names)

    def _check(self, flight: Flight, names: Collection[str]) -> Failures:
        failures = Failures()
        for name in names:
            checks = ground.judge(flight, name)
            self._note(name, checks)
            failed = [check for check in checks if check.result == "failure"]
            if lost := flight.fleet[name].link.lost:
                failures[name] = LinkError(f"{name}: link lost: {lost}")
            elif failed:
                failures[name] = ChecksFailed(failed)
        return failures

    def _check_again(self, flight: Flight, names: Collection[str]) -> Failures:
        """Uploads take a while: somebody may have been moved, covered, swapped or restarted since the checks."""
        asked = flight.clock.now()
        flight.wait(_LOOK + 1.0 / flight.plan.mission.flight.log_rate)
        failures = self._check(flight, names)
        for name in names:
            estimate = flight.fleet[name].estimate
            if estimate is None or estimate.t <= asked:
                failures.setdefault(name, LinkError(f"{name}: no telemetry any more: has it restarted?"))
        return failures

    def _note(self, name: str, checks: tuple[PreflightCheck, ...]) -> None:
        """Keep the newest checks of a drone and write them down; what fails is no fault as long as it may pass."""
        self._checks[name] = checks
        for item in checks:
            level: Level = "info" if item.result == "pass" else "warning"
            self._flight.event("preflight", item.text, robot=item.robot, level=level)

    def _go_on_without(self, reasons: Mapping[str, str]) -> bool:
        """Leave some behind; False if the mission does not want that or it is not safe, which is a failed check."""
        flight = self._flight
        fewest, left = flight.plan.mission.safety.min_robots, len(flight.fleet) - len(reasons)
        if fewest is None:
            return not reasons
        if not reasons:
            return True
        plan, failing = _plan_of_others(flight.plan, reasons) if left >= fewest else (None, "")
        if plan is None:
            self._refusals = (check_left(left, fewest, failing),)
            self._note("", self._refusals)
            return False
        flight.allow(0.0)  # certificates are computed in the loop's own time
        flight.fleet.attempt(lambda drone: drone.close(force=True), flight.tick, among=reasons)
        flight.go_on_without(plan, reasons)
        for name, why in reasons.items():
            flight.left_behind[name] = why
            flight.event("left_behind", f"stays on the ground: {why}", robot=name, level="warning")
        text = f"{left} fly without {', '.join(reasons)}; the certificate of their bytes passes"
        flight.event("certified_anew", text, value=float(left))
        return True


def _may_pass(error: DeployError) -> bool:
    return isinstance(error, LinkError | UploadError) or (isinstance(error, ChecksFailed) and error.passing)


def _plan_of_others(plan: FlightPlan, leaving: Collection[str]) -> tuple[FlightPlan | None, str]:
    """The plan of the others if its certificate passes; else why not."""
    try:
        others = without(plan, leaving)
    except PlannerError as error:
        return None, str(error)
    if failed := others.certificate.failures:
        return None, "; ".join(f"{check.name} {check.where}".strip() for check in failed)
    return others, ""
