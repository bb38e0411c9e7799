"""Misuse: one line that says where, what, what was got and what is allowed."""

from pathlib import Path

import pytest

import missions
from missions import MissionError, parse_mission

FOLDER = Path(missions.__file__).parent
ONE = (FOLDER / "one_drone.yaml").read_text()
FOUR = (FOLDER / "imec_four_drones.yaml").read_text()


def refuse(text, name="m.yaml"):
    """The error's text; the mission must be refused."""

    def read_file(wanted):
        raise KeyError(wanted)

    with pytest.raises(MissionError) as caught:
        parse_mission(text, path=name, read_file=read_file)
    message = str(caught.value)
    assert message.isprintable(), "one line"
    assert message.startswith(f"{name}:")
    return message


def changed(old, new, text=FOUR):
    assert text.count(old) >= 1, old
    return text.replace(old, new, 1)


def line_of(fragment, text):
    return text[: text.index(fragment)].count("\n") + 1


STRUCTURE = [
    (
        "name: imec_four_drones",
        "name: imec_four_drones\ncolour: red",
        r"colour: unknown key; known keys: schema_version",
    ),
    ("separation: 0.3", "seperation: 0.3", r"limits\.seperation: unknown key \(did you mean 'separation'\?\)"),
    ("  duration: 30.0", "  dauer: 30.0", r"horizon\.dauer: unknown key"),
    ("  duration: 30.0           # [s]\n", "", r"horizon: missing key 'duration': length of the search \[s\]"),
    ("  duration: 30.0", "  duration: -30.0", r"horizon\.duration: got -30\.0; allowed: above 0, at most 3600 \[s\]"),
    ("  duration: 30.0", "  duration: thirty", r"horizon\.duration: got 'thirty'; allowed: a number \[s\]"),
    ("  duration: 30.0", "  duration: '30.0'", r"got the text '30\.0'; allowed: a number without quotes"),
    ("  duration: 30.0", "  duration: 0:30", r"got '0:30'; allowed: a number in decimal notation"),
    ("  duration: 30.0", "  duration: 030", r"got '030'; allowed: a number without leading zeros"),
    ("  duration: 30.0", "  duration: true", r"got the boolean true; allowed: a number"),
    ("  duration: 30.0", "  duration: .inf", r"got '\.inf'; allowed: a number"),
    ("  duration: 30.0", "  duration: .nan", r"got '\.nan'; allowed: a number"),
    ("  duration: 30.0", "  duration: 1e999", r"got 1e999; allowed: a finite number"),
    ("  duration: 30.0", "  duration:", r"got nothing; allowed: a number"),
    ("  duration: 30.0", "  duration: [30.0]", r"got a list; allowed: a number \[s\]"),
    ("  duration: 30.0", "  duration: 30.0\n  duration: 31.0", r"key 'duration' given twice; first in line"),
    ("name: imec_four_drones", "name: on", r"name: got 'on'; allowed: text \(write 'on' in quotes"),
    ("name: imec_four_drones", "name: 2026-01-31", r"name: got '2026-01-31'; allowed: text"),
    ("name: imec_four_drones", "name: 0x12", r"name: got '0x12'; allowed: text"),
    ("name: imec_four_drones", "name: ../etc", r"name: got '\.\./etc'; allowed: short name"),
    ("name: imec_four_drones", "name: [a]", r"name: got a list; allowed: text"),
    ("name: imec_four_drones", 'name: "a\\0b"', r"name: got a control character \(U\+0000\)"),
    ("seed: 0 ", "seed: 0.5 ", r"solver\.seed: got the number 0\.5; allowed: a whole number"),
    ("seed: 0 ", "seed: -1 ", r"solver\.seed: got -1; allowed: at least 0"),
    ("seed: 0 ", f"seed: {'9' * 5000} ", r"solver\.seed: got .*; allowed: a whole number"),
    ("controller: mellinger", "controller: melinger", r"allowed: pid, mellinger \(did you mean 'mellinger'\?\)"),
    ("policy: probabilistic", "policy: never", r"connectivity\.policy: got 'never'; allowed: probabilistic, sim"),
    ("  policy: probabilistic\n", "", r"connectivity: missing key 'policy'; allowed: probabilistic, simultaneous"),
    ("type: gaussians", "type: gaussian", r"information\.type: .*\(did you mean 'gaussians'\?\)"),
    (
        "{type: circle, center: [1.3, 1.5]",
        "{center: [1.3, 1.5]",
        r"obstacles\[0\]: missing key 'type'; allowed: circle",
    ),
    ("schema_version: 1 ", "schema_version: 2 ", r"schema_version: got '2'; allowed: 1"),
    ("name: cf2,", "name: cf2, 12: 3,", r"robots\[1\]\.12: unknown key"),
    ("lower: [0.0, 0.0]", "lower: {x: 0.0}", r"workspace\.lower: got a mapping; allowed: a list \[m\]"),
    ("lower: [0.0, 0.0]", "lower: [0.0]", r"workspace\.lower: got 1 items; allowed: 2 to 3 \[m\]"),
    ("lower: [0.0, 0.0]", "lower: [0.0, ]]", r"not valid YAML"),
    ("lower: [0.0, 0.0]", "lower: &a [0.0, 0.0]", r"anchor '&a'"),
    ("upper: [3.0, 2.5]", "upper: *a", r"an alias|not valid YAML"),
    ("lower: [0.0, 0.0]", "lower: !!python/tuple [0.0, 0.0]", r"tag 'tag:yaml.org,2002:python/tuple'"),
    ("name: imec_four_drones", "name: !!python/object/apply:os.system ['true']", r"tag '.*os\.system'"),
    ("name: imec_four_drones", "name: imec_four_drones\n? [1, 2]\n: 3", r"a list or mapping used as a key"),
]

