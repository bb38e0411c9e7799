import csv
import json

import pytest
import yaml

from planner.study import StudyError, load_study, run_study
from planner.study.page import kendall, section, verdict
from planner.study.record import Claim, set_field

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
            ({"seeds": [-1]}, "seeds"),
            ({"seeds": []}, "seeds"),
            ({"stage": "fly"}, "stage"),
            ({"sweep": {"limits.speed": 1.0}}, "sweep.limits.speed"),
            ({"changes": {"robots[3].start": [0, 0]}}, "leads nowhere at 3"),
            ({"changes": {"name.first": 1}}, "leads nowhere at 'first'"),
            ({"changes": {"a..b": 1}}, "allowed: a path"),
            ({"mission": "nowhere.yaml"}, "cannot read"),
            ({"claims": [{"text": "x", "x": "a", "y": "b", "trend": "up"}]}, "trend"),
            ({"claims": [{"text": "x"}]}, "claims"),
        ],
    )
    def test_what_is_wrong_is_named(self, study_file, changes, named):
        with pytest.raises(StudyError, match=named.replace("[", r"\[")):
            load_study(study_file(**changes))


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

    def test_a_killed_study_goes_on(self, study_file, tmp_path):
        study, told = load_study(study_file()), []
        run_study(study, tmp_path / "out", processes=0, progress=told.append, should_stop=lambda: len(told) >= 3)
        assert len(list((tmp_path / "out" / "runs").iterdir())) == 2
        table = run_study(study, tmp_path / "out", processes=0, progress=told.append)
        assert len(rows_of(table)) == 4
        assert [entry.done for entry in told] == [0, 1, 2, 2, 3, 4]

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


class TestPage:
    def test_kendalls_tau(self):
        assert kendall([(0, 0), (1, 2), (2, 5)]) == 1.0
        assert kendall([(0, 3), (1, 2), (2, 1)]) == -1.0
        assert kendall([(1, 3), (1, 2)]) != kendall([(1, 3), (1, 2)])  # NaN: x never varies
        assert kendall([(1, 1), (2, 2), (3, 2)]) == pytest.approx(2 / 6**0.5)

    def test_a_verdict_says_what_our_runs_say(self):
        rows = [{"feasible": "True", "n": str(n), "E": str(-n), "k": "a"} for n in range(5)]
        rows.append({"feasible": "False", "n": "9", "E": "9", "k": "a"})
        rises, falls = (Claim("E", "n", "E", trend, {"k": "a"}) for trend in ("rises", "falls"))
        assert "the opposite" in verdict(rises, rows)
        assert "agrees" in verdict(falls, rows)
        assert "5 runs" in verdict(falls, rows)

    def test_a_section_shows_means_of_feasible_runs(self, study_file, tmp_path):
        study = load_study(study_file())
        row = dict.fromkeys(("connection_ratio", "probability", "probability_worst", "separation"), "nan")
        row |= {"cpu_s": "1.0", "all_met": "True", "map": "there", "limits.speed": "0.5"}
        rows = [row | {"ergodicity": e, "feasible": f} for e, f in (("0.1", "True"), ("0.3", "True"), ("", "False"))]
        text = section(study, rows)
        assert "| 0.5 | 2/3 | 0.2 |" in text
        assert "Not run yet" in section(study, [])


def test_results_are_plain_json(study_file, tmp_path):
    run_study(load_study(study_file(sweep={}, seeds=[0])), tmp_path / "out", processes=0)
    (file,) = (tmp_path / "out" / "runs").glob("*.json")
    assert json.loads(file.read_text())["status"]
