"""All dongles and links of a simulated swarm."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from deploy.radio.simulated.air.dongle import Dongle
from deploy.radio.simulated.air.line import Line, Receiver
from deploy.radio.simulated.air.model import AirModel, Station
from deploy.radio.simulated.air.packets import Debt


class Air:
    """The radio of a swarm, in the caller's time.

    Args:
        model: its figures.
        stations: how drones are reached, by name; who is not in it is on dongle 0.
        seed: of the losses; every drone has its own.
        held: whether time stands still for somebody's work; see :class:`Line`.
    """

    def __init__(
        self,
        model: AirModel,
        stations: Mapping[str, Station],
        *,
        seed: int = 0,
        held: Callable[[], bool] = lambda: False,
    ) -> None:
        self._model, self._stations, self._seed, self._held = model, dict(stations), seed, held
        self._lines: dict[str, Line] = {}
        self._dongles: tuple[Dongle, ...] = ()

    def attach(self, drones: Mapping[str, Receiver]) -> None:
        """Who is on the air."""
        self._lines = {
            name: Line(drone, self._model, self._stations.get(name, Station()), f"{self._seed}/{name}", self._held)
            for name, drone in drones.items()
        }
        self._dongles = tuple(Dongle(self._model, lines) for lines in self.shared().values())

    @property
    def lines(self) -> Mapping[str, Line]:
        """The links by drone."""
        return MappingProxyType(self._lines)

    def shared(self) -> dict[str, list[Line]]:
        """The links by dongle."""
        found: dict[str, list[Line]] = {}
        for line in self._lines.values():
            found.setdefault(line.station.dongle, []).append(line)
        return found

    def advance(self, t: float) -> None:
        """Let everything happen that happens before ``t`` [s]."""
        for dongle in self._dongles:
            dongle.advance(t)

    def hand_out(self, t: float) -> None:
        """Give the clients what has arrived by ``t`` [s]; last, for it wakes their threads."""
        for line in self._lines.values():
            if line.falling:
                line.hand_out(t)

    def owed(self) -> float:
        """Time that packets took while time stood still, since the last call [s]; nobody may hold it now.

        Drones of a dongle talk at the same time, each waiting for its answers, as far as the dongle gets round.
        """
        owed = 0.0
        for lines in self.shared().values():
            own = max(line.debt.line for line in lines)
            owed = max(owed, own, sum(line.debt.dongle for line in lines))
            for line in lines:
                line.debt = Debt()
        return owed

    def rssi(self, name: str) -> float:
        """Signal strength of a drone's link [-dBm]: a made-up figure that follows its losses."""
        line = self._lines[name]
        return self._model.rssi + 50.0 * max(0.0, line.fading.mean_loss - self._model.loss)
