"""Ways to the search and back: safe by the certificate, fast where they can be, refused where there is none."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.obstacles import BoxObstacle, CylinderObstacle, KeepOutZone, PolygonObstacle
from missions.schema import (
    CircleObstacle,
    Flight,
    Horizon,
    Limits,
    Mission,
    Robot,
    RobotLimits,
    UniformMap,
    Workspace,
)
from missions.shapes import Solid, outline, solid
from planner.certificate.transitions import flown_by, transition_checks
from planner.transfer.descent import clear_descents
from planner.transfer.errors import TransferError
from planner.transfer.plan import PAUSE, SHORTEST, plan_moves, plan_transfers
from planner.transfer.prisms import grown
from planner.transfer.scene import ROOM, closest
from planner.transfers import Move, duration

Z = 0.6


def mission(count, size=3.0, **changes):
    base = Mission(
        schema_version=1,
        name="ways",
        workspace=Workspace((0.0, 0.0), (size, size)),
        horizon=Horizon(4.0, 0.1),
        information=UniformMap(),
        robots=tuple(Robot(f"r{k}", (0.2 + 0.35 * k, 0.2)) for k in range(count)),
        limits=Limits(acceleration=0.5, speed=1.0, separation=0.3),
    )
    return dataclasses.replace(base, **changes)


def high(points, z=Z):
    points = np.array(points, dtype=np.float64)
    return np.column_stack([points, np.broadcast_to(z, len(points))])


def swept(of, begin, passage):
    """(N, T, 3) everybody's way, densely."""
    lasting = max(duration(passage), 0.1)
    t = np.linspace(0.0, lasting, 2000)
    ways = [flown_by(passage.get(r.name, ()), p, lasting) for r, p in zip(of.robots, begin, strict=True)]
    return np.stack([way.evaluate(t)[:, :3] for way in ways])


def least_distance(ways, scale=1.0):
    return min(
        float(np.linalg.norm((a - b) * [1.0, 1.0, scale], axis=1).min()) for a, b in itertools.combinations(ways, 2)
    )


# ------------------------------------------------------------------------------------------------ the whole way


def search(begin, shift):
    """Everybody hops aside by the same."""
    return {name: flown_by([Move(tuple(p + np.array([*shift, 0.0])), 0.0, 4.0)], p, 4.0) for name, p in begin.items()}


def test_straight_together_and_fast_where_that_is_safe():
    of = mission(3, robots=tuple(Robot(f"r{k}", (0.4 + k, 2.0), pad=(0.4 + k, 0.2)) for k in range(3)))
    transfers = plan_transfers(of, search({r.name: high([r.start])[0] for r in of.robots}, (0.1, 0.3)))
    assert {len(moves) for moves in transfers.approach.values()} == {1}
    assert {move.begin for (move,) in transfers.approach.values()} == {0.0}
    assert duration(transfers.approach) == pytest.approx(1.8 / 0.3, abs=1e-3)  # the mission's mean speed
    assert all(moves[0].target[:2] == of.robots[k].pad for k, moves in enumerate(transfers.back.values()))
    down = {name: moves[0].target for name, moves in transfers.landing.items()}
    assert down == {r.name: (*r.pad, 0.0) for r in of.robots}


def test_landing_where_the_search_ends():
    of = mission(2, flight=Flight(return_to="none"))
    flown = search({r.name: high([r.start])[0] for r in of.robots}, (0.1, 0.8))
    transfers = plan_transfers(of, flown)
    assert not transfers.back
    assert transfers.landing["r0"][0].target == pytest.approx((0.3, 1.0, 0.0))
    assert all(item.passed for item in transition_checks(of, transfers, flown))


def test_the_slowest_limit_gives_the_time():
    begin, goal = high([(0.2, 0.2), (0.2, 1.0)]), high([(2.2, 0.2), (0.2, 1.0)])
    assert duration(plan_moves(mission(2), begin, goal)) == pytest.approx(2.0 / 0.3, abs=1.1e-3)
    fast = mission(2, flight=Flight(transfer_speed=3.0))
    assert duration(plan_moves(fast, begin, goal)) == pytest.approx(math.sqrt(7.5132 * 2.0 / 0.5), abs=1.1e-3)
    slow = (Robot("r0", (0.2, 0.2), limits=RobotLimits(speed=0.4)), Robot("r1", (0.2, 1.0)))
    assert duration(plan_moves(mission(2, robots=slow), begin, goal)) == pytest.approx(2.1875 * 2.0 / 0.4, abs=1.1e-3)
    near = high([(0.25, 0.2), (0.2, 1.0)])
    assert duration(plan_moves(mission(2), begin, near)) == SHORTEST


def test_who_would_meet_goes_one_after_another():
    begin, goal = high([(0.2, 1.0), (2.8, 1.2)]), high([(2.8, 1.0), (0.2, 1.2)])
    of = mission(2)
    assert duration(plan_moves(of, begin, goal)) > 2.6 / 0.3 + PAUSE
    ways = swept(of, begin, plan_moves(of, begin, goal))
    assert least_distance(ways) >= 0.3
    assert np.abs(ways[:, -1] - goal).max() < 1e-9


