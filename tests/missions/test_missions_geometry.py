"""Shapes, zones, ends and limits of single robots: what is refused, with place and reason; what is understood."""

import math
import re
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

import missions
import missions.shapes
from missions import MissionError, fleet, load_mission, parse_mission

EXAMPLES = Path(missions.__file__).parent / "examples"
ZONES, LAYERS, ROOM = ((EXAMPLES / name).read_text() for name in ("zones.yaml", "layers.yaml", "room_in_3d.yaml"))
STAY = "\nflight: {return_to: none}\n"  # lands where the search ends


def refuse(text, old, new):
    assert text.count(old) >= 1, old
    with pytest.raises(MissionError) as caught:
        parse_mission(text.replace(old, new, 1), path="m.yaml", read_file=bytes)
    message = str(caught.value)
    assert message.isprintable()
    assert re.match(r"m\.yaml:\d+: ", message), message
    return message


POLYGON = "[[1.9, -0.9], [2.5, -1.0], [2.6, -0.5], [2.2, -0.3]]"
REFUSED = [
    # shapes
    (ZONES, POLYGON, "[[1.9, -0.9], [2.5, -1.0]]", r"obstacles\[0\]\.vertices: got 2 items; allowed: 3 to 100"),
    (ZONES, POLYGON, "[[1.9, -0.9], [2.5, -1.0, 0.0], [2.2, -0.3]]", r"obstacles\[0\]\.vertices\[1\]: got 3 numbers"),
    (
        ZONES,
        POLYGON,
        "[[1.9, -0.9], [2.5, -1.0], [2.2, -0.8], [2.2, -0.3]]",
        r"obstacles\[0\]\.vertices\[2\]: got \(2\.2, -0\.8\), where the polygon turns back; allowed: a convex polygon",
    ),
    (
        ZONES,
        POLYGON,
        "[[2.2, -0.3], [2.2, -0.8], [2.5, -1.0], [1.9, -0.9]]",
        r"obstacles\[0\]\.vertices\[1\]: got \(2\.2, -0\.8\), where the polygon turns back",
    ),
    (
        ZONES,
        POLYGON,
        "[[2, -1], [2.6, -0.6], [1.9, -0.6], [2.5, -1], [2.25, -0.4]]",
        r"obstacles\[0\]\.vertices: the corners go around 2 times; allowed: once",
    ),
    (
        ZONES,
        POLYGON,
        "[[2, -1], [2.5, -1], [2.5, -1], [2.2, -0.4]]",
        r"vertices\[2\]: got \(2\.5, -1\), the same corner as \[1\]",
    ),
    (ZONES, POLYGON, "[[2, -1], [2.2, -1], [2.5, -1]]", r"obstacles\[0\]\.vertices.*(turns back|wide)"),
    (ZONES, POLYGON, "[[2, -1], [2.5, -1], [2.5, -0.9999]]", r"obstacles\[0\]\.vertices.*(wide|same corner)"),
    (ZONES, POLYGON, POLYGON + ", height: 0.5, base: 0.6", r"obstacles\[0\]\.height: got 0\.5 over a base at 0\.6"),
    (ROOM, "lower: [0.6, 0.6, 0.0]", "lower: [0.6, 0.6]", r"obstacles\[1\]\.upper: got 3 numbers; allowed: 2"),
    (ROOM, "lower: [0.6, 0.6, 0.0]", "lower: [0.9, 0.6, 0.0]", r"obstacles\[1\]\.upper\[0\]: got 0\.8 over a lower"),
    (ROOM, "height: 0.9", "height: 0.0", r"obstacles\[0\]\.height: got 0\.0; allowed: above 0"),
    (
        LAYERS,
        "radius: 0.15, height: 0.9",
        "radius: 5.0, height: 1.3",
        r"obstacles: the obstacles cover the whole workspace",
    ),
    # zones
    (
        ZONES,
        "robots: [west]",
        "robots: [wets]",
        r"zones\[1\]\.robots\[0\]: unknown robot 'wets' \(did you mean 'west'\?\)",
    ),
    (ZONES, "start: [1.4, -1.6]", "start: [3.6, -1.6]", r"robots\[0\]\.start: .* 0\.2 m outside zones\[1\]"),
    (ZONES, "start: [4.6, -1.6]", "start: [4.8, 0.2]", r"robots\[1\]\.start: got \(4\.8, 0\.2\) inside zones\[0\]"),
    (ZONES, "start: [1.4, -1.6]", "start: [2.2, -0.7]", r"robots\[0\]\.start: .* inside obstacles\[0\], 0\.\d+ m deep"),
    (ZONES, "start: [1.4, -1.6]", "start: [1.4, -1.6], pad: [4.9, 0.4]", r"robots\[0\]\.pad: .* inside zones\[0\]"),
    (ZONES, "type: keep_out", "type: keepout", r"zones\[0\]\.type: got 'keepout'; allowed: keep_out, keep_in"),
    # single robots
    (
        ZONES,
        "limits: {speed: 0.6}",
        "limits: {speed: 2.6}",
        r"robots\[1\]\.limits\.speed: got 2\.6; allowed: at most 2",
    ),
    (
        ZONES,
        "limits: {speed: 0.6}",
        "limits: {acceleration: 9.6}",
        r"robots\[1\]\.limits\.acceleration: got 9\.6; allowed: at most 3\.5",
    ),
    (
        ZONES,
        "limits: {speed: 0.6}",
        "velocity: [0.6, 1.2]",
        r"robots\[1\]\.velocity: got a speed of 1\.34; .* 1 \[m/s\]",
    ),
    (ZONES, "limits: {speed: 0.6}", "velocity: [0.6]", r"robots\[1\]\.velocity: got 1 items; allowed: 2 to 3"),
    (ROOM, "end: start,", "end: start, altitude: 0.5,", r"robots\[0\]\.altitude: got 0\.5; allowed in 2-D workspaces"),
    (
        ROOM,
        "schema_version: 1",
        "schema_version: 1\nsolver: {method: imec}",
        r"robots\[0\]\.end: given with the method imec; allowed: with fast",
    ),
    (
        ROOM,
        "schema_version: 1",
        "schema_version: 1\ndynamics: {type: single_integrator}",
        r"robots\[0\]\.end: given with dynamics of type single_integrator; allowed: with double_integrator",
    ),
    (ROOM, "end: start,", "end: begin,", r"robots\[0\]\.end: got 'begin'; allowed: start"),
    (ROOM, "end: start,", "end: [0.5, 0.5],", r"robots\[0\]\.end: got 2 numbers; allowed: 3"),
    (ROOM, "end: start,", "end: [0.5, 0.5, 1.7],", r"robots\[0\]\.end: .* outside the workspace"),
    (ROOM, "end: start,", "end: [0.1, 0.0, 0.5],", r"robots\[0\]\.end: .* inside obstacles\[0\]"),
    (
        ROOM + STAY,
        "end: start,",
        "end: [0.1, 0.0, 1.2],",
        r"robots\[0\]\.end: .* above obstacles\[0\]; allowed: nothing below",
    ),
    (ROOM, "end: start,", "end: [1.0, 0.6, 1.3],", r"robots\[1\]\.end: ends of cf1 and cf2 are 0\.2 m apart, vertical"),
    (
        ROOM + STAY,
        "end: start,",
        "end: [1.0, 0.7, 1.6],",
        r"robots\[1\]\.end: .* 0\.1 m apart seen from above; .* land",
    ),
    (
        ROOM,
        "start: [1.0, 0.6, 0.9]",
        "start: [-1.0, -0.6, 1.2], pad: [0.9, -0.6]",
        r"robots\[1\]\.start: starts of cf1 and cf2 are 0\.25 m apart, vertical distance counted as downwash has it",
    ),
    (
        ROOM,
        "start: [-1.0, -0.6, 0.7], end: start",
        "start: [0.0, 0.0, 1.2]",
        r"robots\[0\]\.pad: under its start .* inside obst",
    ),
    (
        LAYERS,
        "vertical_separation: 0.5",
        "vertical_separation: 0.2",
        r"limits\.vertical_separation: got 0\.2; allowed: at least the separation of 0\.3",
    ),
    (LAYERS + STAY, "end: [0.0, -0.8]", "end: [-0.4, 0.3]", r"robots\[2\]\.end: got .* above obstacles\[1\]"),
    (LAYERS, "end: [0.0, -0.8]", "end: [0.7, 0.6]", r"robots\[2\]\.end: ends of middle and high are"),
]


