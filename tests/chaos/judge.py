"""What has to hold of every flight, whatever went wrong in it; judged from what really happened and from the log.

1. Two drones that nothing has struck stay ``HARD`` apart as long as one of them is in the air. A drone is *struck*
   from the moment at which a fault takes it out of the air itself: its motor, its battery or its firmware fails, it
   is turned over, or its motors are stopped (the operator's second word, the policy ``stop_motors``, the watchdog).
2. Nobody leaves the geofence (workspace, pads, starts; plus its margin); the struck not by more than ``FALLING``. Who
   is *away* (its link is gone) or *cut off* (for good, or the host has died) gets no poses any more and drifts: rules 1
   and 2 are for its first ``BLIND`` seconds.
3. In the end no motor turns and everybody is on the ground, or falls there, also who was away; but who is cut off in
   the air, or was away in a flight in which something else went wrong, may hover.
4. What fails before take-off keeps everybody on the ground.
5. The log can be read and is complete (after a kill: up to the kill), holds the fault, and ends in a final phase.
6. A flight that did not go as planned fails the verdict, and what is said of it names the fault. One that did passes,
   unless something struck a drone, or by diagnosis alone: the verdict sees more than the watch.
"""

import itertools
import re
from dataclasses import dataclass

import numpy as np

from deploy.analysis.verdict import Level
from deploy.flight.records import FlightOutcome
from deploy.phases import TABLE
from deploy.scenario.killed import HostDied
from missions import fleet
from tests.chaos.arena import NAMES, arena
from tests.chaos.faults import AWAY, CUT, FALLS

HARD = 0.18  # m between centres: 60 % of the mission's separation; propellers touch at 0.14 m
FALLING = 1.0  # m
BLIND = 4.0  # s
MEASURED = ("mission", "landing", "event", "separation", "obstacle", "geofence", "tracking")  # findings of the verdict
DOWN = 0.05  # m
FINAL = {phase.value for phase, rule in TABLE.items() if rule.next is None}


@dataclass(frozen=True)
class Judged:
    """What came of a flight.

    Attributes:
        problems: what should not have happened, one line each. outcome: in a word.
        separation: smallest of drones that nothing struck, in the air [m]. struck: smallest of all [m].
        excursion: beyond the fence and its margin [m]; negative: inside.
        down: from the first fault until everybody who is to land is on the ground [s].
    """

    problems: tuple[str, ...]
    outcome: str
    separation: float
    struck: float
    excursion: float
    down: float


def judge(flown):
    """Every rule above."""
    onset = [(fault, _began(fault, flown.log)) for fault in flown.case.faults]
    stopped = [((event.robot,), event.t) for event in flown.log.events if "motors stopped by" in event.text]
    struck = _since(flown, [*((fault.whom, t) for fault, t in onset if _strikes(fault)), *stopped])
    gone = (CUT,) if len(onset) == 1 else (CUT, AWAY)
    cut = _since(flown, [(fault.whom, t) for fault, t in onset if fault.nature in gone])
    blind = _since(flown, [(fault.whom, t + BLIND) for fault, t in onset if fault.nature in (CUT, AWAY)])
    air = flown.position[:, :, 2] > DOWN
    separation, closest = _separation(flown.position, air, ~(struck | blind)), _separation(flown.position, air)
    outside = _outside(flown.position)
    problems = [
        *_apart(flown, separation),
        *_fenced(outside, struck, blind),
        *_down(flown, air, cut),
        *_grounded(flown, air),
        *_logged(flown, onset),
        *_named(flown),
    ]
    began = min(t for _, t in onset)
    last = flown.t[np.flatnonzero((air & ~cut).any(axis=1))].max(initial=-np.inf)
    return Judged(
        tuple(problems),
        _word(flown.ended),
        float(np.nanmin(separation, initial=np.inf)),
        float(np.nanmin(closest, initial=np.inf)),
        float(outside.max()),
        float(last + 0.01 - began) if last > began else 0.0,
    )


def _strikes(fault):
    return fault.nature == FALLS or (fault.nature in (CUT, AWAY) and fault.on_host_loss == "motor_stop")


def _began(fault, log):
    """When a fault first happened [s]; inf if the flight was over before."""
    kind = fault.event["fault"]
    whom = fault.whom if "to" in fault.event else ()
    for event in log.events:
        found = re.fullmatch(r"scenario: (\w+)(?: \((.*)\))?", event.text)
        if found and found[1] == kind and (not whom or set(whom) == set(found[2].split(", "))):
            return event.t
    return np.inf