THINGS = [
    CircleObstacle((1.5, 1.5), 0.5),
    BoxObstacle((1.1, 1.2), (1.7, 1.9), rotation=0.4),
    PolygonObstacle(((1.0, 1.0), (2.0, 1.2), (1.3, 2.0))),
    BoxObstacle((1.2, 1.2, 0.5), (1.8, 1.8, 0.9)),
]


@pytest.mark.parametrize("thing", THINGS)
def test_around_what_is_in_the_way(thing):
    of = mission(1, obstacles=(thing,))
    begin, goal = high([(0.3, 1.5)]), high([(2.7, 1.4)])
    passage = plan_moves(of, begin, goal)
    (way,) = swept(of, begin, passage)
    assert solid(thing).value(way.T).min() >= ROOM - 1e-6
    assert np.linalg.norm(np.diff(way, axis=0), axis=1).sum() < 3.3, "not far around"
    assert len(passage["r0"]) <= 4


def test_over_what_is_low_if_the_fence_is_high_enough():
    wall = BoxObstacle((1.4, -1.0, 0.0), (1.6, 4.0, 0.7))
    with pytest.raises(TransferError, match=r"r0: obstacles\[0\] is in the way from \(0\.30.* inside the geofence"):
        plan_moves(mission(1, obstacles=(wall,)), high([(0.3, 1.5)]), high([(2.7, 1.5)]))
    roomy = mission(1, obstacles=(wall,), flight=Flight(geofence_margin=0.6))
    (way,) = swept(roomy, high([(0.3, 1.5)]), plan_moves(roomy, high([(0.3, 1.5)]), high([(2.7, 1.5)])))
    assert solid(wall).value(way.T).min() >= ROOM - 1e-6
    assert way[:, 2].max() < 0.8


def test_zones_bind_whom_they_name():
    zone = KeepOutZone(((1.0, 0.5), (2.0, 0.5), (2.0, 2.5), (1.0, 2.5)), robots=("r1",))
    begin, goal = high([(0.3, 1.0), (0.3, 1.6)]), high([(2.7, 1.0), (2.7, 1.6)])
    of = mission(2, zones=(zone,))
    ways = swept(of, begin, plan_moves(of, begin, goal))
    body = Solid(outline(zone))
    assert body.value(ways[0].T).min() < -0.4
    assert body.value(ways[1].T).min() >= ROOM - 1e-6


def test_nearer_than_one_likes_is_no_reason_to_stay():
    """A start 1 cm from a pillar, two pads exactly the separation apart: clearances shrink to what is given."""
    of = mission(2, obstacles=(CircleObstacle((1.5, 1.5), 0.5),))
    begin, goal = high([(0.2, 0.2), (0.2, 0.5)]), high([(2.01, 1.5), (0.2, 0.8)])
    ways = swept(of, begin, plan_moves(of, begin, goal))
    assert solid(of.obstacles[0]).value(ways[0].T).min() >= 0.01 - 1e-3
    assert least_distance(ways) >= 0.3 - 1e-5


def test_two_who_are_too_close_are_refused():
    with pytest.raises(TransferError, match=r"r0 and r1 are 0\.2 m apart at the beginning of their way; allowed"):
        plan_moves(mission(2), high([(0.2, 0.2), (0.4, 0.2)]), high([(0.2, 1.0), (1.4, 1.0)]))
    layers = mission(2, robots=(Robot("r0", (0.2, 0.2)), Robot("r1", (1.2, 0.2), altitude=1.0)))
    with pytest.raises(TransferError, match=r"r0 and r1 are 0\.2 m apart at the end of their way, vertical distance"):
        plan_moves(layers, high([(0.2, 0.2), (1.2, 0.2)], [Z, 1.0]), high([(0.5, 1.0), (0.5, 1.0)], [Z, 1.0]))


def test_who_cannot_pass_says_who_is_in_the_way():
    """A corridor as wide as one drone: nobody can make room."""
    walls = (BoxObstacle((-1.0, 1.2), (4.0, 4.0)), BoxObstacle((-1.0, -1.0), (4.0, 0.9)))
    of = mission(2, obstacles=walls, robots=(Robot("r0", (0.2, 1.05)), Robot("r1", (2.8, 1.05))))
    with pytest.raises(TransferError, match=r"r[01]: r[01] hovers in the way from .* and nobody can make room"):
        plan_moves(of, high([(0.2, 1.05), (2.8, 1.05)]), high([(2.8, 1.05), (0.2, 1.05)]))


coordinates = st.tuples(st.floats(0.2, 2.8), st.floats(0.2, 2.8))


