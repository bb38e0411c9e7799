"""Crazyswarm2's set-ups become missions that load, and missions become set-ups; what is lost is said."""

import pytest
import yaml

from missions.errors import MissionError
from missions.interchange.crazyflies import parse_crazyflies
from missions.interchange.motion_capture import parse_motion_capture
from missions.interchange.swarm_mission import swarm_mission
from missions.interchange.to_crazyflies import crazyflies_yaml
from missions.loader import parse_mission

# In the published format, version 3, with its comments' alternatives in use.
CRAZYFLIES = """
fileversion: 3

# named list of all robots
robots:
  cf231:
    enabled: true
    uri: radio://0/80/2M/E7E7E7E7E7
    initial_position: [0.0, 0.5, 0.0]
    type: cf21  # see robot_types
    firmware_params:
      kalman:
        pNAcc_xy: 1.0
  cf5:
    enabled: false
    uri: radio://0/80/2M/E7E7E7E705
    initial_position: [0.0, -0.5, 0.0]
    type: cf21_mocap_deck
  cf4:
    uri: radio://0/80/2M/E7E7E7E704
    initial_position: [1.0, -0.5, 0.1]
    type: cf21_mocap_deck
    role: pursuer

robot_types:
  cf21:
    motion_capture:
      tracking: "librigidbodytracker"
      marker: default_single_marker
      dynamics: default
    big_quad: false
    battery:
      voltage_warning: 3.8  # V
      voltage_critical: 3.6 # V
    firmware_params:
      ring:
        effect: 7
  cf21_mocap_deck:
    motion_capture:
      tracking: "vendor"
    big_quad: false
    battery:
      voltage_warning: 3.8
      voltage_critical: 3.7
    firmware_logging:
      custom_topics:
        topic_name3:
          frequency: 1
          vars: ["acc.x", "acc.y", "acc.z"]

all:
  firmware_logging:
    enabled: true
    default_topics:
      pose:
        frequency: 10 # Hz
  firmware_params:
    commander:
      enHighLevel: 1
    stabilizer:
      estimator: 2 # 1: complementary, 2: kalman
      controller: 1 # 1: PID, 2: mellinger
    ring:
      effect: 16
      headlightEnable: false
    locSrv:
      extPosStdDev: 1e-3
      extQuatStdDev: 0.5e-1
    kalman:
      pNAcc_xy: 0.5
      resetEstimation: 1
  reference_frame: "world"
  broadcasts:
    num_repeats: 15
    delay_between_repeats_ms: 1
"""

MOTION_CAPTURE = """
/motion_capture_tracking:
  ros__parameters:
    type: "optitrack"
    hostname: "192.168.2.15"
    topics:
      poses:
        qos: {mode: "sensor", deadline: 100.0}
    marker_configurations:
      default:
        offset: [0.0, 0.0, 0.0]
        points: {p0: [0.0, 0.0, 0.022]}
    dynamics_configurations:
      default: {max_velocity: [2, 2, 3], max_fitness_score: 0.001}
"""


def imported(text=CRAZYFLIES, capture=None):
    swarm = parse_crazyflies(text, "crazyflies.yaml")
    out, notes = swarm_mission(swarm, capture, name="lab", file="crazyflies.yaml")
    return parse_mission(out, path="lab.yaml", read_file=lambda _: b""), notes, out


def test_robots_that_are_enabled_become_the_mission():
    mission, _, text = imported()
    assert [(r.name, r.uri, r.start) for r in mission.robots] == [
        ("cf231", "radio://0/80/2M/E7E7E7E7E7", (0.0, 0.5)),
        ("cf4", "radio://0/80/2M/E7E7E7E704", (1.0, -0.5)),
    ]
    assert (mission.workspace.lower, mission.workspace.upper) == ((-1.0, -1.5), (2.0, 1.5))
    assert mission.flight.controller == "pid"
    assert mission.flight.battery_minimum == 3.7
    assert mission.flight.airframe == "cf21"
    assert text.startswith("# Made from crazyflies.yaml")


def test_the_nearest_parameter_wins():
    robots = {robot.name: robot for robot in parse_crazyflies(CRAZYFLIES, "c.yaml").robots}
    assert robots["cf231"].parameters["kalman.pNAcc_xy"] == 1.0  # its own before everybody's
    assert robots["cf4"].parameters["kalman.pNAcc_xy"] == 0.5
    assert robots["cf231"].parameters["ring.effect"] == 7.0  # its type's before everybody's
    assert robots["cf4"].parameters["ring.effect"] == 16.0
    assert robots["cf4"].parameters["ring.headlightEnable"] == 0.0
    assert robots["cf4"].parameters["locSrv.extQuatStdDev"] == 0.05


