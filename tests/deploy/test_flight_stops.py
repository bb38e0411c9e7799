"""Everybody stops, waits and lands without coming near anybody; pure judgements, no drones."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.flight.landing import landing_waves, may_fall, with_those_below
from deploy.flight.reference import Way
from deploy.flight.stops import Moving, Space, braking, stop
from deploy.radio.simulated.high_level.evaluation import Evaluation
from deploy.radio.simulated.high_level.trajectory import PlannedPiece

SEPARATION = 0.3
HARD = 0.6 * SEPARATION
SCALE = np.array([1.0, 1.0, 0.5])  # 0.6 m one above the other
STEP = 1e-3


def space(top=2.0, low=0.25):
    return Space(SEPARATION, SCALE, (-9.0, -9.0, low), (9.0, 9.0, top))


def dance(seed, n):
    """A swarm on its certified way: a formation that turns and drifts while everybody wiggles, 0.3 m apart."""
    rng = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(n))
    base = np.array([[i % side - side / 2, i // side - side / 2] for i in range(n)]) * 0.45
    turn, phase, drift = rng.uniform(-1.0, 1.0) / (0.45 * side), rng.uniform(0.0, 6.0), rng.uniform(0.1, 0.6)
    wiggle, rate, shift = (rng.uniform(low, high, (n, 2)) for low, high in ((0.0, 0.04), (1.0, 3.0), (0.0, 6.0)))

    def place(i, t):
        angle = phase + turn * math.sin(t)
        x, y = base[i]
        u, v = wiggle[i] * np.sin(rate[i] * t + shift[i])
        c, s = math.cos(angle), math.sin(angle)
        return (c * x - s * y + u + drift * math.sin(t), s * x + c * y + v, 1.0)

    return place


def moving(place, i, t, told=True):
    before, now, after = (np.array(place(i, t + k * STEP)) for k in (-1, 0, 1))
    velocity, acceleration = (after - before) / (2 * STEP), (after - 2 * now + before) / STEP**2
    return Moving(tuple(now), tuple(velocity), tuple(acceleration), lambda s: place(i, t + s), told)


def flown(drones, stops, t):
    """(N, K, 3) what everybody flies."""
    ways = []
    for name, d in drones.items():
        if d.told:
            ways.append(braking(d.position, d.velocity, d.acceleration, stops.targets[name], stops.durations[name], t))
        else:
            ways.append(np.array([d.later(s) for s in t]))
    return np.array(ways)


def least(ways, scale=SCALE):
    pairs = [(i, j) for i in range(len(ways)) for j in range(i)]
    return min((np.linalg.norm((ways[i] - ways[j]) * scale, axis=1).min() for i, j in pairs), default=math.inf)


def test_braking_is_what_the_firmware_flies():
    begin = np.array([[1.0, 2.0, 0.7, 0.3], [0.4, -0.6, 0.1, 0.0], [0.5, 0.2, -0.3, 0.0]], np.float32)
    end = np.array([[1.3, 1.7, 0.9, 0.3], [0.0] * 4, [0.0] * 4], np.float32)
    piece = PlannedPiece(np.float32(0.0), np.float32(0.8), begin, end)
    t = np.linspace(0.0, 0.8, 9)
    ours = braking(*(tuple(row[:3].tolist()) for row in begin), tuple(end[0, :3].tolist()), 0.8, t)
    theirs = [Evaluation.of(piece.evaluate_all(np.array([at], np.float32))).position for at in t]
    assert ours == pytest.approx(np.array(theirs), abs=1e-5)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.integers(2, 9), st.floats(0.0, 6.0))
def test_those_who_stop_together_stay_as_far_apart_as_they_were_certified(seed, n, t0):
    place = dance(seed, n)
    drones = {str(i): moving(place, i, t0) for i in range(n)}
    stops = stop(drones, space(), after=2.0)
    t = np.arange(0.0, max(stops.durations.values()) + 0.01, 0.01)
    assert least(flown(drones, stops, t)) >= SEPARATION - 0.02
    assert stops.moved == {}
    assert set(stops.targets) == set(drones)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 10**6),
    st.integers(2, 9),
    st.floats(0.0, 6.0),
    st.sets(st.integers(0, 8), max_size=3),
    st.floats(1.0, 2.0),
)
def test_whatever_is_found_at_once_nobody_comes_near_anybody_on_the_way_to_the_ground(seed, n, t0, lost, top):
    """Some fly on, everybody else stops, waits for his turn and lands: hard separation throughout, downwash counted."""
    place = dance(seed, n)
    drones = {str(i): moving(place, i, t0, told=i not in lost) for i in range(n)}
    stops = stop(drones, space(top), after=2.5)
    assert stop(drones, space(top), after=2.5) == stops
    t = np.arange(0.0, max(stops.durations.values(), default=0.0) + 2.5, 0.02)
    ways = flown(drones, stops, t)
    assert least(ways) >= HARD
    hovering = dict(stops.targets)
    while hovering:
        wave = landing_waves(hovering, SEPARATION)[0]
        s = np.linspace(0.0, 1.0, 50)[:, None]
        ways = [
            np.array(p) * [1.0, 1.0, 0.0] + (1.0 - s) * [0.0, 0.0, p[2]] if name in wave else np.repeat([p], 50, axis=0)
            for name, p in hovering.items()
        ]
        assert least(np.array(ways)) >= HARD
        hovering = {name: p for name, p in hovering.items() if name not in wave}


def test_who_is_in_the_way_of_one_who_cannot_be_told_waits_at_another_height():
    still = Moving((0.0, 0.0, 1.0), (0.0,) * 3, (0.0,) * 3, lambda t: (0.0, 0.0, 1.0))
    passing = Moving((-1.0, 0.0, 1.0), (0.5, 0.0, 0.0), (0.0,) * 3, lambda t: (-1.0 + 0.5 * t, 0.0, 1.0), told=False)
    stops = stop({"a": still, "b": passing}, space(), after=3.0)
    assert stops.targets == {"a": (0.0, 0.0, 1.6)}
    assert stops.moved == {"a": pytest.approx(0.6)}
    assert stops.apart >= SEPARATION - 1e-2
    low = stop({"a": still, "b": passing}, space(top=1.1, low=0.9), after=3.0)
    assert low.targets["a"][2] == 1.0  # no room above or below: aside
    assert low.apart >= SEPARATION - 1e-2
    blocked = stop({"a": still, "b": passing}, space(), after=3.0, clear=lambda name, place: place[2] < 1.0)
    assert blocked.targets["a"][2] < 1.0


def test_a_climb_that_is_called_off_ends_no_higher_than_it_was_certified():
    way = Way((0.0, 0.0, 0.0), (0.0, 0.0, 1.1), 0.0, 1.6)
    for t0 in np.arange(0.1, 1.6, 0.1):
        drone = moving(lambda i, t: way.position(t), 0, t0)
        stops = stop({"a": dataclasses.replace(drone, left=1.6 - t0)}, space(), after=1.0)
        t = np.arange(0.0, 3.0, 0.01)
        assert flown({"a": drone}, stops, t)[0, :, 2].max() <= 1.1 + 0.02


def test_nobody_is_told_to_stop_outside():
    out = Moving((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0,) * 3, lambda t: (t, 0.0, 1.0))
    assert stop({"a": out}, Space(0.3, SCALE, (-1.0, -1.0, 0.25), (0.2, 1.0, 2.0)), after=1.0).targets["a"][0] == 0.2
    assert stop({}, space(), after=1.0).targets == {}


def test_the_lower_of_two_lands_first():
    hovering = {"top": (0.0, 0.0, 1.8), "far": (2.0, 0.0, 1.0), "low": (0.1, 0.0, 0.6), "mid": (0.2, 0.0, 1.2)}
    assert landing_waves(hovering, SEPARATION) == (("far", "low"), ("mid",), ("top",))
    assert with_those_below(["mid"], hovering, SEPARATION) == ("low", "mid")
    assert with_those_below(["far", "gone"], hovering, SEPARATION) == ("far",)
    assert landing_waves({}, SEPARATION) == ()


def test_motors_stop_only_where_nobody_is_below():
    below = {"a": (0.0, 0.0, 1.0), "b": (0.2, 0.0, 0.4)}
    assert not may_fall("a", below, (0.0, 0.0, 0.0), SEPARATION)
    assert may_fall("b", below, (0.0, 0.0, 0.0), SEPARATION)
    ahead = {"a": (0.0, 0.0, 1.0), "b": (0.5, 0.0, 0.1)}  # 0.43 s of fall
    assert may_fall("a", ahead, (0.0, 0.0, 0.0), SEPARATION)
    assert not may_fall("a", ahead, (1.0, 0.0, 0.0), SEPARATION)
    assert may_fall("a", ahead, (-1.0, 0.0, 0.0), SEPARATION)
