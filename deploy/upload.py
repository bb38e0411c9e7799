"""Stage 5 of 7: certified bytes into the trajectory memory, read back and compared."""

from __future__ import annotations

from deploy.errors import UploadError
from deploy.radio import highlevel
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY
from planner.trajectory.encoded import EncodedTrajectory, Encoding

TRAJECTORY_ID = 1


def upload(drone: Drone, trajectory: EncodedTrajectory) -> None:
    """Write a trajectory at address 0, read all of it back, compare, and define it as :data:`TRAJECTORY_ID`.

    Never in flight: the firmware flies from this very memory. Blocks; every packet has a deadline.

    Raises:
        UploadError: it does not fit, or what was read back differs.
        CommandRefused: the drone has no trajectory memory, or refuses the definition.
        LinkError: it stopped answering.
    """
    memory = drone.memory(TRAJECTORY)
    data = trajectory.data
    if len(data) > memory.size:
        raise UploadError(f"{drone.name}: the trajectory has {len(data)} bytes, its memory {memory.size}")
    drone.write_memory(memory, 0, data)
    held = drone.read_memory(memory, 0, len(data))
    if held != data:
        first = next(i for i, (a, b) in enumerate(zip(data, held, strict=True)) if a != b)
        wrong = sum(a != b for a, b in zip(data, held, strict=True))
        raise UploadError(
            f"{drone.name}: {wrong} of {len(data)} bytes read back differ from what was written, first at {first}"
        )
    kind = 1 if trajectory.encoding is Encoding.COMPRESSED else 0
    drone.ask(highlevel.define_trajectory(TRAJECTORY_ID, kind, 0, trajectory.pieces))
