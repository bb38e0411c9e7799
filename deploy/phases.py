"""Stage 6a of 7: the flight as one table of phases; no I/O, no time, no drones.

``execute.py`` interprets the table; the README's diagram is drawn from it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from types import MappingProxyType

from deploy.errors import DeployError


class Phase(Enum):
    """Where a flight is."""

    IDLE = "idle"
    CONNECTED = "connected"
    CHECKED = "checked"
    UPLOADED = "uploaded"
    ARMED = "armed"
    TAKING_OFF = "taking off"
    TRANSFERRING = "transferring"
    SETTLING = "settling"
    ON_MISSION = "on mission"
    HOLDING = "holding"
    RETURNING = "returning"
    LANDING = "landing"
    LANDED = "landed"
    CANCELLED = "cancelled"
    ABORTING = "aborting"
    ABORTED = "aborted"
    EMERGENCY = "emergency"


class IllegalTransition(DeployError):
    """A step the table does not allow: a bug in the caller."""


@dataclass(frozen=True)
class Rule:
    """One row of the table.

    Attributes:
        entry: what has to be true of every drone that flies to enter the phase.
        allowance: how long the phase may last beyond what the flight plan itself takes [s]. On the ground every try of
            a step may last so long, when a flight ends early every part of that.
        next: the phase after it when all goes well; None at the end.
        otherwise: the phase when a drone misses the entry of the next one, or the operator says so; None at the end.
        failing: what happens with a drone that fails in the phase; empty at the end.
        late: what happens when its time is up; empty at the end.
    """

    entry: str
    allowance: float
    next: Phase | None
    otherwise: Phase | None
    failing: str = ""
    late: str = ""


P = Phase
AGAIN = "tried again, then left behind (`min_robots`), else nobody flies"
POLICY = "the mission's policy for what is found; by default all land"
EXCLUDED = "who is late has failed"
LAND = "all land"
TABLE: Mapping[Phase, Rule] = MappingProxyType(
    {
        P.IDLE: Rule("the certificate passes and is for these bytes", 75.0, P.CONNECTED, P.CANCELLED, AGAIN, EXCLUDED),
        P.CONNECTED: Rule(
            "link up, parameters read back, telemetry runs", 25.0, P.CHECKED, P.CANCELLED, AGAIN, "the checks say who"
        ),
        P.CHECKED: Rule(
            "estimator settled, every pre-flight check passed", 60.0, P.UPLOADED, P.CANCELLED, AGAIN, EXCLUDED
        ),
        P.UPLOADED: Rule("memory read back equal, trajectory defined", 5.0, P.ARMED, P.CANCELLED, AGAIN, EXCLUDED),
        P.ARMED: Rule(
            "every check passed once more, supervisor armed",
            2.0,
            P.TAKING_OFF,
            P.CANCELLED,
            "nobody flies",
            "nobody flies",
        ),
        P.TAKING_OFF: Rule(
            "every supervisor ready; take-off is commanded", 3.0, P.TRANSFERRING, P.ABORTING, POLICY, LAND
        ),
        P.TRANSFERRING: Rule("pose within 15 cm of the altitude", 2.0, P.SETTLING, P.ABORTING, POLICY, LAND),
        P.SETTLING: Rule("transfer time is over", 5.0, P.ON_MISSION, P.ABORTING, POLICY, LAND),
        P.ON_MISSION: Rule(
            "pose within 10 cm of the start; all trajectories are started", 0.5, P.HOLDING, P.ABORTING, POLICY, LAND
        ),
        P.HOLDING: Rule("trajectory time is over", 2.0, P.RETURNING, P.ABORTING, POLICY, LAND),
        P.RETURNING: Rule(
            "hover time is over", 5.0, P.LANDING, P.ABORTING, POLICY, "a warning: they land where they are"
        ),
        P.LANDING: Rule(
            "moves back are over; landing is commanded", 8.0, P.LANDED, P.ABORTED, "the others land", "a fault"
        ),
        P.LANDED: Rule("supervisor says not flying", 0.0, None, None),
        P.CANCELLED: Rule("nobody has left the ground", 0.0, None, None),
        P.ABORTING: Rule(
            "a limit, a lost drone, a refusal or the operator",
            20.0,
            P.ABORTED,
            P.ABORTED,
            "what is worse than what is being done changes it",
            "all land at once where they are",
        ),
        P.ABORTED: Rule("everybody who can be heard is down", 0.0, None, None),
        P.EMERGENCY: Rule("the operator stopped the motors", 0.0, None, None),
    }
)
AIRBORNE = frozenset(
    {P.TAKING_OFF, P.TRANSFERRING, P.SETTLING, P.ON_MISSION, P.HOLDING, P.RETURNING, P.LANDING, P.ABORTING}
)


def allowed(phase: Phase) -> frozenset[Phase]:
    """Phases that may follow; the motors may be stopped as long as they may turn."""
    rule = TABLE[phase]
    follow = {rule.next, rule.otherwise} - {None}
    if phase in AIRBORNE | {P.ARMED}:
        follow.add(P.EMERGENCY)
    return frozenset(p for p in follow if p is not None)


class Phases:
    """The phase a flight is in, changed by legal steps only."""

    def __init__(self) -> None:
        self._now = Phase.IDLE

    @property
    def now(self) -> Phase:
        """The present phase."""
        return self._now

    @property
    def over(self) -> bool:
        """Whether nothing can follow."""
        return not allowed(self._now)

    @property
    def airborne(self) -> bool:
        """Whether a drone may be in the air."""
        return self._now in AIRBORNE

    def enter(self, phase: Phase) -> None:
        """Go to another phase.

        Raises:
            IllegalTransition: the table does not allow it.
        """
        if phase not in allowed(self._now):
            options = ", ".join(sorted(p.value for p in allowed(self._now))) or "nothing: the flight is over"
            raise IllegalTransition(f"a flight that is {self._now.value} cannot be {phase.value}; allowed: {options}")
        self._now = phase


def mermaid() -> str:
    """The table as a Mermaid state diagram."""
    lines = ["stateDiagram-v2", f"    [*] --> {P.IDLE.name}"]
    for phase, rule in TABLE.items():
        lines.append(f'    state "{phase.value}" as {phase.name}')
        for target in sorted(allowed(phase), key=list(Phase).index):
            label = f": {TABLE[target].entry}" if target is rule.next else ""
            lines.append(f"    {phase.name} --> {target.name}{label}")
        if rule.next is None:
            lines.append(f"    {phase.name} --> [*]")
    return "\n".join(lines) + "\n"


def markdown() -> str:
    """The table for the README: deadlines are beyond what the flight plan itself takes."""
    head = ("phase", "entered when", "deadline", "when it is over", "then", "who fails in it")
    lines = [f"| {' | '.join(head)} |", "|---" * len(head) + "|"]
    for phase, rule in TABLE.items():
        if rule.next is not None:
            cells = (phase.value, rule.entry, f"{rule.allowance:g} s", rule.late, rule.next.value, rule.failing)
            lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"