@pytest.mark.parametrize(("text", "old", "new", "message"), REFUSED)
def test_refused_with_place_and_reason(text, old, new, message):
    error = refuse(text, old, new)
    assert re.search(message, error), error


@pytest.mark.parametrize("path", sorted(EXAMPLES.glob("*.yaml")), ids=lambda path: path.stem)
def test_examples_conform_to_the_schema_and_are_read_again_from_their_text(path):
    mission = load_mission(path)
    files = mission.source.files
    assert parse_mission(mission.source.text, path="inside a plan", read_file=files.__getitem__) == mission
    assert mission.name == path.stem
    validator = jsonschema.Draft202012Validator(missions.json_schema())
    assert [error.message for error in validator.iter_errors(yaml.safe_load(path.read_text()))] == []


def test_each_robot_has_its_own_values_or_the_missions():
    zones, layers, room = (load_mission(EXAMPLES / name) for name in ("zones.yaml", "layers.yaml", "room_in_3d.yaml"))
    np.testing.assert_array_equal(fleet.speeds(zones), [1.0, 0.6])
    np.testing.assert_array_equal(fleet.accelerations(zones), [0.6, 0.6])
    np.testing.assert_array_equal(fleet.altitudes(layers), [0.5, 0.8, 1.2])
    np.testing.assert_array_equal(fleet.altitudes(room), [0.7, 0.9])
    np.testing.assert_array_equal(fleet.ends(layers), [(-0.7, 0.7), (0.7, 0.7), (0.0, -0.8)])
    assert np.isnan(fleet.ends(zones)).all()
    assert not fleet.velocities(room).any()
    assert [fleet.at_different_heights(mission) for mission in (zones, layers, room)] == [False, True, True]
    assert [fleet.vertical_scale(mission) for mission in (zones, layers, room)] == [1.0, 0.6, 0.5]


def test_searches_in_layers_are_lifted_to_their_heights():
    layers = load_mission(EXAMPLES / "layers.yaml")
    lifted = fleet.in_space(layers, np.zeros((7, 3, 2)))
    assert lifted.shape == (7, 3, 3)
    np.testing.assert_array_equal(lifted[4, :, 2], [0.5, 0.8, 1.2])


def test_nobody_flies_over_what_has_no_height():
    box = load_mission(EXAMPLES / "layers.yaml").obstacles[0]
    assert missions.shapes.heights(box) == (0.0, math.inf)
