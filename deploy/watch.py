"""Who is there when a flight is flown: whose word ends it, and who is told how it goes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.flight.records import FlightStatus
    from deploy.operator import Operator


@dataclass(frozen=True)
class Watch:
    """Who watches a flight.

    Attributes:
        operator: who may end the flight.
        observer: told ten times a second how it goes.
        tap: is told every record of the log, as ``FlightLog.tap``.
        new_map: a map that somebody has told, as text, once; None: nothing new.
    """

    operator: Operator
    observer: Callable[[FlightStatus], None] | None = None
    tap: Callable[[int, str, bytes], None] | None = None
    new_map: Callable[[], str | None] = lambda: None
