"""What is told of the motion capture once a second, against a count of everything."""

from types import SimpleNamespace

import numpy as np
import pytest

from deploy.flight.poses import STALE, Poses
from mocap.source import MocapFrame, Pose

BODY = "alpha"
RATE = 50.0  # Hz


class Scripted:
    """A source that has what it is given."""

    def __init__(self):
        self.frames = []

    def poll(self):
        frames, self.frames = self.frames, []
        return frames


@pytest.fixture
def bench():
    sent, told = [], []
    drone = SimpleNamespace(estimate=None, send_pose=lambda *pose: sent.append(pose))
    log = SimpleNamespace(pose=lambda *_: None, write=lambda topic, t, record: told.append(record))
    source = Scripted()
    return SimpleNamespace(
        source=source, sent=sent, told=told, poses=Poses(source, {"cf1": BODY}, {"cf1": RATE}, {"cf1": drone}, log)
    )


def test_rates_are_of_the_last_second_whatever_the_frames_order(bench):
    rng, arrived, sent = np.random.default_rng(2), [], []
    for tick in range(1, 700):
        now = 0.01 * tick
        late = rng.exponential(0.06, rng.integers(0, 3))
        bench.source.frames = [MocapFrame(now - delay, tick, {BODY: Pose((0.0, 0.0, 0.0))}) for delay in late]
        arrived += [(now - delay, delay) for delay in late]
        bench.poses.pump(now)
        sent += [now] * (len(bench.sent) - len(sent))
        if rng.random() < 0.02:
            bench.poses.record_health(now)
            delays = [delay for t, delay in arrived if t > now - 1.0]
            record = bench.told[-1]
            assert record["rate"] == len(delays)
            assert record["sent"] == sum(t > now - 1.0 for t in sent)
            assert record["stale"] == sum(delay > STALE for delay in delays)
            assert record["worst_latency_ms"] == pytest.approx(1000.0 * max(delays))
    assert len(bench.told) > 8
    assert 0 < bench.told[-1]["sent"] <= RATE


def test_nothing_is_told_of_what_stopped_a_second_ago(bench):
    bench.source.frames = [MocapFrame(0.5, 1, {BODY: Pose((0.0, 0.0, 0.0))})]
    bench.poses.pump(0.5)
    bench.poses.record_health(1.4)
    bench.poses.record_health(1.6)
    assert [(record["rate"], record["sent"]) for record in bench.told] == [(1.0, 1.0), (0.0, 0.0)]
    assert bench.told[-1]["latency_ms"] is None
    assert bench.told[-1]["age"] == pytest.approx(1.1)
