"""Plan files: nothing gets lost, and nothing gets changed unnoticed."""

import dataclasses

import numpy as np
import pytest

from deploy.errors import PlanFileError
from deploy.flightlog.container import check_intact
from deploy.planfile import layout, plan_bytes, read_plan, read_plan_bytes, write_plan
from planner.trajectory.encoded import EncodedTrajectory
from tests.deploy import synthetic_flight as synthetic
from tests.tampering import altered


@pytest.fixture(scope="module")
def plan():
    return synthetic.flight_plan(duration=3.0, robots=2)


def test_everything_comes_back_and_the_bytes_repeat(plan, tmp_path):
    write_plan(tmp_path / "plan.mcap", plan)
    write_plan(tmp_path / "plan.mcap", plan)  # replaces
    again = read_plan(tmp_path / "plan.mcap")
    assert plan_bytes(again) == plan_bytes(plan) == (tmp_path / "plan.mcap").read_bytes()
    assert again.mission == plan.mission
    assert again.trajectories == plan.trajectories
    assert again.certificate == plan.certificate
    assert dict(again.versions) == dict(plan.versions)
    for name in ("t", "q", "v", "u"):
        assert np.array_equal(getattr(again.plan, name), getattr(plan.plan, name))
    assert [path.name for path in tmp_path.iterdir()] == ["plan.mcap"]


def test_numbers_that_are_not_finite_survive():
    assert layout.load(layout.dump({"a": [float("inf"), 1.5]})) == {"a": (float("inf"), 1.5)}
    assert np.isnan(layout.load(layout.dump(float("nan"))))


def test_any_edited_byte_is_refused(plan):
    data = plan_bytes(plan)
    rng = np.random.default_rng(1)
    tail = range(len(data) - 400, len(data))  # summary, footer, magic: every byte
    for at in [*range(0, len(data), 97), *range(60), *tail]:
        edited = bytearray(data)
        edited[at] ^= int(rng.integers(1, 256))
        with pytest.raises(PlanFileError) as refusal:
            read_plan_bytes(bytes(edited))
        assert "\n" not in str(refusal.value)


def test_the_checksums_alone_see_every_single_byte(plan):
    data = bytearray(plan_bytes(plan))
    check_intact(bytes(data))
    for at in range(0, len(data), 11):
        data[at] ^= 0x40
        with pytest.raises(ValueError, match=r"damaged|checksum|MCAP|cut off"):
            check_intact(bytes(data))
        data[at] ^= 0x40


def test_any_cut_is_refused(plan):
    data = plan_bytes(plan)
    for cut in [0, 1, 8, 40, len(data) // 2, len(data) - 8, len(data) - 1]:
        with pytest.raises(PlanFileError):
            read_plan_bytes(data[:cut])
    with pytest.raises(PlanFileError):
        read_plan_bytes(data + b"\0")


def test_a_certificate_for_other_bytes_is_refused(plan):
    name = plan.mission.robots[0].name
    other = dict(plan.trajectories)
    other[name] = altered(other[name], data=other[name].legs[0].data[:-1] + b"\1")
    with pytest.raises(PlanFileError, match="other trajectories"):
        read_plan_bytes(plan_bytes(dataclasses.replace(plan, trajectories=other)))
    certificate = dataclasses.replace(plan.certificate, mission_sha256="0" * 64)
    with pytest.raises(PlanFileError, match="another mission"):
        read_plan_bytes(plan_bytes(dataclasses.replace(plan, certificate=certificate)))
    with pytest.raises(PlanFileError, match="the mission has cf1, cf2"):
        read_plan_bytes(plan_bytes(dataclasses.replace(plan, trajectories={})))


def test_legs_come_back_in_their_order_and_no_other(plan):
    name = plan.mission.robots[0].name
    (leg,) = plan.trajectories[name].legs
    halves = [dataclasses.replace(leg, offset=2048 * number) for number in (0, 1)]
    legs = {**plan.trajectories, name: EncodedTrajectory(tuple(halves))}
    hashes = tuple((robot, item.sha256) for robot, item in legs.items())
    chained = dataclasses.replace(
        plan, trajectories=legs, certificate=dataclasses.replace(plan.certificate, trajectories_sha256=hashes)
    )
    assert read_plan_bytes(plan_bytes(chained)).trajectories == legs
    swapped = {**legs, name: EncodedTrajectory(tuple(halves[::-1]))}
    with pytest.raises(PlanFileError, match="other trajectories"):
        read_plan_bytes(plan_bytes(dataclasses.replace(chained, trajectories=swapped)))
    one = {**legs, name: EncodedTrajectory((leg,))}
    with pytest.raises(PlanFileError, match="other trajectories"):
        read_plan_bytes(plan_bytes(dataclasses.replace(chained, trajectories=one)))


def test_a_failed_certificate_is_read_as_failed():
    uncertified = synthetic.flight_plan(passed=False, duration=3.0, robots=2)
    assert read_plan_bytes(plan_bytes(uncertified)).certificate.passed is False


def test_a_newer_format_is_refused_by_name(plan, monkeypatch):
    monkeypatch.setattr("deploy.planfile.write.FORMAT", 99)
    data = plan_bytes(plan)
    with pytest.raises(PlanFileError, match="format '99'"):
        read_plan_bytes(data)


def test_other_files_are_refused(tmp_path, plan):
    log = tmp_path / "flight.mcap"
    synthetic.write_flight(log, plan)
    with pytest.raises(PlanFileError, match="not a plan file"):
        read_plan(log)
    with pytest.raises(PlanFileError, match="cannot read"):
        read_plan(tmp_path / "none.mcap")
    (tmp_path / "text.mcap").write_text("hello")
    with pytest.raises(PlanFileError, match="not an MCAP file"):
        read_plan(tmp_path / "text.mcap")
    with pytest.raises(PlanFileError, match="cannot write"):
        write_plan(tmp_path / "no" / "plan.mcap", plan)
    with pytest.raises(PlanFileError, match="no source text"):
        plan_bytes(dataclasses.replace(plan, mission=dataclasses.replace(plan.mission, source=None)))
