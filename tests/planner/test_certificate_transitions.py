"""The certificate of the moves around the search: every kind of violation is caught, whoever planned them."""

import dataclasses
import json

import numpy as np
import pytest

from missions.obstacles import BoxObstacle, CylinderObstacle, KeepOutZone
from missions.schema import CircleObstacle, Flight, Horizon, Limits, Mission, Robot, UniformMap, Workspace
from planner.certificate.certify import certify, verify
from planner.certificate.errors import CertificateError
from planner.certificate.transitions import flown_by, transition_checks
from planner.trajectory.encode import decode, encode
from planner.transfer.plan import plan_transfers
from planner.transfers import Move, Transfers

Z = 0.6
STARTS = {"a": (0.5, 0.5), "b": (0.5, 1.0)}
ENDS = {"a": (2.5, 0.5), "b": (2.5, 1.0)}


def mission(**changes):
    base = Mission(
        schema_version=1,
        name="there_and_back",
        workspace=Workspace((0.0, 0.0), (3.0, 2.0)),
        horizon=Horizon(8.0, 0.1),
        information=UniformMap(),
        robots=tuple(Robot(name, start) for name, start in STARTS.items()),
        limits=Limits(acceleration=1.0, speed=1.5, separation=0.3),
        flight=Flight(altitude=Z),
    )
    return dataclasses.replace(base, **changes)


def flown(ends=ENDS):
    """The search: straight from the starts to the ends."""
    return {name: flown_by([Move((*ends[name], Z), 0.0, 8.0)], np.array([*STARTS[name], Z]), 8.0) for name in STARTS}


def moved(**passages):
    """What is planned for the mission, with some passages changed."""
    return dataclasses.replace(plan_transfers(mission(), flown()), **passages)


def failed(of, transfers, ends=ENDS):
    return {item.name for item in transition_checks(of, transfers, flown(ends)) if not item.passed}


def over(*steps, of="a"):
    return {of: tuple(Move((*point, Z), begin, lasting) for point, begin, lasting in steps)}


def test_what_was_planned_passes():
    checks = transition_checks(mission(), moved(), flown())
    assert all(item.passed for item in checks)
    assert {item.name for item in checks} >= {
        "take-off separation", "return separation", "landing separation", "return geofence", "return speed",
        "transfer end", "landing place",
    }  # fmt: skip
    assert not any(item.name.startswith("transfer s") for item in checks), "pads are under the starts: nobody moves"


def test_the_commander_s_profile_is_the_firmware_s():
    """Peaks of a move of 1 m in 1 s, as measured on the real firmware (protocol notes B1)."""
    move = flown_by([Move((1.0, 0.0, Z), 0.0, 1.0)], np.array([0.0, 0.0, Z]), 1.0)
    t = np.linspace(0.0, 1.0, 10_001)
    for order, peak in ((1, 2.1875), (2, 7.5132), (3, 52.5)):
        assert np.abs(move.evaluate(t, order)[:, 0]).max() == pytest.approx(peak, abs=2e-3)


def test_moves_become_holds_and_pieces():
    move = flown_by([Move((1.0, 0.0, Z), 0.5, 1.0), Move((1.0, 1.0, Z), 2.0, 1.0)], np.array([0.0, 0.0, Z]), 4.0)
    assert move.knots() == pytest.approx([0.0, 0.5, 1.5, 2.0, 3.0, 4.0])
    assert move.evaluate(np.array([0.2, 1.0, 1.7, 2.5, 3.5]))[:, :2] == pytest.approx(
        np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0], [1.0, 0.5], [1.0, 1.0]])
    )


ON_THE_SPOT = {name: (Move((*point, 0.0), 0.0, 3.0),) for name, point in ENDS.items()}
TOO_CLOSE = {"a": (Move((2.5, 1.0, Z), 0.0, 8.0), Move((0.5, 0.5, Z), 8.0, 12.0)), "b": (Move((0.5, 1.0, Z), 20, 8.0),)}


@pytest.mark.parametrize(
    ("passages", "expected"),
    [
        ({"back": TOO_CLOSE}, {"return separation"}),
        ({"back": {}, "landing": ON_THE_SPOT}, {"landing place"}),
        ({"approach": over(((0.5, 0.4), 0.0, 2.0))}, {"transfer end"}),
        ({"approach": over(((0.5, -0.3), 0.0, 5.0), ((0.5, 0.5), 5.0, 5.0))}, {"transfer geofence"}),
        ({"approach": over(((0.5, 0.1), 0.0, 0.8), ((0.5, 0.5), 3.0, 2.0))}, {"transfer acceleration"}),
    ],
)
def test_every_kind_of_bad_move_is_caught(passages, expected):
    assert failed(mission(), moved(**passages)) == expected


def test_speed_is_the_robot_s_own():
    hasty = {
        "a": (Move((0.5, 0.5, Z), 0.0, 3.5),), "b": (Move((0.5, 1.0, Z), 0.0, 3.5),),
    }  # fmt: skip
    assert failed(mission(), moved(back=hasty)) == {"return acceleration"}
    slow = mission(limits=Limits(acceleration=2.0, speed=1.0, separation=0.3))
    assert failed(slow, moved(back=hasty)) == {"return speed"}


