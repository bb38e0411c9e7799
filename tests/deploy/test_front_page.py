"""The page of a front and the commands around it: whole, safe, alive in a browser; refusals in one line."""

import dataclasses
import html
import json
import re
import shutil
import subprocess

import numpy as np
import pytest

from deploy.cli.__main__ import main
from deploy.front.build import build_front_page
from missions.loader import parse_mission
from missions.weights import reweighted
from planner.indicators import ergodic_metric
from planner.models import mission_dynamics
from planner.pareto.file import front_text, read_front
from planner.pareto.front import Front, FrontPoint, FrontSettings, Maps
from planner.plan import Plan

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
FLAGS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run"]
FLAGS += ["--disable-component-update", "--disable-sync", "--virtual-time-budget=4000"]
TEXT = """\
schema_version: 1
name: page
description: "</script><script>alert(1)</script> & <b>bold</b>"
workspace: {lower: [0.0, 0.0], upper: [2.0, 2.0]}
horizon: {duration: 4.0}
information:
  type: several
  maps:
    - {name: people, map: {type: gaussians, components: [{mean: [0.6, 0.6], covariance: 0.08}]}}
    - {name: gas, map: {type: gaussians, components: [{mean: [1.4, 1.4], covariance: 0.08}]}}
    - {name: noise, map: {type: gaussians, components: [{mean: [1.4, 0.6], covariance: 0.08}]}}
robots: [{name: a, start: [1.0, 0.6]}, {name: b, start: [1.0, 1.4]}]
obstacles: [{type: circle, center: [0.4, 1.6], radius: 0.2}]
limits: {acceleration: 0.6, speed: 1.0, separation: 0.3}
"""
TWO = TEXT.replace(TEXT[TEXT.index("    - {name: noise") : TEXT.index("robots:")], "")
WITNESS = """<script>
const seen = [];
addEventListener("error", (e) => seen.push(String(e.message)));
addEventListener("securitypolicyviolation", (e) => seen.push("request: " + e.blockedURI));
addEventListener("load", () => setTimeout(() => {
  const at = (id) => document.getElementById(id), chosen_ = () => Number(document.documentElement.dataset.chosen);
  const command = () => at("command").textContent;
  const begun = chosen_();
  const [x, y] = scatter.place(3), box = at("scatter").getBoundingClientRect();
  at("scatter").dispatchEvent(new MouseEvent("click", { clientX: box.left + x, clientY: box.top + y, bubbles: true }));
  drawAll();
  const clicked = [chosen_(), command()];
  at("scatter").dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight", bubbles: true }));
  const walked = chosen_();
  [...document.querySelectorAll("#rows tr")][2].click(); drawAll();
  const row = [chosen_(), document.querySelector('#rows tr[aria-selected="true"]').rowIndex];
  const slider = document.querySelector("#limits input");
  slider.value = 0; slider.dispatchEvent(new Event("input"));
  const kept = points.filter(allowed).length;
  slider.value = 1; slider.dispatchEvent(new Event("input"));
  at("play").click();
  setTimeout(() => {
    at("play").click(); const played = cursor.t;
    at("theme").click();
    const colours_ = (c) => { const found = new Set();
      const d = c.getContext("2d").getImageData(0, 0, c.width, c.height).data;
      for (let i = 0; i < d.length; i += 4) found.add(d[i] * 65536 + d[i + 1] * 256 + d[i + 2]); return found.size; };
    const named = (e) => e.getAttribute("aria-label") || e.textContent.trim() || e.labels?.length;
    const out = document.createElement("pre"); out.id = "witness";
    out.textContent = JSON.stringify({ errors: seen, begun, clicked, walked, row, kept, played,
      canvases: [...document.querySelectorAll("canvas")].map((c) => [c.id, Number(c.dataset.points), colours_(c)]),
      deaf: [...document.querySelectorAll("button, select, canvas, input")].filter((e) => !named(e)).map((e) => e.id),
      width: document.documentElement.scrollWidth, view: document.documentElement.clientWidth,
      boxes: [...document.querySelectorAll("figure")].map((f) => f.getBoundingClientRect())
        .map((r) => [r.left, r.top, r.right, r.bottom]) });
    document.body.append(out);
  }, 1000);
}, 300));
</script>"""


def made_up(text=TEXT, points=6):
    """A front of plans that nobody searched."""
    mission = parse_mission(text, path="page.yaml", read_file={}.__getitem__)
    maps, dynamics, rng = Maps.of(mission), mission_dynamics(mission), np.random.default_rng(0)
    found = []
    for number in range(points):
        u = 0.4 * rng.standard_normal(dynamics.controls_shape).cumsum(axis=0) / 6.0
        motion = dynamics.rollout(u)
        weights = rng.dirichlet(np.ones(len(maps.names)))
        E = ergodic_metric(reweighted(mission, weights)).value(motion.q[:-1])
        plan = Plan(np.arange(len(motion.q)) * mission.horizon.dt, motion.q, motion.v, u, E, 0.0)
        found.append(FrontPoint(weights, maps.vector(motion.q[:-1]), plan, None if number == 0 else 0, "fine <i>"))
    return Front(mission, FrontSettings(), maps.names, maps.distances, tuple(found), ("a note & <b>more</b>",))


@pytest.fixture(scope="module")
def front():
    return made_up()


