"""Read Crazyswarm2's ``crazyflies.yaml``: the robots that are enabled, with what holds for each of them.

A parameter may be set for a robot, for its type, or for all; the nearest wins. What a mission has no place for is
collected in words, so that nobody believes it was taken over.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Set
from dataclasses import dataclass
from typing import TypeVar

from missions.errors import MissionError
from missions.fields import NAME, Vector
from missions.mappings import FrozenMapping
from missions.scalars import ScalarError, is_null, to_bool, to_float, to_text
from missions.uris import check_uri
from missions.yamltree import MappingNode, Node, ScalarNode, SequenceNode, parse_yaml

Value = TypeVar("Value")
_PARAMETER = "[A-Za-z0-9_]{1,26}"
_ROOT = {"fileversion", "robots", "robot_types", "all"}
_ROBOT = {"enabled", "uri", "initial_position", "type", "firmware_params"}
_TYPE = {"motion_capture", "battery", "big_quad", "firmware_params"}
_ALL = {"firmware_params", "reference_frame"}


@dataclass(frozen=True)
class SwarmRobot:
    """One enabled robot.

    Attributes:
        name: as in the file. uri: of its link.
        position: (x, y, z) where it stands [m].
        type: name of its type.
        parameters: on-board parameters, ``group.name`` to value, of robot, type and all.
        voltage: ``voltage_critical`` of its type [V]; None if it has none.
        marker: name of the marker configuration by which librigidbodytracker tells it apart; empty if the system does.
    """

    name: str
    uri: str
    position: Vector
    type: str
    parameters: Mapping[str, float]
    voltage: float | None
    marker: str = ""


@dataclass(frozen=True)
class Swarm:
    """The enabled robots, in the file's order, and what was left behind, one line each."""

    robots: tuple[SwarmRobot, ...]
    notes: tuple[str, ...]


def parse_crazyflies(text: str, file: str) -> Swarm:
    """Read a ``crazyflies.yaml``.

    Args:
        text: the file's text.
        file: its name, for messages.

    Raises:
        MissionError: not YAML, no robot enabled, or a robot without usable name, uri, position or type; with the line.
    """
    root = Branch(parse_yaml(text, file=file), "", file)
    notes = _unknown(root, _ROOT)
    everybody = root.branch("all")
    notes += _unknown(everybody, _ALL)
    if (frame := everybody.text("reference_frame")) not in (None, "world"):
        notes.append(f"all.reference_frame: {frame}")
    types = root.branch("robot_types")
    enabled = [robot for robot in root.branch("robots").branches() if robot.flag("enabled", default=True)]
    if not enabled:
        raise root.error("no robot is enabled; allowed: at least one with 'enabled: true'", "robots")
    robots = []
    for robot in enabled:
        notes += _unknown(robot, _ROBOT)
        robots.append(_robot(robot, types, everybody))
    for name in dict.fromkeys(robot.type for robot in robots):
        notes += _type_notes(types.branch(name))
    idle = [robot.key for robot in root.branch("robots").branches() if not robot.flag("enabled", default=True)]
    if idle:
        notes.append(f"robots that are not enabled: {', '.join(idle)}")
    return Swarm(tuple(robots), tuple(dict.fromkeys(notes)))