MEANING = [
    (
        "  tolerance: 0.01",
        "  yaw_rate: 11.0",
        r"trajectory\.yaw_rate: got 11; allowed: at most 10 \[rad/s\] for airframe cf21",
    ),
    ("  tolerance: 0.01", "  yaw_rate: 0.0", r"trajectory\.yaw_rate: got 0\.0; allowed: above 0, at most 20 \[rad/s\]"),
    (
        "  yaw: {type: fixed}",
        "  yaw: {type: along}",
        r"trajectory\.yaw\.type: got 'along'; allowed: fixed, path, facing",
    ),
    (
        "  yaw: {type: fixed}",
        "  yaw: {type: facing}",
        r"trajectory\.yaw: missing key 'point': \(x, y\) of what they look at",
    ),
    ("  yaw: {type: fixed}", "  yaw: {type: fixed, angle: 90.0}", r"yaw\.angle: got 90\.0; allowed: at least -6\.2832"),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nmotion_capture: {tracking: marker}",
        r"motion_capture\.tracking: got 'marker'; allowed: bodies, positions, markers",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nmotion_capture: {up: x}",
        r"motion_capture\.up: got 'x'; allowed: z, y",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nmotion_capture: {unit: 0.0}",
        r"motion_capture\.unit: got 0\.0; allowed: above 0",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nmotion_capture: {origin: [1.0, 2.0]}",
        r"motion_capture\.origin: got 2 .*allowed: .*3",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nmotion_capture: {height: 20.0}",
        r"motion_capture\.height: got 20\.0; allowed: at least -0\.2, at most 0\.2 \[m\]",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nradio: {packet_rate: 10.0}",
        r"radio\.packet_rate: got 10\.0; allowed: at least 50, at most 5000 \[1/s\]",
    ),
    (
        "name: imec_four_drones",
        "name: imec_four_drones\nradio: {drones_per_dongle: 3}",
        r"radio\.drones_per_dongle: got 3; allowed: at least 4, as many as share one by their URIs",
    ),
    ("  duration: 30.0", "  duration: 30.05", r"a whole multiple of dt = 0\.1, e\.g\. 30 or 30\.1"),
    ("  duration: 30.0", "  duration: 0.1", r"got 1 steps of 0\.1 s; allowed: 2 to"),
    ("  dt: 0.1", "  dt: 1e-5", r"steps of 1e-05 s; allowed: 2 to"),
    ("upper: [3.0, 2.5]", "upper: [3.0, -2.5]", r"workspace\.upper\[1\]: got -2\.5 over a lower corner of 0"),
    ("upper: [3.0, 2.5]", "upper: [3.0, 2.5, 1.0]", r"workspace\.upper: got 3 numbers; allowed: 2"),
    ("upper: [3.0, 2.5]", "upper: [3000.0, 2.5]", r"workspace: workspace further than 1000 m"),
    ("mean: [1.0, 0.8]", "mean: [1.0, 0.8, 1.0]", r"components\[0\]\.mean: got 3 numbers; allowed: 2"),
    ("mean: [1.0, 0.8]", "mean: [10.0, 0.8]", r"components\[0\]\.mean: this Gaussian has nothing inside"),
    ("covariance: 0.03", "covariance: 0.0", r"covariance: not positive definite"),
    ("covariance: 0.03", "covariance: [0.03, -0.01]", r"covariance: not positive definite \(least eigenvalue -0\.01\)"),
    ("covariance: 0.03", "covariance: [[0.03, 0.05], [0.05, 0.03]]", r"covariance: not positive definite"),
    ("covariance: 0.03", "covariance: [[0.03, 0.01], [0.02, 0.03]]", r"covariance: got a matrix that is not symmetric"),
    (
        "covariance: 0.03",
        "covariance: [[0.03, 0.0], [0.0]]",
        r"covariance: got .*; allowed: a number, 2 numbers, or a 2 × 2",
    ),
    (
        "covariance: 0.03",
        "covariance: {x: 1}",
        r"covariance: got a mapping; allowed: a number \(isotropic\), a diagonal",
    ),
    ("covariance: 0.03", "covariance: [[[0.03]]]", r"covariance: got a list; allowed: a number \(isotropic\)"),
    (
        "policy: probabilistic",
        "policy: none",
        r"connectivity\.sub_periods: unknown key; known keys of policy none: range",
    ),
    ("covariance: 0.03", "covariance: [0.03]", r"covariance: got .*; allowed: a number, 2 numbers, or a 2 × 2"),
    ("weight: 0.25", "weight: 0.0", r"components\[0\]\.weight: got 0\.0; allowed: above 0"),
    ("speed: 1.0", "speed: 3.0", r"limits\.speed: got 3; allowed: at most 2 \[m/s\] for airframe cf21"),
    ("acceleration: 0.5", "acceleration: 9.0", r"limits\.acceleration: got 9; allowed: at most 3\.5"),
    ("separation: 0.3", "separation: 0.1", r"limits\.separation: got 0\.1; allowed: at least 0\.14 \[m\], two bodies"),
    (
        "separation: 0.3",
        "separation: 0.8",
        r"robots\[1\]\.start: starts of cf1 and cf2 are 0\.7 m apart; allowed: at least 0\.8",
    ),
    ("start: [1.2, 0.3]", "start: [0.6, 0.3]", r"robots\[1\]\.start: starts of cf1 and cf2 are 0\.1 m apart"),
    ("start: [1.2, 0.3]", "start: [1.2, 2.6]", r"robots\[1\]\.start: got \(1\.2, 2\.6\) outside the workspace"),
    (
        "start: [1.2, 0.3]",
        "start: [1.2, 1.4]",
        r"robots\[1\]\.start: got \(1\.2, 1\.4\) inside obstacles\[0\], 0\.159 m deep",
    ),
    ("start: [1.2, 0.3]", "start: [1.2, 0.3, 0.3]", r"robots\[1\]\.start: got 3 numbers; allowed: 2"),
    (
        "start: [1.2, 0.3]",
        "start: [1.2, 0.3], pad: [0.6, 0.3]",
        r"robots\[1\]\.pad: pads of cf1 and cf2 are 0\.1 m apart",
    ),
    ("start: [1.2, 0.3]", "start: [1.2, 0.3], pad: [1.2, -0.5]", r"robots\[1\]\.pad: .* geofence_margin = 0\.3 m"),
    ("start: [1.2, 0.3]", "start: [1.2, 0.3], pad: [1.3, 1.5]", r"robots\[1\]\.pad: .* inside obstacles\[0\]"),
    ("name: cf2", "name: CF1", r"robots\[1\]\.name: the same as robots\[0\]'s \(cf1\)"),
    ("name: cf2", "name: cf2, rigid_body: cf1", r"robots\[1\]\.rigid_body: the same as robots\[0\]'s"),
    (
        "name: cf2",
        "name: cf2, decks: [flow]",
        r"robots\[1\]\.decks\[0\]: got 'flow'; allowed: active_marker.*mean 'flow2'",
    ),
    ("name: cf2", "name: cf2, decks: flow2", r"robots\[1\]\.decks: got 'flow2'; allowed: a list"),
    ("name: cf2", "name: cf2, decks: [loco, loco]", r"robots\[1\]\.decks\[1\]: got 'loco' twice"),
    (
        "name: cf2",
        "name: cf2, decks: [zranger2, flow2]",
        r"robots\[1\]\.decks\[1\]: got flow2 and zranger2; allowed: one",
    ),
    ("E7E7E7E702", "e7e7e7e701", r"robots\[1\]\.uri: the same as robots\[0\]'s"),
    ("0/80/2M/E7E7E7E702", "1/80/2M/E7E7E7E701?rate_limit=100", r"robots\[1\]\.uri: the same as robots\[0\]'s"),
    ("radio://0/80/2M/E7E7E7E702", "radio://0/126/2M/E7E7E7E702", r"robots\[1\]\.uri: got .*channel 0 to 125"),
    ("radio://0/80/2M/E7E7E7E702", "radio://0/80/2M/E7E7E702", r"robots\[1\]\.uri: got .*10 hexadecimal digits"),
    ("radio://0/80/2M/E7E7E7E702", "radoi://0/80/2M", r"robots\[1\]\.uri: got .*did you mean 'radio'"),
    ("radio://0/80/2M/E7E7E7E702", "0xE7E7E7E702", r"for this address: radio://0/80/2M/E7E7E7E702"),
    ('"radio://0/80/2M/E7E7E7E702"', "0xE7E7E7E702", r"robots\[1\]\.uri: got '0xE7E7E7E702'; allowed: text"),
    ("radius: 0.3", "radius: 5.0", r"obstacles: the obstacles cover the whole workspace"),
    ("center: [1.3, 1.5]", "center: [1.3]", r"obstacles\[0\]\.center: got 1 items; allowed: 2"),
    ("airframe: cf21 ", "airframe: cf20 ", r"flight\.airframe: unknown airframe 'cf20'; known airframes: cf21"),
    ("altitude: 0.6", "parameters: {pid: 1}", r"flight\.parameters\.'pid': allowed: 'group\.name'"),
    ("sub_periods: 3", "sub_periods: 7", r"sub_periods: got 7; allowed: a divisor of the 300 steps, e\.g\. 4, 5, 6"),
    ("  range: 0.5", "  range: 0.3", r"connectivity\.range: got 0\.3; allowed: above the separation of 0\.3"),
    ("threshold: 0.25", "threshold: 1.5", r"connectivity\.threshold: got 1\.5; allowed: above 0, below 1"),
    (
        "threshold: 0.25",
        "threshold: 0.999",
        r"connectivity\.threshold: got 0\.999; cf1 and cf4 can reach at most 0\.\d",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), STRUCTURE + MEANING)
