"""Flights side by side: what changed, for whom, and how the command line says it."""

import html
import json
import re
import subprocess

import pytest

from deploy.analysis.analyse import analyse
from deploy.analysis.compare import Figure, compare, labels
from deploy.cli.__main__ import main
from deploy.flightlog.reader import read_log
from deploy.report import build_comparison
from tests.deploy import synthetic_flight as synthetic
from tests.deploy.test_report_page import CHROMIUM, FLAGS, Tags

CHARTS = ("ergodicity", "tracking", "separation", "battery", "link")
WITNESS = """<script>
const seen = [];
addEventListener("error", (e) => seen.push(String(e.message)));
addEventListener("load", () => setTimeout(() => {
  const out = document.createElement("pre"); out.id = "witness";
  out.textContent = JSON.stringify({ seen, width: document.documentElement.scrollWidth, time: document.documentElement.dataset.time,
    charts: Object.fromEntries([...document.querySelectorAll(".chart")].map((f) => [f.id, Number(f.querySelector("canvas").dataset.points)])) });
  document.body.append(out);
}, 500));
</script>"""  # noqa: E501


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flights")
    plan = synthetic.flight_plan(duration=6.0)
    made = {}
    for name, options in {
        "before": {"lag": 0.02},
        "after": {"lag": 0.07, "fault": "battery"},
        "again": {"lag": 0.02},
    }.items():
        made[name] = folder / name / "flight.mcap"
        made[name].parent.mkdir()
        synthetic.write_flight(made[name], plan, **options)
    return made


@pytest.fixture(scope="module")
def comparison(logs):
    return compare([analyse(read_log(logs[name])) for name in ("before", "after")])


def test_what_got_worse_is_said_and_what_did_not_is_not(comparison):
    figures = {item.name: item for item in comparison.figures}
    worse = {name for name, item in figures.items() if item.worse(1)}
    assert {"lag, mean", "tracking error, mean", "lowest voltage"} <= worse
    assert worse & {"radio latency, 95 %", "poses, slowest", "ergodicity certified"} == set()
    assert figures["lag, mean"].values == pytest.approx((20.0, 70.0), abs=10.0)
    assert comparison.same_bytes
    assert comparison.same_robots
    assert comparison.labels == ("before", "after")


def test_a_flight_compared_with_itself_has_not_changed(logs):
    flight = analyse(read_log(logs["before"]))
    same = compare([flight, flight])
    assert not any(item.worse(1) or item.improved(1) for item in same.figures)
    assert "Nothing changed notably" in build_comparison(same)


@pytest.mark.parametrize(
    ("values", "better", "worse", "improved"),
    [
        ((1.0, 1.3), "less", True, False),
        ((1.0, 0.7), "less", False, True),
        ((1.0, 1.3), "more", False, True),
        ((1.0, 0.7), "more", True, False),
        ((1.0, 1.05), "less", False, False),  # within a tenth
        ((0.01, 0.1), "less", False, False),  # smaller than the least that counts
        ((1.0, float("nan")), "less", False, False),
        ((1.0, 5.0), "", False, False),
    ],
)
def test_notable_changes(values, better, worse, improved):
    figure = Figure("x", "m", values, better, 0.1)
    assert (figure.worse(1), figure.improved(1)) == (worse, improved)


def test_labels_tell_flights_apart():
    assert labels(["out/a/flight.mcap", "out/b/flight.mcap"]) == ("a", "b")
    assert labels(["x/one.mcap", "y/two.mcap.part"]) == ("one", "two")
    assert labels(["a/x/f.mcap", "a/y/f.mcap", "b/y/f.mcap"]) == ("a/x/f", "a/y/f", "b/y/f")
    assert labels(["f.mcap", "f.mcap"]) == ("f 1", "f 2")


def test_one_flight_is_no_comparison(comparison):
    with pytest.raises(ValueError, match="two flights"):
        compare(comparison.flights[:1])


def test_the_page_is_whole_and_shows_the_second_flight_as_the_ghost(comparison):
    page = build_comparison(comparison)
    tags = Tags()
    tags.feed(page)
    assert tags.open == []
    assert "https://" not in page
    assert "Solid: before. Dashed and hollow: after." in page
    assert "certified plan" not in page
    assert "the same bytes flew in all of them" in page
    assert "lag, mean" in page


def test_the_command_compares_and_says_so_to_machines(logs, tmp_path, capsys):
    target = tmp_path / "both.html"
    both = [str(logs["before"]), str(logs["after"])]
    assert main(["report", *both, "-o", str(target), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert [flight["verdict"] for flight in said["flights"]] == ["PASS", "WARN"]
    assert said["flights"][1]["label"] == "after"
    assert said["report"] == str(target)
    (lag,) = (item for item in said["figures"] if item["name"] == "lag, mean")
    assert lag["worse"] == [False, True]
    assert target.exists()
    assert main(["report", *both, "-o", str(target), "--fail-on", "WARN"]) == 1
    assert "lag, mean [ms]" in capsys.readouterr().out
    assert main(["report", str(logs["before"]), str(logs["again"]), "--fail-on", "WARN"]) == 0
    assert (logs["again"].parent / "comparison.html").exists()


def test_a_single_report_fails_on_what_it_is_told_to(logs, tmp_path, capsys):
    target = ["-o", str(tmp_path / "one.html")]
    assert main(["report", str(logs["after"]), *target]) == 0
    assert main(["report", str(logs["after"]), *target, "--fail-on", "WARN"]) == 1
    said = capsys.readouterr().out
    assert "weak battery: cf3's battery fell to" in said
    assert "→ charge it before the next flight" in said


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: the page was not tried in a browser")
def test_the_page_lives_in_a_browser(comparison, tmp_path):
    path = tmp_path / "comparison.html"
    path.write_text(build_comparison(comparison).replace("<style>", WITNESS + "<style>", 1), encoding="utf-8")
    command = [CHROMIUM, *FLAGS, "--window-size=1000,2000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]
    dom = subprocess.run([*command, path.as_uri()], capture_output=True, text=True, timeout=240, check=True).stdout
    witness = json.loads(html.unescape(re.search(r'<pre id="witness">(.*?)</pre>', dom, flags=re.S)[1]))
    assert witness["seen"] == []
    assert witness["width"] <= 1000
    assert set(witness["charts"]) == {f"chart-{name}" for name in CHARTS}
    assert min(witness["charts"].values()) > 50
