"""Read plan files, and refuse every one that is not exactly as it was written."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

import numpy as np

from deploy.errors import PlanFileError
from deploy.flightlog.container import Contents, DamagedError, check_intact
from deploy.planfile.layout import ARRAYS, FORMAT, METADATA, PROFILE, contents_sha256, leg_file, load
from missions.arrays import Array
from missions.errors import MissionError
from missions.loader import parse_mission
from missions.schema import Mission
from planner.certificate.record import Certificate, Check, Indicators, PairConnection
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.trajectory.encode import decode
from planner.trajectory.encoded import EncodedTrajectory, Encoding, Leg
from planner.trajectory.errors import TrajectoryError
from planner.transfers import Transfers

SIZE_LIMIT = 1 << 30  # bytes; a plan file of a hundred robots is a few MB


def read_plan(path: str | Path) -> FlightPlan:
    """Read a plan file. Whether it may be flown is ``FlightPlan.certificate.passed``, the caller's to ask.

    Raises:
        PlanFileError: missing, cut, edited by so much as a byte, of a newer format, not a plan file, or not the
            bytes and the mission its certificate was made for.
    """
    path = Path(path)
    try:
        if path.stat().st_size > SIZE_LIMIT:
            raise PlanFileError(f"{path}: larger than any plan file ({SIZE_LIMIT / 1e9:.0f} GB)")
        data = path.read_bytes()
    except OSError as error:
        raise PlanFileError(f"{path}: cannot read the plan file: {error.strerror or error}") from error
    return read_plan_bytes(data, name=str(path))


def read_plan_bytes(data: bytes, name: str = "plan") -> FlightPlan:
    """Read a plan file's bytes, e.g. as embedded in a flight log; ``name`` is what messages call it.

    Raises:
        PlanFileError: as :func:`read_plan`.
    """
    return _PlanReader(name).read(data)


class _PlanReader:
    """One reading; every refusal is a line that starts with the file's name."""

    def __init__(self, name: str) -> None:
        self._name = name

    def read(self, data: bytes) -> FlightPlan:
        files, metadata = self._open(data)
        mission = self._mission(files, metadata)
        try:
            plan = _plan(files)
            trajectories = _trajectories(files)
            certificate, transfers = _certificate(files), _transfers(files)
        except (ValueError, TypeError, KeyError) as error:
            raise PlanFileError(f"{self._name}: the plan file cannot be understood: {_line(error)}") from error
        self._check_shapes(mission, plan)
        self._check_certificate(mission, trajectories, certificate)
        if certificate.transfers_sha256 != (transfers.sha256 if transfers else ""):
            self._refuse("the certificate was made for other moves to the search and back")
        versions = {
            key.removeprefix("version."): value for key, value in metadata.items() if key.startswith("version.")
        }
        return FlightPlan(
            mission, plan, MappingProxyType(trajectories), certificate, MappingProxyType(versions), transfers
        )

    def _open(self, data: bytes) -> tuple[Mapping[str, bytes], Mapping[str, str]]:
        try:
            check_intact(data)
            contents = Contents(data)
        except DamagedError as error:
            raise PlanFileError(f"{self._name}: not an intact plan file: {error}") from error
        metadata = contents.metadata.get(METADATA)
        if contents.profile != PROFILE or metadata is None:
            self._refuse(f"not a plan file: its profile is {contents.profile!r}; allowed: {PROFILE!r}")
        version = metadata.get("format", "")
        if version != str(FORMAT):
            self._refuse(f"format {version!r} of the plan file; this version reads {FORMAT}")
        if contents.problems or metadata.get("contents_sha256") != contents_sha256(contents.attachments):
            self._refuse("not an intact plan file: the contents do not match their hash")
        return contents.attachments, metadata

    def _mission(self, files: Mapping[str, bytes], metadata: Mapping[str, str]) -> Mission:
        def read_file(name: str) -> bytes:
            return files[f"files/{name}"]

        try:
            text = files["mission.yaml"].decode()
            return parse_mission(text, path=metadata.get("mission_file") or "mission.yaml", read_file=read_file)
        except (MissionError, KeyError, UnicodeDecodeError) as error:
            raise PlanFileError(f"{self._name}: the mission in it cannot be read: {_line(error)}") from error

    def _check_shapes(self, mission: Mission, plan: Plan) -> None:
        steps, robots, nu = mission.steps, len(mission.robots), mission.dimension
        state = (steps + 1, robots, nu)
        wanted = {"t": (steps + 1,), "q": state, "v": state, "u": (steps, robots, nu)}
        for name, shape in wanted.items():
            array: Array = getattr(plan, name)
            if array.shape != shape or not np.isfinite(array).all():
                self._refuse(f"the plan's {name} has shape {array.shape}; allowed: finite numbers of shape {shape}")

    def _check_certificate(
        self, mission: Mission, trajectories: Mapping[str, EncodedTrajectory], certificate: Certificate
    ) -> None:
        names = [robot.name for robot in mission.robots]
        if list(trajectories) != names:
            self._refuse(f"trajectories for {', '.join(trajectories) or 'nobody'}; the mission has {', '.join(names)}")
        if mission.source is None or certificate.mission_sha256 != mission.source.sha256:
            self._refuse("the certificate was made for another mission")
        if dict(certificate.trajectories_sha256) != {name: item.sha256 for name, item in trajectories.items()}:
            self._refuse("the certificate was made for other trajectories")
        for name, item in trajectories.items():
            try:
                decode(item)
            except TrajectoryError as error:
                raise PlanFileError(f"{self._name}: the trajectory of '{name}' cannot be decoded: {error}") from error

    def _refuse(self, reason: str) -> NoReturn:
        raise PlanFileError(f"{self._name}: {reason}")


def _plan(files: Mapping[str, bytes]) -> Plan:
    arrays = {name: np.load(io.BytesIO(files[f"plan/{name}.npy"]), allow_pickle=False) for name in ARRAYS}
    return Plan(**arrays, **_object(files["plan.json"]))


def _trajectories(files: Mapping[str, bytes]) -> dict[str, EncodedTrajectory]:
    rows: Any = load(files["trajectories.json"])
    return {
        row["robot"]: EncodedTrajectory(
            tuple(
                Leg(
                    Encoding[leg["encoding"]],
                    files[leg_file(row["robot"], number)],
                    leg["pieces"],
                    leg["offset"],
                    leg["reason"],
                )
                for number, leg in enumerate(row["legs"])
            )
        )
        for row in rows
    }


def _transfers(files: Mapping[str, bytes]) -> Transfers | None:
    return Transfers.of_record(_object(files["transfers.json"])) if "transfers.json" in files else None


def _certificate(files: Mapping[str, bytes]) -> Certificate:
    values = _object(files["certificate.json"])
    indicators = values.pop("indicators")
    pairs = tuple(PairConnection(**pair) for pair in indicators.pop("pairs"))
    checks = tuple(Check(**check) for check in values.pop("checks"))
    return Certificate(checks=checks, indicators=Indicators(**indicators, pairs=pairs), **values)


def _object(data: bytes) -> dict[str, Any]:
    value = load(data)
    if not isinstance(value, dict):
        raise ValueError("a JSON object was expected")
    return value


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
