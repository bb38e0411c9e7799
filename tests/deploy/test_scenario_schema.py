"""The JSON Schema of scenario files and their loader are made from the same records and agree."""

import copy
import json
from pathlib import Path

import jsonschema
import pytest
import yaml

import missions
from deploy.cli.__main__ import main
from deploy.scenario.jsonschema import json_schema
from deploy.scenario.load import load_scenario, parse_scenario
from missions import MissionError, load_mission

FOLDER = Path(missions.__file__).parent
SHIPPED = sorted((FOLDER / "scenarios").glob("*.yaml"))
MISSION = load_mission(FOLDER / "imec_four_drones.yaml")
VALIDATOR = jsonschema.Draft202012Validator(json_schema())
README = yaml.safe_load(
    """
name: a bad day
seed: 3
events:
  - {fault: loss, at: 5.0, to: dongle 0, rate: 0.3, burst: 0.05, duration: 2.0}
  - {fault: motor_failure, when: mission_start, after: 4.0, to: cf2, motor: 3, left: 0.5}
  - {fault: operator_abort, when: battery, after: 1.0}
"""
)


def test_it_is_a_json_schema_and_printed(capsys):
    jsonschema.Draft202012Validator.check_schema(json_schema())
    assert main(["schema", "scenario"]) == 0
    assert json.loads(capsys.readouterr().out) == json.loads(json.dumps(json_schema()))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_scenarios_conform(path):
    load_scenario(path, MISSION)
    assert [error.message for error in VALIDATOR.iter_errors(yaml.safe_load(path.read_text()))] == []


def test_every_field_says_what_it_means():
    def walk(schema, path):
        for key, child in schema.get("properties", {}).items():
            assert child.get("description"), f"{path}.{key}"
            walk(child, f"{path}.{key}")
        for child in schema.get("oneOf", []) + ([schema["items"]] if "items" in schema else []):
            walk(child, path)

    walk(json_schema(), "")


def changed(key, value, event=1):
    document = copy.deepcopy(README)
    if value is None:
        del document["events"][event][key]
    else:
        document["events"][event][key] = value
    return document


@pytest.mark.parametrize(
    "document",
    [
        README | {"colour": "red"},
        README | {"seed": -1},
        README | {"events": []},
        changed("fault", "sunshine"),
        changed("fault", None),
        changed("at", 3.0),  # and when
        changed("when", None),  # neither
        changed("when", "tea time"),
        changed("after", -1.0),
        changed("motor", 5),
        changed("motor", 1.5),
        changed("left", "half"),
        changed("rate", 0.5),  # of a motor
        changed("rate", None, event=0),
        changed("rate", 1.5, event=0),
    ],
)
def test_what_the_loader_refuses_the_schema_refuses(document):
    text = yaml.safe_dump(document)
    with pytest.raises(MissionError):
        parse_scenario(text, path="s.yaml", mission=MISSION)
    assert not VALIDATOR.is_valid(document)


def test_the_readmes_example_passes_both():
    assert VALIDATOR.is_valid(README)
    assert len(parse_scenario(yaml.safe_dump(README), path="s.yaml", mission=MISSION).events) == 3
