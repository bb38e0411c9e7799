"""STUDIES.md from the results of the shipped studies: ``python -m planner.study.page RESULTS [STUDIES] [PAGE]``.

RESULTS holds the tables that ``run_study`` wrote; studies without a table are listed as not run.
"""

from __future__ import annotations

import csv
import itertools
import math
import os
import statistics
import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from planner.study.load import load_study
from planner.study.plots import write_plots
from planner.study.record import Claim, Study

Row = Mapping[str, str]
FIGURES = ("ergodicity", "connection_ratio", "probability", "probability_worst", "separation", "cpu_s")
HEADS = {
    "ergodicity": "E", "connection_ratio": "R_c ratio", "probability": "mean P", "probability_worst": "worst P",
    "separation": "separation [m]", "cpu_s": "CPU [s]",
}  # fmt: skip
INTRODUCTION = """# Studies

The experiments of the IMEC paper (A Probabilistic Measure of Multi-Robot Connectivity and Ergodic Optimal Control), run
with this planner. Written by `python -m planner.study.page` from the tables in `missions/studies/results`; to run one
again: `ergoflie study FILE -o FOLDER`. Figures are means over the seeds that ended in a
feasible plan. The paper shows most of its results as plots without numbers, so trends are compared: Kendall's τ is 1 if
one column always rises with the other, −1 if it always falls. CPU seconds are those of a loaded two-core machine.

The paper's Algorithm 1 is here too (`solver: {method: imec}`). `python -m tests.benchmarks.reference` runs it on the
notebook case as the authors did: the augmented Lagrangian and the violations are those of their printed log (a test
pins iterations 0 to 20), and at iteration 923, where their code ended, E is within 5 % of their 1.987e-3 with limits
missed by 2 to 4 mm as theirs. Rounding grows after some hundred iterations, so the last digits differ between
machines. Two details decide: the Riccati equation is integrated in continuous time, and a control on its bound counts
half in the linearised dynamics; runs with either left out ended between 3.6e-3 and 3.8e-2.
"""
CLEAR = 0.3  # |τ| from which a trend is one


def write_page(results: Path, studies: Path, page: Path) -> None:
    """Write the page of every study in the folder ``studies``."""
    sections = [INTRODUCTION]
    for path in sorted(studies.glob("*.yaml")):
        study, table = load_study(path), results / f"{load_study(path).name}.csv"
        rows = read_table(table) if table.exists() else []
        pictures = write_plots(study, rows, results)
        shown = "\n".join(f"![{picture.stem}]({_link(picture, page)})" for picture in pictures)
        sections.append(section(study, rows) + (f"{shown}\n" if shown else ""))
    page.write_text("\n".join(sections), encoding="utf-8")


def _link(picture: Path, page: Path) -> str:
    """Path of a picture as the page names it."""
    return Path(os.path.relpath(picture, page.parent)).as_posix()


def read_table(path: Path) -> list[Row]:
    """Rows of a study's CSV."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def section(study: Study, rows: Sequence[Row]) -> str:
    """One study: the paper's statement, our table, the claims."""
    lines = [f"## {study.title}", "", f"Paper: {study.paper}", ""]
    if study.note:
        lines += [study.note, ""]
    if not rows:
        return "\n".join([*lines, "Not run yet.", ""])
    axes = [axis for axis in study.sweep if len(study.sweep[axis]) > 1]
    lines += [f"Ours ({len(rows)} of {len(study.runs())} runs, `missions/studies/{study.name}.yaml`):", ""]
    heads = [*(axis.rpartition(".")[2] for axis in axes), "feasible", *(HEADS[name] for name in FIGURES), "all met"]
    lines += ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for point, group in itertools.groupby(rows, key=lambda row: tuple(row[axis] for axis in axes)):
        lines.append("| " + " | ".join([*point, *_cells(list(group))]) + " |")
    lines += ["", *(verdict(claim, rows) for claim in study.claims), ""]
    return "\n".join(lines)


def _cells(group: Sequence[Row]) -> list[str]:
    feasible = [row for row in group if row["feasible"] == "True"]
    cells = [f"{len(feasible)}/{len(group)}"]
    for name in FIGURES:
        values = [float(row[name]) for row in feasible if row[name] not in ("", "nan", "inf")]
        cells.append(f"{statistics.fmean(values):.3g}" if values else "–")
    met = sum(row["all_met"] == "True" for row in feasible)
    return [*cells, f"{met}/{len(feasible)}"]


def verdict(claim: Claim, rows: Iterable[Row]) -> str:
    """Whether a claim of the paper holds in our rows; the other axes of the grid held fixed."""
    used = [
        row
        for row in rows
        if row["feasible"] == "True" and all(row[key] == str(value) for key, value in claim.where.items())
    ]
    points = [(float(row[claim.x]), float(row[claim.y])) for row in used if row[claim.x] and row[claim.y]]
    tau = kendall(points)
    if math.isnan(tau):
        return f"- {claim.text}: too few runs to say."
    signed = tau if claim.trend == "rises" else -tau
    found = "agrees" if signed >= CLEAR else "the opposite" if signed <= -CLEAR else "no clear trend"
    return f"- {claim.text}: **{found}** (τ = {tau:+.2f}, {len(points)} runs)."


def kendall(points: Sequence[tuple[float, float]]) -> float:
    """Kendall's τ_b; NaN if either column never varies."""
    concordant = x_tied = y_tied = total = 0
    for (x, y), (a, b) in itertools.combinations(points, 2):
        total += 1
        x_tied += x == a
        y_tied += y == b
        concordant += (x - a) * (y - b) > 0
        concordant -= (x - a) * (y - b) < 0
    scale = math.sqrt((total - x_tied) * (total - y_tied))
    return concordant / scale if scale else math.nan


if __name__ == "__main__":
    folders = [Path(argument) for argument in sys.argv[1:]]
    defaults = [Path("missions/studies/results"), Path("missions/studies"), Path("planner/STUDIES.md")]
    write_page(*(given or default for given, default in itertools.zip_longest(folders, defaults)))
