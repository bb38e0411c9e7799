"""Plots of studies: well-formed, one dot a run, dots where the numbers are."""

import dataclasses
import xml.etree.ElementTree as ET

from planner.study.plots import plot, write_plots
from planner.study.record import Claim, Study

SVG = "{http://www.w3.org/2000/svg}"
CLAIM = Claim("E rises <with> N_p", "ergodicity", "rises", x="connectivity.sub_periods")
AXIS = tuple((k, {"connectivity.sub_periods": k}) for k in (1, 2, 3))
STUDY = Study("s", "t", "p", {}, ".", {}, {"connectivity.sub_periods": AXIS}, (0,), "plan", (CLAIM, CLAIM))


def row(k, value, feasible="True"):
    return {"connectivity.sub_periods": str(k), "ergodicity": str(value), "feasible": feasible}


def dots(text):
    return [(float(c.get("cx")), float(c.get("cy"))) for c in ET.fromstring(text).iter(f"{SVG}circle")]


def test_every_feasible_run_with_numbers_is_a_dot():
    rows = [row(1, 1e-4), row(2, 1e-3), row(3, 1e-2), row(3, "nan"), row(2, 1.0, "False"), row(2, "")]
    (a, b, c) = dots(plot(STUDY, rows, CLAIM))
    assert a[0] < b[0] < c[0]
    assert a[1] > b[1] > c[1]  # y grows downwards in SVG
    assert abs((a[1] - b[1]) - (b[1] - c[1])) < 0.11  # decades are equally far apart


def test_too_few_runs_give_no_plot(tmp_path):
    assert plot(STUDY, [row(1, 1e-4)], CLAIM) == ""
    assert write_plots(STUDY, [], tmp_path) == []


def test_one_file_for_each_pair_of_columns(tmp_path):
    (path,) = write_plots(STUDY, [row(1, 1e-4), row(1, 1e-4)], tmp_path)
    assert path.name == "s_ergodicity_over_sub_periods.svg"
    assert len(dots(path.read_text(encoding="utf-8"))) == 2


def test_a_line_goes_through_the_medians():
    rows = [row(k, 10.0**-e) for k, exponents in ((1, (4, 3, 0)), (2, (2, 2, 1))) for e in exponents]
    picture = plot(STUDY, rows, CLAIM)
    (line,) = (p.get("d") for p in ET.fromstring(picture).iter(f"{SVG}path") if p.get("stroke-width") == "1.5")
    ends = [tuple(map(float, point.split())) for point in line[1:].split("L")]
    assert ends == [dots(picture)[1], dots(picture)[3]]


def test_ratios_have_no_plot(tmp_path):
    ratio = Claim("E", "ergodicity", "below", of={"connectivity.sub_periods": 1}, to={"connectivity.sub_periods": 2})
    assert write_plots(dataclasses.replace(STUDY, claims=(ratio,)), [row(1, 1e-4), row(2, 1e-4)], tmp_path) == []
