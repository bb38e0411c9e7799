"""The live page: the report's playback, fed over a WebSocket instead of from the page itself."""

from __future__ import annotations

from html import escape

from deploy.report.page import Kind, fill
from deploy.report.playback import stage_data
from planner.flightplan import FlightPlan

# ``stand_in.js`` is there before what it stands in for is used, ``live.js`` after everything it feeds.
_SCRIPTS = (
    "report/page.js",
    "report/scene.js",
    "live/stand_in.js",
    "report/charts.js",
    "report/main.js",
    "live/live.js",
)
_LIVE = Kind(
    "live/live.html",
    _SCRIPTS,
    style="live/live.css",
    body=' class="live"',
    sources="; connect-src 'self' ws://127.0.0.1:* ws://localhost:*",
)
_PHASE = '<b id="phase">waiting for the flight</b> <span id="message" aria-live="polite"></span>'


def build_page(flight_plan: FlightPlan) -> str:
    """The page; it asks for nothing but its feed."""
    mission = flight_plan.mission
    unseen = [None] * 3 * len(mission.robots)
    nothing = {"t0": 0.0, "dt": 0.1, "n": 1, "flown": unseen, "planned": unseen, "phases": [], "marks": []}
    data = {"playback": {**stage_data(mission), **nothing}, "charts": [_ergodicity()]}
    return fill(
        _LIVE,
        data,
        title=escape(f"{mission.name}: live"),
        kind="live",
        name=escape(mission.name),
        under={"facts": _PHASE},
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
