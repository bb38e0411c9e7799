"""What lies where in a plan file, for the writer and the reader.

===============================  ====================================================================
attachment                       content
===============================  ====================================================================
``mission.yaml``                 the mission file's text
``files/<name>``                 every file the mission names, under the name written there
``plan.json``                    the plan's figures (E, violation, seed, effort)
``plan/<t|q|v|u>.npy``           the plan's arrays
``trajectories.json``            per robot, in order: name; per leg: encoding, pieces, offset, why
``trajectories/<robot>.<k>.bin`` the bytes of leg k (from 0), as they fly
``transfers.json``               the moves to the search and back; none in a plan nobody has to fly
``certificate.json``             what was checked, and of which bytes and moves
===============================  ====================================================================

The metadata record ``ergoflie.plan`` holds the format, versions, seed and hashes; ``contents_sha256`` is taken over
all attachments. Messages (``/plan/<robot>/pose``) are for viewers only: nothing is read back from them.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping

PROFILE = "ergoflie-plan"
FORMAT = 2  # raised when readers of the previous format could misread a file
METADATA = "ergoflie.plan"
ARRAYS = ("t", "q", "v", "u")


def leg_file(robot: str, number: int) -> str:
    """Attachment that holds the bytes of a robot's leg."""
    return f"trajectories/{robot}.{number}.bin"


def contents_sha256(attachments: Mapping[str, bytes]) -> str:
    """Hash over names and contents of all attachments."""
    digest = hashlib.sha256()
    for name in sorted(attachments):
        digest.update(hashlib.sha256(name.encode()).digest() + hashlib.sha256(attachments[name]).digest())
    return digest.hexdigest()


def dump(value: object) -> bytes:
    """JSON, with numbers that are not finite as ``{"float": "inf"}``."""
    return json.dumps(_outward(value), allow_nan=False, indent=1, sort_keys=True).encode()


def load(data: bytes) -> object:
    """What :func:`dump` wrote, with tuples for lists.

    Raises:
        ValueError: no such JSON.
    """
    return _inward(json.loads(data))


def _outward(value: object) -> object:
    if isinstance(value, Mapping):
        return {key: _outward(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_outward(item) for item in value]
    if hasattr(value, "item"):  # a NumPy scalar
        return _outward(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": str(value)}
    return value


def _inward(value: object) -> object:
    if isinstance(value, dict):
        if value.keys() == {"float"}:
            return float(value["float"])
        return {key: _inward(item) for key, item in value.items()}
    return tuple(_inward(item) for item in value) if isinstance(value, list) else value
