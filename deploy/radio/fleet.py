"""All drones at once: actions run in parallel, every failure is reported."""

from __future__ import annotations

import math
from collections.abc import Callable, ItemsView, Iterable, Iterator, Mapping, ValuesView
from functools import partial
from types import MappingProxyType
from typing import TypeVar

from deploy.aside import Aside
from deploy.clock import Clock
from deploy.errors import DeployError, LinkError
from deploy.radio.drone import Drone

T = TypeVar("T")


class FleetError(DeployError):
    """An action failed on some drones.

    Attributes:
        action: what was tried. errors: what happened, by drone.
    """

    def __init__(self, action: str, errors: Mapping[str, DeployError], total: int) -> None:
        self.action, self.errors = action, MappingProxyType(dict(errors))
        lines = "; ".join(str(error) for error in self.errors.values())
        super().__init__(f"{action} failed on {len(self.errors)} of {total} drones: {lines}")


class Fleet(Mapping[str, Drone]):
    """The drones of a flight, by robot name, in the mission's order; without those that were left behind."""

    def __init__(self, drones: Iterable[Drone], clock: Clock) -> None:
        self._drones = {drone.name: drone for drone in drones}
        self._clock = clock

    def leave_behind(self, name: str) -> None:
        """Go on without a drone; closing its link is up to the caller, before this."""
        del self._drones[name]

    def __getitem__(self, name: str) -> Drone:
        return self._drones[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._drones)

    def __len__(self) -> int:
        return len(self._drones)

    # As those of Mapping, which look every name up again: the flight loop asks a hundred times a second.

    def items(self) -> ItemsView[str, Drone]:
        """Names and drones."""
        return self._drones.items()

    def values(self) -> ValuesView[Drone]:
        """Drones."""
        return self._drones.values()

    def each(
        self,
        what: str,
        action: Callable[[Drone], T],
        tick: Callable[[], None],
        *,
        among: Iterable[str] | None = None,
    ) -> dict[str, T]:
        """Run an action on every drone in worker threads while the flight loop goes on.

        Args:
            what: name of the action in error messages.
            action: blocking work on one drone; must end by itself (everything in Drone has a deadline).
            tick: one turn of the caller's loop (poses keep flowing); it sleeps on the clock.
            among: names of the drones to act on; default: all.

        Returns:
            Results by drone.

        Raises:
            FleetError: with every failure, when all drones are done. Whatever else an action raised (a bug).
        """
        results, errors = self.attempt(action, tick, among=among)
        if errors:
            raise FleetError(what, errors, len(results) + len(errors))
        return results

    def attempt(
        self,
        action: Callable[[Drone], T],
        tick: Callable[[], None],
        *,
        among: Iterable[str] | None = None,
        within: float = math.inf,
    ) -> tuple[dict[str, T], dict[str, DeployError]]:
        """As :meth:`each`, for callers that can go on without some: results and failures by drone.

        On the ground the time may be limited: the links of those who are not done ``within`` so long [s] are closed,
        which ends whatever they wait for, and they have failed.
        """
        names = list(self) if among is None else list(among)
        work = {name: Aside(partial(action, self[name]), self._clock, f"{name}-worker") for name in names}
        for item in work.values():
            item.start()
        due, late = self._clock.now() + within, set[str]()
        while True:  # at least one tick: a rehearsal's clock then stands until all are done, and so repeats
            tick()
            if all(item.done for item in work.values()) and not self._clock.owes():
                break
            if self._clock.now() > due:
                for name in (name for name, item in work.items() if not item.done and name not in late):
                    late.add(name)
                    Aside(partial(self[name].close, force=True), self._clock, f"{name}-closing").start()
        results, errors = {}, {}
        for name, item in work.items():
            try:
                results[name] = item.outcome()
            except DeployError as error:
                errors[name] = error
            if name in late:
                results.pop(name, None)
                errors[name] = LinkError(f"{name}: not done within {within:.0f} s")
        return results, errors
