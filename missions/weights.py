"""Another weighting of a mission's maps: in its record, and in its text, comments and all.

A plan file holds the mission's text, and its certificate is for that text: whoever picks a plan from a front picks
weights, and they have to be written where they are read.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import yaml

from missions.errors import MissionError
from missions.information import SeveralMaps
from missions.loader import parse_mission
from missions.schema import Mission

_KEY = "weights"


def reweighted(mission: Mission, weights: Sequence[float]) -> Mission:
    """The mission with other weights in its record only, to plan with; a plan file needs :func:`rewritten`.

    Raises:
        ValueError: the mission has one map, or not as many as there are weights.
    """
    information = mission.information
    if not isinstance(information, SeveralMaps) or len(weights) != len(information.maps):
        raise ValueError(f"{len(weights)} weights for the maps of mission '{mission.name}'")
    plain = tuple(float(weight) for weight in weights)
    return dataclasses.replace(mission, information=dataclasses.replace(information, weights=plain))


def rewritten(mission: Mission, weights: Sequence[float]) -> Mission:
    """The mission with other weights, read again from its text with the weights written into it.

    Raises:
        ValueError: as :func:`reweighted`, or the mission has no text.
        MissionError: the weights are none, e.g. do not sum to 1.
    """
    source, wanted = mission.source, reweighted(mission, weights)
    if source is None or not isinstance(wanted.information, SeveralMaps):
        raise ValueError(f"mission '{mission.name}' has no source text; load it from a file")
    text = _with_weights(source.text, wanted.information.shares)
    return parse_mission(text, path=source.path, read_file=source.files.__getitem__)


def _with_weights(text: str, weights: Sequence[float]) -> str:
    """A mission's text with ``information.weights`` replaced or added; everything else stays as it is."""
    values = "[" + ", ".join(map(repr, weights)) + "]"
    root = yaml.compose(text, Loader=yaml.BaseLoader)
    information = _child(root, "information")
    if not isinstance(information, yaml.MappingNode):
        raise MissionError("missing key 'information'")
    found = _child(information, _KEY)
    if found is not None:
        # A block ends where the next key begins; its last item does not.
        last = found if getattr(found, "flow_style", True) else found.value[-1]
        return text[: found.start_mark.index] + values + text[last.end_mark.index :]
    first = information.value[0][0].start_mark
    if information.flow_style:
        return f"{text[: first.index]}{_KEY}: {values}, {text[first.index :]}"
    return f"{text[: first.index]}{_KEY}: {values}\n{' ' * first.column}{text[first.index :]}"


def _child(node: yaml.Node | None, key: str) -> yaml.Node | None:
    if not isinstance(node, yaml.MappingNode):
        return None
    return next((value for name, value in node.value if name.value == key), None)
