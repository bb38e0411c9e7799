import math

import numpy as np
import pytest

from mocap.tracking import Settings, Tracker
from tests.mocap import crossings
from tests.mocap.crossings import Camera, score

POOR = Camera(noise=0.002, missing=0.2, ghosts=2.0)
PADS = {"a": (0.0, 0.0, 0.0), "b": (1.0, 0.0, 0.0)}


def standing(tracker, frames=10, extra=(), t=0.0):
    """Show everybody on their pads; the time of the last frame."""
    for k in range(frames):
        seen = tracker.update(t + 0.01 * k, [*PADS.values(), *extra])
    return t + 0.01 * (frames - 1), seen


@pytest.mark.parametrize("make", crossings.SETS, ids=lambda make: make.__name__)
@pytest.mark.parametrize(("speed", "gap"), [(1.0, 0.3), (2.0, 0.1)])
@pytest.mark.parametrize("camera", [Camera(), POOR], ids=["good", "poor"])
def test_nobody_is_mistaken_at_a_crossing(make, speed, gap, camera):
    crossing = make(speed, gap)
    assert crossing.gap() == pytest.approx(gap, abs=0.005)
    result = score(crossing, camera, seed=1)
    assert (result.swaps, result.wrong) == (0, 0)
    assert result.located > 0.95 * (1.0 - camera.missing)
    assert result.silence < 0.25


@pytest.mark.parametrize("make", crossings.SETS, ids=lambda make: make.__name__)
@pytest.mark.parametrize("blind", [0.2, 0.4])
def test_a_blind_moment_in_the_middle_of_a_crossing_swaps_nobody(make, blind):
    result = score(make(2.0, 0.1 if blind == 0.2 else 0.3), Camera(blind=blind), seed=2)
    assert (result.swaps, result.wrong) == (0, 0)


def test_who_is_told_apart_after_a_blind_moment_is_seen_again():
    result = score(crossings.bounce(1.0, 0.3), Camera(blind=0.2), seed=3)
    assert result.silence < 0.35
    assert result.located > 0.85


def test_sets_that_only_guessing_could_solve_are_answered_with_silence():
    """Two that stop 10 cm apart and fly back, unseen for 0.4 s in between, look like two that pass."""
    result = score(crossings.bounce(1.0, 0.1), Camera(blind=0.4), seed=1)
    assert result.swaps == 0
    assert result.silence > 1.0


def test_a_reference_tells_apart_who_cannot_be_told_by_motion():
    crossing, camera = crossings.bounce(1.0, 0.3), Camera(blind=0.4)
    pads = dict(zip(crossing.names, map(tuple, crossing.positions(0.0)), strict=True))

    def located(reference):
        tracker = Tracker(pads, reference=reference)
        count = 0
        for t, points in crossings.film(crossing, camera, seed=1):
            seen, truth = (
                tracker.update(t, points).positions,
                dict(zip(crossing.names, crossing.positions(t), strict=True)),
            )
            assert all(math.dist(position, truth[name]) < 0.05 for name, position in seen.items())
            count += len(seen)
        return count

    def reference(name, t):
        return tuple(crossing.positions(t)[crossing.names.index(name)] + np.array([0.03, -0.03, 0.02]))

    assert located(reference) > 1.5 * located(None)


def test_identity_comes_from_the_pads_whatever_the_order_of_points():
    tracker = Tracker(PADS)
    _, seen = standing(tracker, extra=[(3.0, 3.0, 1.0)])
    assert seen.positions == PADS
    assert tracker.tracked == ("a", "b")
    assert seen.ghosts == 1
    reversed_ = tracker.update(0.1, [(3.0, 3.0, 1.0), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0)])
    assert reversed_.positions == PADS


def test_two_markers_on_one_pad_are_nobody():
    tracker = Tracker(PADS)
    _, seen = standing(tracker, frames=30, extra=[(0.03, 0.0, 0.0)])
    assert set(seen.positions) == {"b"}
    assert seen.ambiguous == ("a",)
    # Taking the other marker away makes it clear.
    _, seen = standing(tracker, t=0.3)
    assert seen.positions == PADS


def test_a_flickering_reflection_is_never_a_robot():
    tracker = Tracker(PADS)
    for k in range(40):
        points = [PADS["b"], (0.05, 0.0, 0.0)] if k % 8 < 4 else [PADS["b"]]
        assert "a" not in tracker.update(0.02 * k, points).positions


def test_a_marker_that_is_not_on_a_pad_is_nobody():
    tracker = Tracker({"a": (0.0, 0.0, 0.0)})
    for k in range(20):
        assert not tracker.update(0.01 * k, [(0.2, 0.0, 0.0)]).positions


def test_a_robot_that_vanished_in_flight_is_not_found_on_its_pad():
    tracker = Tracker(PADS)
    t, _ = standing(tracker)
    for k in range(200):  # a flies away at 0.75 m/s
        t += 0.01
        tracker.update(t, [(0.0, 0.0075 * k, 0.0), PADS["b"]])
    for _ in range(400):  # and is gone, while something lies on its pad
        t += 0.01
        assert set(tracker.update(t, [PADS["a"], PADS["b"]]).positions) == {"b"}


def test_a_robot_covered_on_its_pad_is_found_again():
    tracker = Tracker(PADS)
    t, _ = standing(tracker)
    for _ in range(300):
        t += 0.01
        tracker.update(t, [PADS["b"]])
    assert tracker.tracked == ("b",)
    _, seen = standing(tracker, t=t + 0.01)
    assert seen.positions == PADS


def test_old_and_broken_frames_change_nothing():
    tracker = Tracker(PADS)
    t, _ = standing(tracker)
    assert not tracker.update(t, list(PADS.values())).positions
    assert not tracker.update(t - 0.5, list(PADS.values())).positions
    seen = tracker.update(t + 0.01, [(math.nan, 0.0, 0.0), *PADS.values(), (math.inf, 0.0, 0.0)])
    assert seen.positions == PADS


def test_pads_closer_than_twice_the_radius_share_no_marker():
    tracker = Tracker({"a": (0.0, 0.0, 0.0), "b": (0.12, 0.0, 0.0)}, Settings(pad=0.15))
    for k in range(20):
        seen = tracker.update(0.01 * k, [(0.06, 0.0, 0.0)])
    assert not seen.positions


def test_nobody_flies():
    assert not Tracker({}).update(0.0, [(0.0, 0.0, 0.0)]).positions
