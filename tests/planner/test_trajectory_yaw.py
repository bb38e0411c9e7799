"""Where robots look: what is wanted where it means something, smooth and slow enough everywhere."""

import dataclasses
import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.schema import FacingYaw, FixedYaw, PathYaw, TrajectorySettings
from planner.trajectory.encode import decode, encode
from planner.trajectory.fit import fit
from planner.trajectory.motion import plan_motion
from planner.trajectory.yaw import SLOW, WINDOW, heading
from tests.planner.random_plans import dense, mission_of, plan_of, sides_of_joints

RATE = 1.0


def circle(t, derivative=0):
    """Radius 2 m, once in 20 s."""
    phase = 2 * np.pi * t / 20 + derivative * np.pi / 2
    return 2 * (2 * np.pi / 20) ** derivative * np.stack([np.cos(phase), np.sin(phase)], axis=1)


def there_and_back(t, derivative=0):
    """Along x and back: at the turning point the direction jumps by half a turn."""
    phase = np.pi * t / 20
    x = np.sin(phase) if derivative == 0 else np.pi / 20 * np.cos(phase)
    return 2 * np.stack([x, 0.0 * t], axis=1)


def turned(a, b):
    """Distance of angles, whole turns aside."""
    return np.abs(np.angle(np.exp(1j * (a - b))))


def test_along_a_circle_the_heading_is_the_tangent_and_goes_round():
    wanted = heading(circle, 20.0, PathYaw(), RATE)
    t = np.linspace(2.0, 18.0, 50)
    assert turned(wanted(t)[:, 0], np.pi / 2 + 2 * np.pi * t / 20).max() < 0.02
    assert wanted(np.array([18.0]))[0, 0] - wanted(np.array([2.0]))[0, 0] == pytest.approx(0.8 * 2 * np.pi, abs=0.02)


def test_from_inside_a_circle_robots_face_its_centre():
    wanted = heading(circle, 20.0, FacingYaw((0.0, 0.0)), RATE)
    t = np.linspace(2.0, 18.0, 50)
    assert turned(wanted(t)[:, 0], np.pi + 2 * np.pi * t / 20).max() < 0.02


def test_half_turns_begin_in_time_and_take_as_long_as_they_need():
    wanted = heading(there_and_back, 20.0, PathYaw(), RATE)
    t = np.linspace(0.0, 20.0, 2001)
    assert np.abs(wanted(t, 1)).max() <= RATE
    assert turned(wanted(np.array([2.0, 18.0]))[:, 0], np.array([0.0, np.pi])).max() < 0.05
    quarter = t[np.argmin(turned(wanted(t)[:, 0], np.sign(wanted(t)[-1, 0]) * np.pi / 2))]
    assert quarter == pytest.approx(10.0, abs=0.3)


@given(st.integers(0, 10_000), st.floats(0.2, 3.0), st.booleans())
@settings(max_examples=20, deadline=None)
def test_headings_can_be_flown(seed, rate, facing):
    plan = plan_of(seed, steps=150)
    way = functools.partial(plan_motion, plan, 0)
    wanted = heading(way, 15.0, FacingYaw((0.3, 0.1)) if facing else PathYaw(), rate)
    t = np.linspace(0.0, 15.0, 3001)
    assert np.abs(wanted(t, 1)).max() <= rate
    np.testing.assert_array_equal(wanted(np.array([0.0, 15.0]), 1), 0.0)
    np.testing.assert_allclose(np.diff(wanted(t)[:, 0]), wanted(t, 1)[1:, 0] * 0.005, atol=rate * 0.005)
    assert np.abs(wanted(t, 2)).max() <= 6 * rate / WINDOW


@pytest.mark.parametrize("wanted", [FixedYaw(1.2), PathYaw(), FacingYaw((0.0, 0.0))], ids=["fixed", "path", "facing"])
@pytest.mark.parametrize("encoding", ["poly4d", "compressed"])
def test_laws_of_a_fitted_heading(wanted, encoding):
    plan = plan_of(6, steps=200, cap=0.3, band=0.25)
    trajectory_settings = TrajectorySettings(yaw=wanted, yaw_rate=0.8, encoding=encoding)
    (trajectory,) = fit(plan, dataclasses.replace(mission_of(plan), trajectory=trajectory_settings))
    flown = decode(encode(trajectory, trajectory_settings))
    t = dense(flown)
    assert np.abs(flown.evaluate(t, 1)[:, 3]).max() <= 0.8
    if encoding == "poly4d":
        for order in range(4):
            before, after = sides_of_joints(trajectory, order)
            np.testing.assert_allclose(before[:, 3], after[:, 3], atol=1e-9 * 20.0**order)
        np.testing.assert_allclose(trajectory.evaluate(np.array([0.0, 20.0]), 1)[:, 3], 0.0, atol=1e-9)
    velocity, position = flown.evaluate(t, 1)[:, :2], flown.evaluate(t)[:, :2]
    arrow = velocity if isinstance(wanted, PathYaw) else -position
    means = np.linalg.norm(arrow, axis=1) > 5 * SLOW
    expected = 1.2 if isinstance(wanted, FixedYaw) else np.arctan2(arrow[:, 1], arrow[:, 0])
    assert np.median(turned(flown.evaluate(t)[:, 3], expected)[means]) < 0.15
