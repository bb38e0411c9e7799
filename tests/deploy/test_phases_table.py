"""Laws of the table of phases."""

import pytest

from deploy.phases import AIRBORNE, TABLE, IllegalTransition, Phase, Phases, allowed, markdown, mermaid

TERMINAL = {Phase.LANDED, Phase.CANCELLED, Phase.ABORTED, Phase.EMERGENCY}


def reachable(start):
    seen, front = {start}, [start]
    while front:
        front = [target for phase in front for target in allowed(phase) if target not in seen]
        seen |= set(front)
    return seen


def test_every_phase_has_a_row_and_can_be_reached():
    assert set(TABLE) == set(Phase)
    assert reachable(Phase.IDLE) == set(Phase)


def test_exactly_the_ends_have_no_way_out_and_everything_ends():
    assert {phase for phase in Phase if not allowed(phase)} == TERMINAL
    assert all(reachable(phase) & TERMINAL for phase in Phase)


@pytest.mark.parametrize("phase", sorted(AIRBORNE, key=lambda p: p.name))
def test_the_air_is_left_by_landing_or_by_the_operator_only(phase):
    assert Phase.EMERGENCY in allowed(phase)
    assert Phase.CANCELLED not in reachable(phase)


def test_nobody_is_airborne_without_having_been_checked():
    for skipped in (Phase.CONNECTED, Phase.CHECKED, Phase.UPLOADED, Phase.ARMED):
        seen, front = {Phase.IDLE}, [Phase.IDLE]
        while front:
            front = [t for phase in front for t in allowed(phase) if t not in seen and t is not skipped]
            seen |= set(front)
        assert not seen & AIRBORNE


def test_the_good_flight_follows_next():
    phases, path = Phases(), [Phase.IDLE]
    while (target := TABLE[phases.now].next) is not None:
        phases.enter(target)
        path.append(target)
    assert path[-1] is Phase.LANDED
    assert phases.over
    assert path.index(Phase.UPLOADED) < path.index(Phase.ARMED) < path.index(Phase.TAKING_OFF)


def test_an_illegal_step_says_what_is_allowed():
    with pytest.raises(IllegalTransition, match=r"idle cannot be on mission; allowed: cancelled, connected"):
        Phases().enter(Phase.ON_MISSION)


def test_the_drawings_hold_every_phase_and_every_arrow():
    diagram = mermaid()
    arrows = [line.split(":")[0].split() for line in diagram.splitlines() if "-->" in line and "[*]" not in line]
    assert {(a, b) for a, _, b in arrows} == {(p.name, t.name) for p in Phase for t in allowed(p)}
    rows = markdown().splitlines()[2:]
    assert [row.split(" | ")[0].strip("| ") for row in rows] == [p.value for p in Phase if TABLE[p].next]


def test_every_phase_says_what_becomes_of_who_fails_in_it():
    assert {phase for phase in Phase if not TABLE[phase].failing} == TERMINAL
