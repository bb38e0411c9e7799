"""Objects in mission files: what is read, where it stands, what is refused, in one line each."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import missions
from missions.errors import MissionError
from missions.loader import load_mission
from missions.make_objects import FOLDER, chair, ply, statue
from missions.obstacles import ObjectPart
from missions.placing import parts, spread
from missions.schema import FacingYaw, FixedYaw
from missions.shapes import solid
from tests.planner.objects_bench import BOX, STATUE, as_cloud, as_ply, box, read, text

EXAMPLES = Path(missions.__file__).parent / "examples"


def refuse(data, mission=None, **how):
    with pytest.raises(MissionError) as caught:
        read(data, mission, **how)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def sphere(count=600, radius=0.3, centre=(0.0, 0.0, 0.5)):
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, 2.399963229728653 * k
    flat = np.sqrt(1.0 - z * z)
    return np.array(centre) + radius * np.stack((flat * np.cos(angle), flat * np.sin(angle), z), axis=1)


@pytest.mark.parametrize(("name", "surface"), [("statue", statue()), ("chair", chair())])
def test_shipped_objects_are_what_is_drawn(name, surface):
    assert (FOLDER / f"{name}.ply").read_text() == ply(*surface)
    assert (FOLDER / f"{name}.ply").stat().st_size < 200_000


def test_the_object_stands_where_the_mission_says():
    mission = read(BOX, item="position: [0.3, -0.2, 0.1], yaw: 1.5707963267948966, scale: 0.5")
    surface = mission.object.surface
    np.testing.assert_allclose(surface.lower, [0.3 - 0.075, -0.2 - 0.1, 0.1], atol=1e-6)
    np.testing.assert_allclose(surface.upper, [0.3 + 0.075, -0.2 + 0.1, 0.4], atol=1e-6)
    assert mission.trajectory.yaw == FacingYaw(surface.centre)
    assert mission.information_axes == 3
    assert mission.source.files == {"thing.ply": BOX}


def test_robots_look_where_the_mission_says_if_it_says():
    mission = read(BOX, text() + "trajectory: {yaw: {type: fixed, angle: 0.5}}")
    assert mission.trajectory.yaw == FixedYaw(0.5)


@pytest.mark.parametrize("ending", ["ply", "obj", "stl"])
def test_formats_of_meshes_say_the_same(ending):
    trimesh = pytest.importorskip("trimesh")
    data = trimesh.Trimesh(*box(), process=False).export(file_type=ending)
    data = data.encode() if isinstance(data, str) else data
    surface = read(data, text().replace("thing.ply", f"thing.{ending}")).object.surface
    np.testing.assert_allclose([surface.lower, surface.upper], [[-0.2, -0.15, 0.0], [0.2, 0.15, 0.6]], atol=1e-6)
    assert not surface.two_sided


def test_points_are_spread_evenly_and_face_outwards():
    vertices, faces = box()
    points, normals, face, area = spread(vertices, faces, 800)
    total = 2.0 * (0.4 * 0.3 + 0.4 * 0.6 + 0.3 * 0.6)
    assert area * 800 == pytest.approx(total)
    assert (np.einsum("jd,jd->j", points - [0.0, 0.0, 0.3], normals) > 0.0).all()
    for axis, (a, b) in enumerate(((0.3, 0.6), (0.4, 0.6), (0.4, 0.3))):
        assert (np.abs(normals[:, axis]) > 0.5).mean() == pytest.approx(2.0 * a * b / total, abs=0.01)
    np.testing.assert_allclose(points.mean(axis=0), [0.0, 0.0, 0.3], atol=0.01)
    assert face.max() < len(faces)


def test_a_cloud_of_points_is_a_surface_too():
    surface = read(as_cloud(sphere())).object.surface
    assert surface.two_sided
    assert surface.area * len(surface.points) == pytest.approx(4.0 * np.pi * 0.09, rel=0.2)
    outward = (surface.points - [0.0, 0.0, 0.5]) / 0.3
    assert np.abs(np.einsum("jd,jd->j", outward, surface.normals)).min() > 0.95


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from([0.1, 0.4]))
def test_nothing_closer_than_near_is_outside_the_prisms_around_it(seed, near):
    vertices, faces = statue() if seed % 2 else chair()
    prisms = [solid(part) for part in parts(vertices, faces, near)]
    rng = np.random.default_rng(seed)
    on, *_ = spread(vertices, faces, 300)
    way = rng.standard_normal(on.shape)
    x = (on + near * rng.uniform(0.0, 1.0, (300, 1)) * way / np.linalg.norm(way, axis=1, keepdims=True)).T
    assert np.min([prism.value(x) for prism in prisms], axis=0).max() < 1e-9


def test_prisms_follow_the_shape():
    """A drone may come as close to a chair's back, above the seat, as to its legs."""
    prisms = [solid(part) for part in parts(*chair(), 0.3)]
    above_the_seat = np.array([[0.0], [-0.16], [0.9]])
    assert min(float(prism.value(above_the_seat)[0]) for prism in prisms) > 0.0
    assert len(prisms) == 2


def test_it_is_in_everybodys_way():
    mission = read(STATUE)
    assert all(isinstance(obstacle, ObjectPart) for obstacle in mission.obstacles)
    error = refuse(STATUE, text().replace("[1.0, 0.1, 0.7]", "[0.4, 0.0, 0.5]"))
    assert re.search(r"robots\[0\]\.start: got .* inside object", error)


