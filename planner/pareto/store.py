"""Finished searches on disk, so that a front that was interrupted goes on where it stopped."""

from __future__ import annotations

import hashlib
import importlib.metadata
import io
import json
import os
import zipfile
from pathlib import Path

import numpy as np

from missions.arrays import Array
from missions.schema import Mission
from planner.plan import Plan

_ARRAYS = ("t", "q", "v", "u")
_FIGURES = ("ergodicity", "violation", "seed", "evaluations", "seconds")


class PlanStore:
    """A folder with one file a finished search, named by all that decides it."""

    def __init__(self, folder: Path | None, mission: Mission) -> None:
        """Use a folder, made if absent; None keeps nothing."""
        self._folder = folder if mission.source is not None else None
        self._mission = mission.source.sha256 if mission.source is not None else ""
        self._solver = repr(mission.solver)
        if self._folder is not None:
            self._folder.mkdir(parents=True, exist_ok=True)

    def key(self, weights: Array, parent: str) -> str:
        """Of a search: mission, solver, weights, and the key of the search it begins with."""
        decisive = [importlib.metadata.version("ergoflie"), self._mission, self._solver, weights.tolist(), parent]
        return hashlib.sha256(json.dumps(decisive).encode()).hexdigest()[:32]

    def load(self, key: str) -> tuple[Plan | None, str] | None:
        """Plan and status of a search; None if it has not been finished, or a crashed disk left it unreadable."""
        if self._folder is None:
            return None
        try:
            with np.load(io.BytesIO(self._path(key).read_bytes()), allow_pickle=False) as stored:
                status = json.loads(bytes(stored["status"]))
                if not status["plan"]:
                    return None, status["message"]
                arrays = {name: stored[name] for name in _ARRAYS}
            return Plan(**arrays, **{name: status[name] for name in _FIGURES}), status["message"]
        except (OSError, ValueError, KeyError, TypeError, EOFError, zipfile.BadZipFile):
            return None

    def save(self, key: str, plan: Plan | None, message: str) -> None:
        """Keep a finished search, whole or not at all."""
        if self._folder is None:
            return
        status = {"plan": plan is not None, "message": message}
        status |= {name: getattr(plan, name) for name in _FIGURES} if plan is not None else {}
        arrays = {name: getattr(plan, name) for name in _ARRAYS} if plan is not None else {}
        stream = io.BytesIO()
        np.savez_compressed(stream, status=np.frombuffer(json.dumps(status).encode(), np.uint8), **arrays)
        beside = self._path(key).with_suffix(f".{os.getpid()}.tmp")
        beside.write_bytes(stream.getvalue())
        os.replace(beside, self._path(key))

    def _path(self, key: str) -> Path:
        assert self._folder is not None  # noqa: S101 - callers have asked
        return self._folder / f"{key}.npz"
