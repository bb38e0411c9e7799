"""A flight log to everything that can be said about the flight."""

from __future__ import annotations

import numpy as np

from deploy.analysis.align import flown_motion, mission_window
from deploy.analysis.coverage import coverage
from deploy.analysis.health import battery_use, link_use, pose_feed
from deploy.analysis.meetings import meetings
from deploy.analysis.record import FlightAnalysis
from deploy.analysis.separation import separation
from deploy.analysis.switches import flown_switches, timelines
from deploy.analysis.timing import Timing, timing
from deploy.analysis.tracking import Tracking, track
from deploy.flightlog.reader import FlightRecord
from planner.flightplan import FlightPlan
from planner.subset import without
from planner.trajectory.encode import decode


def analyse(record: FlightRecord) -> FlightAnalysis:
    """Judge a flight from its log; works on whatever part of a flight the log holds.

    Raises:
        LogFileError: the log holds no readable flight plan.
    """
    flown_plan = _of_those_who_flew(record)
    mission, certificate = flown_plan.mission, flown_plan.certificate
    names = tuple(robot.name for robot in mission.robots)
    references = {name: decode(encoded) for name, encoded in flown_plan.trajectories.items()}
    duration = max(reference.duration for reference in references.values())
    window, motion = mission_window(record, duration), flown_motion(record, names)
    search = motion.during(window) if motion is not None and window is not None else None
    covered = coverage(mission, flown_plan.plan, certificate.indicators, references, motion, window)
    tracking: tuple[Tracking, ...] = ()
    timings: tuple[Timing, ...] = ()
    if motion is not None and window is not None:
        course = timelines(record, flown_plan, window)
        timings = tuple(timing(record, name, window, references[name], course[name]) for name in names)
        tracking = tuple(track(name, i, motion, window, references[name], course[name]) for i, name in enumerate(names))
    nobody = np.empty((0, len(names), 3))
    apart = separation(mission, motion, search[1] if search else nobody) if motion is not None else None
    return FlightAnalysis(
        record=record,
        flight_plan=flown_plan,
        window=window,
        motion=motion,
        coverage=covered,
        tracking=tracking,
        timings=timings,
        switches=flown_switches(record, flown_plan, references),
        separation=apart,
        meetings=meetings(mission, references, search, certificate.indicators, covered.flown),
        batteries=tuple(battery_use(record, name, window, mission.safety.battery_limit) for name in names),
        links=tuple(link_use(record, name) for name in names),
        feeds=tuple(pose_feed(record, name) for name in names),
    )


def _of_those_who_flew(record: FlightRecord) -> FlightPlan:
    """The plan without those who were left behind on the ground: what was certified anew, and flown."""
    left = {event.robot for event in record.events if event.name == "left_behind"}
    plan = record.flight_plan
    return without(plan, left) if left and left < set(plan.trajectories) else plan