@given(
    st.data(),
    st.integers(2, 5),
    st.sampled_from([(), (THINGS[0],), (THINGS[2],), (CylinderObstacle((1.5, 1.5), 0.4, 0.8),)]),
)
@settings(deadline=None, max_examples=60)
def test_whatever_is_planned_passes_the_certificate(data, count, things):
    """Random pads, starts and layers: a way that the certificate grants, or a line that says that there is none."""
    heights = data.draw(st.lists(st.sampled_from([0.6, 1.3]), min_size=count, max_size=count))
    places = []
    for _ in range(2):
        chosen = data.draw(st.lists(coordinates, min_size=count, max_size=count))
        apart = all(math.dist(a, b) >= 0.31 for a, b in itertools.combinations(chosen, 2))
        clear = all(solid(o).column().value(np.array([*p, 0.6])) >= 0.0 for o in things for p in chosen)
        places.append(chosen if apart and clear else None)
    if None in places:
        return
    pads, starts = places
    robots = tuple(
        Robot(f"r{k}", s, pad=p, altitude=z) for k, (p, s, z) in enumerate(zip(pads, starts, heights, strict=True))
    )
    of = mission(count, robots=robots, obstacles=things)
    flown = search({r.name: np.array([*r.start, r.altitude]) for r in robots}, (0.0, 0.0))
    try:
        transfers = plan_transfers(of, flown)
    except TransferError:
        return
    bad = [item for item in transition_checks(of, transfers, flown) if not item.passed]
    assert not bad
    assert plan_transfers(of, flown) == transfers, "the same every time"


def test_ten_robots_in_random_places_find_their_way():
    """Not proof, but a floor: nearly every swap of ten robots in 4 m by 4 m works out."""
    rng, found = np.random.default_rng(0), 0
    of = mission(10, size=4.0)
    for _ in range(10):
        begin, goal = high(spread(rng, 10)), high(spread(rng, 10))
        try:
            ways = swept(of, begin, plan_moves(of, begin, goal))
        except TransferError:
            continue
        assert least_distance(ways) >= 0.3
        found += 1
    assert found >= 9


def spread(rng, count):
    points = []
    while len(points) < count:
        point = rng.uniform(0.1, 3.9, 2)
        if all(math.dist(point, other) >= 0.32 for other in points):
            points.append(point)
    return points


# ------------------------------------------------------------------------------------------------ parts


@given(st.tuples(*[st.floats(0.0, 3.0)] * 4), st.floats(0.0, 1.5), st.floats(0.0, 1.5), st.sampled_from(THINGS))
@settings(deadline=None, max_examples=200)
def test_prisms_hit_what_comes_too_close(ends, low, top, thing):
    """Against dense samples: what comes closer than the clearance is a hit; what stays 1.5 times as far is not."""
    a, b = np.array([*ends[:2], low]), np.array([*ends[2:], top])
    prism = grown("it", solid(thing), 0.1, np.full((1, 3), 50.0))
    samples = a[:, None] + np.linspace(0.0, 1.0, 400) * (b - a)[:, None]
    distance = solid(thing).value(samples).min()
    if distance < 0.1 - 1e-3:
        assert prism.hits(a, b[None])[0]
    if distance > 0.15:
        assert not prism.hits(a, b[None])[0]


def test_closest_of_straight_ways_is_the_least_of_samples():
    rng = np.random.default_rng(1)
    begin, end = rng.normal(size=(2, 50, 3))
    s = np.linspace(0.0, 1.0, 20_001)[:, None, None]
    sampled = np.linalg.norm(begin + s * (end - begin), axis=-1).min(axis=0)
    assert closest(begin, end) == pytest.approx(sampled, abs=1e-6)
    assert closest(begin, begin) == pytest.approx(np.linalg.norm(begin, axis=-1))


# ------------------------------------------------------------------------------------------------ coming down early


def test_straight_down_where_nothing_is_below():
    of = mission(3, obstacles=(CylinderObstacle((1.5, 1.5), 0.3, 0.4),))
    positions = {"r0": (0.5, 0.5, 0.6), "r1": (1.0, 0.5, 0.7), "r2": (2.5, 2.5, 0.0)}
    assert clear_descents(of, positions, ["r0", "r1"]) == {}


def test_aside_where_an_obstacle_or_somebody_is_below():
    low = CylinderObstacle((1.5, 1.5), 0.3, 0.4)
    of = mission(4, obstacles=(low,))
    positions = {"r0": (1.6, 1.5, 0.6), "r1": (0.5, 0.5, 0.6), "r2": (0.55, 0.5, 1.0), "r3": (1.95, 1.5, 0.0)}
    passage = clear_descents(of, positions, ["r0", "r1", "r2"])
    assert set(passage) == {"r0", "r2"}, "the lower one stays"
    down = {name: passage[name][-1].target if name in passage else positions[name] for name in positions}
    assert solid(low).column().value(np.array(down["r0"])) >= ROOM - 1e-6
    for a, b in itertools.combinations(down.values(), 2):
        assert math.dist(a[:2], b[:2]) >= 2 * 0.07
    begin = np.array(list(positions.values()))
    assert math.dist(down["r0"], positions["r0"]) < 0.5
    assert solid(low).value(swept(of, begin, passage)[0].T).min() > 0.0


def test_nowhere_to_land_is_said():
    everywhere = BoxObstacle((-1.0, -1.0, 0.0), (4.0, 4.0, 0.3))
    with pytest.raises(TransferError, match="r0 has something below and no clear place to land within the geofence"):
        clear_descents(mission(1, obstacles=(everywhere,)), {"r0": (1.0, 1.0, 0.6)}, ["r0"])
