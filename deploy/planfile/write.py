"""Write plan files: the same flight plan gives the same bytes."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from deploy.errors import PlanFileError
from deploy.files import write_whole
from deploy.flightlog.encode import NANOSECONDS, pose_in_frame, to_json
from deploy.flightlog.mcapfile import McapFile
from deploy.flightlog.scene import drones_scene, links_scene, map_grid, mission_scene, transforms
from deploy.flightlog.topics import find_topic
from deploy.planfile.layout import ARRAYS, FORMAT, METADATA, PROFILE, contents_sha256, dump, leg_file
from missions.arrays import Array
from planner.flightplan import FlightPlan
from planner.trajectory.encode import decode
from planner.trajectory.encoded import Leg

VIEWER_RATE = 10.0  # Hz of the poses a viewer plays


def write_plan(path: str | Path, flight_plan: FlightPlan) -> None:
    """Write a plan file; it appears whole or not at all, replacing one that is there.

    Raises:
        PlanFileError: the folder cannot be written, or the mission has no source text.
    """
    path = Path(path)
    data = plan_bytes(flight_plan)
    try:
        write_whole(path, data)
    except OSError as error:
        raise PlanFileError(f"{path}: cannot write the plan file: {error.strerror or error}") from error


def plan_bytes(flight_plan: FlightPlan) -> bytes:
    """A plan file's bytes.

    Raises:
        PlanFileError: the mission has no source text, so that the plan could not be checked again.
    """
    attachments = _attachments(flight_plan)
    stream = io.BytesIO()
    file = McapFile(stream, PROFILE)
    file.describe(METADATA, _metadata(flight_plan, attachments))
    for name in sorted(attachments):
        file.attach(name, attachments[name])
    _add_pictures(file, flight_plan)
    file.finish()
    return stream.getvalue()


def _attachments(flight_plan: FlightPlan) -> dict[str, bytes]:
    source, plan = flight_plan.mission.source, flight_plan.plan
    if source is None:
        raise PlanFileError(f"mission '{flight_plan.mission.name}' has no source text; load it from a file")
    figures = {field.name: getattr(plan, field.name) for field in dataclasses.fields(plan) if field.name not in ARRAYS}
    rows = [
        {"robot": name, "legs": [_leg(leg) for leg in item.legs]} for name, item in flight_plan.trajectories.items()
    ]
    return {
        "mission.yaml": source.text.encode(),
        **{f"files/{name}": data for name, data in source.files.items()},
        "plan.json": dump(figures),
        **{f"plan/{name}.npy": _npy(getattr(plan, name)) for name in ARRAYS},
        "trajectories.json": dump(rows),
        **{
            leg_file(name, number): leg.data
            for name, item in flight_plan.trajectories.items()
            for number, leg in enumerate(item.legs)
        },
        **({"transfers.json": dump(flight_plan.transfers.record())} if flight_plan.transfers else {}),
        "certificate.json": dump(dataclasses.asdict(flight_plan.certificate)),
    }


def _leg(leg: Leg) -> dict[str, object]:
    return {"encoding": leg.encoding.name, "pieces": leg.pieces, "offset": leg.offset, "reason": leg.reason}


def _metadata(flight_plan: FlightPlan, attachments: Mapping[str, bytes]) -> dict[str, str]:
    mission = flight_plan.mission
    source = mission.source
    return {
        "format": str(FORMAT),
        "mission": mission.name,
        # Only the file's name: a plan is passed on, and where its author keeps his files is nobody's business.
        "mission_file": Path(source.path).name if source else "",
        "mission_sha256": source.sha256 if source else "",
        "contents_sha256": contents_sha256(attachments),
        "seed": str(flight_plan.plan.seed),
        **{f"version.{name}": version for name, version in flight_plan.versions.items()},
    }


def _npy(array: Array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(array, dtype="<f8"), allow_pickle=False)
    return stream.getvalue()


def _add_pictures(file: McapFile, flight_plan: FlightPlan) -> None:
    """The certified trajectories, decoded from the bytes, and what is around them, for viewers."""
    mission = flight_plan.mission
    trajectories = {name: decode(encoded) for name, encoded in flight_plan.trajectories.items()}
    last = max((trajectory.duration for trajectory in trajectories.values()), default=0.0)
    times = np.arange(0.0, last, 1.0 / VIEWER_RATE)
    moments = [round(float(t) * NANOSECONDS) for t in times]
    poses = {name: _poses(item.evaluate(np.minimum(times, item.duration))) for name, item in trajectories.items()}
    messages = _Messages(file)
    messages.add("/map", 0, map_grid(mission, 0))
    paths = {name: np.array([place for place, _ in found]) for name, found in poses.items()}
    messages.add("/scene/mission", 0, mission_scene(mission, paths, 0))
    messages.add("/scene/drones", 0, drones_scene(tuple(trajectories), 0))
    for number, moment in enumerate(moments):
        places = {name: poses[name][number] for name in trajectories}
        messages.add("/tf", moment, transforms(places, moment))
        if mission.connectivity.range is not None:
            messages.add("/scene/links", moment, links_scene(places, mission.connectivity.range, moment))
        for name, (position, quaternion) in places.items():
            messages.add(f"/plan/{name}/pose", moment, pose_in_frame(moment, position, quaternion))
    file.chunk(messages.encoded)


def _poses(values: Array) -> list[tuple[list[float], tuple[float, ...]]]:
    """Positions [m] and quaternions of a trajectory's values (S, 4): x, y, z, yaw."""
    sines, cosines = np.sin(0.5 * values[:, 3]), np.cos(0.5 * values[:, 3])
    rows = zip(values[:, :3].tolist(), sines.tolist(), cosines.tolist(), strict=True)
    return [(place, (0.0, 0.0, z, w)) for place, z, w in rows]


class _Messages:
    """Encoded messages, and the channels they declare."""

    def __init__(self, file: McapFile) -> None:
        self._file = file
        self._channels: dict[str, int] = {}
        self.encoded: list[tuple[int, int, bytes]] = []

    def add(self, name: str, nanoseconds: int, message: Mapping[str, object]) -> None:
        """Add one message of a topic."""
        if name not in self._channels:
            topic, robot = find_topic(name)
            self._channels[name] = self._file.channel(name, topic, robot)
        self.encoded.append((nanoseconds, self._channels[name], to_json(message)))
