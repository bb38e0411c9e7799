"""LED rings: they show how wide each robot sees, on the radio that is left over, and nothing waits for them."""

import dataclasses
import itertools

import numpy as np
import pytest

from deploy.errors import CommandRefused
from deploy.flight.lights import Lights, ring_parameters
from deploy.flightlog.reader import read_log
from deploy.phases import Phase
from deploy.radio.drone import Drone
from deploy.radio.requests import Reply
from deploy.radio.simulated.air.model import AirModel
from deploy.radio.simulated.led_ring import LedRing
from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.toc import param_toc
from missions.fleet import altitudes
from missions.footprint import CameraFootprint, ConeFootprint, DiscFootprint, PointFootprint, WindowFootprint
from missions.lights import DARK, DIMMEST, LIGHT_PERIOD, NARROW, WIDE, colour, lit, spread
from missions.objects import InspectedObject, Surface
from missions.radio import background_rate
from missions.schema import Radio
from tests.deploy.flight_bench import At, fly_on, parsed, small_mission, small_plan, small_text, stage

RING = ", decks: [led_ring], altitude: "
CONE = "footprint: {type: cone, slope: 0.5}"


def shining(more=CONE, cf1=RING + "0.25", cf2=RING + "0.5"):
    return small_plan(parsed(small_text(cf1, cf2, more)))


def flown(tmp_path, plan, operator=None):
    """Outcome, log, and what the rings shone like every 0.1 s of the flight: (t, {robot: colour})."""
    seen = []
    with stage(tmp_path, plan) as ready:
        drones = list(ready.swarm.drones.values())
        ready.world.every(0.1, lambda t: seen.append((t, [drone.light for drone in drones])))
        extra = {} if operator is None else {"operator": operator.bind(ready.clock)}
        outcome = fly_on(ready, plan, **extra)
    return outcome, read_log(next(tmp_path.glob("flight-*.mcap"))), seen


def test_colours_go_from_warm_and_bright_to_cold_and_dim():
    assert colour(0.1, 0.1, 0.5) == colour(0.01, 0.1, 0.5) == NARROW
    assert colour(0.5, 0.1, 0.5) == tuple(round(0.2 * part) for part in WIDE)
    assert max(colour(5.0, 0.1, 5.0)) == round(255 * DIMMEST)
    brightness = [max(colour(wide, 0.1, 0.5)) for wide in (0.1, 0.15, 0.2, 0.3, 0.5)]
    assert brightness == sorted(brightness, reverse=True)
    assert colour(0.2, 0.2, 0.2) == NARROW  # of one size all the time


@pytest.mark.parametrize(
    ("footprint", "wide"),
    [
        (PointFootprint(), 0.0),
        (DiscFootprint(0.3), 0.3),
        (ConeFootprint(0.5), 0.4),
        (WindowFootprint((0.2, 0.8)), 0.32),
        (CameraFootprint(half_angle=0.46364760900080615), 0.4),
    ],
    ids=lambda item: getattr(item, "type", ""),
)
def test_how_wide_one_sees_from_above(footprint, wide):
    assert spread(footprint, 0.8) == pytest.approx(wide)


def test_only_rings_with_a_footprint_are_lit_and_counted_on():
    one = parsed(small_text(RING + "0.3", more=CONE))
    assert lit(one) == ("cf1",)
    assert ring_parameters(one, "cf1")["ring.effect"] == 14
    assert ring_parameters(one, "cf2") == {}
    without = parsed(small_text(RING + "0.3"))
    assert lit(without) == lit(parsed(small_text(RING + "0.3", more="footprint: {type: point}"))) == ()
    assert background_rate(one) - background_rate(without) == 2.0 / LIGHT_PERIOD


def test_the_simulated_ring_fades_as_the_firmware_does():
    toc = param_toc()
    parameters = Parameters(toc, {})
    ring = LedRing(parameters)
    assert ring.run(0.0) == DARK  # effect 0
    for name, value in (("fadeTime", 0.5), ("fadeColor", 0x000000), ("effect", 14)):
        parameters.set(f"ring.{name}", value)
    assert ring.run(1.0) == (255.0, 255.0, 255.0)
    assert ring.run(1.5) == (0.0, 0.0, 0.0)
    parameters.set("ring.fadeColor", 0x64C80A)
    assert ring.run(2.0) == (0.0, 0.0, 0.0)
    assert ring.run(2.25) == pytest.approx((50.0, 100.0, 5.0))
    parameters.set("ring.fadeColor", 0)  # from the colour it has in the middle of a fade
    assert ring.run(2.25) == pytest.approx((50.0, 100.0, 5.0))
    assert ring.run(2.5) == pytest.approx((25.0, 50.0, 2.5))


