"""Misuse gives one clear line on stderr and exit code 2, and leaves nothing behind."""

from pathlib import Path

import pytest

import missions
from deploy.cli.__main__ import main

MISSIONS = Path(missions.__file__).parent


@pytest.fixture(scope="module")
def plan(tmp_path_factory):
    path = tmp_path_factory.mktemp("plan") / "a folder" / "that is new" / "one.plan.mcap"
    assert main(["plan", str(MISSIONS / "one_drone.yaml"), "-o", str(path)]) == 0
    return path


def refused(capsys, *argv):
    """Run a command that must be refused; its one line."""
    capsys.readouterr()
    assert main([str(arg) for arg in argv]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    lines = captured.err.strip().splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("ergoflie: ")
    return lines[0]


def edited(tmp_path, name, old, new):
    """A shipped mission with one place changed."""
    text = (MISSIONS / f"{name}.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "mission.yaml"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("mission", "old", "new", "expected"),
    [
        ("imec_four_drones", "separation:", "seperation:", ["limits", "seperation", "separation"]),
        ("imec_four_drones", "range: 0.5", "range: far", ["connectivity.range", "far", "m"]),
        ("imec_four_drones", "duration: 30.0", "duration: -30.0", ["horizon.duration", "-30"]),
        ("imec_four_drones", "start: [1.2, 0.3]", "start: [0.6, 0.3]", ["robots[", "0.3"]),
        ("imec_four_drones", "start: [1.2, 0.3]", "start: [1.3, 1.5]", ["robots[", "obstacles["]),
        ("imec_four_drones", "threshold: 0.25", "threshold: 0.99", ["threshold", "0.99"]),
        ("imec_four_drones", "threshold: 0.25", "threshold: 1.5", ["threshold", "1.5"]),
        ("photo_map", "file: photo_map.png", "file: no_such.png", ["information.file", "no_such.png"]),
        ("photo_map", "file: photo_map.png", "file: ../../../etc/passwd", ["information.file"]),
    ],
)
def test_missions_that_make_no_sense(tmp_path, capsys, mission, old, new, expected):
    path = edited(tmp_path, mission, old, new)
    line = refused(capsys, "plan", path, "-o", tmp_path / "out.mcap")
    assert "mission.yaml:" in line
    for part in expected:
        assert part in line
    assert not (tmp_path / "out.mcap").exists()


def test_missing_files(tmp_path, capsys):
    for command in ("plan", "dry-run", "check", "report", "fly"):
        assert "nix" in refused(capsys, command, tmp_path / "nix.yaml")
    assert refused(capsys, "check", tmp_path)


def test_a_plan_cut_in_half_or_edited_by_one_byte(plan, tmp_path, capsys):
    whole = plan.read_bytes()
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(whole[: len(whole) // 2])
    for command in ("check", "dry-run", "fly"):
        assert "bad.mcap" in refused(capsys, command, bad)
    assert refused(capsys, "export", bad, "-o", tmp_path / "csv")
    assert not (tmp_path / "csv").exists()
    for position in range(100, len(whole), len(whole) // 7):
        data = bytearray(whole)
        data[position] ^= 1
        bad.write_bytes(data)
        assert "bad.mcap" in refused(capsys, "check", bad)


def test_a_mission_is_no_plan_and_a_plan_is_no_mission_and_no_log(plan, capsys):
    assert refused(capsys, "check", MISSIONS / "one_drone.yaml")
    assert refused(capsys, "plan", plan)
    assert refused(capsys, "report", plan)


def test_flying_without_a_radio(plan, tmp_path, capsys):
    line = refused(capsys, "fly", plan, "--yes", "-o", tmp_path / "logs")
    assert "Crazyradio" in line
    assert not (tmp_path / "logs").exists()


def test_output_that_cannot_be_written(plan, tmp_path, capsys):
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    assert "file" in refused(capsys, "export", plan, "-o", blocked / "csv")
    assert "file" in refused(capsys, "dry-run", plan, "-o", blocked)


@pytest.mark.parametrize(("output", "expected"), [("file/new/x.mcap", "no folder"), (".", "is a folder")])
def test_a_plan_that_could_not_be_written_is_not_searched_for(tmp_path, capsys, monkeypatch, output, expected):
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setattr("deploy.cli.planning.plan_mission", lambda *_, **__: pytest.fail("it was"))
    assert expected in refused(capsys, "plan", MISSIONS / "one_drone.yaml", "-o", tmp_path / output)


def test_a_good_plan_is_certified_again_and_exported(plan, tmp_path, capsys):
    assert main(["check", str(plan)]) == 0
    assert "acceleration" in capsys.readouterr().out
    assert main(["export", str(plan), "-o", str(tmp_path / "csv")]) == 0
    assert [path.name for path in (tmp_path / "csv").iterdir()] == ["cf1.csv"]


def test_an_infeasible_mission_is_a_table_and_no_file(tmp_path, capsys):
    """Four robots 0.3 m apart cannot all be that connected: not provable beforehand, so the solver has to say it."""
    path = edited(tmp_path, "imec_four_drones", "threshold: 0.25", "threshold: 0.72")
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("  seed: 0", "  time_limit: 1.0\n  seed: 0"), encoding="utf-8")
    capsys.readouterr()
    assert main(["plan", str(path), "-o", str(tmp_path / "out.mcap")]) == 1
    captured = capsys.readouterr()
    assert "connection" in captured.out
    assert "ergoflie: " in captured.err
    assert not list(tmp_path.glob("out*"))
