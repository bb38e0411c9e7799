"""study.yaml to Study: whatever is wrong with any of its runs is found before the first one starts."""

from __future__ import annotations

import contextlib
import dataclasses
import hashlib
import importlib.metadata
import json
import math
import re
from collections import Counter
from pathlib import Path
from typing import Any

from missions.errors import MissionError
from missions.files import read_map_file
from missions.loader import load_mission, parse_mission
from missions.records import RecordReader
from missions.schema import Mission
from missions.yamltree import parse_yaml
from planner.study.claims import read_claims
from planner.study.plain import read_plain
from planner.study.record import STAGES, Points, Run, Study, StudyError, Value

KEYS = ("name", "title", "paper", "mission", "changes", "sweep", "seeds", "stage", "claims", "note")
MOST_RUNS = 100_000
_NAME = re.compile(r"[A-Za-z0-9_-]{1,64}")


def load_study(path: str | Path) -> Study:
    """Read a study file, its base mission, and the mission of every point of its grid.

    ::

        name: sub_periods                        # of its files: letters, digits, _ and -
        mission: ../imec_four_drones.yaml        # relative to this file
        changes: {connectivity.threshold: 0.2}   # for every run
        sweep:                                   # the grid; an axis is a field's path with its values,
          connectivity.sub_periods: [1, 2, 3]
          map:                                   # or a name whose values change several fields at once
            one: {information.components: […]}
        seeds: [0, 1]

    Raises:
        StudyError: what is wrong and where: the file, the key, the point of the grid.
    """
    path = Path(path)
    tree = _mapping(read_plain(path), str(path))
    for key in tree:
        if key not in KEYS:
            raise StudyError(f"{path}: unknown key {key!r}; known keys: {', '.join(KEYS)}")
    name, stage = tree.get("name"), tree.get("stage", "plan")
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise StudyError(f"{path}: name: got {name!r}; allowed: up to 64 letters, digits, _ and - (it names files)")
    if stage not in STAGES:
        raise StudyError(f"{path}: stage: got {stage!r}; allowed: {', '.join(STAGES)}")
    mission = _mission(path, tree.get("mission"))
    study = Study(
        name=name,
        title=_text(tree, "title", name, path),
        paper=_text(tree, "paper", "", path),
        base=_mapping(read_plain(mission), str(mission)),
        folder=str(mission.parent),
        changes=_mapping(tree.get("changes") or {}, f"{path}: changes"),
        sweep=_sweep(tree.get("sweep") or {}, f"{path}: sweep"),
        seeds=_seeds(tree.get("seeds", [0]), f"{path}: seeds"),
        stage=stage,
        note=_text(tree, "note", "", path),
    )
    total = math.prod(len(points) for points in study.sweep.values()) * len(study.seeds)
    if total > MOST_RUNS:
        raise StudyError(f"{path}: sweep: {total} runs; allowed: {MOST_RUNS}")
    claims = read_claims(tree.get("claims") or [], study.sweep, f"{path}: claims")
    return dataclasses.replace(study, claims=claims, decisive=_check_missions(study, path))


def _mission(path: Path, value: Value) -> Path:
    if not isinstance(value, str):
        raise StudyError(f"{path}: mission: got {value!r}; allowed: the path of a mission file")
    mission = path.parent / value
    try:
        load_mission(mission)  # its own mistakes are told with its own lines
    except MissionError as error:
        raise StudyError(f"{path}: mission: {error}") from None
    return mission


def _check_missions(study: Study, path: Path) -> dict[str, str]:
    """Read the mission of every point; returns the version and hashes of the files that missions name.

    What no mission may hold is refused. One that contradicts itself, e.g. robots that start too far apart to be in
    contact, stays: that it cannot be flown is a result.
    """
    decisive = {"version": importlib.metadata.version("ergoflie")}

    def read_file(name: str) -> bytes:
        data = read_map_file(Path(study.folder), name)
        decisive[name] = hashlib.sha256(data).hexdigest()
        return data

    try:
        runs = study.runs()
    except StudyError as error:  # a path that leads nowhere
        raise StudyError(f"{path}: {error}") from None
    for run in runs[:: len(study.seeds)]:
        text = json.dumps(run.mission)
        try:
            RecordReader("").read_record(parse_yaml(text, file=""), Mission)
        except MissionError as error:
            where = f"{error.where}: " if error.where else ""
            raise StudyError(f"{path}: {_point(run)}: {where}{error.reason}") from None
        with contextlib.suppress(MissionError):
            parse_mission(text, path="", read_file=read_file)
    return decisive


def _point(run: Run) -> str:
    return ", ".join(f"{axis} = {str(label)[:40]}" for axis, label in run.point.items()) or "changes"


def _sweep(value: Value, where: str) -> dict[str, Points]:
    return {axis: _points(axis, values, f"{where}.{axis}") for axis, values in _mapping(value, where).items()}


def _points(axis: str, values: Value, where: str) -> Points:
    if isinstance(values, list) and values:
        points: Points = tuple((value, {axis: value}) for value in values)
    elif isinstance(values, dict) and values:
        points = tuple((label, _mapping(changes, f"{where}.{label}")) for label, changes in values.items())
    else:
        raise StudyError(f"{where}: got {values!r}; allowed: a list of values, or a mapping of names to changes")
    label, times = Counter(str(label) for label, _ in points).most_common(1)[0]
    if times > 1:
        raise StudyError(f"{where}: {label} is given twice")
    return points


def _seeds(value: Value, where: str) -> tuple[int, ...]:
    if not isinstance(value, list) or not value or not all(type(seed) is int and seed >= 0 for seed in value):
        raise StudyError(f"{where}: got {value!r}; allowed: a list of whole numbers, at least 0")
    if len(set(value)) < len(value):
        raise StudyError(f"{where}: got {value!r}; allowed: every seed once")
    return tuple(value)


def _text(tree: dict[str, Any], key: str, default: str, path: Path) -> str:
    value = tree.get(key, default)
    if not isinstance(value, str):
        raise StudyError(f"{path}: {key}: got {value!r}; allowed: text")
    return value


def _mapping(value: Value, where: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise StudyError(f"{where}: got {str(value)[:60]!r}; allowed: a mapping of 'key: value' lines")
    return value
