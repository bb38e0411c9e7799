"""The missions that ship: they load, say what the publication says, and can be read again from a plan file."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import missions
from missions import load_mission, make_floor_plan, parse_mission
from missions.schema import ProbabilisticConnectivity

FOLDER = Path(missions.__file__).parent
SHIPPED = sorted(path.name for path in FOLDER.glob("*.yaml") if path.name != "airframes.yaml")


def test_four_missions_ship():
    assert SHIPPED == ["imec_four_drones.yaml", "one_drone.yaml", "photo_map.yaml", "replan.yaml"]


@pytest.mark.parametrize("name", SHIPPED)
def test_an_embedded_mission_is_read_again_without_the_folder(name):
    mission = load_mission(FOLDER / name)

    def no_other_file(wanted):
        return mission.source.files[wanted]

    again = parse_mission(mission.source.text, path="inside a plan", read_file=no_other_file)

    assert again == mission
    assert again.source.sha256 == mission.source.sha256
    density = getattr(mission.information, "density", None)
    assert np.array_equal(density, getattr(again.information, "density", None))


@pytest.mark.parametrize("name", SHIPPED)
def test_missions_travel_between_processes_and_serve_as_keys(name):
    mission = load_mission(FOLDER / name)
    copy = pickle.loads(pickle.dumps(mission))
    assert copy == mission
    assert hash(copy) == hash(mission)
    assert copy.source.sha256 == mission.source.sha256
    with pytest.raises(TypeError):
        mission.flight.parameters["pid_rate.roll_kp"] = 1.0


def test_imec_is_the_published_experiment():
    mission = load_mission(FOLDER / "imec_four_drones.yaml")

    assert mission.workspace.lower == (0.0, 0.0)
    assert mission.workspace.upper == (3.0, 2.5)
    assert (mission.horizon.duration, mission.horizon.dt, mission.steps) == (30.0, 0.1, 300)
    assert [component.mean for component in mission.information.components] == [
        (1.0, 0.8),
        (0.5, 1.7),
        (2.0, 1.7),
        (2.5, 0.8),
    ]
    assert {(component.covariance, component.weight) for component in mission.information.components} == {(0.03, 0.25)}
    assert [robot.start for robot in mission.robots] == [(0.5, 0.3), (1.2, 0.3), (1.9, 0.3), (2.6, 0.3)]
    assert mission.connectivity == ProbabilisticConnectivity(range=0.5, sub_periods=3, threshold=0.25)
    assert [(o.center, o.radius) for o in mission.obstacles] == [((1.3, 1.5), 0.3), ((1.8, 0.7), 0.3)]
    assert (mission.limits.acceleration, mission.limits.speed, mission.limits.separation) == (0.5, 1.0, 0.3)
    assert mission.basis.functions_per_axis == 10
    assert (mission.flight.controller, mission.flight.altitude, mission.trajectory.tolerance) == (
        "mellinger",
        0.6,
        0.01,
    )


def test_the_photo_map_lies_as_it_was_drawn():
    density = load_mission(FOLDER / "photo_map.yaml").information.density

    i, j = np.unravel_index(density.argmax(), density.shape)
    brightest = (i + 0.5) / make_floor_plan.PIXELS_PER_METRE, (j + 0.5) / make_floor_plan.PIXELS_PER_METRE

    assert density.shape == (320, 240)
    assert (
        np.linalg.norm(np.subtract(brightest, (0.8, 0.55))) < 0.25
        or np.linalg.norm(np.subtract(brightest, (3.3, 2.35))) < 0.25
    )
    assert density[2, 2] == 0.0  # a wall
    assert not density.flags.writeable


def test_the_shipped_image_is_what_the_script_draws():
    with Image.open(FOLDER / "photo_map.png") as image:
        assert np.array_equal(np.asarray(image), make_floor_plan.draw())


def test_the_script_writes_the_image(monkeypatch, tmp_path):
    monkeypatch.setattr(make_floor_plan, "__file__", str(tmp_path / "script.py"))

    make_floor_plan.main()

    with Image.open(tmp_path / "photo_map.png") as image:
        assert image.size == (320, 240)
