import csv
import json
import multiprocessing
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import missions
from planner.study import StudyError, load_study, run_study
from planner.study.judge import judge, kendall
from planner.study.page import INTRODUCTION, section, write_page
from planner.study.record import Claim, set_field

MISSIONS = Path(missions.__file__).parent
MISSION = {
    "schema_version": 1,
    "name": "tiny",
    "workspace": {"lower": [-1.0, -1.0], "upper": [1.0, 1.0]},
    "horizon": {"duration": 1.0, "dt": 0.1},
    "basis": {"functions_per_axis": 3},
    "limits": {"acceleration": 0.5},
    "information": {"type": "gaussians", "components": [{"mean": [0.2, 0.1], "covariance": 0.1}]},
    "robots": [{"name": "a", "start": [0.0, 0.0]}],
}
STUDY = {
    "name": "tiny",
    "mission": "mission.yaml",
    "changes": {"solver.time_limit": 30},
    "sweep": {"limits.speed": [0.5, 1.0], "map": {"there": {"information.components[0].mean": [0.4, 0.4]}}},
    "seeds": [0, 1],
}
CLAIM = {"text": "E falls", "x": "limits.speed", "y": "ergodicity", "trend": "falls"}


@pytest.fixture
def study_file(tmp_path):
    (tmp_path / "mission.yaml").write_text(yaml.safe_dump(MISSION))

    def write(**changes):
        path = tmp_path / "study.yaml"
        path.write_text(yaml.safe_dump({**STUDY, **changes}))
        return path

    return write


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def without_cpu(text):
    return [row[:-4] + row[-3:] for row in csv.reader(text.splitlines())]


KILLED = """
import os, signal, sys
from planner.study import load_study, run_study
def progress(entry):
    if entry.done == 2:
        os.kill(os.getpid(), signal.SIGKILL)
if __name__ == "__main__":
    run_study(load_study(sys.argv[1]), sys.argv[2], processes=int(sys.argv[3]), progress=progress)
"""


