"""``ergoflie fly --check-only`` as the terminal shows it; the checks themselves are tested with the flight."""

import pytest

import deploy.hardware
from deploy.cli.__main__ import main
from deploy.cli.flying import print_preflight
from deploy.errors import PreflightError
from deploy.planfile import write_plan
from deploy.preflight import PreflightCheck
from missions.loader import load_mission
from tests.deploy.flight_bench import small_plan, small_text

GOOD = PreflightCheck("battery", "cf1", "pass", "4.10 V", ">= 3.70 V")
BAD = PreflightCheck("pose", "cf2", "failure", "never seen", "<= 0.2 s old", "check [the] body")


def test_every_check_is_listed_and_one_failure_is_a_no(capsys):
    assert print_preflight([GOOD]) == 0
    assert print_preflight([GOOD, BAD]) == 1
    shown = capsys.readouterr().out
    assert "all 1 checks passed" in shown
    assert "1 of 2 checks failed" in shown
    assert "check [the] body" in " ".join(shown.split())


@pytest.mark.parametrize("check_only", [True, False])
def test_failed_checks_are_the_answer_of_the_command(tmp_path, capsys, monkeypatch, check_only):
    (tmp_path / "m.yaml").write_text(small_text())
    write_plan(tmp_path / "plan.mcap", small_plan(load_mission(tmp_path / "m.yaml")))
    report = type("Report", (), {"checks": (GOOD, BAD)})

    def refuse(*args, **kwargs):
        raise PreflightError("no", (GOOD, BAD))

    monkeypatch.setattr(deploy.hardware, "prepare_links", lambda mission: {})
    monkeypatch.setattr(deploy.hardware, "check_hardware", lambda plan, **kwargs: (report, kwargs["log_path"]))
    monkeypatch.setattr(deploy.hardware, "fly_hardware", refuse)
    option = "--check-only" if check_only else "--yes"
    assert main(["fly", str(tmp_path / "plan.mcap"), option, "-o", str(tmp_path / "logs")]) == 1
    assert "1 of 2 checks failed" in capsys.readouterr().out
