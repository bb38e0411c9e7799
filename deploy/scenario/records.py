"""Records of a scenario file, like those of a mission: every field with meaning, unit and bounds.

YAML's traps decide two names: ``on`` is a boolean to other readers, so it is ``when``; and ``for`` is ``duration``.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal, TypeAlias

from deploy.phases import Phase
from missions.fields import field

EVERYBODY = "everybody"
DONGLE = "dongle "
PHASES = tuple(phase.value for phase in Phase)
# Names that the flight writes into its log; a test finds every one of them in the flight's code.
HAPPENINGS = (
    "estimators",
    "upload",
    "mission_start",
    "leg_upload",
    "mission_end",
    "abort",
    "repeat",
    "link",
    "supervisor",
    "mocap",
    "pose",
    "tracking",
    "separation",
    "geofence",
    "battery",
)


@dataclass(frozen=True, kw_only=True)
class Timed:
    """Something that happens."""

    at: float | None = field(
        "when, by the flight's clock, which starts with the connection: 0 is before it",
        unit="s",
        at_least=0.0,
        at_most=36000.0,
        default=None,
    )
    when: str = field(
        "instead of 'at': the first time a phase is entered (e.g. on mission) or the log has an event (e.g. battery)",
        default="",
    )
    after: float = field("how long after that", unit="s", at_least=0.0, at_most=36000.0, default=0.0)


@dataclass(frozen=True, kw_only=True)
class Aimed(Timed):
    """Something that happens to drones."""

    to: str = field("whom: a robot's name, 'dongle N', or everybody", default=EVERYBODY)
    packets: int = field(
        "and then with so many more packets to the robot, one by name: what connections and uploads take passes after "
        "them, so this is how to hit one in the middle",
        at_least=0,
        at_most=100_000,
        default=0,
    )


@dataclass(frozen=True, kw_only=True)
class Passing(Aimed):
    """Something that happens to drones and may go away."""

    duration: float | None = field(
        "how long it lasts; default: to the end", unit="s", above=0.0, at_most=36000.0, default=None
    )


@dataclass(frozen=True, kw_only=True)
class Loss(Passing):
    """Attempts on the air fail."""

    fault: Literal["loss"] = field("which kind", default="loss")
    rate: float = field("share of attempts that fail", at_least=0.0, at_most=1.0)
    burst: float = field(
        "mean length of bursts in which nothing gets through; 0: independent losses",
        unit="s",
        at_least=0.0,
        at_most=60.0,
        default=0.0,
    )


@dataclass(frozen=True, kw_only=True)
class Silence(Passing):
    """Nothing gets through."""

    fault: Literal["silence"] = field("which kind", default="silence")


@dataclass(frozen=True, kw_only=True)
class Reconnect(Passing):
    """The link breaks at once; after the duration the drone answers again."""

    fault: Literal["reconnect"] = field("which kind", default="reconnect")


@dataclass(frozen=True, kw_only=True)
class SlowLink(Passing):
    """Packets take longer, both ways."""

    fault: Literal["slow_link"] = field("which kind", default="slow_link")
    latency: float = field("how much longer, each way", unit="s", above=0.0, at_most=10.0)


@dataclass(frozen=True, kw_only=True)
class Reboot(Aimed):
    """The firmware restarts."""

    fault: Literal["reboot"] = field("which kind", default="reboot")


@dataclass(frozen=True, kw_only=True)
class BatteryLow(Aimed):
    """The battery is as good as empty."""

    fault: Literal["battery_low"] = field("which kind", default="battery_low")
    charge: float = field("state of charge that is left", at_least=0.0, at_most=1.0, default=0.06)


@dataclass(frozen=True, kw_only=True)
class MotorFailure(Passing):
    """A motor loses thrust."""

    fault: Literal["motor_failure"] = field("which kind", default="motor_failure")
    motor: int = field("1 front right, 2 back right, 3 back left, 4 front left", at_least=1, at_most=4, default=1)
    left: float = field("share of its thrust that is left", at_least=0.0, at_most=1.0, default=0.0)


@dataclass(frozen=True, kw_only=True)
class Tumble(Aimed):
    """A push makes the drone roll over."""

    fault: Literal["tumble"] = field("which kind", default="tumble")
    rate: float = field("roll rate that it is given", unit="rad/s", at_least=-100.0, at_most=100.0, default=40.0)


@dataclass(frozen=True, kw_only=True)
class MocapDropout(Passing):
    """Motion capture sees these drones no longer; no frames at all if it is everybody."""

    fault: Literal["mocap_dropout"] = field("which kind", default="mocap_dropout")


@dataclass(frozen=True, kw_only=True)
class MocapSwap(Passing):
    """Motion capture takes one drone for another."""

    fault: Literal["mocap_swap"] = field("which kind", default="mocap_swap")
    other: str = field("the other robot's name")


@dataclass(frozen=True, kw_only=True)
class MocapOutlier(Passing):
    """Motion capture sees these drones beside where they are."""

    fault: Literal["mocap_outlier"] = field("which kind", default="mocap_outlier")
    offset: tuple[float, ...] = field(
        "how far off, x, y, z", unit="m", at_least=-100.0, at_most=100.0, items=(3, 3), default=(0.0, 0.0, 1.0)
    )


@dataclass(frozen=True, kw_only=True)
class OperatorAbort(Timed):
    """The operator presses Ctrl-C: once to land everybody, twice to stop the motors."""

    fault: Literal["operator_abort"] = field("which kind", default="operator_abort")
    times: int = field("how often", at_least=1, at_most=2, default=1)


@dataclass(frozen=True, kw_only=True)
class ProcessKill(Timed):
    """The host's process dies without a word; the drones fly on, and the rehearsal tells where that ends."""

    fault: Literal["process_kill"] = field("which kind", default="process_kill")
    watch: float = field("for how long the drones are watched then", unit="s", above=0.0, at_most=600.0, default=60.0)


Fault: TypeAlias = (
    Loss
    | Silence
    | Reconnect
    | SlowLink
    | Reboot
    | BatteryLow
    | MotorFailure
    | Tumble
    | MocapDropout
    | MocapSwap
    | MocapOutlier
    | OperatorAbort
    | ProcessKill
)


@dataclass(frozen=True, kw_only=True)
class Scenario:
    """What goes wrong in a rehearsal."""

    name: str = field("name, for the log", default="scenario")
    seed: int | None = field(
        "of everything random in the rehearsal, unless the command line gives one", at_least=0, default=None
    )
    events: tuple[Fault, ...] = field("what happens", items=(1, 1000))
    text: str = dataclasses.field(default="", metadata={"internal": True})  # the file's
