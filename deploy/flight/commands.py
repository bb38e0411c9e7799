"""Commands with answers: to several drones at once, repeated where that is needed and may be done."""

from __future__ import annotations

from collections.abc import Mapping

from deploy.flight.loop import RETRY, Flight
from deploy.radio import highlevel
from deploy.radio.requests import Reply, Request

BUSY_RETRY = 0.05  # s until a command refused with EBUSY is repeated; the supervisor runs at 25 Hz


def command(flight: Flight, requests: Mapping[str, Request], *, patience: float = 1.0) -> dict[str, int | None]:
    """Give one command to each of several drones, back to back, and see who accepts.

    Unanswered commands and those refused because the supervisor is busy are repeated: only for commands that may
    arrive twice.

    Args:
        flight: of these drones.
        requests: command by drone.
        patience: how long to repeat [s].

    Returns:
        Return code by drone; None from those that never answered.
    """
    replies = {name: flight.fleet[name].send(request) for name, request in requests.items()}
    codes: dict[str, int | None] = dict.fromkeys(requests)
    end = flight.clock.now() + patience
    while (waiting := [name for name, code in codes.items() if code in (None, highlevel.BUSY)]) and (
        flight.clock.now() < end - 1e-9
    ):
        flight.tick()
        for name in waiting:
            replies[name], codes[name] = _follow_up(flight, name, replies[name])
    return codes


def refusals(codes: Mapping[str, int | None]) -> str:
    """Who did not accept, as one line; empty if everybody did."""
    return "; ".join(
        f"{name}: {'no answer' if code is None else highlevel.meaning(code)}"
        for name, code in codes.items()
        if code != 0
    )


def _follow_up(flight: Flight, name: str, reply: Reply) -> tuple[Reply, int | None]:
    since = flight.clock.now() - reply.sent
    if not reply.here:
        if since >= RETRY - 1e-9:
            flight.event("repeat", f"{reply.request.what}: no answer, repeated", robot=name, level="warning")
            flight.fleet[name].resend(reply)
        return reply, None
    flight.timing.answered(name, reply)
    code = highlevel.return_code(reply.payload)
    if code == highlevel.REFUSED and reply.repeated:
        # The first copy was heard and only its answer lost: the drone is already doing it.
        return reply, 0
    if code == highlevel.BUSY and since >= BUSY_RETRY - 1e-9:
        return flight.fleet[name].send(reply.request), code
    return reply, code