def test_only_what_all_share_becomes_a_parameter_and_the_rest_is_said():
    mission, notes, text = imported()
    assert dict(mission.flight.parameters) == {
        "ring.headlightEnable": 0.0,
        "locSrv.extPosStdDev": 0.001,
        "locSrv.extQuatStdDev": 0.05,
    }
    for lost in (
        "firmware_params ring.effect: differs",
        "firmware_params kalman.pNAcc_xy: differs",
        "firmware_params kalman.resetEstimation: every flight",
        "firmware_params stabilizer.estimator: every flight",
        "robots.cf4.role",
        "robots.cf4.initial_position: height 0.1 m",
        "robots that are not enabled: cf5",
        "markers (default_single_marker): robots are told apart by one marker each, all of them",
        "robot_types.cf21_mocap_deck.firmware_logging",
        "all.firmware_logging",
        "all.broadcasts",
    ):
        assert [note for note in notes if note.startswith(lost)], lost
        assert f"#   {lost}" in text
    assert not [note for note in notes if "controller" in note or "reference_frame" in note]


def test_a_voltage_meant_for_flight_never_weakens_the_one_for_take_off():
    for critical, expected in ((3.2, 3.7), (3.85, 3.85), (7.0, 4.3)):
        text = CRAZYFLIES.replace("voltage_critical: 3.6", f"voltage_critical: {critical}")
        mission, notes, _ = imported(text)
        assert mission.flight.battery_minimum == expected
        assert bool([note for note in notes if "voltage_critical" in note]) == (critical < 3.7)


def test_motion_capture_becomes_a_hint():
    capture = parse_motion_capture(MOTION_CAPTURE, "motion_capture.yaml")
    assert (capture.system, capture.hostname) == ("optitrack", "192.168.2.15")
    _, notes, text = imported(capture=capture)
    assert "ergoflie fly PLAN --mocap optitrack --mocap-host 192.168.2.15" in text
    assert "motion_capture.yaml: dynamics_configurations" in notes
    other = parse_motion_capture(MOTION_CAPTURE.replace("optitrack", "nokov"), "m.yaml")
    assert "m.yaml: type 'nokov' is not among those tested here: vicon, optitrack, qualisys, vrpn" in other.notes
    with pytest.raises(MissionError, match=r"^m\.yaml.*missing key 'type'"):
        parse_motion_capture("robots: {}", "m.yaml")


SINGLE = """
  ros__parameters:
    type: optitrack
    marker_configurations:
      default_single_marker:
        offset: [0.0, 0.0, -0.01]
        points: {p0: [0.0, 0.0, 0.03]}
      four: {points: {p0: [0.0, 0.0, 0.02], p1: [0.01, 0.0, 0.02]}}
"""


def test_robots_with_one_marker_each_are_told_apart_by_motion():
    text = CRAZYFLIES.replace('tracking: "vendor"', "{tracking: librigidbodytracker, marker: default_single_marker}")
    text = text.replace("motion_capture:\n      {", "motion_capture: {")
    mission, notes, _ = imported(text)
    assert (mission.motion_capture.tracking, mission.motion_capture.height) == ("markers", 0.0)
    capture = parse_motion_capture(f"/motion_capture_tracking:{SINGLE}", "m.yaml")
    mission, notes, _ = imported(text, capture)
    assert (mission.motion_capture.tracking, mission.motion_capture.height) == ("markers", 0.02)
    assert not [note for note in notes if note.startswith("markers")]
    mission, notes, _ = imported(text.replace("default_single_marker", "four"), capture)
    assert mission.motion_capture.tracking == "bodies"
    assert [note for note in notes if note.startswith("markers (four)")]
    assert imported(CRAZYFLIES.replace("librigidbodytracker", "vendor"))[0].motion_capture.tracking == "bodies"


