"""A front as text: the mission with all it names, and each plan as its controls, from which everything else follows.

What is read is worked out again: positions from controls, ergodic vectors from positions. A front grants nothing by
itself; the plan that is picked is certified as the bytes that fly, like every other.
"""

from __future__ import annotations

import base64
import binascii
import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from missions.arrays import Array, frozen
from missions.errors import MissionError
from missions.loader import parse_mission
from missions.schema import Mission
from planner.models import mission_dynamics
from planner.pareto.front import Front, FrontError, FrontPoint, FrontSettings, Maps
from planner.pareto.ideal import ideal_vectors
from planner.plan import Plan

KIND, FORMAT = "ergoflie front", 1
SIZE_LIMIT = 500_000_000  # bytes
_AGREE = 1e-6  # of stored and recomputed ergodic vectors, relative: another NumPy rounds differently


def front_text(front: Front) -> str:
    """The front as JSON.

    Raises:
        FrontError: the mission has no source text.
    """
    source = front.mission.source
    if source is None:
        raise FrontError(f"mission '{front.mission.name}' has no source text; load it from a file")
    value = {
        "kind": KIND,
        "format": FORMAT,
        "mission": {
            "path": Path(source.path).name,  # where its author keeps his files is nobody's business
            "text": source.text,
            "files": {name: base64.b64encode(data).decode() for name, data in source.files.items()},
        },
        "settings": dataclasses.asdict(front.settings),
        "notes": list(front.notes),
        "hypervolume": front.hypervolume,
        "named": front.named,
        "points": [_point(point) for point in front.points],
    }
    return json.dumps(value, indent=1, allow_nan=False)


def _point(point: FrontPoint) -> dict[str, object]:
    plan = point.plan
    return {
        "weights": point.weights.tolist(),
        "vector": point.vector.tolist(),
        "parent": point.parent,
        "status": point.status,
        "violation": plan.violation,
        "seed": plan.seed,
        "evaluations": plan.evaluations,
        "seconds": plan.seconds,
        "shape": list(plan.u.shape),
        "u": base64.b64encode(np.ascontiguousarray(plan.u, dtype="<f8").tobytes()).decode(),
    }


def read_front(path: str | Path) -> Front:
    """Read a front file.

    Raises:
        FrontError: missing, cut, edited, of a newer format, or no front at all.
    """
    path = Path(path)
    try:
        if path.stat().st_size > SIZE_LIMIT:
            raise FrontError(f"{path}: larger than any front ({SIZE_LIMIT / 1e6:.0f} MB)")
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise FrontError(f"{path}: cannot read the front: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise FrontError(f"{path}: not a front file: it is no text") from None
    return parse_front(text, str(path))


def parse_front(text: str, name: str = "front") -> Front:
    """A front from its text; ``name`` is what messages call it.

    Raises:
        FrontError: as :func:`read_front`.
    """
    try:
        value = json.loads(text)
    except (json.JSONDecodeError, RecursionError):
        raise FrontError(f"{name}: not a front file: it is no JSON, or cut short") from None
    if not isinstance(value, dict) or value.get("kind") != KIND:
        raise FrontError(f"{name}: not a front file; 'ergoflie pareto' makes them")
    if value.get("format") != FORMAT:
        raise FrontError(f"{name}: format {str(value.get('format'))[:20]} of the front; this version reads {FORMAT}")
    try:
        return _front(value, name)
    except MissionError as error:
        raise FrontError(f"{name}: the mission in it cannot be read: {error}") from None
    except (KeyError, TypeError, ValueError, binascii.Error) as error:
        if isinstance(error, FrontError):
            raise
        raise FrontError(f"{name}: the front cannot be understood: {_line(error)}") from None


def _front(value: Mapping[str, Any], name: str) -> Front:
    stored = value["mission"]
    files = {key: base64.b64decode(data, validate=True) for key, data in stored["files"].items()}
    mission = parse_mission(stored["text"], path=str(stored["path"]), read_file=files.__getitem__)
    maps = Maps.of(mission)
    points = tuple(
        _read_point(row, number, mission, maps, f"{name}: point {number}") for number, row in enumerate(value["points"])
    )
    notes = tuple(str(note) for note in value["notes"])
    return Front(mission, FrontSettings(**value["settings"]), maps.names, maps.distances, points, notes)


def _read_point(row: Mapping[str, Any], number: int, mission: Mission, maps: Maps, where: str) -> FrontPoint:
    weights, vector = np.array(row["weights"], np.float64), np.array(row["vector"], np.float64)
    shape, wanted = tuple(row["shape"]), mission_dynamics(mission).controls_shape
    if weights.shape != maps.prefer.shape or not abs(math.fsum(weights) - 1.0) < _AGREE or (weights < 0.0).any():
        raise FrontError(f"{where}: got weights {weights.tolist()}; allowed: one for each map, with a sum of 1")
    if shape != tuple(wanted):
        raise FrontError(f"{where}: got controls of shape {shape}; allowed: {tuple(wanted)}")
    u = np.frombuffer(base64.b64decode(row["u"], validate=True), "<f8").reshape(shape).astype(np.float64)
    if not np.isfinite(u).all():
        raise FrontError(f"{where}: controls that are not finite")
    parent = row["parent"]
    if parent is not None and not (isinstance(parent, int) and parent >= 0):
        raise FrontError(f"{where}: got parent {parent!r}; allowed: the number of a point")
    plan = _plan(mission, u, row)
    found = maps.vector(plan.q[:-1])
    if not np.allclose(found, vector, rtol=_AGREE, atol=1e-12):
        raise FrontError(f"{where}: its plan is worth {found.tolist()}, not {vector.tolist()}: the file was edited")
    E = float(weights @ (found - ideal_vectors(weights[None], maps.distances)[0]))
    return FrontPoint(frozen(weights), found, replace(plan, ergodicity=E), parent, str(row["status"]))


def _plan(mission: Mission, u: Array, row: Mapping[str, Any]) -> Plan:
    """The plan of controls (T, N, m), without its ergodicity."""
    dynamics = mission_dynamics(mission)
    motion = dynamics.rollout(u)
    v = motion.v.copy()
    if dynamics.rests:
        v[-1] = 0.0  # by construction, up to rounding
    return Plan(
        t=np.arange(mission.steps + 1, dtype=np.float64) * mission.horizon.dt,
        q=motion.q,
        v=v,
        u=u,
        ergodicity=math.nan,
        violation=float(row["violation"]),
        seed=int(row["seed"]),
        evaluations=int(row["evaluations"]),
        seconds=float(row["seconds"]),
    )


def _line(error: Exception) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__