def test_information_is_what_the_map_puts_on_the_surface():
    surface = read(BOX, information="type: gaussians, components: [{mean: [0, 0, 0.6], covariance: 0.004}]")
    surface = surface.object.surface
    assert surface.share.sum() == pytest.approx(1.0)
    assert surface.share[surface.points[:, 2] > 0.5].sum() > 0.9
    facing = read(BOX, item="facing: [0, 0, 2]").object.surface
    assert facing.share[facing.normals[:, 2] > 0.9].sum() == pytest.approx(1.0)


OPEN = as_ply((box()[0], box()[1][:-1]))
REFUSED = [
    (b"", {}, r"object\.file: 'thing\.ply': not a readable PLY file"),
    (b"\0" * 100, {}, r"object\.file: 'thing\.ply': not a readable PLY file"),
    (BOX[:200], {}, r"object\.file: 'thing\.ply': (not a readable PLY file|2 points)"),
    (as_ply((np.empty((0, 3)), np.empty((0, 3), int))), {}, r"object\.file: 'thing\.ply': (empty|not a readable)"),
    (OPEN, {}, r"object\.file: 'thing\.ply': not watertight: 3 edges"),
    (as_cloud(sphere(20)), {}, r"object\.file: 'thing\.ply': 20 points; allowed: 50 to"),
    (as_cloud([[np.nan, 0, 0]] * 60), {}, r"object\.file: 'thing\.ply': points with NaN"),
    (
        as_ply((1000.0 * box()[0], box()[1])),
        {},
        r"object\.scale: the object is 400 × 300 × 600 m .* e\.g\. 0\.001 \[m\]",
    ),
    (as_ply((0.03 * box()[0], box()[1])), {}, r"object\.scale: the object is 0\.012 × 0\.009 × 0\.018 m"),
    (
        BOX,
        {"item": "position: [1.4, 0, 0]"},
        r"object\.position: the object reaches from \(1\.2, .* outside the workspace",
    ),
    (BOX, {"item": "position: [0, 0, -0.1]"}, r"object\.position: .*the floor included"),
    (BOX, {"item": "far: 0.2"}, r"object\.far: got 0\.2; allowed: more than near = 0\.3"),
    (BOX, {"item": "far: 0.5"}, r"robots\[0\]\.start: got .* m from the object; allowed: at most object\.far = 0\.5"),
    (BOX, {"item": "facing: [0, 0, 0]"}, r"object\.facing: got no direction"),
    (as_cloud(sphere()), {"item": "facing: [0, 0, 1]"}, r"object\.facing: got a direction for a point cloud"),
    (
        BOX,
        {"information": "type: gaussians, components: [{mean: [1.4, 1.4, 1.7], covariance: 0.0001}]"},
        r"information: nothing of it is on the object's surface",
    ),
]


@pytest.mark.parametrize(("data", "how", "message"), REFUSED, ids=[message[:45] for *_, message in REFUSED])
def test_refused_with_place_and_reason(data, how, message):
    error = refuse(data, **how)
    assert re.search(message, error), error
    assert error.startswith("m.yaml:")


RULES = [
    ("thing.ply", "thing.step", r"object\.file: 'thing\.step': a file of type 'step'; allowed: ply, obj, stl"),
    ("type: camera, half_angle: 0.5, pitch: 0.0", "type: cone, slope: 0.4", r"footprint: got a footprint on the floor"),
    ("footprint: {type: camera, half_angle: 0.5, pitch: 0.0}", "", r"missing key 'footprint'"),
    ("object: {file: thing.ply, near: 0.3, samples: 200}", "", r"footprint: got a camera without an object"),
    ("near: 0.3", "near: 0.01", r"object\.near: got 0\.01; allowed: at least 0\.\d+ \[m\], the radius of"),
    ("functions_per_axis: 4", "functions_per_axis: 20", r"basis\.functions_per_axis: got 20; allowed: at most 12"),
    ("starts: 1}", "starts: 1}\ntrajectory: {yaw: {type: path}}", r"trajectory\.yaw: got path with an object"),
]


@pytest.mark.parametrize(("old", "new", "message"), RULES, ids=[message[:40] for *_, message in RULES])
def test_rules_between_records(old, new, message):
    assert old in text()
    error = refuse(BOX, text().replace(old, new))
    assert re.search(message, error), error


def test_files_that_are_not_there(tmp_path):
    (tmp_path / "m.yaml").write_text(text())
    with pytest.raises(MissionError, match=r"m\.yaml:6: object\.file: no such file: .*thing\.ply"):
        load_mission(tmp_path / "m.yaml")


def test_without_the_library_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "trimesh", None)
    assert "pip install 'ergoflie[objects]'" in refuse(BOX)


@settings(max_examples=60)
@given(st.binary(max_size=60), st.integers(0, len(BOX) - 1), st.sampled_from(["ply", "obj", "stl"]))
def test_damaged_files_are_refused_or_read_never_worse(junk, at, ending):
    data = BOX[:at] + junk + BOX[at + len(junk) :]
    errors: list[str] = []
    try:
        read(data, text().replace("thing.ply", f"thing.{ending}"))
    except MissionError as error:
        errors.append(str(error))
    assert not any("\n" in error for error in errors)


@pytest.mark.parametrize("name", ["inspect_four", "inspect_chair"])
def test_examples_have_their_object_inside(name):
    mission = load_mission(EXAMPLES / f"{name}.yaml")
    assert mission.object.surface.share.sum() == pytest.approx(1.0)
