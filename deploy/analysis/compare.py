"""Flights side by side: the same figures of each, and which of them changed for the worse."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.analysis.telemetry import motor_share, tilt_angles
from deploy.analysis.timing import mean_lag

Better = Literal["less", "more", ""]
_NOTABLE = 0.1  # relative change below which two flights are alike


@dataclass(frozen=True)
class Figure:
    """One figure of every flight.

    Attributes:
        name: what it is. unit: of the values; empty for pure numbers.
        values: one a flight, NaN where not known.
        better: which direction is. least: a change smaller than this, in its unit, is none.
    """

    name: str
    unit: str
    values: tuple[float, ...]
    better: Better
    least: float

    def change(self, flight: int) -> float:
        """How much more than in the first flight, in the figure's unit."""
        return self.values[flight] - self.values[0]

    def worse(self, flight: int) -> bool:
        """Whether it changed notably for the worse since the first flight."""
        return self._notable(flight) and (self.change(flight) > 0.0) == (self.better == "less")

    def improved(self, flight: int) -> bool:
        """Whether it changed notably for the better."""
        return self._notable(flight) and not self.worse(flight)

    def _notable(self, flight: int) -> bool:
        change = abs(self.change(flight))
        beyond = change > max(self.least, _NOTABLE * abs(self.values[0]))
        return bool(self.better) and math.isfinite(change) and beyond


@dataclass(frozen=True)
class Comparison:
    """Flights, each with its label, and their figures."""

    labels: tuple[str, ...]
    flights: tuple[FlightAnalysis, ...]
    figures: tuple[Figure, ...]

    @property
    def same_bytes(self) -> bool:
        """Whether everybody was sent the same trajectories in all of them."""
        hashes = [dict(flight.flight_plan.certificate.trajectories_sha256) for flight in self.flights]
        return all(item == hashes[0] for item in hashes)

    @property
    def same_robots(self) -> bool:
        """Whether the same robots flew in all of them."""
        names = [[robot.name for robot in flight.flight_plan.mission.robots] for flight in self.flights]
        return all(item == names[0] for item in names)

    def summary(self) -> dict[str, object]:
        """For machines."""
        return {
            "flights": [
                {"log": flight.record.path, "label": label, **flight.summary()}
                for label, flight in zip(self.labels, self.flights, strict=True)
            ],
            "same_bytes": self.same_bytes,
            "figures": [
                {
                    "name": item.name,
                    "unit": item.unit,
                    "values": list(item.values),
                    "worse": [item.worse(k) for k in range(len(self.flights))],
                }
                for item in self.figures
            ],
        }


def compare(flights: Sequence[FlightAnalysis]) -> Comparison:
    """Compare flights with the first of them; at least two.

    Raises:
        ValueError: fewer than two flights.
    """
    if len(flights) < 2:
        raise ValueError(f"a comparison needs two flights; got {len(flights)}")
    figures = tuple(
        Figure(name, unit, tuple(float(measure(flight)) for flight in flights), better, least)
        for name, unit, better, least, measure in _FIGURES
    )
    known = tuple(item for item in figures if any(math.isfinite(value) for value in item.values))
    return Comparison(labels([flight.record.path for flight in flights]), tuple(flights), known)


def labels(paths: Sequence[str]) -> tuple[str, ...]:
    """The last part of the paths that tells them apart, or more of them; numbered where even all of it does not."""
    whole = [(*Path(path).parent.parts, Path(path).name.removesuffix(".part").removesuffix(".mcap")) for path in paths]
    for place in range(1, min(len(parts) for parts in whole) + 1):
        if len({parts[-place] for parts in whole}) == len(whole):
            return tuple(parts[-place] for parts in whole)
    for depth in range(1, max(len(parts) for parts in whole) + 1):
        short = ["/".join(parts[-depth:]) for parts in whole]
        if len(set(short)) == len(short):
            return tuple(short)
    return tuple(f"{parts[-1]} {number}" for number, parts in enumerate(whole, 1))


def _mean(values: Iterable[float]) -> float:
    return mean_lag(list(values))  # of those that are known


def _most(values: Iterable[float]) -> float:
    return max((value for value in values if math.isfinite(value)), default=math.nan)


def _least(values: Iterable[float]) -> float:
    return min((value for value in values if math.isfinite(value)), default=math.nan)


def _tilt(flight: FlightAnalysis) -> float:
    tilts = (tilt_angles(flight.record, robot.name)[1] for robot in flight.flight_plan.mission.robots)
    return _most(math.degrees(float(tilt.max())) for tilt in tilts if len(tilt))


def _motor(flight: FlightAnalysis) -> float:
    shares = (motor_share(flight.record, robot.name)[1] for robot in flight.flight_plan.mission.robots)
    return _most(100.0 * float(np.percentile(share.max(axis=1), 99)) for share in shares if len(share))


def _skew(flight: FlightAnalysis) -> float:
    return _most(1000.0 * (event.value or 0.0) for event in flight.record.events if event.name == "start_skew")


def _flown(field: str) -> Callable[[FlightAnalysis], float]:
    def measure(flight: FlightAnalysis) -> float:
        flown = flight.coverage.flown
        return float(getattr(flown, field)) if flown is not None else math.nan

    return measure


_FIGURES: tuple[tuple[str, str, Better, float, Callable[[FlightAnalysis], float]], ...] = (
    ("ergodicity flown", "", "less", 0.0, _flown("ergodicity")),
    ("ergodicity certified", "", "less", 0.0, lambda f: f.coverage.certified.ergodicity),
    ("share of the search flown", "%", "more", 1.0, lambda f: 100.0 * _searched(f)),
    ("worst connection probability", "", "more", 0.01, _flown("probability_worst")),
    ("tracking error, mean", "cm", "less", 0.2, lambda f: 100.0 * _mean(item.mean for item in f.tracking)),
    ("tracking error, largest", "cm", "less", 0.5, lambda f: 100.0 * _most(item.largest for item in f.tracking)),
    ("lag, mean", "ms", "less", 10.0, lambda f: abs(1000.0 * _mean(item.mean_lag for item in f.tracking))),
    ("smallest separation", "m", "more", 0.02, lambda f: f.separation.smallest if f.separation else math.nan),
    ("smallest clearance", "m", "more", 0.02, lambda f: f.separation.clearance if f.separation else math.nan),
    ("largest tilt", "°", "less", 3.0, _tilt),
    ("strongest motor, 99 %", "%", "less", 5.0, _motor),
    ("lowest voltage", "V", "more", 0.05, lambda f: _least(item.smallest for item in f.batteries)),
    ("flight time left, least", "s", "more", 20.0, lambda f: _least(item.left for item in f.batteries)),
    ("radio latency, 95 %", "ms", "less", 5.0, lambda f: _most(item.latency_p95 for item in f.links)),
    ("acknowledged, worst", "%", "more", 1.0, lambda f: _least(item.quality_smallest for item in f.links)),
    ("requests lost", "", "less", 0.5, lambda f: float(sum(item.lost for item in f.links))),
    ("poses, slowest", "Hz", "more", 2.0, lambda f: _least(item.rate for item in f.feeds)),
    ("longest gap of poses", "s", "less", 0.05, lambda f: _most(item.longest_gap for item in f.feeds)),
    ("start skew", "ms", "less", 5.0, _skew),
)


def _searched(flight: FlightAnalysis) -> float:
    window = flight.window
    return 0.0 if window is None else (window.end - window.start) / flight.flight_plan.mission.horizon.duration