@dataclass(frozen=True)
class Branch:
    """A mapping in a YAML file of others, where keys we do not know are no mistake.

    Attributes:
        node: the mapping; a null or an absent one is empty.
        path: where it is. file: for messages.
    """

    node: Node | None
    path: str
    file: str

    @property
    def key(self) -> str:
        """Its own name."""
        return self.path.rpartition(".")[2]

    @property
    def items(self) -> Mapping[str, Node]:
        """Its keys and values. Raises MissionError if it is no mapping."""
        if self.node is None or (isinstance(self.node, ScalarNode) and is_null(self.node)):
            return {}
        if not isinstance(self.node, MappingNode):
            raise MissionError("allowed: a mapping", where=self.path, file=self.file, line=self.node.line)
        return self.node.items

    def branch(self, key: str) -> Branch:
        """The mapping below."""
        return Branch(self.items.get(key), f"{self.path}.{key}" if self.path else key, self.file)

    def branches(self) -> list[Branch]:
        """All mappings below."""
        return [self.branch(key) for key in self.items]

    def error(self, reason: str, key: str = "") -> MissionError:
        """An error at one of its keys."""
        node = self.items.get(key, self.node)
        where = ".".join(part for part in (self.path, key) if part)
        return MissionError(reason, where=where, file=self.file, line=node.line if node else None)

    def scalar(self, key: str) -> ScalarNode | None:
        """A leaf, None if absent or null."""
        node = self.items.get(key)
        if node is None or (isinstance(node, ScalarNode) and is_null(node)):
            return None
        if not isinstance(node, ScalarNode):
            raise self.error("allowed: a single value", key)
        return node

    def text(self, key: str) -> str | None:
        """Text, None if absent."""
        return None if (node := self.scalar(key)) is None else self._converted(to_text, node, key)

    def number(self, key: str) -> float | None:
        """A finite number, None if absent; booleans count as 0 and 1, as they do for on-board parameters."""
        node = self.scalar(key)
        if node is not None and node.plain and node.text in ("true", "false"):
            return float(node.text == "true")
        return None if node is None else self._converted(to_float, node, key)

    def flag(self, key: str, *, default: bool) -> bool:
        """A boolean."""
        node = self.scalar(key)
        return default if node is None else self._converted(to_bool, node, key)

    def vector(self, key: str) -> Vector | None:
        """A list of three numbers, None if absent."""
        node = self.items.get(key)
        if node is None:
            return None
        if not isinstance(node, SequenceNode) or len(node.items) != 3:
            raise self.error("allowed: three numbers [m]", key)
        leaves = [item for item in node.items if isinstance(item, ScalarNode)]
        if len(leaves) != 3:
            raise self.error("allowed: three numbers [m]", key)
        return tuple(self._converted(to_float, leaf, key) for leaf in leaves)

    def _converted(self, convert: Callable[[ScalarNode], Value], node: ScalarNode, key: str) -> Value:
        try:
            return convert(node)
        except ScalarError as error:
            raise self.error(str(error), key) from None


def _robot(robot: Branch, types: Branch, everybody: Branch) -> SwarmRobot:
    if not re.fullmatch(NAME, robot.key):
        raise robot.error("allowed as a name: up to 64 letters, digits, '_' and '-'")
    uri, position, kind = robot.text("uri"), robot.vector("initial_position"), robot.text("type")
    if uri is None or position is None or kind is None:
        raise robot.error("allowed: a robot with 'uri', 'initial_position' and 'type'")
    if reason := check_uri(uri):
        raise robot.error(reason, "uri")
    if kind not in types.items:
        raise robot.error(f"got {kind[:60]!r}; allowed: a key of robot_types", "type")
    own = types.branch(kind)
    parameters: dict[str, float] = {}
    for source in (everybody, own, robot):  # the nearest wins
        parameters |= _parameters(source.branch("firmware_params"))
    voltage = own.branch("battery").number("voltage_critical")
    return SwarmRobot(robot.key, uri, position, kind, FrozenMapping(parameters), voltage, _marker(own))


def _parameters(groups: Branch) -> dict[str, float]:
    found = {}
    for group in groups.branches():
        for name in group.items:
            if not (re.fullmatch(_PARAMETER, group.key) and re.fullmatch(_PARAMETER, name)):
                raise group.error("allowed: the group and the name of an on-board parameter", name)
            value = group.number(name)
            if value is None:
                raise group.error("allowed: a number", name)
            found[f"{group.key}.{name}"] = value
    return found


def _unknown(branch: Branch, known: Set[str]) -> list[str]:
    return [f"{branch.path}.{key}".lstrip(".") for key in branch.items if key not in known]


def _type_notes(kind: Branch) -> list[str]:
    notes = _unknown(kind, _TYPE)
    if kind.flag("big_quad", default=False):
        notes.append(f"{kind.path}.big_quad: choose flight.airframe")
    return notes


def _marker(kind: Branch) -> str:
    capture = kind.branch("motion_capture")
    tracked = capture.text("tracking") == "librigidbodytracker" or capture.flag("enabled", default=False)
    return (capture.text("marker") or "default") if tracked else ""
