"""Telemetry to the flight log, and the list of everything that went wrong."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Unpack

from deploy.flight.courses import Courses
from deploy.flightlog.events import Details
from deploy.flightlog.writer import FlightLog
from deploy.phases import Phase
from deploy.radio.drone import Drone
from deploy.radio.telemetry import Estimate, Record, Status, Target


class Journal:
    """What the flight writes down.

    Args:
        log: where. rate: of references [Hz].

    Attributes:
        faults, warnings: texts, in order. message: newest event.
    """

    def __init__(self, log: FlightLog, rate: float) -> None:
        self.log = log
        self._period, self._due = 1.0 / rate, -math.inf
        self.faults: list[str] = []
        self.warnings: list[str] = []
        self.message = ""
        self._lost, self._failed = 0, False

    def event(self, t: float, phase: Phase, name: str, text: str, **details: Unpack[Details]) -> None:
        """Something that happened at flight time t [s]."""
        self.log.event(t, name, text, phase=phase.value, **details)
        robot, level = details.get("robot"), details.get("level")
        self.message = f"{robot}: {text}" if robot else text
        if level == "fault":
            self.faults.append(self.message)
        elif level == "warning":
            self.warnings.append(self.message)

    def telemetry(self, robot: str, record: Record) -> None:
        """One telemetry record."""
        if isinstance(record, Estimate):
            self.log.estimate(robot, record.t, record.position, record.velocity, record.rpy, record.tick)
        elif isinstance(record, Target):
            self.log.setpoint(robot, record.t, record.position, record.velocity, record.yaw_rate, record.tick)
        elif isinstance(record, Status):
            self.log.battery(robot, record.t, record.voltage, record.level, record.power_state)
            self.log.supervisor(robot, record.t, record.supervisor.bits, record.supervisor.names)
            self.log.motors(robot, record.t, record.motors)

    def references(self, now: float, courses: Courses, robots: Iterable[str]) -> None:
        """Where robots should be in the search, when that is due."""
        if now < self._due - 1e-9:
            return
        self._due = now + self._period
        for name in robots:
            self.log.reference(name, now, courses.reference(name, now), courses.velocity(name, now))

    def log_state(self, t: float, phase: Phase) -> None:
        """Say once that the log has ended, and whenever it has lost more; the flight goes on all the same."""
        lost, failure = self.log.dropped, self.log.failure
        if failure and not self._failed:
            self._failed = True
            self.event(t, phase, "log", f"the flight log cannot be written any more: {failure}", level="warning")
        elif lost > self._lost and not failure:
            text = f"the flight log has lost {lost} records: the disk cannot keep up"
            self.event(t, phase, "log", text, level="warning", value=float(lost))
        self._lost = lost

    def link(self, t: float, drone: Drone) -> None:
        """The state of a drone's link."""
        state = drone.link
        self.log.link(
            drone.name,
            t,
            latency_ms=_known(state.latency),
            quality=_known(state.quality),
            rssi=_known(state.rssi),
            sent=state.sent,
            received=state.received,
            lost=state.unanswered,
        )


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value
