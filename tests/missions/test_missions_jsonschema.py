"""The JSON Schema and the loader are made from the same records: what one refuses for its shape, so does the other."""

import copy
from pathlib import Path

import jsonschema
import pytest
import yaml

import missions
from missions import MissionError, json_schema, parse_mission

FOLDER = Path(missions.__file__).parent
SHIPPED = ["imec_four_drones.yaml", "one_drone.yaml", "photo_map.yaml"]
VALIDATOR = jsonschema.Draft202012Validator(json_schema())


def document(name="imec_four_drones.yaml"):
    return yaml.safe_load((FOLDER / name).read_text())


def test_it_is_a_json_schema():
    jsonschema.Draft202012Validator.check_schema(json_schema())


@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_missions_conform(name):
    assert [error.message for error in VALIDATOR.iter_errors(document(name))] == []


def test_every_field_says_what_it_means():
    def walk(schema, path):
        for key, child in schema.get("properties", {}).items():
            assert child.get("description"), f"{path}.{key}"
            walk(child, f"{path}.{key}")
        children = schema.get("oneOf", []) + ([schema["items"]] if "items" in schema else [])
        for child in children:
            walk(child, path)

    walk(json_schema(), "")
    assert json_schema()["properties"]["horizon"]["properties"]["duration"]["description"].endswith("[s]")


def put(document, path, value):
    document = copy.deepcopy(document)
    *parents, last = path
    inner = document
    for key in parents:
        inner = inner[key]
    if value is DELETE:
        del inner[last]
    else:
        inner[last] = value
    return document


DELETE = object()
MUTATIONS = [
    (("colour",), "red"),
    (("workspace", "colour"), "red"),
    (("robots", 0, "colour"), "red"),
    (("schema_version",), 2),
    (("schema_version",), DELETE),
    (("workspace",), DELETE),
    (("workspace", "lower"), DELETE),
    (("workspace", "lower"), [0.0]),
    (("workspace", "lower"), "0.0"),
    (("horizon", "duration"), -1.0),
    (("horizon", "duration"), 0.0),
    (("horizon", "duration"), "30"),
    (("horizon", "duration"), True),
    (("horizon", "duration"), 4000.0),
    (("horizon",), 30.0),
    (("information", "type"), "gaussian"),
    (("information", "type"), DELETE),
    (("information", "components"), []),
    (("information", "components", 0, "covariance"), "wide"),
    (("information", "components", 0, "weight"), 0.0),
    (("information",), {"type": "image"}),
    (("information",), {"type": "uniform", "file": "x.png"}),
    (("basis", "functions_per_axis"), 10.5),
    (("basis", "functions_per_axis"), 1),
    (("robots",), []),
    (("robots", 0, "name"), "../etc"),
    (("robots", 0, "name"), 1),
    (("robots", 0, "pad"), [1.0, 2.0, 3.0]),
    (("connectivity", "policy"), "sometimes"),
    (("connectivity", "policy"), DELETE),
    (("connectivity", "range"), DELETE),
    (("connectivity", "threshold"), 1.0),
    (("connectivity", "indicator"), "step"),
    (("connectivity", "pairs"), "some"),
    (("connectivity", "pairs"), ["cf1", "cf2"]),
    (("connectivity", "pairs"), []),
    (("connectivity", "graph"), "ring"),
    (("connectivity", "thresholds"), [{"pair": ["cf1", "cf2"], "threshold": 1.0}]),
    (("connectivity", "boundaries"), [-1.0]),
    (("connectivity",), {"policy": "guaranteed", "range": 0.5}),
    (("connectivity",), {"policy": "all_time", "range": 0.5, "sub_periods": 3}),
    (("limits", "acceleration"), DELETE),
    (("limits", "acceleration"), 30.0),
    (("obstacles", 0, "type"), "square"),
    (("obstacles", 0, "type"), DELETE),
    (("obstacles", 0, "center"), [1.0]),
    (("flight", "airframe"), "cf20"),
    (("flight", "controller"), "lqr"),
    (("flight", "parameters"), {"pid_rate.roll_kp": "high"}),
    (("solver", "seed"), -1),
]


@pytest.mark.parametrize(("path", "value"), MUTATIONS)
def test_both_refuse(path, value):
    mutated = put(document(), path, value)
    assert not VALIDATOR.is_valid(mutated)
    with pytest.raises(MissionError):
        parse_mission(yaml.safe_dump(mutated), path="m.yaml", read_file=bytes)


ACCEPTED = [
    (("robots", 0, "pad"), None),
    (("robots", 0, "pad"), [0.4, 0.2]),
    (("information", "components", 0, "covariance"), [0.03, 0.02]),
    (("information", "components", 0, "covariance"), [[0.03, 0.01], [0.01, 0.03]]),
    (("information",), {"type": "uniform"}),
    (("connectivity", "indicator"), "sigmoid"),
    (("connectivity", "pairs"), "ring"),
    (("connectivity", "pairs"), [["cf1", "cf2"], ["cf4", "cf3"]]),
    (("connectivity", "graph"), "connected"),
    (("connectivity", "thresholds"), [{"pair": ["cf1", "cf2"], "threshold": 0.3}]),
    (("connectivity",), {"policy": "simultaneous", "range": 0.5, "threshold": 0.2, "pairs": "star", "hub": "cf2"}),
    (("connectivity",), {"policy": "periodic", "range": 0.5, "boundaries": [12.0, 20.0]}),
    (("connectivity",), {"policy": "periodic", "range": 0.5, "instants": [12.0, 30.0]}),
    (("connectivity",), {"policy": "all_time", "range": 0.8, "pairs": "chain"}),
    (("connectivity",), {"policy": "guaranteed", "range": 0.5, "duration": 1.0, "contact": "total"}),
    (("connectivity",), {"policy": "none"}),
    (("connectivity",), {"policy": "none", "range": None}),
    (("connectivity",), DELETE),
    (("horizon", "duration"), 30),
    (("flight", "parameters"), {"pid_rate.roll_kp": 250}),
]


@pytest.mark.parametrize(("path", "value"), ACCEPTED)
def test_both_accept(path, value):
    mutated = put(document(), path, value)
    assert [error.message for error in VALIDATOR.iter_errors(mutated)] == []
    parse_mission(yaml.safe_dump(mutated), path="m.yaml", read_file=bytes)
