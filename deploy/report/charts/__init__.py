"""The page's charts, drawn by ``charts.js``: what happened, and what it means."""

from __future__ import annotations

from deploy.analysis.record import FlightAnalysis
from deploy.report.charts.chart import Chart
from deploy.report.charts.machine import attitude, battery, motors
from deploy.report.charts.motion import altitude, separation, tracking
from deploy.report.charts.radio import mocap, radio
from deploy.report.charts.search import ergodicity, groups, meetings


def all_charts(analysis: FlightAnalysis) -> list[Chart]:
    """Every chart there is data for, in the order of the page."""
    makers = (
        ergodicity,
        groups,
        meetings,
        separation,
        altitude,
        tracking,
        attitude,
        motors,
        battery,
        radio,
        mocap,
    )
    return [chart for make in makers if (chart := make(analysis)) is not None]
