"""``ergoflie study``: Ctrl-C keeps what is done, the same command goes on, mistakes are one line."""

import os
import signal

import pytest
import rich.progress

from deploy.cli.__main__ import main

MISSION = """
schema_version: 1
name: tiny
workspace: {lower: [-1.0, -1.0], upper: [1.0, 1.0]}
horizon: {duration: 1.0, dt: 0.1}
basis: {functions_per_axis: 3}
limits: {acceleration: 0.5}
information: {type: gaussians, components: [{mean: [0.2, 0.1], covariance: 0.1}]}
robots: [{name: a, start: [0.0, 0.0]}]
"""
STUDY = """
name: tiny
mission: mission.yaml
sweep: {limits.speed: [0.5, 1.0]}
seeds: [0, 1]
"""


@pytest.fixture
def study(tmp_path):
    (tmp_path / "mission.yaml").write_text(MISSION)
    path = tmp_path / "study.yaml"
    path.write_text(STUDY)
    return path


def test_ctrl_c_keeps_what_is_done_and_the_same_command_goes_on(study, tmp_path, monkeypatch, capsys):
    shown = []

    def interrupt(bar, task, *, completed, total):
        shown.append((completed, total))
        if completed == 1:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr(rich.progress.Progress, "update", interrupt)
    command = ["study", str(study), "-o", str(tmp_path / "out"), "--processes", "1"]
    assert main(command) == 130
    assert "run the same command again" in capsys.readouterr().err
    table = tmp_path / "out" / "tiny.csv"
    assert 2 <= len(table.read_text().splitlines()) < 5  # heads, and what was done or under way
    monkeypatch.setattr(rich.progress.Progress, "update", lambda bar, task, *, completed, total: None)
    assert main(command) == 0
    assert len(table.read_text().splitlines()) == 5
    assert shown[:2] == [(0, 4), (1, 4)]


def test_runs_without_a_plan_are_told(study, tmp_path, capsys):
    study.write_text(STUDY.replace("limits.speed: [0.5, 1.0]", "'robots[0].start': [[0.0, 0.0], [5.0, 0.0]]"))
    assert main(["study", str(study), "-o", str(tmp_path / "out"), "--processes", "1"]) == 0
    assert "2 of 4 runs found no plan; the table says why" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("limits.speed", "limits.sped", "limits.sped = 0.5: limits.sped: unknown key"),
        ("mission.yaml", "nowhere.yaml", "no such file"),
        ("[0, 1]", "[0, one]", "seeds: got [0, 'one']"),
    ],
)
def test_mistakes_are_one_line_and_leave_nothing(study, tmp_path, capsys, old, new, named):
    study.write_text(STUDY.replace(old, new))
    assert main(["study", str(study), "-o", str(tmp_path / "out")]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert named in line
    assert not (tmp_path / "out").exists()
