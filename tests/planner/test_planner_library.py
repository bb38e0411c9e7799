"""The package as a library: few names, lazily, and the example in its docstring runs as it stands."""

import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

import planner

ROOT = Path(__file__).parents[2]


def run(code):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-W", "error", "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True
    )


def test_at_most_ten_names_and_each_exists():
    assert len(planner.__all__) <= 10
    assert all(getattr(planner, name) is not None for name in planner.__all__)


def test_an_unknown_name_is_an_error_that_lists_the_known():
    with pytest.raises(AttributeError, match="'certifi'; known: Plan, "):
        _ = planner.certifi


def test_importing_the_package_imports_nothing_heavy():
    done = run("import sys, planner; print([m for m in ('numpy', 'yaml', 'casadi', 'scipy') if m in sys.modules])")
    assert done.stdout.strip() == "[]", done.stderr


def test_planning_needs_no_casadi():
    done = run("import sys; sys.modules['casadi'] = None; import planner; planner.solve; planner.make_flight_plan")
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_the_example_runs_as_it_stands():
    lines = planner.__doc__.split("::\n", 1)[1].split("\nNames are", 1)[0]
    code = textwrap.dedent(lines)
    assert len([line for line in code.splitlines() if line.strip()]) <= 16
    done = run(code)
    assert done.returncode == 0, done.stderr
    assert "every limit is met" in done.stdout