class TestStudy:
    def test_the_grid_is_every_point_with_every_seed(self, study_file):
        runs = load_study(study_file()).runs()
        assert [(run.point["limits.speed"], run.seed) for run in runs] == [(0.5, 0), (0.5, 1), (1.0, 0), (1.0, 1)]
        assert {run.point["map"] for run in runs} == {"there"}
        assert runs[3].mission["limits"]["speed"] == 1.0
        assert runs[3].mission["information"]["components"][0]["mean"] == [0.4, 0.4]
        assert runs[3].mission["solver"] == {"time_limit": 30, "seed": 1}
        assert len({run.key for run in runs}) == 4

    def test_runs_do_not_share_their_missions(self, study_file):
        runs = load_study(study_file()).runs()
        assert runs[0].mission["limits"]["speed"] == 0.5

    @pytest.mark.parametrize(
        ("changes", "named"),
        [
            ({"sweeps": {}}, "unknown key 'sweeps'"),
            ({"name": "../out"}, "name: got '../out'; allowed: up to 64 letters"),
            ({"title": [1]}, "title: got [1]; allowed: text"),
            ({"mission": 3}, "mission: got 3; allowed: the path of a mission file"),
            ({"mission": "nowhere.yaml"}, "no such file"),
            ({"mission": "study.yaml"}, "unknown key"),
            ({"seeds": [-1]}, "seeds"),
            ({"seeds": []}, "seeds"),
            ({"seeds": [1, 1]}, "every seed once"),
            ({"stage": "fly"}, "stage: got 'fly'; allowed: plan, certify, reference"),
            ({"sweep": {"limits.speed": 1.0}}, "sweep.limits.speed"),
            ({"sweep": {"limits.speed": [1.0, 1.0]}}, "1.0 is given twice"),
            ({"sweep": {"conectivity.threshold": [0.1]}}, "conectivity.threshold = 0.1: conectivity: unknown key"),
            ({"sweep": {"limits.speed": [1.0, "fast"]}}, "limits.speed = fast: limits.speed: got the text 'fast'"),
            ({"sweep": {}, "changes": {"limits.sped": 1}}, "changes: limits.sped: unknown key"),
            ({"sweep": {"a": list(range(1, 400)), "b": list(range(400))}}, "319200 runs; allowed: 100000"),
            ({"changes": {"robots[3].start": [0, 0]}}, "leads nowhere at 3"),
            ({"changes": {"name.first": 1}}, "leads nowhere at 'first'"),
            ({"changes": {"a..b": 1}}, "allowed: a path"),
            ({"claims": 3}, "claims: got 3; allowed: a list"),
            ({"claims": [{"text": "x"}]}, "claims[0]: got"),
            ({"claims": [CLAIM | {"trend": "up"}]}, "claims[0].trend: got 'up'; allowed: rises, falls, below, above"),
            ({"claims": [CLAIM | {"x": "sped"}]}, "claims[0].x: got 'sped'; allowed: limits.speed, map, seed, feas"),
            ({"claims": [CLAIM | {"where": {"mop": 1}}]}, "claims[0].where: got axis 'mop'; allowed: limits.speed"),
            ({"claims": [CLAIM | {"where": {"map": "here"}}]}, "claims[0].where.map: got 'here'; allowed: there"),
            ({"claims": [CLAIM | {"within": ["mop"]}]}, "claims[0].within: got ['mop']"),
            ({"claims": [CLAIM | {"trend": "below"}]}, "a ratio needs both 'of' and 'to'"),
        ],
    )
    def test_what_is_wrong_is_named_before_anything_runs(self, study_file, changes, named):
        path = study_file(**changes)
        with pytest.raises(StudyError, match=re.escape(named)) as caught:
            load_study(path)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)

    @pytest.mark.parametrize(
        ("text", "named"),
        [
            ("- 1", "allowed: a mapping"),
            ("name: a\nname: b", "study.yaml:2: key 'name' given twice"),
            ("name: 2020-01-01", "study.yaml:1: got '2020-01-01'"),
            ("name: [", "not valid YAML"),
            ("", "the file is empty"),
        ],
    )
    def test_yaml_is_read_as_strictly_as_missions(self, study_file, text, named):
        path = study_file()
        path.write_text(text)
        with pytest.raises(StudyError, match=re.escape(named)):
            load_study(path)

    def test_numbers_are_those_of_missions(self, study_file):
        path = study_file(sweep={})
        path.write_text(path.read_text().replace("time_limit: 30", "time_limit: 3e1"))  # text to most YAML readers
        assert load_study(path).runs()[0].mission["solver"]["time_limit"] == 30.0

    def test_files_that_missions_name_decide_results(self, study_file, tmp_path):
        information = {"type": "array", "file": "map.npy"}
        keys = []
        for scale in (1.0, 2.0):
            np.save(tmp_path / "map.npy", np.arange(1.0, 10.0).reshape(3, 3) ** scale)
            keys.append(load_study(study_file(sweep={}, changes={"information": information})).runs()[0].key)
        assert keys[0] != keys[1]


def test_fields_are_set_through_lists_and_new_mappings():
    tree = {"robots": [{"start": [0, 0]}]}
    set_field(tree, "robots[0].start[1]", 5)
    set_field(tree, "limits.speed", 2)
    assert tree == {"robots": [{"start": [0, 5]}], "limits": {"speed": 2}}


