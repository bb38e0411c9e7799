"""Stage 7 of 7: a judged flight to one self-contained HTML page that needs no network and no library."""

from __future__ import annotations

from html import escape

from deploy.analysis.record import FlightAnalysis
from deploy.report import sections
from deploy.report.charts import all_charts
from deploy.report.checks import parameters_table, preflight_table
from deploy.report.delays import delays_table
from deploy.report.maps import maps_data
from deploy.report.page import PLAYED, Kind, fill
from deploy.report.playback import playback_data
from deploy.report.replans import replans_table
from deploy.report.switches import switches_table
from deploy.report.thing import thing_table
from deploy.report.verdict import diagnoses, verdict

_REPORT = Kind("report/report.html", PLAYED)


def build_report(analysis: FlightAnalysis) -> str:
    """The page. Everything in it is inline; a content security policy forbids it to ask for more."""
    mission = analysis.flight_plan.mission
    data = {"playback": playback_data(analysis), "charts": all_charts(analysis), "maps": maps_data(analysis)}
    robots = f"{len(mission.robots)} robot{'s' if len(mission.robots) > 1 else ''}"
    return fill(
        _REPORT,
        data,
        title=escape(f"{mission.name}: {analysis.verdict.level.name}"),
        name=escape(mission.name),
        kind="Rehearsal on simulated drones" if analysis.simulated else "Flight",
        under={"lede": escape(mission.description), "facts": f"{robots} · {mission.horizon.duration:g} s search"},
        verdict=verdict(analysis),
        diagnoses=diagnoses(analysis),
        figures=sections.figures(analysis),
        indicators=thing_table(analysis) + sections.indicators_table(analysis),
        probabilities=sections.probability_table(analysis),
        forwarding=sections.forwarding_table(analysis),
        robots_table=sections.robots_table(analysis)
        + delays_table(analysis)
        + switches_table(analysis)
        + replans_table(analysis),
        certificate=sections.certificate_table(analysis),
        preflight=preflight_table(analysis),
        parameters=parameters_table(analysis),
        events=sections.events_table(analysis),
        provenance=sections.provenance_table(analysis),
        simulation=sections.simulation(analysis),
    )
