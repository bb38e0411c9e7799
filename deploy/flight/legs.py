"""Legs of everybody in flight: uploaded while others fly, started on time, a packet at a time and never waiting.

Whatever does not go as planned ends the mission while everybody still flies or hovers at the end of a leg: a leg that
is not ready ``READY_BEFORE`` its start, a start that is refused or not heard, a drone that holds although its start was
accepted. Legs that are planned anew are offered to everybody, and taken over by everybody or by nobody.
"""

from __future__ import annotations

from collections.abc import Mapping

from deploy.errors import DeployError, FlightAborted
from deploy.flight.chain import Chain, Offer
from deploy.flight.loop import Flight
from missions.radio import request_rate
from planner.trajectory.encoded import EncodedTrajectory


class Chains:
    """The legs of everybody who has more than one. Made when all trajectories have been started."""

    def __init__(self, flight: Flight) -> None:
        mission, self._flight = flight.plan.mission, flight
        rates = request_rate(mission)
        self._chains = {
            robot.name: Chain(
                flight.fleet[robot.name],
                flight.plan.trajectories[robot.name],
                flight.courses.timelines[robot.name],
                flight.courses.search.start,
                mission,
                rate,
            )
            for robot, rate in zip(mission.robots, rates, strict=True)
            if flight.courses.timelines[robot.name].legs > 1
        }
        for name, chain in self._chains.items():
            self._tell(name, 0, chain.timeline.latest - chain.due(0))

    def turn(self) -> None:
        """Do what is due for everybody; call it after every tick.

        Raises:
            FlightAborted: the mission cannot go on, with all reasons.
        """
        now, reasons = self._flight.clock.now(), []
        for name, chain in self._chains.items():
            if not chain.drone.connected:
                continue  # the watch knows what to do about that
            ready = chain.ready
            try:
                late = chain.turn(now)
            except DeployError as error:
                reasons.append(str(error))
                continue
            if chain.ready > ready:
                ahead = chain.due(ready) - now
                text = f"leg {ready + 1} of {len(chain.legs)} read back equal, {ahead:.1f} s before its start"
                self._flight.event("leg_upload", text, robot=name, value=ahead)
            if late is not None:
                self._tell(name, chain.flying, late)
        if reasons:
            for chain in self._chains.values():
                chain.end()
            raise FlightAborted("; ".join(reasons))

    # ------------------------------------------------------------------------------------------------ planned anew

    def due(self, number: int) -> float:
        """When a leg of everybody should begin [s, flight clock]."""
        return max(chain.due(number) for chain in self._chains.values())

    def offer(self, trajectories: Mapping[str, EncodedTrajectory], number: int) -> None:
        """Have everybody upload a leg that may take the place of leg ``number``, as soon as that is the next one."""
        now = self._flight.clock.now()
        for name, chain in self._chains.items():
            chain.offer = Offer(number, trajectories[name].legs[number], now)

    def unready(self) -> dict[str, str]:
        """Who has not got what was offered, and why."""
        return {
            name: chain.offer.failure if chain.offer is not None and chain.offer.failure else "not uploaded yet"
            for name, chain in self._chains.items()
            if chain.offer is None or not chain.offer.ready or not chain.drone.connected
        }

    def take_over(self, trajectories: Mapping[str, EncodedTrajectory]) -> None:
        """From the next leg on, everybody flies these."""
        for name, chain in self._chains.items():
            chain.take_over(trajectories[name])

    def withdraw(self) -> None:
        """Nobody is offered anything any more."""
        for chain in self._chains.values():
            chain.withdraw()

    def _tell(self, name: str, number: int, late: float) -> None:
        flight, chain = self._flight, self._chains[name]
        word = f"{abs(late) * 1000:.1f} ms {'late' if late >= 0.0 else 'early'}"
        off = abs(late) > flight.plan.mission.radio.jitter
        text = f"leg {number + 1} of {len(chain.legs)} began {word}" + (", more than the certificate counts on" * off)
        flight.journal.event(
            chain.timeline.latest,
            flight.phases.now,
            "leg_start",
            text,
            robot=name,
            level="warning" if off else "info",
            value=late,
        )
