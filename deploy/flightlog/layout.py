"""A layout for Foxglove and Lichtblick: scene, figures, phases and events of a plan or a flight, with no set-up."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

from deploy.flightlog.scene import colour

Json = dict[str, object]

_SHOWN = ("/map", "/scene/mission", "/scene/drones", "/scene/links")


def layout(robots: Sequence[str]) -> Json:
    """The layout file's contents, for robots of these names."""
    plots = {
        "Plot!ergodicity": _plot("Ergodicity so far", ["/ergodicity.value", "/ergodicity.certified"]),
        "Plot!height": _plot("Height [m]", [f"/{name}/pose.pose.position.z" for name in robots]),
        "Plot!battery": _plot("Battery [V]", [f"/{name}/battery.voltage" for name in robots]),
        "Plot!link": _plot("Round trip [ms]", [f"/{name}/link.latency_ms" for name in robots]),
    }
    phases: Json = {"paths": [{"value": "/events.phase", "timestampMethod": "receiveTime", "label": "phase"}]}
    panels: Json = {
        "3D!scene": _scene(),
        **plots,
        "StateTransitions!phases": {**phases, "isSynced": True, "foxglovePanelTitle": "Phases"},
        "RosOut!log": {"topicToRender": "/log", "searchTerms": [], "minLogLevel": 1},
    }
    left = _split("column", "3D!scene", _split("column", "StateTransitions!phases", "RosOut!log", 35), 70)
    right = _split(
        "column",
        _split("column", "Plot!ergodicity", "Plot!height", 50),
        _split("column", "Plot!battery", "Plot!link", 50),
        50,
    )
    return {
        "configById": panels,
        "globalVariables": {},
        "userNodes": {},
        "playbackConfig": {"speed": 1},
        "layout": _split("row", left, right, 60),
    }


def _scene() -> Json:
    camera = {
        "perspective": True,
        "distance": 6.0,
        "phi": 50.0,
        "thetaOffset": 30.0,
        "targetOffset": [1.5, 1.25, 0.0],
        "target": [0, 0, 0],
        "targetOrientation": [0, 0, 0, 1],
        "fovy": 45,
        "near": 0.05,
        "far": 500,
    }
    topics: Json = {name: {"visible": True} for name in _SHOWN}
    topics["/map"] = {"visible": True, "colorMode": "colormap", "colorField": "information", "colorMap": "turbo"}
    transforms = {"labelSize": 0.0, "axisScale": 0.0, "lineWidth": 0}
    return {
        "cameraState": camera,
        "followMode": "follow-none",
        "followTf": "world",
        "fixedFrame": "world",
        "scene": {"transforms": transforms},
        "topics": topics,
        "layers": {},
        "foxglovePanelTitle": "Flight",
    }


def _plot(title: str, paths: Sequence[str]) -> Json:
    lines = [
        {"value": path, "enabled": True, "timestampMethod": "receiveTime", "color": _hex(number), "label": _label(path)}
        for path, number in zip(paths, itertools.count())
    ]
    return {
        "foxglovePanelTitle": title,
        "paths": lines,
        "showLegend": True,
        "legendDisplay": "floating",
        "isSynced": True,
        "xAxisVal": "timestamp",
        "showXAxisLabels": True,
        "showYAxisLabels": True,
    }


def _label(path: str) -> str:
    """A robot's name, or the field's."""
    topic, _, field = path.partition(".")
    parts = topic.strip("/").split("/")
    return parts[0] if len(parts) > 1 else field


def _hex(number: int) -> str:
    return "#" + "".join(f"{round(255 * part):02x}" for part in colour(number)[:3])


def _split(direction: str, first: object, second: object, share: float) -> Json:
    return {"direction": direction, "first": first, "second": second, "splitPercentage": share}
