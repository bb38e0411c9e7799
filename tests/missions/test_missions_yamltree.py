import itertools
from pathlib import Path

import pytest
import yaml

import missions
from missions import MissionError, load_mission, yamltree
from missions.scalars import ScalarError, to_float, to_int, to_text
from missions.yamltree import ScalarNode, parse_yaml

FOLDER = Path(missions.__file__).parent


def plain(text):
    return ScalarNode(text, plain=True, line=1)


@pytest.mark.parametrize("name", ["imec_four_drones.yaml", "one_drone.yaml", "photo_map.yaml"])
def test_the_parser_in_python_reads_the_same(monkeypatch, name):
    fast = load_mission(FOLDER / name)
    monkeypatch.setattr(yamltree, "_Loader", yaml.BaseLoader)
    assert load_mission(FOLDER / name) == fast


@pytest.mark.parametrize(
    "text", ["a: [", "a: b: c", "\x07", "%YAML 9.9\n---\na: 1", "a: 'x", "\t- a", "a: *b", "&a", "--- a\n--- b", "!<"]
)
def test_both_parsers_refuse(monkeypatch, text):
    for loader in (yamltree._Loader, yaml.BaseLoader):
        monkeypatch.setattr(yamltree, "_Loader", loader)
        with pytest.raises(MissionError):
            parse_yaml(text, file="m.yaml")


def test_lines_are_counted_from_one():
    tree = parse_yaml("# comment\na: 1\nb:\n  - 2\n  -\n    3\n", file="m.yaml")
    assert tree.lines == {"a": 2, "b": 3}
    assert [item.line for item in tree.items["b"].items] == [4, 6]


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        ("-1.5", -1.5),
        ("+2", 2.0),
        ("1e-3", 1e-3),
        ("1E3", 1e3),
        (".5", 0.5),
        ("1.", 1.0),
        ("0", 0.0),
        ("-0.0", 0.0),
    ],
)
def test_numbers(text, value):
    assert to_float(plain(text)) == value


REFUSED = [
    "",
    "~",
    "012",
    "-00",
    "1_000",
    "0x1f",
    "0o17",
    "1:30",
    ".inf",
    "-.INF",
    ".nan",
    "1e",
    "e3",
    ".",
    "1 2",
    "١",
    "true",
]


@pytest.mark.parametrize("text", REFUSED)
def test_not_numbers(text):
    for convert in (to_float, to_int):
        with pytest.raises(ScalarError):
            convert(plain(text))


@pytest.mark.parametrize("text", ["1.0", "1e3", ".5"])
def test_whole_numbers_have_no_fraction(text):
    with pytest.raises(ScalarError):
        to_int(plain(text))


def test_plain_text_is_text_to_a_yaml_1_1_reader_too():
    """Whatever the schema takes for plain text, PyYAML's resolver does not take for a number, boolean, date or null."""
    words = ["on", "1", "2", "-", ".", ":30", "e", "0x", "_", "null", "~", "y", "true", "cf", "2026-01-01", "+", "NO"]
    resolver = yaml.SafeLoader("")
    accepted = 0
    for parts in itertools.product(["", *words], repeat=3):
        text = "".join(parts)
        try:
            to_text(plain(text))
        except ScalarError:
            continue
        accepted += 1
        assert resolver.resolve(yaml.ScalarNode, text, (True, False)) == "tag:yaml.org,2002:str", text
    assert accepted > 1000
