"""All drones at once: actions run in parallel, every failure is reported."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Iterator, Mapping
from types import MappingProxyType
from typing import Generic, TypeVar

from deploy.clock import Clock
from deploy.errors import DeployError
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


class _Work(Generic[T]):
    """One action running on one drone in a thread that holds the clock."""

    def __init__(self, drone: Drone, action: Callable[[Drone], T], clock: Clock) -> None:
        self.result: T | None = None
        self.error: DeployError | None = None
        self.crash: BaseException | None = None
        self._drone, self._action, self._clock = drone, action, clock
        self.done = False
        self._holding = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"{drone.name}-worker", daemon=True)

    def start(self) -> None:
        """Return when the thread holds the clock, so that no flight time passes before it has begun."""
        self._thread.start()
        self._holding.wait()

    def _run(self) -> None:
        with self._clock.hold():
            self._holding.set()
            try:
                self.result = self._action(self._drone)
            except DeployError as error:
                self.error = error
            except BaseException as error:  # noqa: BLE001 - raised again in the flight's own thread
                self.crash = error
            finally:
                self.done = True  # before the clock is let go


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
        self, action: Callable[[Drone], T], tick: Callable[[], None], *, among: Iterable[str] | None = None
    ) -> tuple[dict[str, T], dict[str, DeployError]]:
        """As :meth:`each`, for callers that can go on without some: results and failures by drone."""
        names = list(self) if among is None else list(among)
        work = {name: _Work(self[name], action, self._clock) for name in names}
        for item in work.values():
            item.start()
        while True:  # at least one tick: a rehearsal's clock then stands until all are done, and so repeats
            tick()
            if all(item.done for item in work.values()):
                break
        for item in work.values():
            if item.crash is not None:
                raise item.crash
        errors = {name: item.error for name, item in work.items() if item.error is not None}
        results = {name: item.result for name, item in work.items() if name not in errors}
        return results, errors  # type: ignore[return-value]