def _since(flown, times):
    """(T, N) whether it was one of these times for a drone."""
    out = np.zeros(flown.turning.shape, dtype=bool)
    for whom, began in times:
        for name in whom:
            out[:, NAMES.index(name)] |= flown.t >= began
    return out


def _separation(position, air, fine=None):
    """(T,) smallest distance [m] of two drones one of which is in the air; NaN if there are none."""
    out = np.full(len(position), np.nan)
    for a, b in itertools.combinations(range(position.shape[1]), 2):
        counts = air[:, a] | air[:, b]
        if fine is not None:
            counts &= fine[:, a] & fine[:, b]
        apart = np.linalg.norm(position[:, a] - position[:, b], axis=1)
        out = np.fmin(out, np.where(counts, apart, np.nan))
    return out


def _outside(position):
    """(T, N) how far beyond the fence and its margin [m]."""
    mission = arena()
    lower, upper = fleet.fence(mission)
    margin = mission.flight.geofence_margin
    return np.maximum(lower - margin - position, position - upper - margin).max(axis=2)


def _apart(flown, separation):
    near = np.flatnonzero(separation < HARD)
    if len(near):
        least = np.nanargmin(separation)
        yield f"{separation[least]:.2f} m apart at {flown.t[least]:.2f} s"


def _fenced(outside, struck, blind):
    for i, name in enumerate(NAMES):
        for kind, mask, allowed in (
            ("", ~(struck[:, i] | blind[:, i]), 0.0),
            (" (struck)", struck[:, i] & ~blind[:, i], FALLING),
        ):
            beyond = outside[mask, i].max(initial=-np.inf)
            if beyond > allowed:
                yield f"{name}{kind} {beyond:.2f} m beyond the fence's margin"


def _down(flown, air, cut):
    if not flown.turning[-1].any():  # who is in the air then falls
        return
    may_hover = cut[-1] & (flown.case.on_host_loss == "continue")
    for i in np.flatnonzero((air[-1] | flown.turning[-1]) & ~may_hover):
        x, y, z = flown.position[-1, i]
        motors = "on" if flown.turning[-1, i] else "off"
        yield f"{NAMES[i]} at ({x:.2f}, {y:.2f}, {z:.2f}) m in the end, motors {motors}"


def _grounded(flown, air):
    if isinstance(flown.ended, Exception) and not isinstance(flown.ended, HostDied) and air.any():
        yield "somebody was in the air although the flight was called off before take-off"


def _logged(flown, onset):
    log, killed = flown.log, isinstance(flown.ended, HostDied)
    if log.complete == killed or (log.problems and not killed):
        yield f"log: complete is {log.complete}; {'; '.join(log.problems)}"
    due = any(fault.event.get("at", 0.0) < flown.t[-1] for fault, _ in onset)
    if not killed and due and not any(np.isfinite(t) for _, t in onset):
        yield "log: nothing of the fault"
    phases = [event.text for event in log.events if event.name == "phase"]
    if not killed and phases[-1] not in FINAL:
        yield f"log: ends while {phases[-1]}"


def _named(flown):
    ended, level = flown.ended, flown.analysis.verdict.level
    fine = isinstance(ended, FlightOutcome) and ended.completed
    struck = any(_strikes(fault) for fault in flown.case.faults)
    measured = any(f.level is Level.FAIL and f.name in MEASURED for f in flown.analysis.verdict.findings)
    if (fine and measured and not struck) or (not fine and level is not Level.FAIL):
        yield f"verdict {level.name} of a flight that is {_word(ended)}"
    if fine or len(flown.case.faults) > 1:
        return
    (fault,) = flown.case.faults
    said = str(ended) if isinstance(ended, Exception) else "; ".join((ended.reason, *ended.faults))
    if not re.search(fault.word, said):
        yield f"does not say what went wrong: {said}"
    if len(fault.whom) < len(NAMES) and not any(name in said for name in fault.whom):
        yield f"does not say with whom: {said}"


def _word(ended):
    if isinstance(ended, HostDied):
        return "killed"
    if isinstance(ended, Exception):
        return "called off"
    return "completed" if ended.completed else f"{ended.phase.value}"
