"""The report page: complete without a network, safe against hostile texts, alive in a browser."""

import dataclasses
import html
import itertools
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest

from deploy.analysis.analyse import analyse
from deploy.analysis.compare import compare
from deploy.flightlog.reader import Series, read_log
from deploy.report import build_comparison
from deploy.report.build import build_report
from deploy.report.packing import script_json, thin
from tests.deploy import synthetic_flight as synthetic

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"]
FLAGS += ["--disable-component-update", "--disable-sync", "--virtual-time-budget=4000"]
WITNESS = f"<script>{(Path(__file__).parent / 'report_witness.js').read_text(encoding='utf-8')}</script>"


CHARTS = ["ergodicity", "groups", "connectivity", "separation", "altitude", "tracking", "attitude", "motors"]
CHARTS += ["battery", "link", "mocap"]


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.mcap"
    plan = synthetic.flight_plan(duration=6.0, description="</script><script>alert(1)</script> & <b>bold</b>")
    evil = {"backend": "simulated", "note": "<img src=x onerror=alert(2)>", "simulation": "<i>modelled</i>"}
    synthetic.write_flight(path, plan, fault="link", metadata=evil)
    return analyse(read_log(path))


@pytest.fixture(scope="module")
def page(flight):
    return build_report(flight)


class Tags(HTMLParser):
    VOID = frozenset({"meta", "input", "img", "br"})

    def __init__(self):
        super().__init__()
        self.tags, self.links, self.open = [], [], []

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.links += [value for name, value in attrs if name in {"src", "href", "srcset", "action"}]
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag, f"</{tag}>"


def test_page_is_whole_and_asks_for_nothing(page):
    tags = Tags()
    tags.feed(page)
    assert all(link.startswith("#") for link in tags.links)
    assert {link[1:] for link in tags.links} <= set(re.findall(r'id="(\w+)"', page))
    # Optional end tags are all written, so everything opened is closed in order.
    assert tags.open == []
    assert tags.tags.count("script") == 2
    assert "img" not in tags.tags
    assert "http://" not in page.replace("http-equiv", "")
    assert "https://" not in page
    assert len(page) < 1_000_000


def test_hostile_texts_stay_texts(page):
    assert html.escape("</script><script>alert(1)</script>") in page
    assert "<script>alert" not in page
    assert "<img" not in page
    assert "<i>modelled" not in page
    assert "$" not in re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert json.loads(script_json({"a": "</script><!--&", "b": np.float64("nan")})) == {
        "a": "</script><!--&",
        "b": None,
    }
    assert "<" not in script_json("</script>")


def test_every_chart_says_what_it_shows(page):
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, flags=re.S)[1])
    ids = [chart["id"] for chart in data["charts"]]
    assert ids == CHARTS
    for chart in data["charts"]:
        assert chart["title"]
        assert len(chart["reading"]) > 30
        assert chart["reading"].endswith(".")
        assert chart["kind"] == "spans" or all(panel["unit"] and panel["curves"] for panel in chart["panels"])


def test_verdict_figures_and_tables_are_on_the_page(flight, page):
    assert f'<p class="level">{flight.verdict.level.name}</p>' in page
    for finding in flight.verdict.findings:
        assert html.escape(finding.text) in page
    for word in (
        "Indicators of the search",
        "Certificate of the bytes",
        "Pre-flight checks",
        "mission_start",
        "SHA-256",
        "Parameters changed: 2",
    ):
        assert word in page


def test_thinning_keeps_the_worst():
    t, y = np.arange(1000.0), np.ones(1000)
    y[503] = 9.0
    assert thin(t, y, 100, "largest")[1].max() == 9.0
    assert thin(t, -y, 100, "smallest")[1].min() == -9.0
    assert len(thin(t, y, 100)[0]) == 100


