"""The fault matrix: whatever goes wrong, whenever it does, the rules of ``judge.py`` hold.

The suite flies every fault once and every phase at least once; ``make chaos`` flies everything.
"""

import pytest

from tests.chaos.faults import FAULTS, PHASES, cell, matrix, sequence
from tests.chaos.flown import fly
from tests.chaos.judge import judge

# Fault by phase: each once, spread so that what is dangerous happens in the air.
SUITE = {
    "connecting": ("silence", "empty battery"),
    "checking": ("low battery", "displaced"),
    "uploading": ("reboot", "body hidden"),
    "arming": ("reconnect", "operator"),
    "taking off": ("dead motor", "swap", "host killed"),
    "transferring": ("dead dongle", "mocap gone"),
    "settling": ("brief swap", "outlier"),
    "on mission": ("tumble", "weak motor", "host killed, watchdog"),
    "holding": ("blink", "motors off"),
    "returning": ("slow link", "mocap blink"),
    "landing": ("bad radio",),
}
SHORT = [cell(fault, phase) for phase, faults in SUITE.items() for fault in faults]
WHOLE = [case for case in matrix() if case.name not in {short.name for short in SHORT}]
SEEDS, ALL_SEEDS = range(4), range(4, 200)


def problems(case):
    """What is wrong, with the scenario that shows it."""
    found = judge(fly(case)).problems
    return f"{case.name}: {'; '.join(found)}\n{case.text}" if found else ""


@pytest.fixture(autouse=True, scope="module")
def _tables_of_contents(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


def test_the_suite_has_every_fault_and_every_phase():
    assert SUITE.keys() == PHASES.keys()
    assert sorted(name for names in SUITE.values() for name in names) == sorted(FAULTS)


@pytest.mark.parametrize("case", SHORT, ids=lambda case: case.name)
def test_a_fault_in_a_phase(case):
    assert problems(case) == ""


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_sequence_of_faults(seed):
    assert problems(sequence(seed)) == ""


@pytest.mark.chaos
@pytest.mark.parametrize("case", WHOLE, ids=lambda case: case.name)
def test_every_other_fault_in_every_other_phase(case):
    assert problems(case) == ""


@pytest.mark.chaos
@pytest.mark.parametrize("seed", ALL_SEEDS)
def test_more_random_sequences_of_faults(seed):
    assert problems(sequence(seed)) == ""
