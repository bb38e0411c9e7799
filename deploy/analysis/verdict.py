"""PASS, WARN or FAIL, and the reasons, most serious first."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

from deploy.analysis.diagnosis import diagnose
from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level, Verdict, ordered
from deploy.flightlog.reader import FlightRecord

SEPARATION_ALLOWANCE = 0.05  # m that drones may come closer than the mission's separation
CLEARANCE_ALLOWANCE = 0.02  # m that drones may come closer to obstacles than planned: what good tracking takes
TRACKING_LIMIT = 0.05  # m, mean error of a good flight
LANDED, ABORTED = "landed", "aborted"


def judge(evidence: Evidence) -> Verdict:
    """Judge a flight by all of it."""
    judges = (_completion, _separation, _tracking, _landing, _faults, _meetings, _fence, _health, _log, _certificate)
    findings = [finding for judge_one in judges for finding in judge_one(evidence)]
    return ordered([*diagnose(evidence), *findings])


def _completion(e: Evidence) -> Iterator[Finding]:
    if e.window is None:
        yield Finding(Level.FAIL, "mission", "the search never began")
    elif not e.window.complete:
        flown, whole = e.window.end - e.window.start, e.mission.horizon.duration
        yield Finding(Level.FAIL, "mission", f"the search ended after {flown:.1f} s of {whole:.1f} s")
    else:
        yield Finding(Level.PASS, "mission", f"the whole search of {e.mission.horizon.duration:.0f} s was flown")


def _landing(e: Evidence) -> Iterator[Finding]:
    phases = [event.phase for event in e.record.events if event.phase]
    up = [robot.name for robot in e.mission.robots if _flying_at_end(e.record, robot.name)]
    if up:
        yield Finding(Level.FAIL, "landing", f"last heard of in the air: {', '.join(up)}")
    elif phases and phases[-1] == LANDED:
        yield Finding(Level.PASS, "landing", "everybody landed")
    elif phases and phases[-1] == ABORTED:
        yield Finding(Level.FAIL, "landing", "everybody came down before the end: the flight was aborted")
    else:
        last = phases[-1] if phases else "unknown"
        yield Finding(Level.FAIL, "landing", f"the flight did not end with a landing; its last phase is '{last}'")


def _flying_at_end(record: FlightRecord, robot: str) -> bool:
    series = record.of(robot, "supervisor")
    names = series.texts["names"][-1] if series is not None and len(series) else None
    return isinstance(names, list) and any("flying" in str(name).replace("_", " ").split() for name in names)


def _faults(e: Evidence) -> Iterator[Finding]:
    by_level = {"fault": Level.FAIL, "warning": Level.WARN}
    counts: Counter[tuple[Level, str]] = Counter()
    for event in e.record.events:
        if event.level in by_level:
            who = f"{event.robot}: " if event.robot else ""
            counts[by_level[event.level], f"{who}{event.text}"] += 1
    for (level, text), count in counts.items():
        yield Finding(level, "event", f"{text} ({count} times)" if count > 1 else text)
    if not counts:
        yield Finding(Level.PASS, "event", "no warning and no fault")


def _separation(e: Evidence) -> Iterator[Finding]:
    if e.separation is None or math.isnan(e.separation.at):
        return
    allowed = e.mission.limits.separation - SEPARATION_ALLOWANCE
    found, pair = e.separation.smallest, "–".join(e.separation.pair)
    level = Level.PASS if found >= allowed else Level.FAIL
    text = f"smallest separation {found:.3f} m ({pair}, {e.when(e.separation.at)}); allowed: {allowed:.2f} m"
    yield Finding(level, "separation", text)
    if math.isfinite(clearance := e.separation.clearance):
        level = Level.FAIL if clearance < -SEPARATION_ALLOWANCE else Level.WARN
        level = Level.PASS if clearance >= -CLEARANCE_ALLOWANCE else level
        taken = f"tracking may take {CLEARANCE_ALLOWANCE * 1e3:.0f} mm"
        text = f"smallest obstacle clearance {clearance * 1e3:.1f} mm; {taken}"
        yield Finding(level, "obstacle", text)


def _fence(e: Evidence) -> Iterator[Finding]:
    if e.separation is None or e.window is None:
        return
    margin = e.mission.flight.geofence_margin
    if e.separation.outside > margin:
        text = f"{e.separation.outside_robot} was {e.separation.outside:.2f} m outside the workspace; allowed: {margin}"
        yield Finding(Level.FAIL, "geofence", f"{text} m")
    else:
        yield Finding(Level.PASS, "geofence", f"nobody left the workspace by more than {margin:.2f} m")


def _tracking(e: Evidence) -> Iterator[Finding]:
    known = [item for item in e.tracking if not math.isnan(item.mean)]
    unseen = [item.robot for item in e.tracking if math.isnan(item.mean)]
    if unseen and e.window is not None:
        yield Finding(Level.FAIL, "tracking", f"never seen during the search: {', '.join(unseen)}")
    if not known:
        return
    mean = sum(item.mean for item in known) / len(known)
    worst = max(known, key=lambda item: item.mean)
    text = f"mean tracking error {mean * 100:.1f} cm, worst {worst.robot} with {worst.mean * 100:.1f} cm"
    level = Level.FAIL if mean > TRACKING_LIMIT else Level.WARN if worst.mean > TRACKING_LIMIT else Level.PASS
    yield Finding(level, "tracking", f"{text}; allowed: {TRACKING_LIMIT * 100:.0f} cm")


def _meetings(e: Evidence) -> Iterator[Finding]:
    flown = e.coverage.flown
    if flown is None or e.mission.connectivity.policy == "none" or not flown.pairs:
        return
    missed = [pair.robots for pair in flown.pairs if not all(pair.met)]
    if not missed:
        yield Finding(Level.PASS, "meetings", "every pair met in every sub-period")
    elif e.coverage.certified.all_met:
        who = ", ".join("–".join(pair) for pair in missed)
        yield Finding(Level.WARN, "meetings", f"planned but not flown within range in every sub-period: {who}")


def _health(e: Evidence) -> Iterator[Finding]:
    for link in e.links:
        if link.lost:
            yield Finding(Level.WARN, "link", f"{link.robot}: {link.lost} packets lost")


def _log(e: Evidence) -> Iterator[Finding]:
    for problem in e.record.problems:
        yield Finding(Level.WARN, "log", problem)
    if e.record.dropped:
        yield Finding(Level.WARN, "log", f"{e.record.dropped} records were dropped: the disk could not keep up")
    if e.record.complete and not e.record.dropped:
        yield Finding(Level.PASS, "log", "the log is complete")


def _certificate(e: Evidence) -> Iterator[Finding]:
    if not e.certificate.passed:
        yield Finding(Level.FAIL, "certificate", "what was flown was not certified")