@pytest.mark.parametrize("change", ["no search", "nobody seen", "one robot"])
def test_a_report_of_half_a_flight_is_still_a_report(flight, tmp_path, change):
    record = flight.record
    if change == "one robot":
        plan = synthetic.flight_plan(duration=3.0, robots=1)
        synthetic.write_flight(tmp_path / "one.mcap", plan)
        record = read_log(tmp_path / "one.mcap")
    elif change == "no search":
        record = dataclasses.replace(record, events=tuple(e for e in record.events if "mission" not in e.name))
    else:
        gone = {name: item for name, item in record.series.items() if "pose" not in name and "estimate" not in name}
        record = dataclasses.replace(record, series=gone)
    Tags().feed(build_report(analyse(record)))


def left_of(record, rng):
    """Some of a record: topics missing for some robots, a window of time, values unknown from some moment on."""
    begin, end = sorted(rng.uniform(0.0, 18.0, 2)) if rng.random() < 0.8 else (0.0, 99.0)
    series = {}
    for topic, item in record.series.items():
        if rng.random() < 0.15:
            continue
        kept = (item.t >= begin) & (item.t <= end * rng.choice([1.0, 0.7]))
        columns = {name: values[kept].copy() for name, values in item.columns.items()}
        if columns and kept.any() and rng.random() < 0.2:
            columns[rng.choice(list(columns))][rng.integers(kept.sum()) :] = np.nan
        texts = {name: tuple(values[k] for k in np.flatnonzero(kept)) for name, values in item.texts.items()}
        series[topic] = Series(item.t[kept], columns, texts)
    events = tuple(event for event in record.events if begin <= event.t <= end and rng.random() < 0.9)
    return dataclasses.replace(record, series=series, events=events, complete=False)


@pytest.mark.parametrize("seed", range(12))
def test_a_report_of_whatever_is_left_of_a_flight_is_a_report(flight, seed):
    rest = analyse(left_of(flight.record, np.random.default_rng(seed)))
    Tags().feed(build_report(rest))
    Tags().feed(build_comparison(compare([flight, rest])))


def laid_out(witness, width):
    """The screenshot test: boxes, not pixels."""
    boxes = [box for _, box in witness["sections"]]
    assert [name for name, _ in witness["sections"]][:4] == ["", "verdict", "diagnoses", ""]
    for above, below in itertools.pairwise(boxes):
        assert below[1] >= above[3], "sections follow one another"
    for name, (left, top, right, bottom) in witness["figures"]:
        assert 0 <= left < right <= max(width, 500), name
        assert right - left > 120, name
        assert bottom - top > 80, name
    for (_, a), (_, b) in itertools.combinations(witness["figures"], 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], "figures do not overlap"
    columns = {box[0] for name, box in witness["figures"] if name.startswith("chart-")}
    assert len(columns) == (2 if width > 820 else 1)
    assert witness["bar"][3] - witness["bar"][1] < 90


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: the page was not tried in a browser")
@pytest.mark.parametrize("width", [1400, 700])
def test_page_lives_in_a_browser(flight, page, tmp_path, width):
    path = tmp_path / "report.html"
    path.write_text(page.replace("<style>", WITNESS + "<style>", 1), encoding="utf-8")
    command = [CHROMIUM, *FLAGS, f"--window-size={width},3000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]
    dom = subprocess.run([*command, path.as_uri()], capture_output=True, text=True, timeout=240, check=True).stdout
    witness = json.loads(html.unescape(re.search(r'<pre id="witness">(.*?)</pre>', dom, flags=re.S)[1]))
    assert witness["errors"] == []
    assert 0.3 < witness["played"] < 5.0  # began at the start of the search and moved
    assert witness["stepped"] == pytest.approx(witness["start"] + 0.2, abs=1e-3)
    assert witness["jumped"] == pytest.approx(witness["asked"], abs=1e-3)  # a moment in the diagnosis
    assert set(witness["pressed"]) == {"cf1"}  # in focus, wherever it is named
    assert witness["deaf"] == []  # every control and picture has a name
    assert len(witness["charts"]) == len(CHARTS)
    for name, (points, colours) in witness["charts"].items():
        assert points > 0, name
        assert colours > 5, name
    assert witness["scene"] > 50
    assert min(witness["maps"][:3]) > 20
    assert witness["ergodicity"] == pytest.approx(flight.coverage.flown.ergodicity, rel=0.05)
    laid_out(witness, width)
    assert witness["width"] <= max(width, 500)  # nothing sticks out sideways