def test_rings_show_what_is_seen_while_the_plan_is_flown(tmp_path):
    plan = shining()
    outcome, log, seen = flown(tmp_path, plan)
    assert outcome.phase is Phase.LANDED
    start, end = (next(e.t for e in log.events if e.name == name) for name in ("mission_start", "mission_end"))
    low, high = (spread(ConeFootprint(0.5), z) for z in altitudes(plan.mission))
    during = [colours for t, colours in seen if start + 1.2 < t < end - 0.1]
    for robot, wide in ((0, low), (1, high)):
        wanted = colour(wide, low, high)
        assert all(colours[robot] == pytest.approx(wanted, abs=12.0) for colours in during), wanted
    assert all(colours == [DARK, DARK] for t, colours in seen if start - 2.0 < t < start)
    assert seen[-1][1] == [DARK, DARK]
    for robot, wide in (("cf1", low), ("cf2", high)):
        lights = log.of(robot, "light")
        assert start < lights.t[0] < start + 0.2
        assert lights["spread"][0] == pytest.approx(wide, abs=0.03)
        assert [lights[name][-1] for name in ("red", "green", "blue")] == [0, 0, 0]
        assert all(b - a > LIGHT_PERIOD - 0.02 for a, b in itertools.pairwise(lights.t))


def test_no_colour_is_sent_once_a_flight_ends_early(tmp_path, monkeypatch):
    sent = []
    send = Drone.send_parameter
    monkeypatch.setattr(
        Drone, "send_parameter", lambda self, *a: sent.append(self._link._clock.now()) or send(self, *a)
    )
    operator = At(9.0)
    outcome, log, _ = flown(tmp_path, shining(), operator=operator)
    assert outcome.phase is Phase.ABORTED
    began = next(event.t for event in log.events if event.name == "abort" or "operator" in event.text)
    assert sent, "it was on its way"
    assert max(sent) <= began


class OldDrone:
    """One whose firmware cannot fade."""

    connected, asked = True, 0

    def send_parameter(self, name, value):
        self.asked += 1
        raise CommandRefused(f"it has no parameter '{name}'")


def test_a_firmware_that_cannot_fade_is_asked_once():
    drone = OldDrone()
    lights = Lights(shining().mission, {"cf1": drone}, log=None)
    for turn in range(300):
        lights.turn(0.01 * turn, lambda name: (0.5, 0.5, 0.3), showing=True)
    assert drone.asked == 1


class Told(OldDrone):
    """One that is told colours and says nothing."""

    def send_parameter(self, name, value):
        self.colour = (int(value) >> 16 & 0xFF, int(value) >> 8 & 0xFF, int(value) & 0xFF)
        return Reply(None, 0.0)


def test_around_an_object_it_is_the_distance_that_counts():
    """Nearest point of the surface; ``near`` is the narrowest, ``far`` the widest."""
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.0, 1.0]])
    seen = Surface(points, np.zeros((0, 3), int), points, points, 1.0, np.ones(2), np.zeros(2, int))
    thing = InspectedObject("thing.ply", near=0.4, far=1.6, surface=seen)
    robots = tuple(dataclasses.replace(robot, decks=("led_ring",)) for robot in small_mission().robots)
    mission = dataclasses.replace(
        small_mission(), robots=robots, footprint=CameraFootprint(half_angle=0.5), object=thing
    )
    for distance, wanted in ((0.4, colour(1.0, 1.0, 4.0)), (0.8, colour(2.0, 1.0, 4.0)), (1.6, colour(4.0, 1.0, 4.0))):
        drone = Told()
        lights = Lights(mission, {"cf1": drone}, log=None)
        lights.turn(0.0, lambda name, away=distance: (away, 0.0, 1.0), showing=True)
        assert drone.colour == wanted


class Deaf(OldDrone):
    """One that never answers."""

    def __init__(self):
        self.waiting = []

    def send_parameter(self, name, value):
        self.asked += 1
        self.waiting.append(Reply(None, 0.01 * self.now))
        return self.waiting[-1]

    def forget(self, reply):
        self.waiting.remove(reply)


def test_who_does_not_answer_is_told_nothing_for_a_while():
    drone = Deaf()
    lights = Lights(shining().mission, {"cf1": drone}, log=None)
    for drone.now in range(450):
        lights.turn(0.01 * drone.now, lambda name: (0.5, 0.5, 0.3), showing=True)
    assert drone.asked == 3  # at 0, and 2 s after each
    assert len(drone.waiting) == 1


def test_a_dongle_that_carries_no_more_than_the_budget_carries_the_lights(tmp_path):
    """Two drones with rings on a dongle of just so many exchanges a second: nobody is late, lost or poorly heard."""
    mission = shining().mission
    tight = dataclasses.replace(mission, radio=Radio(packet_rate=2.0 * background_rate(mission)))
    plan = small_plan(tight)
    with stage(tmp_path, plan, air=AirModel.of(tight)) as ready:
        outcome = fly_on(ready, plan, mocap=ready.capture)
        assert outcome.phase is Phase.LANDED
        assert all(line.dropped == 0 for line in ready.air.lines.values())
    lights = read_log(next(tmp_path.glob("flight-*.mcap"))).of("cf1", "light")
    assert 2 <= len(lights) <= mission.horizon.duration / LIGHT_PERIOD + 3
    assert max(outcome.largest_error.values()) < 0.1  # [m]
