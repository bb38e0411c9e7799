"""Whether the radio carries the flight: poses and telemetry all the time, and the upload before take-off.

Advice, all of it: a slow radio is seen before take-off. What has to be uploaded in time, in flight, is another check.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from missions.radio import background_rate, drones_sharing, request_rate
from missions.schema import Mission
from planner.certificate.checks import check
from planner.certificate.record import Check
from planner.trajectory.encoded import EncodedTrajectory

CHUNK = 24  # bytes a packet writes or reads (crtp_mem.c)
LEGS_ON_THE_GROUND = 2  # the memory's halves; more is uploaded in flight
PATIENCE = 60.0  # [s] of upload; hovering costs nothing yet, but batteries, estimators and people grow impatient


def radio_checks(mission: Mission, trajectories: Mapping[str, EncodedTrajectory]) -> list[Check]:
    """The busiest dongle's packets and the slowest robot's upload.

    Args:
        mission: packet rate, pose and telemetry rates, who shares a dongle.
        trajectories: the bytes by robot name.
    """
    robots, radio = mission.robots, mission.radio
    sharing = [radio.drones_per_dongle or count for count in drones_sharing(robots)]
    load = [background_rate(mission) * count for count in sharing]
    times = [
        upload_requests(trajectories[robot.name]) / rate if rate > 0.0 else math.inf
        for robot, rate in zip(robots, request_rate(mission), strict=True)
    ]
    busiest, slowest = max(range(len(load)), key=load.__getitem__), max(range(len(times)), key=times.__getitem__)
    shared = f"{sharing[busiest]} drones on the dongle of {robots[busiest].name}"
    return [
        check("radio load", load[busiest], radio.packet_rate, "1/s", "<=", shared, severity="warning"),
        check("upload time", times[slowest], PATIENCE, "s", "<=", robots[slowest].name, severity="warning"),
    ]


def upload_requests(trajectory: EncodedTrajectory) -> int:
    """Acknowledged requests that write, read back and define what is uploaded on the ground."""
    legs = trajectory.legs[:LEGS_ON_THE_GROUND]
    return sum(2 * math.ceil(len(leg.data) / CHUNK) + 1 for leg in legs)