@pytest.mark.parametrize(
    ("thing", "passage"),
    [
        (CircleObstacle((1.5, 0.5), 0.1), "return"),
        (BoxObstacle((1.4, 0.4, 0.5), (1.6, 0.6, 0.8)), "return"),
        (CylinderObstacle((0.5, 0.5), 0.1, 0.3), "landing"),
    ],
)
def test_what_is_in_the_way_is_caught(thing, passage):
    """Straight moves that somebody planned who did not know of the thing."""
    changed = mission(obstacles=(thing,))
    assert f"{passage} obstacles" in failed(changed, moved())
    zone = KeepOutZone(((1.4, 0.3), (1.6, 0.3), (1.6, 0.6)), robots=("b",))
    assert failed(mission(zones=(zone,)), moved()) == set(), "binds the other one only"


def test_flying_below_somebody_is_too_close_landing_there_too():
    """0.4 m below: far enough for a sphere of 0.3 m, not for what blows down; on the ground nobody is below anybody."""
    layered = mission(robots=(Robot("a", STARTS["a"]), Robot("b", STARTS["b"], altitude=1.0)))
    high = flown()
    high["b"] = flown_by([Move((*ENDS["b"], 1.0), 0.0, 8.0)], np.array([*STARTS["b"], 1.0]), 8.0)
    below = {"a": (Move((2.5, 1.0, Z), 0.0, 8.0), Move((0.5, 0.5, Z), 8.0, 12.0))}
    after = {"b": (Move((0.5, 1.0, 1.0), 20.0, 12.0),)}
    transfers = dataclasses.replace(plan_transfers(layered, high), back=below | after)
    bad = {item.name: item for item in transition_checks(layered, transfers, high) if not item.passed}
    assert set(bad) == {"return separation"}
    assert bad["return separation"].value == pytest.approx(0.4 * 0.3 / 0.6, abs=1e-3)
    stated = dataclasses.replace(layered, limits=dataclasses.replace(layered.limits, vertical_separation=0.35))
    assert all(item.passed for item in transition_checks(stated, transfers, high))


@pytest.mark.parametrize(
    ("passages", "message"),
    [
        ({"approach": over(((0.5, 0.5), 0.0, 2.0), of="nobody")}, "moves of nobody"),
        ({"approach": over(((0.5, 0.4), 0.0, 2.0), ((0.5, 0.5), 1.0, 2.0))}, "before the one before it ends"),
        ({"take_off": over(((0.5, 0.5), 0.0, 2.0))}, "take-off: everybody makes one move, together; b does not"),
        ({"take_off": over(((0.6, 0.5), 0.0, 2.0)) | over(((0.5, 1.0), 0.0, 2.0), of="b")}, "a does not go straight"),
        ({"take_off": over(((0.5, 0.5), 0.0, 2.0)) | over(((0.5, 1.0), 0.0, 3.0), of="b")}, "a does not"),
    ],
)
def test_moves_that_make_no_sense_are_refused(passages, message):
    with pytest.raises(CertificateError, match=message):
        transition_checks(mission(), moved(**passages), flown())


def test_the_certificate_is_bound_to_the_moves():
    bytes_ = {name: encode(trajectory) for name, trajectory in flown().items()}
    transfers = plan_transfers(mission(), {name: decode(item) for name, item in bytes_.items()})
    certificate = certify(mission(), bytes_, transfers)
    assert certificate.passed
    verify(certificate, bytes_, mission(), transfers)
    again = Transfers.of_record(json.loads(json.dumps(transfers.record())))
    assert (again, again.sha256) == (transfers, transfers.sha256)
    moves = dict(transfers.back)
    (move,) = moves["a"]
    moves["a"] = (dataclasses.replace(move, duration=move.duration + 1e-9),)
    with pytest.raises(CertificateError, match="moves to the search and back are not those"):
        verify(certificate, bytes_, mission(), dataclasses.replace(transfers, back=moves))
    assert certify(mission(), bytes_).transfers_sha256 == ""


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -1.0])
def test_a_move_has_numbers_that_mean_something(bad):
    with pytest.raises(ValueError, match="a move"):
        Move((0.0, 0.0, 0.0), bad, 1.0)
    with pytest.raises(ValueError, match="a move"):
        Move((0.0, 0.0, 0.0), 0.0, bad)


def test_separation_is_found_between_samples():
    """Two moves that cross at right angles at different times: against dense samples."""
    moves = {
        "a": (Move((2.5, 1.0, Z), 0.0, 7.0), Move((0.5, 0.5, Z), 7.0, 12.0)),
        "b": (Move((0.5, 1.0, Z), 4.0, 7.0),),
    }
    found = {item.name: item for item in transition_checks(mission(), moved(back=moves), flown())}["return separation"]
    ways = [flown_by(moves[name], np.array([*ENDS[name], Z]), 19.0) for name in STARTS]
    t = np.linspace(0.0, 19.0, 190_001)
    p, q = (way.evaluate(t)[:, :3] for way in ways)
    sampled = np.linalg.norm(p - q, axis=1).min()
    assert sampled - 2e-4 <= found.value <= sampled + 1e-9