def test_page_is_whole_asks_for_nothing_and_hostile_texts_stay_texts(front):
    page = build_front_page(front, "out/page.front.json")
    assert "$" not in re.sub(r"<script.*?</script>", "", page, flags=re.S)
    assert html.escape("</script><script>alert(1)</script>") in page
    assert "<script>alert" not in page
    assert "fine <i>" not in page
    assert "a note &amp; &lt;b&gt;more" in page
    assert "http://" not in page.replace("http-equiv", "")
    assert "https://" not in page
    assert len(page) < 400_000
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, flags=re.S)[1])
    assert data["names"] == ["people", "gas", "noise"]
    assert [point["vector"] for point in data["points"]] == front.vectors.tolist()
    assert [index for index, point in enumerate(data["points"]) if point["best"]] == list(front.best)


def test_plans_of_a_large_front_are_drawn_more_coarsely(monkeypatch):
    monkeypatch.setattr("deploy.front.build.MOST_SAMPLES", 100)
    data = json.loads(re.search(r'id="data">(.*?)</script>', build_front_page(made_up(), "f"), flags=re.S)[1])
    assert data["playback"]["n"] == 9
    assert data["playback"]["dt"] == pytest.approx(0.5)


@pytest.mark.browser
@pytest.mark.skipif(CHROMIUM is None, reason="no chromium on this machine: the page was not tried in a browser")
@pytest.mark.parametrize(("text", "width"), [(TEXT, 1400), (TWO, 700)])
def test_page_lives_in_a_browser(tmp_path, text, width):
    front = made_up(text)
    path = tmp_path / "front.html"
    page = build_front_page(front, "out/page.front.json")
    path.write_text(page.replace("<style>", WITNESS + "<style>", 1), encoding="utf-8")
    command = [CHROMIUM, *FLAGS, f"--window-size={width},3000", f"--user-data-dir={tmp_path / 'profile'}", "--dump-dom"]
    dom = subprocess.run([*command, path.as_uri()], capture_output=True, text=True, timeout=240, check=True).stdout
    witness = json.loads(html.unescape(re.search(r'<pre id="witness">(.*?)</pre>', dom, flags=re.S)[1]))
    assert witness["errors"] == []
    assert witness["begun"] == front.named["compromise"]
    assert witness["clicked"] == [3, "ergoflie plan out/page.front.json --pick 3"]
    assert witness["walked"] != 3
    assert witness["row"] == [2, 3]  # below the headings
    assert witness["kept"] == 0  # nobody is perfect on the first map
    assert 0.0 < witness["played"] < 4.0
    assert witness["deaf"] == []
    assert [name for name, _, _ in witness["canvases"]] == [
        "scatter",
        "parallel",
        *(f"map-{m}" for m in range(len(front.names))),
    ]
    for name, points, colours in witness["canvases"]:
        assert points == (41 if name.startswith("map") else 6), name
        assert colours > 8, name
    assert witness["width"] <= witness["view"]
    for left, top, right, bottom in witness["boxes"]:
        assert right - left > 250
        assert bottom - top > 200


def run(*argv):
    return main([str(arg) for arg in argv])


def test_pareto_writes_front_and_page(tmp_path, monkeypatch, capsys, front):
    plan = front.points[0].plan
    monkeypatch.setattr("planner.pareto.work.search", lambda *_: (plan, "fine"))
    mission = tmp_path / "page.yaml"
    mission.write_text(TEXT)
    assert run("pareto", mission, "-o", tmp_path / "out", "--refine", 0, "--processes", 0, "--json") == 0
    said = json.loads(capsys.readouterr().out)
    assert said["maps"] == ["people", "gas", "noise"]
    assert len(said["points"]) == 4
    again = read_front(tmp_path / "out" / "page.front.json")
    assert len(again.points) == 4
    assert "--pick" in (tmp_path / "out" / "page.front.html").read_text()
    assert run("pareto", mission, "-o", tmp_path / "out", "--refine", 0, "--processes", 0) == 0
    printed = capsys.readouterr().out
    assert "hyper-volume to (1, …, 1)" in printed
    assert "page.front.html" in printed


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--method", "best"), "method: got 'best'; allowed: thin, a-sles, sles, scalar, nsga2"),
        (("--method", "sles", "--step", "0.001"), "plans; allowed: at most 5000; take larger steps"),
        (("--processes", "-1"), "--processes: got -1; allowed: at least 0"),
    ],
)
def test_refusals_are_one_line(tmp_path, capsys, options, message):
    mission = tmp_path / "page.yaml"
    mission.write_text(TEXT)
    assert run("pareto", mission, "-o", tmp_path / "out", *options) == 2
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert line.startswith("ergoflie: ")
    assert message in line
    assert not list(tmp_path.glob("out/*.json"))


def test_a_pick_that_is_not_there_and_a_front_that_is_none(tmp_path, capsys, front):
    path = tmp_path / "page.front.json"
    path.write_text(front_text(dataclasses.replace(front, notes=())))
    assert run("plan", path, "--pick", "nobody") == 2
    assert "no point 'nobody' on this front; allowed: people, gas, noise" in capsys.readouterr().err
    assert run("plan", path, "--pick", "0", "--seed", "3") == 2
    assert "--seed: a plan that is picked is not searched for again" in capsys.readouterr().err
    path.write_text("{}")
    assert run("plan", path, "--pick", "0") == 2
    assert "not a front file; 'ergoflie pareto' makes them" in capsys.readouterr().err
