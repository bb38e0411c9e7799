"""Checks of what concerns everybody: the plan, the log, the swarm as a whole."""

from __future__ import annotations

from collections.abc import Mapping

from deploy.preflight.records import PreflightCheck, Result, judge
from planner.certificate.certify import certify, verify
from planner.certificate.compare import differences
from planner.certificate.errors import CertificateError
from planner.errors import PlannerError
from planner.flightplan import FlightPlan

DISK_LIMIT = 200.0  # MB; half an hour of ten drones takes about as much


def check_plan(plan: FlightPlan) -> tuple[PreflightCheck, ...]:
    """The certificate passes, belongs to these very bytes and this mission, and is what they certify to, once more."""
    certificate = plan.certificate
    text = ", ".join(f"{check.name} {check.where}".strip() for check in certificate.failures) or (
        "passed" if certificate.passed else "nothing was checked"
    )
    passed = judge("certificate", "", certificate.passed, text, "every check passed", "plan the mission again")
    try:
        verify(plan.certificate, plan.trajectories, plan.mission, plan.transfers)
        found = "these bytes, this mission" if plan.transfers else "a search without a way to it and back"
    except CertificateError as error:
        found = str(error)
    bound = judge(
        "certificate is for",
        "",
        found.startswith("these"),
        found,
        "these bytes, this mission",
        "do not edit plan files; plan again",
    )
    return passed, bound, _repeated(plan)


def _repeated(plan: FlightPlan) -> PreflightCheck:
    """A file's hashes can be made to fit whatever was edited into it; the proof cannot."""
    try:
        differing = differences(plan.certificate, certify(plan.mission, plan.trajectories, plan.transfers))
        found = f"another result for {', '.join(differing)}" if differing else "the same"
    except PlannerError as error:
        differing, found = ("everything",), str(error)
    remedy = "do not edit plan files; plan again with this version"
    return judge("certificate, computed again", "", not differing, found, "the same", remedy)


def check_log(failure: str, free: float) -> tuple[PreflightCheck, ...]:
    """The flight log is being written, and has room.

    Args:
        failure: why it is not being written; empty if it is.
        free: room on its disk [MB].
    """
    remedy = "free disk space, or log elsewhere"
    # How much more there is would make every log of a flight another one: it is this computer's, not the flight's.
    found = "enough" if free >= DISK_LIMIT else f"{free:.0f} MB"
    return (
        judge("flight log", "", not failure, failure or "open", "open", remedy),
        judge("disk", "", free >= DISK_LIMIT, found, f">= {DISK_LIMIT:.0f} MB", remedy),
    )


def check_limits(plan: FlightPlan) -> tuple[PreflightCheck, ...]:
    """What the certificate has proven of the geofence and the radio, by name; without it there is no such check."""
    inside = [c for c in plan.certificate.checks if c.name == "workspace" or c.name.endswith("geofence")]
    load = [c for c in plan.certificate.checks if c.name == "radio load"]
    checks = []
    if inside:
        least = min(inside, key=lambda check: check.value - check.limit)
        found = f"{least.value:.2f} {least.unit} inside ({least.name}, {least.where})"
        limit, remedy = f">= {least.limit:g} {least.unit}", "a larger flight.geofence_margin, or plan again"
        checks.append(judge("geofence contains the flight", "", all(c.passed for c in inside), found, limit, remedy))
    for check in load:
        result: Result = "pass" if check.passed else "warning"
        remedy = "" if check.passed else "fewer drones a dongle, lower flight.pose_rate or log_rate"
        value, limit = f"{check.value:.0f} {check.unit} ({check.where})", f"<= {check.limit:.0f} {check.unit}"
        checks.append(PreflightCheck("radio budget", "", result, value, limit, remedy))
    return tuple(checks)


def check_left(left: int, fewest: int, failing: str) -> PreflightCheck:
    """Why nobody is left behind: too few others, or what of their certificate fails (empty: too few)."""
    if failing:
        remedy = "make everybody fit, or plan without them"
        return PreflightCheck("certificate of the others", "", "failure", failing, "every check passed", remedy)
    return PreflightCheck("robots left", "", "failure", str(left), f">= {fewest} (safety.min_robots)", "make them fit")


def check_same(firmware: Mapping[str, str]) -> PreflightCheck:
    """Everybody flies the same firmware.

    Args:
        firmware: version by robot.
    """
    versions = sorted(set(firmware.values()))
    same: Result = "pass" if len(versions) <= 1 else "warning"
    remedy = "" if same == "pass" else "flash all drones with the same release"
    return PreflightCheck("same firmware", "", same, ", ".join(versions) or "unknown", "one version", remedy)
