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
    "arming": ("operator",),
    "taking off": ("dead motor", "body hidden", "host killed"),
    "transferring": ("tumble", "mocap gone", "brief swap"),
    "settling": ("weak motor", "host killed, watchdog"),
    "on mission": ("motors off",),
}
# And those that are survived, several in one flight.
SURVIVED = {
    "a bad morning": (("reconnect", "connecting"), ("reboot", "uploading"), ("silence", "arming")),
    "a bad day": (
        ("slow link", "settling"),
        ("blink", "on mission"),
        ("outlier", "holding"),
        ("mocap blink", "returning"),
        ("bad radio", "landing"),
    ),
}
NOTICED_AS = {"weak motor / settling": "from where it should be"}
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
    flown = [(fault, phase) for phase, names in SUITE.items() for fault in names]
    flown += [pair for cells in SURVIVED.values() for pair in cells]
    faults, phases = zip(*flown, strict=True)
    assert sorted(faults) == sorted(FAULTS)
    assert set(phases) == set(PHASES)


@pytest.mark.parametrize("case", SHORT, ids=lambda case: case.name)
def test_a_fault_in_a_phase(case):
    flown = fly(case)
    assert judge(flown).problems == ()
    assert NOTICED_AS.get(case.name, "") in str(getattr(flown.ended, "reason", flown.ended))


@pytest.mark.parametrize("name", SURVIVED)
def test_faults_that_are_survived(name):
    flown = fly(together(name, SURVIVED[name]))
    judged = judge(flown)
    assert judged.problems == ()
    assert judged.outcome == "completed", flown.ended
    begun = {event.text for event in flown.log.events if event.name == "scenario" and "is over" not in event.text}
    assert len(begun) == len(SURVIVED[name])


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
