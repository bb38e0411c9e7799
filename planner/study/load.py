"""study.yaml to Study."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.study.record import Claim, Study, StudyError, Value

KEYS = ("name", "title", "paper", "mission", "changes", "sweep", "seeds", "stage", "claims", "note")


def load_study(path: str | Path) -> Study:
    """Read a study file and its base mission.

    ::

        name: sub_periods
        mission: ../imec_four_drones.yaml        # relative to this file
        changes: {connectivity.threshold: 0.2}   # for every run
        sweep:                                   # the grid; an axis is a field's path with its values,
          connectivity.sub_periods: [1, 2, 3]
          map:                                   # or a name whose values change several fields at once
            one: {information.components: […]}
        seeds: [0, 1]

    Raises:
        StudyError: what is wrong and where.
    """
    path = Path(path)
    tree = _mapping(_read(path), str(path))
    for key in tree:
        if key not in KEYS:
            raise StudyError(f"{path}: unknown key {key!r}; known keys: {', '.join(KEYS)}")
    for key in ("name", "mission"):
        if not isinstance(tree.get(key), str):
            raise StudyError(f"{path}: {key}: got {tree.get(key)!r}; allowed: text")
    mission = path.parent / tree["mission"]
    seeds = tree.get("seeds", [0])
    if not isinstance(seeds, list) or not seeds or not all(type(seed) is int and seed >= 0 for seed in seeds):
        raise StudyError(f"{path}: seeds: got {seeds!r}; allowed: a list of whole numbers, at least 0")
    stage = tree.get("stage", "plan")
    if stage not in ("plan", "certify"):
        raise StudyError(f"{path}: stage: got {stage!r}; allowed: plan, certify")
    sweep = _mapping(tree.get("sweep", {}), f"{path}: sweep")
    study = Study(
        name=tree["name"],
        title=str(tree.get("title", tree["name"])),
        paper=str(tree.get("paper", "")),
        base=_mapping(_read(mission), str(mission)),
        folder=str(mission.parent),
        changes=_mapping(tree.get("changes", {}), f"{path}: changes"),
        sweep={axis: _points(axis, values, f"{path}: sweep.{axis}") for axis, values in sweep.items()},
        seeds=tuple(seeds),
        stage=stage,
        claims=tuple(_claim(item, f"{path}: claims") for item in tree.get("claims", [])),
        note=str(tree.get("note", "")),
    )
    study.runs()  # a path that leads nowhere is found now
    return study


def _points(axis: str, values: Value, where: str) -> tuple[tuple[Value, Mapping[str, Value]], ...]:
    if isinstance(values, list) and values:
        return tuple((value, {axis: value}) for value in values)
    if isinstance(values, dict) and values:
        return tuple((label, _mapping(changes, f"{where}.{label}")) for label, changes in values.items())
    raise StudyError(f"{where}: got {values!r}; allowed: a list of values, or a mapping of names to changes")


def _claim(tree: Value, where: str) -> Claim:
    try:
        claim = Claim(**_mapping(tree, where))
    except TypeError as error:
        raise StudyError(f"{where}: {error}; allowed: text, x, y, trend, where") from None
    if claim.trend not in ("rises", "falls"):
        raise StudyError(f"{where}: trend: got {claim.trend!r}; allowed: rises, falls")
    return claim


def _read(path: Path) -> Value:
    import yaml  # worker processes do without

    try:
        return yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise StudyError(f"{path}: cannot read: {error.strerror or error}") from None
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise StudyError(f"{path}: {' '.join(str(error).split())}") from None


def _mapping(value: Value, where: str) -> dict[str, Any]:
    if not isinstance(value, dict) or not all(isinstance(key, str) for key in value):
        raise StudyError(f"{where}: got {str(value)[:60]!r}; allowed: a mapping of 'key: value' lines")
    return value
