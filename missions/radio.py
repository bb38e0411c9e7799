"""What a mission assumes of its radio: how many packets it carries, and how punctual a command is.

Missions longer than the trajectory memory are uploaded leg by leg in flight, and every leg begins when its start
command arrives. The certificate bounds what that does to the flight for the figures given here; a flight on a worse
radio than the mission says is not the flight that was certified.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from missions.fields import field
from missions.lights import LIGHT_PERIOD, lit

if TYPE_CHECKING:
    from missions.schema import Mission, Robot

# Log packets of a drone in every period of flight.log_rate (deploy/radio/telemetry.py); the filter's variance stops
# before take-off.
TELEMETRY_BLOCKS = 3
LEAST_POSES = 10.0  # [1/s]
HOUSEKEEPING = 5.0  # [1/s] our pings, two a second, their answers, and commands; cflib's pings are stopped


@dataclass(frozen=True)
class Radio:
    """Rate and punctuality of the radio."""

    packet_rate: float = field(
        "packets that one dongle exchanges with all its drones together; cflib's own radio tests expect more than "
        "450, Crazyswarm2 measures 1300, and 200 on a computer with slow USB",
        unit="1/s",
        at_least=50.0,
        at_most=5000.0,
        default=500.0,
    )
    latency: float = field(
        "time from sending a command to its effect; it is sent so much earlier (Crazyswarm2's link check: 3 ms; "
        "cflib's radio tests: below 8 ms)",
        unit="s",
        at_least=0.0,
        at_most=0.2,
        default=0.005,
    )
    jitter: float = field(
        "a command takes effect up to this much sooner or later than 'latency' says: retries on the air, the 10 ms "
        "tick of the flight loop and that of the drone's commander",
        unit="s",
        at_least=0.005,
        at_most=0.1,
        default=0.015,
    )
    drones_per_dongle: int | None = field(
        "most drones that share a dongle; default: as the URIs say, and all those without one share one",
        at_least=1,
        at_most=100,
        default=None,
    )
    rehearsal: Literal["modelled", "ideal"] = field(
        "the radio of rehearsals: modelled, as the other figures here say, with losses; or ideal: packets take no "
        "time, all arrive, and connections and uploads are over at once, for tests of what happens, not of when",
        default="modelled",
    )
    switch_jump: float = field(
        "largest jump of the setpoint when one leg of a trajectory follows another; legs slow down where they meet to "
        "keep it",
        unit="m",
        above=0.0,
        at_most=0.2,
        default=0.02,
    )


def dongle_of(robot: Robot) -> str:
    """A key that is equal for robots that share a dongle; a cable or a socket is nobody else's."""
    if robot.uri.startswith("radio://") or not robot.uri:
        return robot.uri.removeprefix("radio://").partition("/")[0]
    return robot.uri


def drones_sharing(robots: Sequence[Robot]) -> tuple[int, ...]:
    """For every robot, how many drones are on its dongle, itself included, by the URIs."""
    count = Counter(dongle_of(robot) for robot in robots)
    return tuple(count[dongle_of(robot)] for robot in robots)


def background_rate(mission: Mission) -> float:
    """Packets a drone takes for poses, telemetry, pings and lights [1/s], whatever else is sent to it.

    Up and down are added, although a packet down may ride in the acknowledgement of one up: with 50 poses and 30 log
    packets a second a twentieth does (tests/deploy/test_radio_budget.py).
    """
    return mission.flight.pose_rate + TELEMETRY_BLOCKS * mission.flight.log_rate + _besides(mission)


def pose_rates(mission: Mission) -> dict[str, float]:
    """Poses that are sent to each robot [1/s]: what the mission asks for, or what its share of the dongle leaves.

    Telemetry comes back in the acknowledgements of poses, so it needs no room of its own; commands do. Below
    :data:`LEAST_POSES` nobody flies well, so that much is sent whatever it crowds out.
    """
    shared = [mission.radio.drones_per_dongle or count for count in drones_sharing(mission.robots)]
    return {
        robot.name: min(
            mission.flight.pose_rate, max(LEAST_POSES, mission.radio.packet_rate / count - _besides(mission))
        )
        for robot, count in zip(mission.robots, shared, strict=True)
    }


def _besides(mission: Mission) -> float:
    """Packets of a drone beside poses and telemetry [1/s]; a colour of an LED ring is a request and its answer."""
    return HOUSEKEEPING + (2.0 / LIGHT_PERIOD if lit(mission) else 0.0)


def request_rate(mission: Mission) -> tuple[float, ...]:
    """Per robot, acknowledged requests a second that are left beside poses and telemetry; 0 or less: none.

    Every drone of a dongle gets the same share. A request takes two packets: the answer rides in the acknowledgement
    of a later one.
    """
    radio = mission.radio
    shared = [radio.drones_per_dongle or sharing for sharing in drones_sharing(mission.robots)]
    return tuple((radio.packet_rate / count - background_rate(mission)) / 2.0 for count in shared)
