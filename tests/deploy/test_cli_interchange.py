"""``import`` and ``export`` on the command line: round trips, refusals in one line, nothing half written."""

import shutil
from pathlib import Path

import pytest

import missions
from deploy.cli.__main__ import main
from deploy.files import write_whole
from deploy.planfile import read_plan
from missions.loader import load_mission

MISSIONS = Path(missions.__file__).parent
ONE = MISSIONS / "one_drone.yaml"
WAYPOINTS = "0.5,0.5,0.6\n1.5,0.6,0.6,\n1.2,1.3,0.6\n0.6,1.0,0.6\n"
CRAZYFLIES = """
robots:
  ann: {uri: "radio://0/80/2M/E7E7E7E701", initial_position: [0, 0, 0], type: cf21}
  bob: {uri: "radio://0/80/2M/E7E7E7E702", initial_position: [0, 1, 0], type: cf21}
robot_types: {cf21: {}}
all: {broadcasts: {num_repeats: 15}}
"""


def run(*argv):
    return main([str(arg) for arg in argv])


def refused(capsys, *argv, code=2):
    capsys.readouterr()
    assert run(*argv) == code
    captured = capsys.readouterr()
    assert captured.out == ""
    (line,) = captured.err.strip().splitlines()
    assert line.startswith("ergoflie: ")
    return line


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """A plan through waypoints, and its export."""
    folder = tmp_path_factory.mktemp("flown")
    (folder / "cf1.csv").write_text(WAYPOINTS)
    assert run("import", "waypoints", ONE, folder / "cf1.csv", "-o", folder / "first.mcap") == 0
    assert run("export", folder / "first.mcap", "-o", folder / "csv", "--crazyswarm2") == 0
    return folder


def test_export_and_import_give_the_same_bytes(flown, tmp_path, capsys):
    assert sorted(path.name for path in (flown / "csv").iterdir()) == ["cf1.csv", "crazyflies.yaml"]
    assert run("import", "trajectories", ONE, flown / "csv", "-o", tmp_path / "again.mcap", "--json") == 0
    assert '"certified": true' in capsys.readouterr().out
    first, again = read_plan(flown / "first.mcap"), read_plan(tmp_path / "again.mcap")
    assert again.trajectories["cf1"].sha256 == first.trajectories["cf1"].sha256
    assert run("check", tmp_path / "again.mcap") == 0


def test_an_imported_plan_flies(flown, tmp_path, capsys):
    assert run("dry-run", flown / "first.mcap", "-o", tmp_path / "out") == 0
    assert "verdict: PASS" in capsys.readouterr().out


def test_exported_robots_are_imported(flown, tmp_path):
    assert run("import", "crazyswarm2", flown / "csv" / "crazyflies.yaml", "-o", tmp_path / "lab.yaml") == 0
    assert load_mission(tmp_path / "lab.yaml").robots == load_mission(ONE).robots


def test_a_set_up_becomes_a_mission_that_is_never_overwritten(tmp_path, capsys):
    source, target = tmp_path / "crazyflies.yaml", tmp_path / "my lab.yaml"
    source.write_text(CRAZYFLIES)
    assert run("import", "crazyswarm2", source, "-o", target) == 0
    captured = capsys.readouterr()
    assert "not taken over: all.broadcasts" in captured.err
    assert load_mission(target).name == "my_lab"
    before = target.read_bytes()
    assert "exists" in refused(capsys, "import", "crazyswarm2", source, "-o", target)
    assert target.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["crazyflies.yaml", "my lab.yaml"]


def test_motion_capture_of_the_set_up(tmp_path, capsys):
    source, capture, target = tmp_path / "crazyflies.yaml", tmp_path / "mc.yaml", tmp_path / "lab.yaml"
    source.write_text(CRAZYFLIES)
    capture.write_text("/motion_capture_tracking: {ros__parameters: {type: vicon, hostname: 10.0.0.2}}")
    assert run("import", "crazyswarm2", source, "--motion-capture", capture, "-o", target) == 0
    assert "--mocap vicon --mocap-host 10.0.0.2" in target.read_text(encoding="utf-8")
    assert "nix.yaml" in refused(
        capsys, "import", "crazyswarm2", source, "--motion-capture", tmp_path / "nix.yaml", "-o", tmp_path / "b.yaml"
    )
    assert not (tmp_path / "b.yaml").exists()