def test_refused_with_place_and_reason(old, new, message):
    import re

    error = refuse(changed(old, new))
    assert re.search(message, error), error
    assert re.match(r"m\.yaml:\d+: ", error), error


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("  duration: 30.0", "  duration: -30.0"),
        ("  range: 0.5", "  range: 0.3"),
        ("start: [1.2, 0.3]", "start: [1.2, 1.4]"),
    ],
)
def test_the_line_is_the_line_of_the_value(old, new):
    text = changed(old, new)
    assert refuse(text).startswith(f"m.yaml:{line_of(new, text)}: ")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "the file is empty"),
        ("# only a comment\n", "the file is empty"),
        ("just text", "got 'just text'; allowed: a mapping"),
        ("- a\n- b\n", "got a list; allowed: a mapping"),
        (ONE + "\n---\n" + ONE, "a second YAML document"),
        ("a: " + "[" * 100 + "]" * 100, "nested deeper than"),
        ("a: [" + "1," * 250_000 + "]", "more than 200000 values"),
        ("#" + "x" * 5_000_001, "file too large"),
        ("name: \x07", "not valid YAML"),
        ("name: \ud800", "not valid Unicode"),
        ("a:\n\t- b", "not valid YAML"),
    ],
)
def test_what_is_no_mission_at_all(text, message):
    assert message in refuse(text)


