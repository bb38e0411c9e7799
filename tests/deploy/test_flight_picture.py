"""Ergodicity while a flight goes on: what is seen follows from how everybody moves, not only from where he is."""

import dataclasses

import numpy as np
import pytest

from deploy.flight.picture import Picture
from deploy.flight.poses import Located
from deploy.flightlog.writer import FlightLog
from missions.footprint import ConeFootprint
from mocap.source import Pose
from planner.footprint.mission import footprint_of
from planner.indicators import ergodic_metric
from planner.trajectory.encode import decode
from tests.deploy.flight_bench import small_mission, small_plan

PERIOD = 0.2  # [s], of the flight loop


@pytest.mark.parametrize("tilts", [True, False])
def test_what_a_tilted_camera_sees_counts_tilted(tmp_path, tilts):
    mission = dataclasses.replace(small_mission(), footprint=ConeFootprint(0.5, tilts=tilts))
    plan = small_plan(mission)
    t = PERIOD * np.arange(40)
    swing = np.stack([1.2 + 0.5 * np.cos(1.8 * t), 1.0 + 0.4 * np.sin(2.0 * t), 0.6 + 0.0 * t], axis=-1)
    q = np.stack([swing, swing + np.array([0.3, 0.0, 0.0])], axis=1)  # (T, N, 3), accelerations up to 1.6 m/s²
    with FlightLog(tmp_path / "f.mcap", 0.0, {}, {}) as log:
        references = {name: decode(item) for name, item in plan.trajectories.items()}
        picture = Picture(log, plan, references, 0.0)
        for now, places in zip(t, q, strict=True):
            seen = (Located(now, Pose(tuple(place), None)) for place in places)
            picture.cover(now, dict(zip(references, seen, strict=True)))
    metric = ergodic_metric(mission)
    at_this_rate = tuple(footprint_of(footprint, PERIOD) for footprint in mission.footprints)
    truth = dataclasses.replace(metric, footprints=at_this_rate, altitude=None).statistics_each(q)[1:-1].mean(axis=0)
    off = truth - metric.phi_k
    assert picture.ergodicity == pytest.approx(np.sum(metric.basis.Lambda_k * off**2), rel=0.01)


def test_nothing_is_counted_across_a_gap(tmp_path):
    plan = small_plan()
    with FlightLog(tmp_path / "f.mcap", 0.0, {}, {}) as log:
        references = {name: decode(item) for name, item in plan.trajectories.items()}
        picture = Picture(log, plan, references, 0.0)
        everybody = {name: Located(0.0, Pose((1.0, 1.0, 0.5), None)) for name in references}
        for now, seen in enumerate((everybody, everybody, {}, everybody, everybody)):
            picture.cover(PERIOD * now, seen)
        assert np.isnan(picture.ergodicity)
        picture.cover(1.0, everybody)
        assert np.isfinite(picture.ergodicity)
