"""What a flight writes for those who watch: the scene, where everybody is in it, and how much of the map is covered."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np

from deploy.flight.poses import Located
from deploy.flightlog.scene import drones_scene, links_scene, map_grid, mission_scene, transforms
from deploy.flightlog.writer import FlightLog
from missions.arrays import Array
from planner.flightplan import FlightPlan
from planner.indicators import ergodic_metric
from planner.trajectory.piecewise import PiecewisePolynomial

PATH_RATE = 5.0  # Hz of a path's points
_PLACES = 3  # as many as tell an acceleration


class Picture:
    """Draws one flight into its log.

    Args:
        log: where it is written.
        plan: what is flown. references: certified trajectories, by robot.
        now: flight time [s].

    Attributes:
        ergodicity: E of everything flown since the search began; NaN before.
    """

    def __init__(
        self, log: FlightLog, plan: FlightPlan, references: Mapping[str, PiecewisePolynomial], now: float
    ) -> None:
        mission = plan.mission
        self.ergodicity = math.nan
        self._log, self._reach = log, mission.connectivity.range
        self._names = tuple(references)
        self._certified, self._dimension = plan.certificate.indicators.ergodicity, mission.dimension
        self._metric = ergodic_metric(mission)
        self._seen, self._statistics = 0, np.zeros_like(self._metric.phi_k)
        self._places: deque[tuple[float, Array]] = deque(maxlen=_PLACES)
        self._step = mission.horizon.dt
        log.picture("/map", now, lambda time: map_grid(mission, time))
        paths = {
            name: reference.evaluate(np.arange(0.0, reference.duration + 0.5 / PATH_RATE, 1.0 / PATH_RATE))[:, :3]
            for name, reference in references.items()
        }
        log.picture("/scene/mission", now, lambda time: mission_scene(mission, paths, time))
        log.picture("/scene/drones", now, lambda time: drones_scene(self._names, time))

    def after(self, plan: FlightPlan, references: Mapping[str, PiecewisePolynomial], now: float) -> Picture:
        """The picture from when another plan is flown: its map and its paths, and what has been covered so far."""
        other = Picture(self._log, plan, references, now)
        other._seen, other._statistics = self._seen, self._statistics
        return other

    def show(self, now: float, located: Mapping[str, Located]) -> None:
        """Write where everybody is, and who is within range of whom; ten times a second."""
        places = {name: (seen.pose.position, seen.pose.quaternion) for name, seen in located.items()}
        self._log.picture("/tf", now, lambda time: transforms(places, time))
        reach = self._reach
        if reach is not None:
            self._log.picture("/scene/links", now, lambda time: links_scene(places, reach, time))

    def cover(self, now: float, located: Mapping[str, Located]) -> None:
        """Count where everybody is, during the search; nothing is counted while somebody is not seen.

        Everybody's place is counted when the next one is known, for what a camera fixed to the body sees follows from
        both and from the one before.
        """
        if any(name not in located for name in self._names):
            self._places.clear()
            return
        self._places.append((now, np.array([located[name].pose.position[: self._dimension] for name in self._names])))
        if len(self._places) < _PLACES:
            return
        self._seen += 1
        self._statistics += (self._seen_in_the_middle() - self._statistics) / self._seen
        off = self._statistics - self._metric.phi_k
        self.ergodicity = float(np.sum(self._metric.basis.Lambda_k * off * off))
        self._log.write("/ergodicity", now, {"value": self.ergodicity, "certified": self._certified})

    def _seen_in_the_middle(self) -> Array:
        """Statistics of the second of three places, with the acceleration that leads through all of them.

        The metric takes accelerations from places a planning step apart: neighbours are moved so that it finds them.
        """
        (begin, before), (_, here), (end, after) = self._places
        nearer = (2.0 * self._step / (end - begin)) ** 2
        q = np.stack([here + nearer * (before - here), here, here + nearer * (after - here)])
        seen: Array = self._metric.statistics_each(q)[1]
        return seen
