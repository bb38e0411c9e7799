"""What is found while a flight ends early changes how it ends, and never to anything less safe."""

import dataclasses
import itertools
from functools import reduce

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from deploy.flight.reactions import IN_AN_ABORT, ORDER, Reaction, joined, policy_for
from deploy.flightlog.reader import read_log
from deploy.operator import Interrupts
from deploy.phases import Phase
from missions.safety import Safety
from tests.deploy.flight_bench import PADS, fly_on, small_mission, small_plan, stage

OF_SOME = ("land_here", "stop_motors")
reactions = st.builds(
    Reaction,
    st.text(max_size=3),
    st.sampled_from(ORDER),
    st.lists(st.sampled_from(["cf1", "cf2", "cf3"]), unique=True).map(tuple),
)


def meaning(reaction):
    """What it comes to: how, and for whom if that matters."""
    return reaction.policy, frozenset(reaction.robots) if reaction.policy in OF_SOME else frozenset()


@given(reactions, reactions)
def test_nothing_becomes_less_safe_and_motors_stop_of_those_only_that_a_finding_means(doing, found):
    after = joined(doing, found)
    assert ORDER.index(after.policy) == max(ORDER.index(doing.policy), ORDER.index(found.policy))
    asked = {robot for r in (doing, found) if r.policy == after.policy for robot in r.robots}
    assert set(after.robots) <= asked
    if after.policy in OF_SOME:
        assert set(after.robots) == asked


@given(reactions, reactions)
def test_what_adds_nothing_changes_nothing(doing, found):
    assert joined(doing, doing) is doing
    after = joined(doing, found)
    assert (after is doing) == (meaning(after) == meaning(doing))
    assert joined(after, found) is after
    assert joined(after, doing) is after


@settings(max_examples=30)
@given(st.lists(reactions, min_size=1, max_size=4))
def test_the_order_of_findings_does_not_matter(found):
    assert len({meaning(reduce(joined, order)) for order in itertools.permutations(found)}) == 1


@pytest.mark.parametrize("kind", sorted(IN_AN_ABORT))
@pytest.mark.parametrize("policy", ORDER)
def test_nobody_waits_or_flies_about_for_what_is_found_in_an_abort(kind, policy):
    safety = dataclasses.replace(Safety(), **{kind: policy})
    assert policy_for(safety, kind) == policy
    then = policy_for(safety, kind, aborting=True)
    assert ORDER.index(then) >= max(ORDER.index(policy), ORDER.index("land_here"))
    assert (then == "stop_motors") == (policy == "stop_motors")


def test_every_kind_of_finding_has_a_least():
    kinds = {field.name for field in dataclasses.fields(Safety) if field.type == "Policy"}
    assert set(IN_AN_ABORT) == kinds


# --------------------------------------------------------------------------------------------------------- flights


@pytest.fixture
def bench(tmp_path, cache):
    def run(word, sign, act, **safety):
        """Fly; the operator says a word 2 s into the search, and after an event of this text something happens."""
        plan = small_plan(dataclasses.replace(small_mission(), safety=Safety(**safety)))
        operator, done = Interrupts(), []
        with stage(tmp_path, plan) as ready:
            truth = []
            ready.world.every(0.05, lambda t: truth.append(ready.world.positions))

            def observe(status):
                if status.mission_time >= 2.0 and not done:
                    operator.say(word)
                    done.append("said")
                if sign in status.message and len(done) == 1:
                    act(ready)
                    done.append("happened")

            outcome = fly_on(ready, plan, cache, operator=operator, observer=observe)
            path = ready.log.path
        assert done == ["said", "happened"]
        worse = [event.text for event in read_log(path).events if event.name == "worse"]
        off = np.linalg.norm(ready.world.positions[:, :2] - np.array(list(PADS.values())), axis=1)
        return outcome, worse, off, np.array(truth)

    return run


def hide(ready):
    ready.mocap.hide({"cf2"})


def test_who_is_lost_from_sight_on_the_way_home_lands_everybody_there(bench):
    outcome, worse, off, truth = bench("abort", "fly back to their pads", hide, pose="return")
    assert outcome.phase is Phase.ABORTED
    assert all(outcome.landed.values())
    assert len(worse) == 1
    assert worse[0].endswith("(land_all)")
    assert "cf2: no pose" in worse[0]
    assert (off > 0.1).all()
    assert np.diff(truth[:, :, 2], axis=0).min() > -0.1  # nobody fell


def test_who_runs_low_in_a_hover_lands_there_and_the_others_fly_home(bench):
    def drain(ready):
        ready.world.batteries.charge[1] = 0.06

    outcome, worse, off, _ = bench("hold", "everybody hovers", drain, battery="hold", hold_time=30.0)
    assert all(outcome.landed.values())
    assert len(worse) == 1
    assert "battery" in worse[0]
    assert worse[0].endswith("(land_here)")
    assert off[0] < 0.1 < off[1]


def test_motors_that_a_policy_stops_stop_at_once_also_while_everybody_brakes(bench):
    def turn_over(ready):
        ready.world.bodies.rates[1, 0] += 40.0
        ready.world.bodies.update()

    outcome, worse, _, truth = bench("hold", "everybody hovers", turn_over, hold_time=30.0, tilt="stop_motors")
    assert worse[-1].startswith("cf2: tilts")
    assert worse[-1].endswith("(stop_motors)")
    assert any("cf2: motors stopped by the mission's policy" in fault for fault in outcome.faults)
    assert outcome.landed["cf1"]
    assert np.diff(truth[:, 0, 2]).min() > -0.1
