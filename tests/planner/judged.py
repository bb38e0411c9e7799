"""What every flight plan has to be, judged from its bytes."""

import numpy as np

from missions import fleet
from planner.indicators import indicators
from planner.trajectory.encode import decode


def judge_bytes(flight):
    """Certified; from starts to ends, at the heights and below the speeds of the mission, clear of obstacles."""
    mission = flight.mission
    assert flight.certificate.passed
    t = np.linspace(0.0, mission.horizon.duration, 2001)
    flown = np.stack([decode(bytes_).evaluate(t)[:, :3] for bytes_ in flight.trajectories.values()], axis=1)
    ends = fleet.ends(mission)
    given = np.isfinite(ends)
    np.testing.assert_allclose(flown[0, :, : mission.dimension], fleet.starts(mission), atol=1e-3)
    np.testing.assert_allclose(flown[-1, :, : mission.dimension][given], ends[given], atol=1e-3)
    if mission.dimension == 2:
        np.testing.assert_allclose(flown[..., 2], np.broadcast_to(fleet.altitudes(mission), flown.shape[:2]), atol=1e-3)
    speed = np.linalg.norm(np.diff(flown, axis=0), axis=-1).max(axis=0) / (t[1] - t[0])
    assert (speed <= 1.01 * fleet.speeds(mission)).all()
    assert indicators(mission, t, flown).smallest_clearance > -1e-3
