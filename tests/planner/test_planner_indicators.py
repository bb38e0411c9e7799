import math

import numpy as np
import pytest

from missions.schema import NoConnectivity
from planner.indicators import indicators, resample
from tests.planner.problems import imec, notebook, robots, small

AUTHORS = notebook()
POSITIONS = np.array(AUTHORS["positions_by_step_robot"])
T = np.arange(300) * 0.1


def test_the_authors_indicators():
    found, measured = indicators(imec(), T, POSITIONS), AUTHORS["measured"]
    assert found.ergodicity == pytest.approx(measured["ergodicity"], abs=1e-12)
    assert found.connected_share == pytest.approx(measured["Rc_ratio_strict"], abs=1e-12)
    assert found.probability_worst == pytest.approx(measured["P_min"], abs=1e-9)
    assert found.probability_mean == pytest.approx(measured["P_avg"], abs=1e-9)
    assert found.all_met is measured["all_pairs_all_periods_connected"]
    # Measured between the steps as well, where they come closer still.
    assert found.smallest_separation == pytest.approx(measured["min_dist_fine"], abs=5e-4)
    assert found.smallest_clearance == pytest.approx(measured["min_obs_clear_fine"], abs=5e-5)
    assert [pair.robots for pair in found.pairs][:2] == [("r0", "r1"), ("r0", "r2")]


def test_samples_taken_finer_and_with_height_say_the_same():
    t = np.arange(2991) * 0.01
    q = resample(T, POSITIONS, t)
    q = np.concatenate([q, np.full((*q.shape[:2], 1), 0.6)], axis=-1)
    coarse, fine = indicators(imec(), T, POSITIONS), indicators(imec(), t, q)
    assert fine.ergodicity == pytest.approx(coarse.ergodicity, rel=1e-9)
    assert fine.probability_worst == pytest.approx(coarse.probability_worst, rel=1e-9)
    assert fine.smallest_separation <= coarse.smallest_separation


def test_a_meeting_counts_in_its_own_sub_period_only():
    mission = imec(robots=robots((0.5, 0.3), (2.0, 0.3)))
    q = np.zeros((301, 2, 2))
    q[:, 1] = (2.0, 0.0)
    q[150, 1] = (0.4, 0.0)  # 15 s: second third
    found = indicators(mission, np.arange(301) * 0.1, q)
    assert found.pairs[0].met == (False, True, False)
    assert not found.all_met
    assert found.smallest_separation == pytest.approx(0.4)


def test_one_robot_without_range_or_obstacles():
    mission = small(NoConnectivity(), robots=robots((0.0, 0.5)), obstacles=())
    found = indicators(mission, np.array([0.0, 8.0]), np.array([[[0.0, 0.5]], [[0.3, 0.5]]]))
    assert math.isnan(found.connected_share)
    assert math.isnan(found.probability_worst)
    assert (found.all_met, found.smallest_separation, found.smallest_clearance) == (True, math.inf, math.inf)


@pytest.mark.parametrize(
    ("t", "q"),
    [
        (T, POSITIONS[:, :3]),
        (T, POSITIONS[..., :1]),
        (T[::-1], POSITIONS),
        (T[:1], POSITIONS[:1]),
        (T, np.where(POSITIONS > 2.0, np.nan, POSITIONS)),
    ],
)
def test_what_is_no_motion_is_refused(t, q):
    with pytest.raises(ValueError, match="indicators need"):
        indicators(imec(), t, q)