def test_billion_laughs_is_refused_at_once():
    laughs = "a: &a [x, x]\n" + "".join(
        f"{chr(98 + i)}: &{chr(98 + i)} [*{chr(97 + i)}, *{chr(97 + i)}]\n" for i in range(20)
    )
    assert "anchor '&a'" in refuse(laughs)


def test_robots_are_counted():
    robots = "\n".join(f"  - {{name: cf{i}, start: [{0.01 * i:.2f}, 0.5]}}" for i in range(101))
    text = ONE[: ONE.index("robots:")] + "robots:\n" + robots
    assert "robots: got 101 items; allowed: 1 to 100" in refuse(text)
    assert "robots: got 0 items; allowed: 1 to 100" in refuse(ONE[: ONE.index("robots:")] + "robots: []\n")


def test_robots_that_start_too_far_apart_to_meet_are_told_so():
    text = changed("upper: [3.0, 2.5]", "upper: [40.0, 2.5]")
    text = changed("start: [2.6, 0.3]", "start: [39.0, 0.3]", text)
    error = refuse(text)
    assert "connectivity.threshold: got 0.25; cf1 and cf4 can reach at most" in error
    assert "in sub-period 1: they start 38.50 m apart and the sub-period ends at 10 s" in error


def test_three_dimensions_need_three_numbers_and_a_floor():
    three = ONE.replace("lower: [0.0, 0.0], upper: [2.0, 2.0]", "lower: [0.0, 0.0, 0.2], upper: [2.0, 2.0, 1.2]")
    three = three.replace("mean: [1.2, 1.3]", "mean: [1.2, 1.3, 0.7]").replace("[0.5, 0.5]", "[0.5, 0.5, 0.4]")
    mission = parse_mission(three, path="m.yaml", read_file=lambda name: b"")
    assert mission.dimension == 3

    assert "workspace.lower[2]: got -0.2; allowed: at least 0 [m], the floor" in refuse(
        three.replace("0.0, 0.2]", "0.0, -0.2]")
    )
    assert "robots[0].start: got 2 numbers; allowed: 3" in refuse(three.replace("[0.5, 0.5, 0.4]", "[0.5, 0.5]"))


def test_robots_one_above_the_other_need_pads():
    two = ONE.replace("lower: [0.0, 0.0], upper: [2.0, 2.0]", "lower: [0.0, 0.0, 0.2], upper: [2.0, 2.0, 1.2]")
    two = two.replace("mean: [1.2, 1.3]", "mean: [1.2, 1.3, 0.7]").replace("[0.5, 0.5]", "[0.5, 0.5, 0.4]")
    two += "  - {name: cf2, start: [0.5, 0.5, 1.0]}\n"
    assert "robots[1].pad: pads of cf1 and cf2 are 0 m apart; allowed: at least 0.3 [m]" in refuse(two)

    mission = parse_mission(
        two.replace("start: [0.5, 0.5, 1.0]", "start: [0.5, 0.5, 1.0], pad: [1, 1]"), path="", read_file=bytes
    )
    assert mission.robots[1].pad == (1.0, 1.0)
