import functools

import numpy as np
import pytest

from deploy.radio.simulated.physics.sensors import SensorNoise
from tests.deploy.recorded_flight import load, replay

FLIGHTS = ("mellinger_eight", "pid_circle", "pid_waypoints")


@functools.cache
def flown(name):
    flight = load(name)
    t, path, world = replay(flight, noise=SensorNoise.none())
    return flight, t, path, world


def error_to_plan(flight, t, path, delay=0.0):
    during = (t >= flight.start) & (t <= flight.start + flight.duration)
    return np.linalg.norm(path[during] - flight.goal(t[during] + 0.005 - delay)[:, :3], axis=1)


@pytest.mark.parametrize("name", FLIGHTS)
def test_tracking_error_is_that_of_the_recorded_firmware(name):
    flight, t, path, _ = flown(name)
    recorded = flight.record["summary"]["error_to_plan"]
    error = error_to_plan(flight, t, path)
    assert error.mean() == pytest.approx(recorded["mean"], rel=0.3)
    assert error.max() == pytest.approx(recorded["max"], rel=0.4)


@pytest.mark.parametrize("name", FLIGHTS)
def test_lag_is_that_of_the_recorded_firmware(name):
    flight, t, path, _ = flown(name)
    delays = np.arange(0.0, 0.8, 0.02)
    best = delays[np.argmin([error_to_plan(flight, t, path, delay).mean() for delay in delays])]
    assert best == pytest.approx(flight.record["summary"]["best_delay"]["delay_s"], abs=0.025)


@pytest.mark.parametrize("name", FLIGHTS)
def test_true_path_follows_the_recorded_one_from_ground_to_ground(name):
    flight, t, path, _ = flown(name)
    times, truth = flight.truth
    at = np.stack([np.interp(times, t, path[:, axis]) for axis in range(3)], axis=1)
    apart = np.linalg.norm(at - truth, axis=1)
    assert apart.mean() < 0.008
    assert apart.max() < 0.04


def test_mellinger_hovers_below_its_setpoint_because_of_its_mass_thrust():
    flight, t, path, _ = flown("mellinger_eight")
    before = path[np.searchsorted(t, flight.start)]
    sag = np.linalg.norm(before - flight.goal(np.array([flight.start]))[0, :3])
    assert sag == pytest.approx(flight.record["summary"]["hover_error_before_start"], abs=0.002)


def test_lands_where_the_recorded_drone_landed():
    for name in FLIGHTS:
        flight, _, path, world = flown(name)
        assert np.linalg.norm(path[-1] - flight.record["summary"]["final_position"]) < 0.02
        assert path[-1, 2] == 0.0
        assert not world.motors.any()
