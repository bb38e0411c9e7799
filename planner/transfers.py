"""How everybody gets from the pads to the search and back, as data: what is certified, uploaded to nobody, and flown.

A flight is five passages, one after another: up from the pads, over to the starts, the search, over to where everybody
lands, down. All but the search are moves of the firmware's high-level commander: rest to rest, straight, along
35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷ (planner.c, ``plan_go_to``; protocol notes B1).
"""

from __future__ import annotations

import dataclasses
import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from missions.mappings import FrozenMapping

Vec3 = tuple[float, float, float]


@dataclass(frozen=True)
class Move:
    """One straight move from wherever the robot hovers.

    Attributes:
        target: where it ends [m].
        begin: when it begins [s] after the passage has begun.
        duration: how long it takes [s].
    """

    target: Vec3
    begin: float
    duration: float

    def __post_init__(self) -> None:
        if not all(math.isfinite(value) for value in (*self.target, self.begin, self.duration)):
            raise ValueError(f"a move has finite numbers; got {self}")
        if self.begin < 0.0 or self.duration <= 0.0:
            raise ValueError(f"a move begins at 0 s or later and takes time; got {self}")

    @property
    def end(self) -> float:
        """When it ends [s] after the passage has begun."""
        return self.begin + self.duration


Passage = Mapping[str, tuple[Move, ...]]  # by robot, in order of time; a robot without moves hovers


@dataclass(frozen=True)
class Transfers:
    """All moves of a flight, by robot.

    Attributes:
        take_off: straight up from the pads, everybody together.
        approach: to the first points of the trajectories.
        back: from the last points of the trajectories to above where everybody lands.
        landing: straight down, everybody together.
    """

    take_off: Passage
    approach: Passage
    back: Passage
    landing: Passage

    def __post_init__(self) -> None:
        for item in dataclasses.fields(self):
            object.__setattr__(self, item.name, FrozenMapping(getattr(self, item.name)))

    @property
    def sha256(self) -> str:
        """Hash over every number in it."""
        return hashlib.sha256(json.dumps(self.record(), sort_keys=True).encode()).hexdigest()

    def record(self) -> dict[str, dict[str, list[dict[str, Any]]]]:
        """As plain data, for a file."""
        return {
            item.name: {
                robot: [dataclasses.asdict(move) | {"target": list(move.target)} for move in moves]
                for robot, moves in getattr(self, item.name).items()
            }
            for item in dataclasses.fields(self)
        }

    @classmethod
    def of_record(cls, record: Mapping[str, Any]) -> Transfers:
        """What :meth:`record` made.

        Raises:
            ValueError, TypeError, KeyError: something else.
        """
        return cls(**{item.name: _passage(record[item.name]) for item in dataclasses.fields(cls)})


def duration(passage: Passage) -> float:
    """How long a passage takes [s]."""
    return max((move.end for moves in passage.values() for move in moves), default=0.0)


def _passage(record: Mapping[str, Any]) -> Passage:
    return {robot: tuple(_move(**move) for move in moves) for robot, moves in record.items()}


def _move(*, target: Any, begin: Any, duration: Any) -> Move:  # noqa: ANN401 - from a file
    x, y, z = (float(value) for value in target)
    return Move((x, y, z), float(begin), float(duration))
