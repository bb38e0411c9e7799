"""The fault matrix: whatever goes wrong, whenever it does, the rules of ``judge.py`` hold.

The suite flies every fault once and every phase at least once; ``make chaos`` flies everything.
"""

import pytest

from tests.chaos.faults import FAULTS, PHASES, cell, matrix, sequence, together
from tests.chaos.flown import fly
from tests.chaos.judge import judge

# Faults by phase, most of them where a flight ends early; test_scenarios.py has those of the search.
SUITE = {
    "connecting": ("empty battery",),
    "checking": ("low battery", "displaced"),
    "uploading": ("swap", "dead dongle"),
    "arming": ("silence", "reconnect", "reboot", "operator"),
    "taking off": ("dead motor", "body hidden", "host killed"),
    "transferring": ("tumble", "mocap gone", "brief swap"),
    "settling": ("weak motor", "host killed, watchdog"),
    "on mission": ("motors off",),
}
# And those that nobody has to land for, all in one flight.
SURVIVED = {"on mission": "blink", "holding": "outlier", "returning": "mocap blink", "landing": "bad radio"}
BEFORE = {"settling": "slow link"}
SHORT = [cell(fault, phase) for phase, faults in SUITE.items() for fault in faults]
WHOLE = [case for case in matrix() if case.name not in {short.name for short in SHORT}]
SEED, ALL_SEEDS = 38, [seed for seed in range(200) if seed != 38]


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
    assert SUITE.keys() | SURVIVED.keys() == PHASES.keys()
    flown = [name for names in SUITE.values() for name in names]
    assert sorted((*flown, *SURVIVED.values(), *BEFORE.values())) == sorted(FAULTS)


@pytest.mark.parametrize("case", SHORT, ids=lambda case: case.name)
def test_a_fault_in_a_phase(case):
    assert problems(case) == ""


def test_faults_that_nobody_has_to_land_for():
    cells = [(fault, phase) for phase, fault in (BEFORE | SURVIVED).items()]
    flown = fly(together("a bad day", cells))
    judged = judge(flown)
    assert judged.problems == ()
    assert judged.outcome == "completed", flown.ended
    begun = {event.text for event in flown.log.events if event.name == "scenario" and "is over" not in event.text}
    assert len(begun) == len(cells)


def test_a_random_sequence_of_faults():
    assert problems(sequence(SEED)) == ""


@pytest.mark.chaos
@pytest.mark.parametrize("case", WHOLE, ids=lambda case: case.name)
def test_every_other_fault_in_every_other_phase(case):
    assert problems(case) == ""


@pytest.mark.chaos
@pytest.mark.parametrize("seed", ALL_SEEDS)
def test_more_random_sequences_of_faults(seed):
    assert problems(sequence(seed)) == ""
