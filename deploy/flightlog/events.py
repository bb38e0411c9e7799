"""What may be said of an event besides its name and its text."""

from __future__ import annotations

from typing import Literal, TypedDict

Level = Literal["info", "warning", "fault"]


class Details(TypedDict, total=False):
    """Fields of ``/events`` that may be left out; an event without them is news of the whole flight.

    Attributes:
        robot: whom it concerns. level: how bad it is. value: a figure, in the unit the text names.
        kind: of events of one name that mean different things.
    """

    robot: str
    level: Level
    value: float | None
    kind: str
