"""Plans without some of their robots: the same bytes, certified anew."""

import dataclasses

import pytest

from missions.connectivity import GuaranteedConnectivity, PairThreshold, ProbabilisticConnectivity
from missions.obstacles import KeepInZone
from planner.certificate.certify import verify
from planner.certificate.errors import CertificateError
from planner.subset import mission_without, without
from tests.deploy.flight_bench import small_mission, small_plan

PLAN = small_plan()
SQUARE = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))


def test_the_others_fly_the_same_bytes_under_a_certificate_of_their_own():
    alone = without(PLAN, {"cf1"})
    assert [robot.name for robot in alone.mission.robots] == ["cf2"]
    assert alone.trajectories == {"cf2": PLAN.trajectories["cf2"]}
    assert alone.plan.q.shape == (PLAN.plan.q.shape[0], 1, 2)
    assert alone.transfers.take_off == {"cf2": PLAN.transfers.take_off["cf2"]}
    assert alone.certificate.passed
    verify(alone.certificate, alone.trajectories, alone.mission, alone.transfers)
    assert not any("cf1" in check.where for check in alone.certificate.checks)


def test_a_meeting_that_needed_the_one_who_left_fails_the_certificate_or_is_refused():
    mission = small_mission()
    meets = GuaranteedConnectivity(range=0.5, duration=1.0)
    lonely = mission_without(dataclasses.replace(mission, connectivity=meets), {"cf1"})
    assert lonely.connectivity == meets
    named = dataclasses.replace(meets, pairs=(("cf1", "cf2"),))
    with pytest.raises(CertificateError, match="every pair of the connectivity policy has cf1 in it"):
        mission_without(dataclasses.replace(mission, connectivity=named), {"cf1"})
    star = dataclasses.replace(meets, pairs="star", hub="cf1")
    with pytest.raises(CertificateError, match="cf1 is the hub"):
        mission_without(dataclasses.replace(mission, connectivity=star), {"cf1"})
    with pytest.raises(CertificateError, match="nobody is left"):
        without(PLAN, {"cf1", "cf2"})


def test_thresholds_and_zones_of_those_who_leave_go_with_them():
    policy = ProbabilisticConnectivity(
        range=0.5, threshold=0.1, thresholds=(PairThreshold(pair=("cf1", "cf2"), threshold=0.2),)
    )
    zones = tuple(KeepInZone(SQUARE, names) for names in (("cf1",), ("cf1", "cf2"), ()))
    left = mission_without(dataclasses.replace(small_mission(), connectivity=policy, zones=zones), {"cf1"})
    assert left.connectivity.thresholds == ()
    assert [zone.robots for zone in left.zones] == [("cf2",), ()]
