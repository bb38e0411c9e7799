"""Stage 5 of 7: certified bytes into the trajectory memory, read back and compared."""

from __future__ import annotations

from deploy.errors import UploadError
from deploy.radio import highlevel
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY
from planner.trajectory.encoded import EncodedTrajectory, Leg

TRAJECTORY_ID = 1


def upload(drone: Drone, trajectory: EncodedTrajectory) -> None:
    """Write a trajectory's bytes, read all of them back, compare, and define them as :data:`TRAJECTORY_ID`.

    Never in flight: the firmware flies from this very memory. Blocks; every packet has a deadline.

    Raises:
        UploadError: it does not fit, or what was read back differs.
        CommandRefused: the drone has no trajectory memory, or refuses the definition.
        LinkError: it stopped answering.
    """
    _upload_leg(drone, trajectory.legs[0], TRAJECTORY_ID)


def _upload_leg(drone: Drone, leg: Leg, identifier: int) -> None:
    memory, data = drone.memory(TRAJECTORY), leg.data
    if leg.end > memory.size:
        raise UploadError(f"{drone.name}: the trajectory needs {leg.end} bytes of its memory, which has {memory.size}")
    drone.write_memory(memory, leg.offset, data)
    held = drone.read_memory(memory, leg.offset, len(data))
    if held != data:
        first = next(i for i, (a, b) in enumerate(zip(data, held, strict=True)) if a != b)
        wrong = sum(a != b for a, b in zip(data, held, strict=True))
        raise UploadError(
            f"{drone.name}: {wrong} of {len(data)} bytes read back differ from what was written, first at {first}"
        )
    drone.ask(highlevel.define_trajectory(identifier, leg.encoding.value, leg.offset, leg.pieces))
