"""Records to JSON bytes: compact, deterministic, always valid JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

from deploy.flightlog.topics import WORLD

NANOSECONDS = 1_000_000_000
LOG_LEVELS = {"debug": 1, "info": 2, "warning": 3, "fault": 4}  # foxglove.LogLevel
IDENTITY = (0.0, 0.0, 0.0, 1.0)


def to_json(record: Mapping[str, object]) -> bytes:
    """JSON bytes of a record; a number that is not finite becomes null, as JSON has no word for it.

    Raises:
        TypeError: a value that has no JSON form.
    """
    try:
        return _ENCODER.encode(record).encode()
    except ValueError:
        return _ENCODER.encode(_finite(record)).encode()


def vector(values: Sequence[float]) -> dict[str, float]:
    """x, y, z as a JSON object."""
    x, y, z = values
    return {"x": float(x), "y": float(y), "z": float(z)}


def timestamp(nanoseconds: int) -> dict[str, int]:
    """Foxglove's time."""
    sec, nsec = divmod(nanoseconds, NANOSECONDS)
    return {"sec": sec, "nsec": nsec}


def pose_in_frame(nanoseconds: int, position: Sequence[float], quaternion: Sequence[float] | None) -> dict[str, object]:
    """A ``foxglove.PoseInFrame`` in the world frame; quaternion x, y, z, w, or None for the identity."""
    x, y, z, w = IDENTITY if quaternion is None else quaternion
    orientation = {"x": float(x), "y": float(y), "z": float(z), "w": float(w)}
    return {
        "timestamp": timestamp(nanoseconds),
        "frame_id": WORLD,
        "pose": {"position": vector(position), "orientation": orientation},
    }


def pose_to_json(nanoseconds: int, position: Sequence[float], quaternion: Sequence[float] | None) -> bytes:
    """``to_json(pose_in_frame(...))``, written out: half of all records of a flight are poses."""
    x, y, z = map(float, position)
    a, b, c, d = IDENTITY if quaternion is None else map(float, quaternion)
    if not math.isfinite(x + y + z + a + b + c + d):
        return to_json(pose_in_frame(nanoseconds, position, quaternion))
    sec, nsec = divmod(nanoseconds, NANOSECONDS)
    return (
        f'{{"timestamp":{{"sec":{sec},"nsec":{nsec}}},"frame_id":"{WORLD}","pose":{{"position":{{"x":{x!r},"y":{y!r},'
        f'"z":{z!r}}},"orientation":{{"x":{a!r},"y":{b!r},"z":{c!r},"w":{d!r}}}}}}}'
    ).encode()


def vectors_to_json(
    names: tuple[str, ...], vectors: Sequence[Sequence[float] | None], rest: Mapping[str, float | None]
) -> bytes:
    """``to_json`` of three-vectors by name, then numbers by name, written out: telemetry is the other half.

    A vector that is None is left out; a number that is None is null.
    """
    parts: list[str] = []
    for name, value in zip(names, vectors, strict=True):
        if value is not None:
            x, y, z = map(float, value)
            if not math.isfinite(x + y + z):
                break
            parts.append(f'"{name}":{{"x":{x!r},"y":{y!r},"z":{z!r}}}')
    else:
        for name, number in rest.items():
            # Only Python's own numbers look in JSON as they look in Python.
            if number is None:
                parts.append(f'"{name}":null')
            elif type(number) is int or (type(number) is float and math.isfinite(number)):
                parts.append(f'"{name}":{number!r}')
            else:
                break
        else:
            return f"{{{','.join(parts)}}}".encode()
    known = {name: vector(value) for name, value in zip(names, vectors, strict=True) if value is not None}
    return to_json({**known, **rest})


def log_line(nanoseconds: int, level: str, name: str, message: str) -> dict[str, object]:
    """A ``foxglove.Log``; level debug, info, warning or fault."""
    return {
        "timestamp": timestamp(nanoseconds),
        "level": LOG_LEVELS.get(level, 0),
        "message": message,
        "name": name,
        "file": "",
        "line": 0,
    }


def _plain(value: object) -> object:
    """NumPy scalars and arrays as Python numbers and lists."""
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"a record holds {type(value).__name__}, which has no JSON form")


def _finite(value: object) -> Any:  # noqa: ANN401 - JSON is recursive
    if isinstance(value, Mapping):
        return {key: _finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(item) for item in value]
    if hasattr(value, "tolist"):
        return _finite(value.tolist())
    return None if isinstance(value, float) and not math.isfinite(value) else value


_ENCODER = json.JSONEncoder(allow_nan=False, separators=(",", ":"), default=_plain)