@pytest.mark.parametrize("kind", ["trajectories", "waypoints"])
@pytest.mark.parametrize(
    ("name", "text", "expected"),
    [
        ("cf2.csv", None, "none for cf1; cf2 is no robot of it"),
        ("cf1.csv", "", "cf1.csv"),
        ("cf1.csv", "a,b\n1,2\n", "cf1.csv"),
        ("cf1.csv", "\0\1\2", "cf1.csv"),
        ("cf1.csv", "1,2,3\n4,5\n", "cf1.csv"),
        ("cf1.txt", None, "no CSV files"),
    ],
)
def test_files_that_cannot_be_used(flown, tmp_path, capsys, kind, name, text, expected):
    good = flown / "cf1.csv" if kind == "waypoints" else flown / "csv" / "cf1.csv"
    source = tmp_path / "in"
    source.mkdir()
    (source / name).write_text(good.read_text() if text is None else text)
    assert expected in refused(capsys, "import", kind, ONE, source, "-o", tmp_path / "out.mcap")
    assert not (tmp_path / "out.mcap").exists()


def test_arguments_that_cannot_be_used(flown, tmp_path, capsys):
    out = tmp_path / "out.mcap"
    csv = flown / "cf1.csv"
    assert "nix.csv" in refused(capsys, "import", "waypoints", ONE, tmp_path / "nix.csv", "-o", out)
    assert "nix.yaml" in refused(capsys, "import", "waypoints", tmp_path / "nix.yaml", csv, "-o", out)
    assert "second file" in refused(capsys, "import", "waypoints", ONE, csv, csv, "-o", out)
    assert "speed: got 9" in refused(capsys, "import", "waypoints", ONE, csv, "--max-speed", 9, "-o", out)
    assert "acceleration: got -1" in refused(
        capsys, "import", "waypoints", ONE, csv, "--max-acceleration=-1", "-o", out
    )
    assert "horizon.duration" in refused(capsys, "import", "waypoints", ONE, csv, "--max-speed", 0.05, "-o", out)
    assert "no" in refused(capsys, "import", "waypoints", ONE, csv, "-o", tmp_path / "no" / "out.mcap")
    assert not out.exists()


def test_what_breaks_a_limit_is_a_table_and_no_file(tmp_path, capsys):
    source, out = tmp_path / "cf1.csv", tmp_path / "out.mcap"
    source.write_text("0,0.5,0.5,0.6\n1,1.5,0.5,0.6\n")
    capsys.readouterr()
    assert run("import", "waypoints", ONE, source, "-o", out) == 1
    captured = capsys.readouterr()
    assert "acceleration" in captured.out
    assert "speed" in captured.out
    assert "ergoflie: " in captured.err
    assert not out.exists()


def test_files_appear_whole_or_not_at_all(tmp_path):
    path = tmp_path / "file"
    write_whole(path, b"one")
    write_whole(path, b"two")
    with pytest.raises(FileExistsError):
        write_whole(path, b"three", replace=False)
    assert path.read_bytes() == b"two"
    with pytest.raises(OSError, match="absent"):
        write_whole(tmp_path / "absent" / "file", b"")
    (tmp_path / "folder").mkdir()
    with pytest.raises(OSError, match="folder"):
        write_whole(tmp_path / "folder", b"")
    assert sorted(item.name for item in tmp_path.iterdir()) == ["file", "folder"]


def test_export_replaces_what_is_there(flown, tmp_path):
    shutil.copytree(flown / "csv", tmp_path / "csv")
    (tmp_path / "csv" / "cf1.csv").write_text("old")
    assert run("export", flown / "first.mcap", "-o", tmp_path / "csv") == 0
    assert (tmp_path / "csv" / "cf1.csv").read_bytes() == (flown / "csv" / "cf1.csv").read_bytes()