def test_names_that_yaml_would_misread_and_comments_that_would_break_out():
    text = CRAZYFLIES.replace("  cf231:", "  on:").replace('"optitrack"', "x")
    mission, _, _ = imported(text)
    assert mission.robots[0].name == "on"
    evil = MOTION_CAPTURE.replace('"192.168.2.15"', '"a\\nschema_version: 2"')
    mission, _, _ = imported(capture=parse_motion_capture(evil, "m.yaml"))
    assert mission.schema_version == 1


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("enabled: true\n    uri", "enabled: false\n    uri", None),
        ("uri: radio://0/80/2M/E7E7E7E7E7", "uri: radio://0/200/2M/E7E7E7E7E7", "c.yaml:8: robots.cf231.uri: got"),
        ("    uri: radio://0/80/2M/E7E7E7E7E7\n", "", "robots.cf231: allowed: a robot with 'uri'"),
        ("[0.0, 0.5, 0.0]", "[0.0, 0.5]", "c.yaml:9: robots.cf231.initial_position: allowed: three numbers"),
        ("[0.0, 0.5, 0.0]", "[0.0, .nan, 0.0]", "robots.cf231.initial_position: got"),
        ("[0.0, 0.5, 0.0]", "[0.0, [1], 0.0]", "robots.cf231.initial_position: allowed: three numbers"),
        ("type: cf21  #", "type: cf22  #", "robots.cf231.type: got 'cf22'; allowed: a key of robot_types"),
        ("pNAcc_xy: 1.0", "pNAcc_xy: fast", "robots.cf231.firmware_params.kalman.pNAcc_xy: got 'fast'"),
        ("pNAcc_xy: 1.0", '"a: 1": 1.0', "allowed: the group and the name of an on-board parameter"),
        ("pNAcc_xy: 1.0", "pNAcc_xy: [1]", "allowed: a single value"),
        ("  cf231:", "  cf 231:", "allowed as a name"),
        ("enabled: true\n    uri", "enabled: perhaps\n    uri", "robots.cf231.enabled: got 'perhaps'; allowed: true"),
        ("robot_types:", "robot_types: 3\nother:", "robot_types: allowed: a mapping"),
        ("[1.0, -0.5, 0.1]", "[0.0, 0.45, 0.0]", "robots.cf4.initial_position: cf231 and cf4 stand 0.05 m apart"),
        ("E7E7E7E704", "E7E7E7E7E7", "robots[1].uri"),
        ("[1.0, -0.5, 0.1]", "[5000.0, 0.0, 0.0]", "these robots make no mission: workspace further than"),
    ],
)
def test_what_is_refused(old, new, expected):
    assert old in CRAZYFLIES
    text = CRAZYFLIES.replace(old, new, 1)
    if expected is None:
        text, expected = (
            text.replace("    uri: radio://0/80/2M/E7E7E7E704", "    enabled: false\n    uri: udp://a:1"),
            "no robot is",
        )
    with pytest.raises(MissionError) as refused:
        swarm_mission(parse_crazyflies(text, "c.yaml"), None, name="lab", file="c.yaml")
    assert expected in str(refused.value)
    assert str(refused.value).startswith("c.yaml")
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("text", ["", "[]", "robots: 3", "robots: {a: 3}", "robots:\n\t- x", "{", "robots: {}"])
def test_no_set_up_at_all(text):
    with pytest.raises(MissionError, match=r"^c\.yaml"):
        parse_crazyflies(text, "c.yaml")


def test_close_pads_lower_the_separation():
    mission, _, _ = imported(CRAZYFLIES.replace("[1.0, -0.5, 0.1]", "[0.25, 0.5, 0.0]"))
    assert mission.limits.separation == 0.25


def test_a_mission_comes_back_from_crazyswarm2():
    mission, _, _ = imported()
    text = crazyflies_yaml(mission)
    again, notes, _ = imported(text)
    assert again.robots == mission.robots
    assert again.flight == mission.flight
    assert again.workspace == mission.workspace
    assert not [note for note in notes if "differs" in note]


def test_other_readers_see_the_same_numbers():
    mission, _, _ = imported(CRAZYFLIES.replace("extPosStdDev: 1e-3", "extPosStdDev: 0.00001"))
    tree = yaml.safe_load(crazyflies_yaml(mission))
    assert tree["fileversion"] == 3
    assert tree["robots"]["cf4"]["initial_position"] == [1, -0.5, 0]
    assert tree["robots"]["cf4"]["enabled"] is True
    assert tree["all"]["firmware_params"]["locSrv"] == {"extPosStdDev": 1e-5, "extQuatStdDev": 0.05}
    assert tree["all"]["firmware_params"]["stabilizer"] == {"estimator": 2, "controller": 1}
    assert set(tree["robot_types"]) == {robot["type"] for robot in tree["robots"].values()}
