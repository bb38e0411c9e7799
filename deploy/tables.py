"""Tables of contents of the simulated drones, known before a rehearsal begins: the first connects like the next.

Connecting takes flight time, and most of it goes into the tables unless they are cached; the same seed would be two
flights, one with an empty cache and one with a full one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from deploy.clock import SystemClock
from deploy.radio.cache import toc_cache
from deploy.radio.drone import Drone
from deploy.radio.simulated.interface import Firmware
from deploy.radio.simulated.swarm import SimulatedSwarm
from deploy.radio.simulated.toc import log_toc, param_toc


class _Nowhere:
    """A world in which nothing happens."""

    def attach(self, firmwares: Sequence[Firmware]) -> None:
        """Whose body would it be."""

    def advance(self, t: float) -> None:
        """Time does not pass."""


@contextmanager
def known_tables() -> Iterator[Path]:
    """A folder with the tables of every simulated drone; inside a ``with`` only, if none can be kept."""
    if (kept := toc_cache("simulated")) is not None:
        _fetch(kept)
        yield kept
        return
    with TemporaryDirectory() as folder:
        _fetch(Path(folder))
        yield Path(folder)


def _fetch(folder: Path) -> None:
    names = (f"{toc.crc:08X}.json" for toc in (log_toc(), param_toc()))  # as cflib's TocCache calls them
    if all((folder / name).exists() for name in names):
        return
    with SimulatedSwarm(["any"], _Nowhere(), label=f"tables-{id(folder)}") as swarm:
        drone = Drone("any", swarm.uris()["any"], SystemClock(), folder)
        drone.connect()
        drone.close(force=True)
