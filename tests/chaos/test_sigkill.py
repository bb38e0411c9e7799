"""SIGKILL of the real process, in flight: what the drones do next is what the README says.

Two processes in real time, hence few here; ``make chaos`` kills at twenty random times.
"""

import random

import pytest

from tests.chaos.host import kill

KINDS = ("continue", "motor_stop")
LONGEST = 17.0  # s from the first packet to the last


def random_kills(count=20, seed=0):
    """Settings and times [s] at which to kill."""
    chance = random.Random(seed)
    return [(KINDS[i % 2], round(chance.uniform(0.2, LONGEST), 2)) for i in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("on_host_loss", KINDS)
def test_in_flight(on_host_loss, tmp_path):
    fate = kill(on_host_loss, 5.0, tmp_path)
    assert fate.problems == (), fate


@pytest.mark.chaos
@pytest.mark.parametrize(("on_host_loss", "seconds"), random_kills())
def test_at_random_times(on_host_loss, seconds, tmp_path):
    fate = kill(on_host_loss, seconds, tmp_path)
    assert fate.problems == (), fate
