"""Write plan files: the same flight plan gives the same bytes."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from mcap.writer import CompressionType, Writer

from deploy.errors import PlanFileError
from deploy.files import write_whole
from deploy.flightlog.encode import NANOSECONDS, pose_in_frame, to_json
from deploy.flightlog.topics import find_topic, json_schema
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
    writer = Writer(stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
    writer.start(profile=PROFILE, library="ergoflie")
    writer.add_metadata(METADATA, _metadata(flight_plan, attachments))
    for name in sorted(attachments):
        writer.add_attachment(0, 0, name, _media_type(name), attachments[name])
    _add_poses(writer, flight_plan)
    writer.finish()  # type: ignore[no-untyped-call]
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
    values = {
        "format": str(FORMAT),
        "mission": mission.name,
        # Only the file's name: a plan is passed on, and where its author keeps his files is nobody's business.
        "mission_file": Path(source.path).name if source else "",
        "mission_sha256": source.sha256 if source else "",
        "contents_sha256": contents_sha256(attachments),
        "seed": str(flight_plan.plan.seed),
        **{f"version.{name}": version for name, version in flight_plan.versions.items()},
    }
    return dict(sorted(values.items()))


def _npy(array: Array) -> bytes:
    stream = io.BytesIO()
    np.save(stream, np.ascontiguousarray(array, dtype="<f8"), allow_pickle=False)
    return stream.getvalue()


def _media_type(name: str) -> str:
    kinds = {".yaml": "application/yaml", ".json": "application/json", ".png": "image/png"}
    return kinds.get(Path(name).suffix, "application/octet-stream")


def _add_poses(writer: Writer, flight_plan: FlightPlan) -> None:
    """The certified trajectories as poses, decoded from the bytes, for viewers."""
    topic, _ = find_topic("/plan/x/pose")
    schema = writer.register_schema(topic.schema, "jsonschema", json_schema(topic).encode())
    for name, encoded in flight_plan.trajectories.items():
        channel = writer.register_channel(f"/plan/{name}/pose", "json", schema)
        trajectory = decode(encoded)
        times = np.arange(0.0, trajectory.duration, 1.0 / VIEWER_RATE)
        for number, (t, value) in enumerate(zip(times, trajectory.evaluate(times), strict=True)):
            nanoseconds = round(float(t) * NANOSECONDS)
            half = 0.5 * float(value[3])
            pose = pose_in_frame(nanoseconds, value[:3], (0.0, 0.0, float(np.sin(half)), float(np.cos(half))))
            writer.add_message(channel, nanoseconds, to_json(pose), nanoseconds, number)
