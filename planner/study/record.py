"""What a study is: a base mission, changes, a grid, seeds."""

from __future__ import annotations

import copy
import hashlib
import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from planner.errors import PlannerError

Value = Any  # plain YAML: numbers, text, lists, mappings
Points = Sequence[tuple[Value, Mapping[str, Value]]]  # of an axis: label, the changes it stands for
_STEP = re.compile(r"([A-Za-z_][A-Za-z0-9_]*)|\[(\d+)\]")


class StudyError(PlannerError):
    """A study file that cannot be run: one line, names the place."""


COLUMNS = (
    "feasible", "status", "ergodicity", "connection_ratio", "probability", "probability_worst", "same_time", "all_met",
    "longest_gap", "separation", "clearance", "violation", "cpu_s", "evaluations", "version", "message",
)  # fmt: skip
"""Of a study's table, after those of its axes and ``seed``.

``probability`` (mean, worst) is P, ``same_time`` the mean of P̃, ``longest_gap`` the longest time [s] that any pair was
out of range without a break; ``violation`` is the worst miss in metres equivalent.
"""
STAGES = ("plan", "certify", "reference")


@dataclass(frozen=True)
class Claim:
    """What the paper says of the results, to be held against ours: a trend of two columns, or a ratio of two groups.

    Attributes:
        text: the paper's words. y: column.
        x: the column over which y ``rises`` or ``falls``; empty for a ratio.
        trend: which of them, or the side of one that the ratio is on: ``below``, ``above``.
        where: only rows with these values. within: axes held fixed when runs are compared, beside those of ``where``.
        of: axis → value of the ratio's numerator. to: of its denominator; runs that agree in all else are compared.
        paper: the paper's number for the ratio, where it has one.
    """

    text: str
    y: str
    trend: Literal["rises", "falls", "below", "above"]
    x: str = ""
    where: Mapping[str, Value] = field(default_factory=dict)
    within: tuple[str, ...] = ()
    of: Mapping[str, Value] = field(default_factory=dict)
    to: Mapping[str, Value] = field(default_factory=dict)
    paper: float | None = None


@dataclass(frozen=True)
class Run:
    """One point of the grid with one seed.

    Attributes:
        point: the grid's coordinates by axis, as the CSV shows them.
        seed: of the solver. mission: the mission's tree. key: hash of all that decides the result.
    """

    point: Mapping[str, Value]
    seed: int
    mission: Mapping[str, Value]
    key: str


@dataclass(frozen=True)
class Study:
    """A sweep.

    Attributes:
        name: used for the CSV's name. title: one line. paper: what the paper reports. note: what else was measured.
        base: the base mission's tree. folder: where files it names are, as text.
        changes: field path → value, for every run.
        sweep: axis → its points: a label and the changes it stands for.
        seeds: of the solver.
        stage: ``plan`` solves; ``certify`` makes the bytes too; ``reference`` runs the paper's Algorithm 1 as its
            authors do, without margins, and takes the motion it ends with even if that misses limits.
        claims: the paper's, to be checked by the page.
        decisive: what else results depend on, part of the runs' keys: version, hashes of the files that missions name.
    """

    name: str
    title: str
    paper: str
    base: Mapping[str, Value]
    folder: str
    changes: Mapping[str, Value]
    sweep: Mapping[str, Points]
    seeds: tuple[int, ...]
    stage: Literal["plan", "certify", "reference"]
    claims: tuple[Claim, ...] = ()
    note: str = ""
    decisive: Mapping[str, str] = field(default_factory=dict)

    def runs(self) -> tuple[Run, ...]:
        """Every point of the grid with every seed, in order.

        Raises:
            StudyError: a path that leads nowhere.
        """
        runs = []
        for points in itertools.product(*self.sweep.values()):
            labels = {axis: label for axis, (label, _) in zip(self.sweep, points, strict=True)}
            for seed in self.seeds:
                tree = copy.deepcopy(dict(self.base))
                for changes in (self.changes, *(changes for _, changes in points), {"solver.seed": seed}):
                    for path, value in changes.items():
                        set_field(tree, path, value)
                text = json.dumps([tree, self.stage, dict(self.decisive)], sort_keys=True)
                runs.append(Run(labels, seed, tree, hashlib.sha256(text.encode()).hexdigest()[:16]))
        return tuple(runs)


def set_field(tree: dict[str, Value], path: str, value: Value) -> None:
    """Set ``a.b[2].c`` in a tree; mappings on the way are made, list items have to exist.

    Raises:
        StudyError: the path is no path, or leads through something that is neither.
    """
    steps: list[str | int] = []
    for part in path.split("."):
        found = _STEP.findall(part)
        if not found or "".join(name or f"[{index}]" for name, index in found) != part:
            raise StudyError(f"got {path!r}; allowed: a path such as connectivity.threshold or robots[0].start")
        steps += [name or int(index) for name, index in found]
    node: Any = tree
    for step, after in itertools.pairwise(steps):
        if isinstance(step, str) and isinstance(node, dict):
            node = node.setdefault(step, {} if isinstance(after, str) else [])
        elif isinstance(step, int) and isinstance(node, list) and step < len(node):
            node = node[step]
        else:
            raise StudyError(f"{path!r} leads nowhere at {step!r}")
    last = steps[-1]
    fits = isinstance(node, dict) if isinstance(last, str) else isinstance(node, list) and last < len(node)
    if not fits:
        raise StudyError(f"{path!r} leads nowhere at {last!r}")
    node[last] = copy.deepcopy(value)
