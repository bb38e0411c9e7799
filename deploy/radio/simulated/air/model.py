"""The figures of a simulated radio, and who shares a dongle."""

from __future__ import annotations

from dataclasses import dataclass
from urllib.parse import parse_qs

from missions.radio import dongle_of
from missions.schema import Mission


@dataclass(frozen=True)
class AirModel:
    """A radio; the defaults are a good one in a laboratory.

    Attributes:
        packet_rate: exchanges a second of one dongle with all its drones together.
        retune: what it takes to go to a drone on another channel or data rate [s] (a USB control transfer).
        retry: what one hardware retry takes [s] (nRF24: 250 µs of patience and the packet again).
        retries: of one exchange, by the dongle itself (cflib sets ARC 3).
        loss: probability that an attempt is not acknowledged.
        uplink, downlink: from the end of an exchange until the drone or the client has what it carried [s].
        rssi: signal strength while nothing is lost [-dBm].
    """

    packet_rate: float = 500.0
    retune: float = 0.001
    retry: float = 0.0005
    retries: int = 3
    loss: float = 0.01
    uplink: float = 0.003
    downlink: float = 0.001
    rssi: float = 40.0

    @classmethod
    def of(cls, mission: Mission) -> AirModel:
        """As the mission's ``radio`` says: its latency is that of a command, one exchange included."""
        radio = mission.radio
        exchange = 1.0 / radio.packet_rate
        return cls(packet_rate=radio.packet_rate, uplink=max(0.0, radio.latency - exchange))


@dataclass(frozen=True)
class Station:
    """How a drone is reached.

    Attributes:
        dongle: a name that drones on the same dongle share.
        tuning: channel and data rate; another one has to be tuned to.
        rate_limit: exchanges a second its URI allows (``?rate_limit=N``); None: as many as there are.
    """

    dongle: str = "0"
    tuning: str = ""
    rate_limit: float | None = None


def stations(mission: Mission) -> dict[str, Station]:
    """Station by robot: as the URIs say; who has none fills dongles from 0 on, ``radio.drones_per_dongle`` on each."""
    found, without = {}, 0
    for robot in mission.robots:
        if robot.uri.startswith("radio://"):
            path, _, query = robot.uri.removeprefix("radio://").partition("?")
            tuning = "/".join(path.split("/")[1:3])
            found[robot.name] = Station(dongle_of(robot), tuning, rate_limit_of(query))
        elif robot.uri:
            found[robot.name] = Station(robot.uri)  # a cable or a socket is nobody else's
        else:
            found[robot.name] = Station(str(without // (mission.radio.drones_per_dongle or len(mission.robots))))
            without += 1
    return found


def rate_limit_of(query: str) -> float | None:
    """The ``rate_limit`` of a URI's query, as cflib reads it; None if there is none that makes sense."""
    words = parse_qs(query).get("rate_limit", ("",))
    return float(words[0]) if words[0].isdigit() and int(words[0]) > 0 else None
