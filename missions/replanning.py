"""Maps that change while robots fly: when, and where they may take new trajectories over.

A drone flies one leg of its trajectory while the next is uploaded (``planner/trajectory/legs.py``). A mission that may
be planned anew in flight cuts everybody's legs at the same instants, its joints: what follows a joint can be replaced
up to half a second before it, for everybody or for nobody.
"""

from __future__ import annotations

import dataclasses
import json
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import yaml

from missions.errors import MissionError
from missions.fields import Vector, field
from missions.information import GaussianMixtureMap, UniformMap

if TYPE_CHECKING:
    from missions.schema import Mission

_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?|true|false")
WrittenMap = GaussianMixtureMap | UniformMap  # a map that is all in the text, with no file beside it


@dataclass(frozen=True)
class MapChange:
    """Another map from some time on."""

    time: float = field("when it becomes known, after the start of the search", unit="s", at_least=0.0)
    information: WrittenMap = field("where there is something to see from then on")


@dataclass(frozen=True)
class Replanning:
    """When robots may take new trajectories over, how long planning them takes, and what changes."""

    joints: Vector = field(
        "instants of the search at which all robots may take new trajectories over, together",
        unit="s",
        above=0.0,
        items=(1, 100),
        default=(),
    )
    budget: float = field(
        "time a new plan gets; in rehearsals it takes exactly as long, on hardware what is late is not flown",
        unit="s",
        above=0.0,
        at_most=600.0,
        default=5.0,
    )
    changes: tuple[MapChange, ...] = field("what is scripted; more may be told in flight", default=(), items=(0, 100))

    def __bool__(self) -> bool:
        return bool(self.joints)


def with_information(mission: Mission, information: WrittenMap) -> Mission:
    """The mission with another map, read again from its text with the map written into it: what a plan file needs.

    Raises:
        ValueError: the mission has no source text.
        MissionError: the map does not fit the mission.
    """
    return _reread(mission, json.dumps(_plain(information)))


def with_information_text(mission: Mission, text: str) -> Mission:
    """The same for a map as YAML or JSON text, as it is told in flight.

    Raises:
        ValueError: the mission has no source text.
        MissionError: the text is no map, or does not fit the mission.
    """
    return _reread(mission, one_line(text))


def one_line(text: str, file: str = "") -> str:
    """YAML of a map as a flow mapping in one line. Raises MissionError."""
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise MissionError(f"a map that is no YAML: {' '.join(str(error).split())[:100]}", file=file) from None
    if not isinstance(node, yaml.MappingNode):
        raise MissionError(f"got {text[:60]!r}; allowed: a mapping, as 'information' in a mission file", file=file)
    return _flow(node)


def _flow(node: yaml.Node) -> str:
    """A node in flow style, numbers as they are written: the mission's own reader judges them."""
    if isinstance(node, yaml.MappingNode):
        return "{" + ", ".join(f"{_flow(key)}: {_flow(value)}" for key, value in node.value) + "}"
    if isinstance(node, yaml.SequenceNode):
        return "[" + ", ".join(map(_flow, node.value)) + "]"
    number = getattr(node, "style", None) is None and _NUMBER.fullmatch(node.value)
    return str(node.value) if number else json.dumps(node.value)


def _reread(mission: Mission, information: str) -> Mission:
    from missions.loader import parse_mission  # it reads records that hold these

    source = mission.source
    if source is None:
        raise ValueError(f"mission '{mission.name}' has no source text; load it from a file")
    root = yaml.compose(source.text, Loader=yaml.BaseLoader)
    keys = root.value if isinstance(root, yaml.MappingNode) else ()
    value = next((value for key, value in keys if key.value == "information"), None)
    if value is None:
        raise MissionError("missing key 'information'")
    begin, end = value.start_mark.index, value.end_mark.index
    after = "" if getattr(value, "flow_style", True) else "\n"  # a block ends where the next key begins
    text = source.text[:begin] + information + after + source.text[end:]
    read = parse_mission(text, path=source.path, read_file=source.files.__getitem__)
    return dataclasses.replace(mission, information=read.information, source=read.source)  # who stays behind, stays


def _plain(record: Any) -> Any:  # noqa: ANN401 - whatever a record holds
    if dataclasses.is_dataclass(record):
        items = (item for item in dataclasses.fields(record) if not item.metadata.get("internal"))
        return {item.name: _plain(getattr(record, item.name)) for item in items}
    if isinstance(record, tuple):
        return [_plain(item) for item in record]
    return record
