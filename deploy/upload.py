"""Stage 5 of 7: certified bytes into the trajectory memory, read back and compared."""

from __future__ import annotations

from deploy.errors import CommandRefused, UploadError
from deploy.radio import highlevel
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY, MemoryInfo, reading, writing
from deploy.radio.requests import Conversation
from planner.certificate.radio import LEGS_ON_THE_GROUND
from planner.trajectory.encoded import EncodedTrajectory, Leg
from planner.trajectory.legs import HALF


def trajectory_id(number: int, leg: Leg) -> int:
    """Identifier of leg ``number`` (from 0): legs take turns, so that the one that flies is never defined anew.

    A leg that was planned anew lies beside the one that it may replace, and is defined beside it.
    """
    return 1 + number % 2 + 2 * (leg.offset % HALF > 0)


def upload(drone: Drone, trajectory: EncodedTrajectory) -> None:
    """Write the legs that are flown first, read all of them back, compare, and define them.

    For the ground: blocks; every packet has a deadline.

    Raises:
        UploadError: it does not fit, or what was read back differs.
        CommandRefused: the drone has no trajectory memory, or refuses the definition.
        LinkError: it stopped answering.
    """
    memory = drone.memory(TRAJECTORY)
    for number, leg in enumerate(trajectory.legs[:LEGS_ON_THE_GROUND]):
        drone.converse(loading(drone.name, memory, leg, trajectory_id(number, leg)))


def loading(name: str, memory: MemoryInfo, leg: Leg, identifier: int) -> Conversation[None]:
    """Write a leg, read it back, compare, define it as a trajectory.

    In flight only for a leg whose place in the memory nobody flies: the firmware flies from this very memory.

    Args:
        name: the drone, for messages.
        memory: its trajectory memory.
        leg: what to write.
        identifier: what it will be started as.

    Raises:
        UploadError: it does not fit, or what was read back differs. CommandRefused: the definition is refused.
    """
    data = leg.data
    if leg.end > memory.size:
        raise UploadError(f"{name}: the trajectory needs {leg.end} bytes of its memory, which has {memory.size}")
    yield from writing(memory, leg.offset, data)
    held = yield from reading(memory, leg.offset, len(data))
    if held != data:
        first = next(i for i, (a, b) in enumerate(zip(data, held, strict=True)) if a != b)
        wrong = sum(a != b for a, b in zip(data, held, strict=True))
        raise UploadError(
            f"{name}: {wrong} of {len(data)} bytes read back differ from what was written, first at {first}"
        )
    request = highlevel.define_trajectory(identifier, leg.encoding.value, leg.offset, leg.pieces)
    code = highlevel.return_code((yield request))
    if code:
        raise CommandRefused(f"{name}: {request.what}: {highlevel.meaning(code)}")
