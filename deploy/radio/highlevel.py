"""Commands of the firmware's high-level commander, as bytes, and what it answers.

Port 8, channel 0 (crtp_commander_high_level.c). The firmware answers every command with its first three bytes and a
return code; cflib offers no way to see it. Needs protocol version 10 (go_to_2 and start_trajectory_2).
"""

from __future__ import annotations

import errno
import struct

from deploy.radio.requests import Request

PORT = 8
EVERYBODY = 0  # group mask: applies to every drone that hears it

REFUSED = 1  # take-off from anything but idle; landing while landing
BUSY = errno.EBUSY

_REFUSALS = {
    0: "accepted",
    REFUSED: "refused by the planner (not allowed from what the drone is doing)",
    errno.ENOEXEC: "refused: unknown command, trajectory id above 30, or a compressed trajectory stretched or reversed",
    errno.EBUSY: "refused: the supervisor forbids flight (not armed, not ready, tumbled, crashed or locked)",
}


def meaning(code: int) -> str:
    """What a return code says."""
    return _REFUSALS.get(code, f"refused with unknown code {code}")


def return_code(answer: bytes) -> int:
    """Return code in an answer; 255 in one that is too short to hold any."""
    return answer[3] if len(answer) > 3 else 0xFF


def _command(what: str, payload: bytes) -> Request:
    return Request(PORT, 0, payload, payload[:3], what)


def takeoff(height: float, duration: float) -> Request:
    """Climb straight up to an absolute height [m] in duration [s], keeping the heading."""
    return _command("take-off", struct.pack("<BBff?f", 0x07, EVERYBODY, height, 0.0, True, duration))


def land(height: float, duration: float) -> Request:
    """Descend straight down to an absolute height [m] in duration [s], keeping the heading; then the motors stop."""
    return _command("land", struct.pack("<BBff?f", 0x08, EVERYBODY, height, 0.0, True, duration))


def go_to(position: tuple[float, float, float], yaw: float, duration: float) -> Request:
    """Fly smoothly from the present setpoint to rest at an absolute position [m] and yaw [rad] in duration [s]."""
    return _command("go to", struct.pack("<BBBBfffff", 0x0C, EVERYBODY, False, False, *position, yaw, duration))


def define_trajectory(identifier: int, kind: int, offset: int, pieces: int) -> Request:
    """Declare memory contents a trajectory; kind 0: Poly4D, 1: compressed; offset in bytes."""
    return _command("define trajectory", struct.pack("<BBBBIB", 0x06, identifier, 1, kind, offset, pieces))


def start_trajectory(identifier: int) -> Request:
    """Fly a defined trajectory in world coordinates at its own speed."""
    return _command("start trajectory", struct.pack("<BBBBBBf", 0x0D, EVERYBODY, False, False, False, identifier, 1.0))


def stop() -> Request:
    """Stop the planner: the motors stop."""
    return _command("stop", struct.pack("<BB", 0x03, EVERYBODY))
