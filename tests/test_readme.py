"""The README is true: its commands run, its mission loads, its diagram is the executor's table."""

import re
import shlex
import shutil
from pathlib import Path

import pytest

from deploy.cli.__main__ import main, parser
from deploy.phases import markdown, mermaid
from missions.loader import load_mission

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")


def blocks(language):
    return re.findall(rf"```{language}\n(.*?)```", README, re.DOTALL)


def test_every_command_runs_in_the_order_shown(tmp_path, monkeypatch, capsys):
    shutil.copytree(ROOT / "missions", tmp_path / "missions", ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    monkeypatch.chdir(tmp_path)
    lines = [line for block in blocks("sh") for line in block.splitlines() if line.startswith("ergoflie ")]
    assert len(lines) >= 6
    for line in lines:
        assert main(shlex.split(line)[1:]) == 0, line
    assert (tmp_path / "out/one/report.html").stat().st_size > 10_000
    for block in blocks("python"):
        exec(block, {})
    assert "PASS" in capsys.readouterr().out


def test_the_table_lists_every_command():
    listed = set(re.findall(r"^\| `ergoflie ([a-z-]+)", README, re.MULTILINE))
    (action,) = (action for action in parser()._subparsers._group_actions if action.choices)
    assert listed == set(action.choices)


def test_the_mission_shown_loads(tmp_path):
    (text,) = blocks("yaml")
    path = tmp_path / "mission.yaml"
    path.write_text(text, encoding="utf-8")
    assert load_mission(path).name == "two_friends"


def test_the_phase_diagram_is_the_table():
    (shown,) = blocks("mermaid")
    assert shown.strip() == mermaid().strip()
    assert f"\n{markdown()}\n" in README


@pytest.mark.parametrize("target", ["demo", "test"])
def test_the_two_commands_exist(target):
    assert f"make {target}" in README
    assert f"\n{target}:" in (ROOT / "Makefile").read_text(encoding="utf-8")
