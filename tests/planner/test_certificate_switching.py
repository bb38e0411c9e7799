"""What a start command that comes too early or too late can do, and whether legs are there in time."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.radio import Radio
from missions.schema import Basis, Horizon, Limits, Robot, TrajectorySettings, UniformMap, Workspace
from planner.certificate.certify import certify
from planner.certificate.places import with_downwash
from planner.certificate.separation import closest_approaches
from planner.certificate.switching import allowed_speed, switches, switching_checks
from planner.trajectory.encode import decode, decode_leg, encode
from planner.trajectory.legs import switch_times
from tests.deploy.flight_bench import small_mission
from tests.planner.long_curves import smooth
from tests.tampering import altered

POLY4D = TrajectorySettings(encoding="poly4d")
LENGTH = 70  # pieces


def mission(**radio):
    """Two robots with room, for as long as the curves last."""
    return dataclasses.replace(
        small_mission(),
        workspace=Workspace((-9.0, -9.0, 0.0), (9.0, 9.0, 9.0)),
        robots=(Robot("a", (0.0, 0.0, 4.0)), Robot("b", (2.5, 0.0, 4.0))),
        limits=Limits(acceleration=9.0, speed=2.0, separation=0.3),
        horizon=Horizon(100.0, 0.5),
        information=UniformMap(),
        basis=Basis(4),
        radio=Radio(**radio),
    )


def chains(seed=0):
    a, b = smooth(LENGTH, seed, origin=(0.0, 0.0, 4.0)), smooth(LENGTH, seed + 100, origin=(2.5, 0.0, 4.0))
    return {"a": encode(a, POLY4D), "b": encode(b, POLY4D)}


def apart(asked, flown):
    paths = list(flown.values())
    return with_downwash(asked, paths, closest_approaches(paths, np.array([0.0, asked.horizon.duration])))


def checks(asked, bytes_):
    flown = {name: decode(encoded) for name, encoded in bytes_.items()}
    found = switching_checks(asked, bytes_, flown, apart(asked, flown))
    return {item.name: item for item in found}


def flown(encoded, late, t):
    """Setpoints (len(t), 3): leg k starts late[k] after its time, and holds its last point until the next starts."""
    legs = [decode_leg(leg) for leg in encoded.legs]
    starts = np.array(switch_times([leg.duration for leg in legs])[:-1]) + late
    leg = np.clip(np.searchsorted(starts, t, side="right") - 1, 0, None)
    out = np.zeros((len(t), 3))
    for k, polynomial in enumerate(legs):
        out[leg == k] = polynomial.evaluate(t[leg == k] - starts[k])[:, :3]
    return out


def test_single_legs_need_none_of_this():
    short = {"a": encode(smooth(20), POLY4D), "b": encode(smooth(20, 1), POLY4D)}
    flown = {name: decode(encoded) for name, encoded in short.items()}
    assert switching_checks(mission(), short, flown, apart(mission(), flown)) == []


@settings(max_examples=25)
@given(st.integers(0, 30), st.integers(0, 1000), st.floats(0.005, 0.1))
def test_no_start_within_the_jitter_jumps_farther_or_comes_closer_than_the_bound(seed, luck, jitter):
    asked, bytes_ = mission(jitter=jitter), chains(seed)
    found, rng = switches(asked, bytes_), np.random.default_rng(luck)
    paths = []
    common = np.linspace(0.0, 60.0, 4001)
    for robot, encoded in enumerate(bytes_.values()):
        late = (
            rng.uniform(-jitter, jitter, len(encoded.legs))
            if luck % 2
            else rng.choice([-jitter, jitter], len(encoded.legs))
        )
        for switch in (item for item in found if item.robot == robot):
            at = switch.time + late[switch.leg]
            before, after = flown(encoded, late, np.array([at - 1e-7, at + 1e-7]))
            assert np.linalg.norm(after - before) <= switch.jump + 1e-5
        paths.append(flown(encoded, late, common))
    closest = np.linalg.norm(paths[0] - paths[1], axis=1).min()
    assert closest >= checks(asked, bytes_)["separation off time"].value - 1e-6


def test_jumps_grow_with_jitter_and_the_allowed_speed_just_keeps_the_limit():
    bytes_ = chains()
    exact, rough = (switches(mission(jitter=jitter), bytes_) for jitter in (0.005, 0.05))
    assert all(b.jump > 8.0 * a.jump for a, b in zip(exact, rough, strict=True))
    fast = max(exact, key=lambda item: item.jump)
    asked = mission(jitter=0.005, switch_jump=0.9 * fast.jump)
    slow = allowed_speed(asked, fast)
    assert 0.0 < slow < fast.speed
    assert slow * 0.01 + (fast.jump - fast.speed * 0.01) == pytest.approx(0.9 * fast.jump)
    line = checks(asked, bytes_)["switch jump"]
    assert not line.passed
    assert (line.value, line.time) == (fast.jump, fast.time)
    assert line.where == f"{'ab'[fast.robot]}, leg {fast.leg + 1}"


def test_an_upload_has_to_fit_between_the_starts():
    bytes_ = chains()
    line = checks(mission(), bytes_)["upload in flight"]
    requests = 2 * -(-len(bytes_["a"].legs[2].data) // 24) + 1
    assert line.passed
    rate = min((500.0 / 2 - 85.0) / 2, 50.0)
    assert 1.5 * requests / rate == pytest.approx(line.value, rel=0.2)  # of the tightest leg
    slow = checks(mission(packet_rate=240.0), bytes_)["upload in flight"]
    assert not slow.passed
    assert "leg" in slow.where
    none = checks(mission(packet_rate=160.0), bytes_)["upload in flight"]
    assert (none.passed, none.value) == (False, np.inf)


def test_legs_that_lie_on_one_another_or_off_the_words_are_refused():
    bytes_ = chains()
    over = {**bytes_, "b": altered(bytes_["b"], leg=1, offset=1024)}
    assert not checks(mission(), over)["legs share memory"].passed
    off = {**bytes_, "b": altered(bytes_["b"], leg=1, offset=2050)}
    assert not checks(mission(), off)["leg alignment"].passed
    names = {item.name for item in certify(mission(), over).checks if item.fails}
    assert "legs share memory" in names