class TestRunning:
    def test_one_tidy_table_that_a_second_call_only_reads(self, study_file, tmp_path):
        study, told = load_study(study_file()), []
        table = run_study(study, tmp_path / "out", processes=0, progress=told.append)
        rows = rows_of(table)
        assert [(entry.done, entry.total) for entry in told] == [(k, 4) for k in range(5)]
        assert [(row["limits.speed"], row["map"], row["seed"]) for row in rows[:2]] == [
            ("0.5", "there", "0"), ("0.5", "there", "1"),
        ]  # fmt: skip
        assert all(row["feasible"] == "True" and 0.0 < float(row["ergodicity"]) < 1.0 for row in rows)
        before, told = table.read_text(), []
        run_study(study, tmp_path / "out", processes=0, progress=told.append)
        assert table.read_text() == before
        assert len(told) == 1

    def test_a_stopped_study_goes_on(self, study_file, tmp_path):
        study, told = load_study(study_file()), []
        run_study(study, tmp_path / "out", processes=0, progress=told.append, should_stop=lambda: len(told) >= 3)
        assert len(list((tmp_path / "out" / "runs").iterdir())) == 2
        table = run_study(study, tmp_path / "out", processes=0, progress=told.append)
        assert len(rows_of(table)) == 4
        assert [entry.done for entry in told] == [0, 1, 2, 2, 3, 4]

    @pytest.mark.parametrize("processes", [0, 1])
    def test_a_killed_study_goes_on(self, study_file, tmp_path, processes):
        path, out = study_file(), tmp_path / "out"
        command = [sys.executable, "-c", KILLED, path, out, str(processes)]
        killed = subprocess.run(
            command, check=False, timeout=120, stdout=subprocess.PIPE
        )  # until workers close it, too
        assert killed.returncode == -signal.SIGKILL
        assert len(list((out / "runs").glob("*.json"))) == 2
        assert not list(out.glob("*.csv"))
        told = []
        rows = rows_of(run_study(load_study(path), out, processes=0, progress=told.append))
        assert [entry.done for entry in told] == [2, 3, 4]
        assert [row["feasible"] for row in rows] == ["True"] * 4

    def test_a_result_that_a_crash_left_half_is_run_again(self, study_file, tmp_path):
        study = load_study(study_file(sweep={}))
        before = run_study(study, tmp_path / "out", processes=0).read_text()
        spoilt = tmp_path / "out" / "runs" / f"{study.runs()[1].key}.json"
        spoilt.write_text(spoilt.read_text()[:20])
        told = []
        after = run_study(study, tmp_path / "out", processes=0, progress=told.append).read_text()
        assert [entry.done for entry in told] == [1, 2]
        assert without_cpu(after) == without_cpu(before)

    def test_a_killed_worker_is_an_error_with_advice(self, study_file, tmp_path):
        study = load_study(study_file(sweep={}))

        def kill_a_worker(_):
            for child in multiprocessing.active_children():
                os.kill(child.pid, signal.SIGKILL)

        with pytest.raises(StudyError, match="run the same again"):
            run_study(study, tmp_path / "out", processes=1, progress=kill_a_worker)
        assert len(rows_of(run_study(study, tmp_path / "out", processes=0))) == 2

    def test_an_interruption_leaves_no_process_behind(self, study_file, tmp_path):
        def interrupt(entry):
            if entry.done:
                raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            run_study(load_study(study_file()), tmp_path / "out", processes=2, progress=interrupt)
        assert not multiprocessing.active_children()

    def test_processes_find_what_one_finds(self, study_file, tmp_path):
        study = load_study(study_file(sweep={}))
        alone = rows_of(run_study(study, tmp_path / "alone", processes=0))
        together = rows_of(run_study(study, tmp_path / "together", processes=2))
        assert [row["ergodicity"] for row in alone] == [row["ergodicity"] for row in together]
        assert alone[0]["ergodicity"] != alone[1]["ergodicity"]

    def test_a_mission_that_cannot_be_planned_is_a_result(self, study_file, tmp_path):
        study = load_study(study_file(sweep={"robots[0].start": [[5.0, 0.0], [0.0, 0.0]]}, seeds=[0]))
        rows = rows_of(run_study(study, tmp_path / "out", processes=0))
        assert [row["feasible"] for row in rows] == ["False", "True"]
        assert "outside the workspace" in rows[0]["message"]

    def test_the_reference_reports_what_it_ends_with(self, study_file, tmp_path):
        """Robots that start out of range: no plan, but the paper has such a row."""
        robots = [{"name": "a", "start": [-0.5, 0.0]}, {"name": "b", "start": [0.5, 0.0]}]
        together = {"policy": "all_time", "range": 0.5}
        changes = {"robots": robots, "connectivity": together, "limits.acceleration": 0.1}
        for stage in ("plan", "reference"):
            study = load_study(study_file(sweep={}, seeds=[0], changes=changes, stage=stage))
            (row,) = rows_of(run_study(study, tmp_path / stage, processes=0))
            assert row["feasible"] == "False"
            assert "they start 1.00 m apart" in row["message"] or "contact at all times missed" in row["message"]
            assert bool(row["ergodicity"]) == (stage == "reference")
        assert float(row["longest_gap"]) == 1.0
        assert float(row["connection_ratio"]) == 0.0


