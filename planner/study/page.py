"""STUDIES.md from the results of the shipped studies: ``python -m planner.study.page [RESULTS [STUDIES [PAGE]]]``.

RESULTS holds the tables that ``run_study`` wrote; studies without a table are listed as not run.
"""

from __future__ import annotations

import csv
import itertools
import os
import statistics
import sys
from collections.abc import Sequence
from pathlib import Path

from planner.study.judge import Row, counted, judge, number
from planner.study.load import load_study
from planner.study.plots import write_plots
from planner.study.record import Study

SPREAD = {"ergodicity": "E", "connection_ratio": "R_c ratio", "probability": "mean P"}
PLAIN = {
    "probability_worst": "worst P", "same_time": "mean P̃", "longest_gap": "longest gap [s]", "cpu_s": "CPU [s]",
}  # fmt: skip
INTRODUCTION = """# Studies

The experiments of the IMEC paper (A Probabilistic Measure of Multi-Robot Connectivity and Ergodic Optimal Control) and
of the FEO paper (Ergodic Trajectory Planning with Dynamic Sensor Footprints), run with this planner. Written by
`python -m planner.study.page` from the tables in `missions/studies/results`; to run one again:
`ergoflie study FILE -o FOLDER`. It writes one tidy CSV (a row a run, a column a quantity) and the plots, runs one
process a core, keeps every run as soon as it ends, and goes on where it was stopped or killed. A study of your own:

```yaml
name: how_far                                  # names its table
mission: ../imec_four_drones.yaml              # relative to this file
changes: {connectivity.threshold: 0.3}         # for every run: any field of the mission, by its path
sweep:                                         # the grid: a field and its values, or a name and what it stands for
  connectivity.range: [0.4, 0.5, 0.6]
  crowd: {two: {robots: [{name: a, start: [1.2, 0.3]}, {name: b, start: [1.9, 0.3]}]}, four: {}}
seeds: [0, 1, 2]
stage: plan                                    # or certify: the bytes too; or reference: the paper's Algorithm 1
claims:                                        # judged on a page such as this one, and plotted
  - {text: "E falls with the range", x: connectivity.range, y: ergodicity, trend: falls, within: [crowd]}
  - {text: "two are worse", y: ergodicity, trend: above, of: {crowd: two}, to: {crowd: four}}
```

How to read it: a seed is another set of random first guesses, n counts runs. Tables show the median over the seeds that
ended in a feasible plan, and smallest to largest in brackets. The paper shows most of its results as plots without
numbers, so trends are compared: Kendall's τ is 1 if one column always rises with the other, −1 if it always falls, and
a trend counts from |τ| = 0.3; other axes of a study are held fixed. A ratio counts if its middle half lies on one side
of one, and agrees if it is within a factor of two of the paper's. CPU seconds are those of a loaded two-core machine.

The paper's Algorithm 1 is here too (`solver: {method: imec}`; studies with `stage: reference` run it as its authors
do). `python -m tests.benchmarks.reference` runs it on the notebook case: the augmented Lagrangian and the violations
are those of their printed log (a test pins iterations 0 to 20), and at iteration 923, where their code ended, E is
within 5 % of their 1.987e-3 with limits missed by 2 to 4 mm as theirs. Rounding grows after some hundred iterations, so
the last digits differ between machines. Two details decide: the Riccati equation is integrated in continuous time, and
a control on its bound counts half in the linearised dynamics; runs with either left out ended between 3.6e-3 and
3.8e-2.

## What agrees and what does not

| figure | the paper | ours |
|---|---|---|
"""


def write_page(results: Path, studies: Path, page: Path) -> None:
    """Write the page of every study in the folder ``studies``, and the plots beside the tables."""
    summary, sections = [], []
    for path in sorted(studies.glob("*.yaml")):
        study = load_study(path)
        table = results / f"{study.name}.csv"
        rows = read_table(table) if table.exists() else []
        pictures = write_plots(study, rows, results)
        summary += [f"| {study.title} | {claim.text} | {judge(claim, study, rows)} |" for claim in study.claims]
        shown = "\n".join(f"![{picture.stem}]({_link(picture, page)})" for picture in pictures)
        sections.append(section(study, rows) + (f"{shown}\n" if shown else ""))
    page.write_text(INTRODUCTION + "\n".join([*summary, "", *sections]), encoding="utf-8")


def _link(picture: Path, page: Path) -> str:
    """Path of a picture as the page names it."""
    return Path(os.path.relpath(picture, page.parent)).as_posix()


def read_table(path: Path) -> list[Row]:
    """Rows of a study's CSV."""
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def section(study: Study, rows: Sequence[Row]) -> str:
    """One study: the paper's statement, our table, what could not be planned and why, the claims."""
    lines = [f"## {study.title}", "", f"Paper: {study.paper}", ""]
    if study.note:
        lines += [study.note, ""]
    if not rows:
        return "\n".join([*lines, "Not run yet.", ""])
    axes = [axis for axis in study.sweep if len(study.sweep[axis]) > 1]
    earlier = "" if rows[0].get("version") else "; with an earlier state of the solver"
    lines += [f"Ours (n = {len(rows)} of {len(study.runs())} runs, `missions/studies/{study.name}.yaml`{earlier}):", ""]
    ended = "ended by the criterion" if study.stage == "reference" else "feasible"
    heads = [*(axis.rpartition(".")[2] for axis in axes), ended, *SPREAD.values(), *PLAIN.values(), "all met"]
    lines += ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    missed = []
    for point, runs in itertools.groupby(rows, key=lambda row: tuple(row[axis] for axis in axes)):
        group = list(runs)
        lines.append("| " + " | ".join([*point, *_cells(study, group)]) + " |")
        if why := next((row["message"] for row in group if row["feasible"] != "True" and row["message"]), ""):
            missed.append(f"- {', '.join(point) or study.name}: {why}")
    lines += ["", *(["Limits missed:", "", *missed, ""] if missed else [])]
    lines += [*(f"- {claim.text}: {judge(claim, study, rows)}" for claim in study.claims), ""]
    return "\n".join(lines)


def _cells(study: Study, group: Sequence[Row]) -> list[str]:
    used = counted(study, group)
    cells = [f"{sum(row['feasible'] == 'True' for row in group)}/{len(group)}"]
    for column in (*SPREAD, *PLAIN):
        values = [value for row in used if abs(value := number(row, column)) < float("inf")]
        cell = f"{statistics.median(values):.3g}" if values else "–"
        if column in SPREAD and len(values) > 1:
            cell += f" ({min(values):.2g}–{max(values):.2g})"
        cells.append(cell)
    met = sum(row["all_met"] == "True" for row in used)
    return [*cells, f"{met}/{len(used)}"]


if __name__ == "__main__":
    folders = [Path(argument) for argument in sys.argv[1:]]
    defaults = [Path("missions/studies/results"), Path("missions/studies"), Path("planner/STUDIES.md")]
    write_page(*(given or default for given, default in itertools.zip_longest(folders, defaults)))
