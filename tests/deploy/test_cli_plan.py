"""``ergoflie plan`` and Ctrl-C: the first keeps the best plan so far, the second ends at once."""

import multiprocessing
import os
import signal
import time

import pytest
import rich.progress

from deploy.cli.__main__ import main

MISSION = """
schema_version: 1
name: pair
workspace: {{lower: [-1.0, -1.0], upper: [1.0, 1.0]}}
horizon: {{duration: 12.0, dt: 0.1}}
limits: {{acceleration: 0.5, separation: 0.3}}
information: {{type: gaussians, components: [{{mean: [0.2, 0.1], covariance: 0.1}}]}}
robots: [{{name: a, start: [-0.5, 0.0]}}, {{name: b, start: [0.5, 0.0]}}]
solver: {{starts: 200, processes: {processes}}}
"""


@pytest.fixture
def press(monkeypatch):
    """Presses Ctrl-C at the first reports of progress, as often as told; when, and how many reports there were."""
    pressed, reports = [], []

    def pressing(times):
        def update(bar, task, **shown):
            reports.append(shown)
            if len(pressed) < times:
                pressed.append(time.monotonic())
                os.kill(os.getpid(), signal.SIGINT)

        monkeypatch.setattr(rich.progress.Progress, "update", update)
        return pressed, reports

    return pressing


def mission(tmp_path, processes=1):
    path = tmp_path / "mission.yaml"
    path.write_text(MISSION.format(processes=processes))
    return path


def test_ctrl_c_keeps_a_plan(tmp_path, press):
    press(1)
    target = tmp_path / "plan.mcap"
    assert main(["plan", str(mission(tmp_path)), "-o", str(target)]) == 0
    assert target.exists()


@pytest.mark.parametrize("processes", [1, 2])
def test_a_second_ctrl_c_ends_at_once(tmp_path, press, capsys, processes):
    handler = signal.getsignal(signal.SIGINT)
    pressed, reports = press(2)
    target = tmp_path / "plan.mcap"
    assert main(["plan", str(mission(tmp_path, processes)), "-o", str(target)]) == 130
    assert len(pressed) == len(reports) == 2  # nothing was searched, repaired or fitted after the second
    assert "interrupted" in capsys.readouterr().err
    assert not target.exists()
    assert multiprocessing.active_children() == []
    assert signal.getsignal(signal.SIGINT) is handler
