"""The matrix: what goes wrong, and when; every case is the text of a scenario file."""

import itertools
import json
import random
from typing import NamedTuple

from tests.chaos.arena import NAMES

FALLS = "falls"  # the fault itself may take these drones out of the air
CUT = "cut off"  # these drones are beyond hearing for good
AWAY = "away"  # these drones are beyond hearing for a while
TOLD = "told"  # everybody flies and hears: what happens is the flight code's doing


class Fault(NamedTuple):
    """One row of the matrix.

    Attributes:
        event: of the scenario; when is up to the case.
        nature: what it may lead to, see above. whom: for whom.
        word: what has to be said of a flight that ends early because of it (a regular expression).
        on_host_loss: the mission's setting.
    """

    event: dict
    nature: str
    whom: tuple[str, ...]
    word: str
    on_host_loss: str = "continue"


def _fault(kind, nature, whom, word, on_host_loss="continue", **fields):
    return Fault({"fault": kind, **fields}, nature, whom, word, on_host_loss)


ONE, TWO = ("cf2",), ("cf2", "cf3")
LINK = "link|no answer|silent|nothing heard|connect|crazy radio|packets lost"
SEEN = "pose|motion capture|estimat"
PLACE = "should be|geofence|altitude|start of the trajectory|tilts|supervisor|ready|pad|apart|estimat|level"
FAULTS = {
    "bad radio": _fault("loss", TOLD, NAMES, LINK, rate=0.4, burst=0.05, duration=2.0),
    "silence": _fault("silence", AWAY, ONE, LINK, to="cf2", duration=2.5),
    "blink": _fault("silence", TOLD, ONE, LINK, to="cf2", duration=0.12),
    "reconnect": _fault("reconnect", AWAY, ONE, LINK, to="cf2", duration=1.0),
    "dead dongle": _fault("reconnect", CUT, ("cf1", "cf2"), LINK, to="dongle 0"),
    "slow link": _fault("slow_link", TOLD, NAMES, LINK, latency=0.06),
    "reboot": _fault("reboot", FALLS, ONE, f"{LINK}|{PLACE}", to="cf2"),
    "low battery": _fault("battery_low", TOLD, ONE, "battery", to="cf2", charge=0.06),
    "empty battery": _fault("battery_low", FALLS, ONE, f"battery|{LINK}|{PLACE}", to="cf2", charge=0.0),
    "weak motor": _fault("motor_failure", FALLS, ONE, PLACE, to="cf2", motor=3, left=0.5),
    "dead motor": _fault("motor_failure", FALLS, ONE, PLACE, to="cf2", motor=1),
    "tumble": _fault("tumble", FALLS, ONE, PLACE, to="cf2", rate=40.0),
    "mocap gone": _fault("mocap_dropout", TOLD, NAMES, SEEN),
    "mocap blink": _fault("mocap_dropout", TOLD, NAMES, SEEN, duration=0.5),
    "body hidden": _fault("mocap_dropout", TOLD, ONE, SEEN, to="cf2"),
    "swap": _fault("mocap_swap", TOLD, TWO, f"{SEEN}|{PLACE}", to="cf2", other="cf3"),
    "brief swap": _fault("mocap_swap", TOLD, TWO, f"{SEEN}|{PLACE}", to="cf2", other="cf3", duration=0.3),
    "outlier": _fault("mocap_outlier", TOLD, ONE, f"{SEEN}|{PLACE}", to="cf2", offset=[0.5, 0.0, 0.0], duration=0.03),
    "displaced": _fault("mocap_outlier", TOLD, ONE, f"{SEEN}|{PLACE}", to="cf2", offset=[0.25, 0.0, 0.0]),
    "operator": _fault("operator_abort", TOLD, NAMES, "operator"),
    "motors off": _fault("operator_abort", FALLS, NAMES, "operator", times=2),
    "host killed": _fault("process_kill", CUT, NAMES, "killed", watch=6.0),
    "host killed, watchdog": _fault("process_kill", CUT, NAMES, "killed", "motor_stop", watch=6.0),
}
# When; and how many packets later it hits what is said to one drone.
PHASES = {
    "connecting": ({"at": 0.0}, 30),
    "checking": ({"when": "connected", "after": 0.5}, 0),
    "uploading": ({"when": "checked"}, 4),
    "arming": ({"when": "uploaded"}, 0),
    "taking off": ({"when": "taking off", "after": 0.7}, 0),
    "transferring": ({"when": "transferring", "after": 0.7}, 0),
    "settling": ({"when": "settling", "after": 0.2}, 0),
    "on mission": ({"when": "on mission", "after": 1.2}, 0),
    "holding": ({"when": "holding", "after": 0.2}, 0),
    "returning": ({"when": "returning", "after": 1.0}, 0),
    "landing": ({"when": "landing", "after": 0.6}, 0),
}
POLICIES = ("land_all", "land_all", "return", "hold", "land_here", "stop_motors")  # of random sequences


class Case(NamedTuple):
    """One flight: its name, its scenario, its faults with their targets, and what the mission says of such things."""

    name: str
    text: str
    faults: tuple[Fault, ...]
    on_host_loss: str
    policy: str = "land_all"


def cell(name, phase):
    """One cell of the matrix."""
    return together(f"{name} / {phase}", [(name, phase)])


def together(title, cells):
    """Several cells of the matrix in one flight."""
    faults, events = [FAULTS[name] for name, _ in cells], []
    for fault, (_, phase) in zip(faults, cells, strict=True):
        when, packets = PHASES[phase]
        counted = {"packets": packets} if packets and fault.event.get("to") in NAMES else {}
        events.append({**fault.event, **counted, **when})
    return Case(title, _scenario(title, 1, events), tuple(faults), faults[0].on_host_loss)


def matrix():
    """Every fault in every phase."""
    return [cell(name, phase) for name, phase in itertools.product(FAULTS, PHASES)]


def sequence(seed, longest=17.0):
    """One to four faults at random times of a flight so long [s], each with random targets; and a random policy."""
    chance = random.Random(seed)
    faults, events = [], []
    on_host_loss = chance.choice(["continue", "motor_stop"])
    for _ in range(chance.randint(1, 4)):
        fault = FAULTS[chance.choice(sorted(FAULTS))]
        others = dict(zip(NAMES, chance.sample(NAMES, len(NAMES)), strict=True))
        named = {key: others.get(fault.event[key], fault.event[key]) for key in ("to", "other") if key in fault.event}
        event = {**fault.event, **named}
        if "duration" in event:
            event["duration"] = round(event["duration"] * chance.uniform(0.3, 3.0), 3)
        whom = fault.whom if event.get("to", "dongle 0") == "dongle 0" else tuple(others[name] for name in fault.whom)
        event["at"] = round(chance.uniform(0.0, longest), 2)
        faults.append(fault._replace(event=event, whom=whom, on_host_loss=on_host_loss))
        events.append(event)
    policy = chance.choice(POLICIES)
    return Case(f"seed {seed}", _scenario(f"chance {seed}", seed, events), tuple(faults), on_host_loss, policy)


def _scenario(name, seed, events):
    lines = "".join(f"  - {json.dumps(event)}\n" for event in events)
    return f"name: {json.dumps(name)}\nseed: {seed}\nevents:\n{lines}"
