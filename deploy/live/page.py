"""The live page: the report's playback, fed over a WebSocket instead of from the page itself."""

from __future__ import annotations

from html import escape
from importlib.resources import files
from string import Template

from deploy.report.packing import script_json
from deploy.report.playback import stage_data
from planner.flightplan import FlightPlan

# ``stand_in.js`` is there before what it stands in for is used, ``live.js`` after everything it feeds.
_SCRIPTS = (
    ("deploy.report", "page.js"),
    ("deploy.report", "scene.js"),
    ("deploy.live", "stand_in.js"),
    ("deploy.report", "charts.js"),
    ("deploy.report", "main.js"),
    ("deploy.live", "live.js"),
)


def build_page(flight_plan: FlightPlan) -> str:
    """The page; it asks for nothing but its feed."""
    mission = flight_plan.mission
    unseen = [None] * 3 * len(mission.robots)
    nothing = {"t0": 0.0, "dt": 0.1, "n": 1, "flown": unseen, "planned": unseen, "phases": [], "marks": []}
    data = {"playback": {**stage_data(mission), **nothing}, "charts": [_ergodicity()]}
    return Template(_read("deploy.live", "live.html")).substitute(
        title=escape(f"{mission.name}: live"),
        name=escape(mission.name),
        style=_read("deploy.report", "report.css") + _read("deploy.live", "live.css"),
        script="\n".join(_read(*script) for script in _SCRIPTS),
        data=script_json(data),
        playback=_read("deploy.report", "playback.html"),
        bar=_read("deploy.report", "bar.html"),
    )


def _ergodicity() -> dict[str, object]:
    """The chart of E so far, still empty; ``live.js`` fills it."""
    empty: dict[str, object] = {"name": "flown", "robot": None, "style": "flown", "t": [], "y": []}
    panel = {"unit": "E, log scale", "log": True, "curves": [empty], "limits": []}
    return {
        "id": "ergodicity",
        "group": "live",
        "kind": "lines",
        "title": "Ergodicity so far",
        "reading": "How well the swarm has covered the map; the line is what is certified for the end of the search.",
        "panels": [panel],
    }


def _read(package: str, name: str) -> str:
    return files(package).joinpath(name).read_text(encoding="utf-8")