class TestPage:
    def test_kendalls_tau(self):
        assert kendall([(0, 0), (1, 2), (2, 5)]) == 1.0
        assert kendall([(0, 3), (1, 2), (2, 1)]) == -1.0
        assert kendall([(1, 3), (1, 2)]) != kendall([(1, 3), (1, 2)])  # NaN: x never varies
        assert kendall([(1, 1), (2, 2), (3, 2)]) == pytest.approx(2 / 6**0.5)

    def test_trends_are_compared_within_strata(self):
        rising, lower = [(0, 0), (1, 1)], [(2, -2), (3, -1)]
        assert kendall(rising, lower) == 1.0
        assert kendall(rising + lower) < 0.0

    def test_a_trend_says_what_our_runs_say(self, study_file):
        study = load_study(study_file())
        rows = [tiny_row(speed=n, E=-n) for n in range(5)] + [tiny_row(speed=9, E=9, feasible=False)]
        assert str(judge(Claim(**CLAIM), study, rows)) == "**agrees** (τ = -1.00, n = 5)"
        assert "the opposite" in judge(Claim(**CLAIM | {"trend": "rises"}), study, rows).found
        assert judge(Claim(**CLAIM | {"where": {"map": "x"}}), study, rows).found == "too few runs"

    @pytest.mark.parametrize(
        ("low", "paper", "found"),
        [
            ((1.0, 1.2, 1.1), None, "agrees"),
            ((1.0, 1.2, 1.1), 0.5, "agrees"),
            ((1.0, 1.2, 1.1), 0.05, "agrees in direction only"),
            ((4.0, 4.2, 4.1), 0.5, "the opposite"),
            ((1.0, 4.0, 2.1), 0.5, "no clear difference"),
            ((), 0.5, "too few runs"),
        ],
    )
    def test_a_ratio_says_what_our_runs_say(self, study_file, low, paper, found):
        study = load_study(study_file())
        rows = [tiny_row(speed=0.5, E=E) for E in low] + [tiny_row(speed=1.0, E=2.0)] * 3
        claim = Claim("", "ergodicity", "below", of={"limits.speed": 0.5}, to={"limits.speed": 1.0}, paper=paper)
        verdict = judge(claim, study, rows)
        assert verdict.found == found
        if low == (1.0, 1.2, 1.1):
            assert verdict.figures.startswith("ratio 0.55, middle half 0.5 to 0.6, n = 3 and 3")

    def test_a_section_shows_medians_spread_and_reasons(self, study_file):
        study = load_study(study_file())
        rows = [tiny_row(E=E) for E in (0.1, 0.2, 0.9)] + [tiny_row(feasible=False, message="too slow")]
        text = section(study, rows)
        assert "n = 4 of 4 runs" in text
        assert "| 0.5 | 3/4 | 0.2 (0.1–0.9) |" in text
        assert "- 0.5: too slow" in text
        assert "Not run yet" in section(study, [])

    def test_the_example_on_the_page_is_a_study(self, tmp_path):
        (example,) = re.findall(r"```yaml\n(.*?)```", INTRODUCTION, re.DOTALL)
        (tmp_path / "studies").mkdir()
        shutil.copy(MISSIONS / "imec_four_drones.yaml", tmp_path)
        (tmp_path / "studies" / "example.yaml").write_text(example)
        assert len(load_study(tmp_path / "studies" / "example.yaml").runs()) == 18

    @pytest.mark.parametrize("path", sorted((MISSIONS / "studies").glob("*.yaml")), ids=lambda path: path.stem)
    def test_shipped_studies_load(self, path):
        assert load_study(path).name == path.stem

    def test_the_page_is_written_from_tables(self, study_file, tmp_path):
        study_file(claims=[CLAIM], note="Measured.")
        (tmp_path / "mission.yaml").rename(tmp_path / "mission.yml")  # only studies are *.yaml in a folder of studies
        path = study_file(mission="mission.yml", claims=[CLAIM], note="Measured.")
        run_study(load_study(path), tmp_path / "results", processes=0)
        write_page(tmp_path / "results", tmp_path, tmp_path / "PAGE.md")
        page = (tmp_path / "PAGE.md").read_text()
        assert "| tiny | E falls | " in page
        assert "Measured." in page
        assert "](results/tiny_ergodicity_over_speed.svg)" in page


def tiny_row(*, speed=0.5, E="", feasible=True, message=""):
    row = {"limits.speed": str(speed), "map": "there", "seed": "0", "feasible": str(feasible), "message": message}
    return row | {"ergodicity": str(E), "cpu_s": "1.0", "all_met": "True"}


def test_results_are_plain_json(study_file, tmp_path):
    run_study(load_study(study_file(sweep={}, seeds=[0])), tmp_path / "out", processes=0)
    (file,) = (tmp_path / "out" / "runs").glob("*.json")
    assert json.loads(file.read_text())["status"]
