"""Motion capture to drones: what cannot be is kept from them (mocap/gate.py), newest pose first, stale ones dropped."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

from deploy.flightlog.writer import FlightLog
from deploy.radio.fleet import Fleet
from mocap.gate import Gate, Incident
from mocap.source import MocapFrame, MocapSource, Pose
from mocap.track import Word

Vec3 = tuple[float, float, float]
STALE = 0.1  # s; an older pose would pull the estimate back
HEALTH_OVER = 1.0  # s that the state of the motion capture is told of


@dataclass(frozen=True)
class Located:
    """Where a robot was seen, and when (flight clock)."""

    t: float
    pose: Pose


@dataclass(frozen=True)
class Arrival:
    """A frame: when it was measured (flight clock), and how much later it could be used [s]."""

    t: float
    delay: float


class Poses:
    """The poses of all robots, and the pump that sends them on.

    Args:
        source: motion capture; None when the drones position themselves.
        bodies: rigid body by robot. rates: poses sent to each drone [Hz].
        fleet: who gets them. log: where they are recorded.
    """

    def __init__(
        self,
        source: MocapSource | None,
        bodies: Mapping[str, str],
        rates: Mapping[str, float],
        fleet: Fleet,
        log: FlightLog,
    ) -> None:
        self._source, self._bodies, self._fleet, self._log = source, dict(bodies), fleet, log
        self._periods = {robot: 1.0 / rate for robot, rate in rates.items()}
        self._due = dict.fromkeys(bodies, -math.inf)
        self._newest: dict[str, Located] = {}
        self._arrivals: deque[Arrival] = deque(maxlen=1000)
        self._sent: deque[float] = deque(maxlen=10_000)
        self._last: MocapFrame | None = None
        self._gate = Gate(bodies, self._word)

    @property
    def external(self) -> bool:
        """Whether there is motion capture at all."""
        return self._source is not None

    def close_gate(self) -> None:
        """Everybody was seen where he should be: from now on names and jumps are not believed without a witness."""
        self._gate.close()

    def pump(self, now: float) -> list[Incident]:
        """Take what motion capture has and send each drone its newest pose when it is due; returns what was odd.

        Raises:
            MocapError: motion capture is gone.
        """
        incidents: list[Incident] = []
        if self._source is None:
            return incidents
        for frame in self._source.poll():
            self._arrivals.append(Arrival(frame.t, now - frame.t))
            self._last = frame
            if frame.points:
                flat = [coordinate for point in frame.points for coordinate in point]
                self._log.write("/mocap/points", frame.t, {"points": flat})
            admitted = self._gate.admit(frame)
            incidents += admitted.incidents
            self._newest |= {robot: Located(frame.t, pose) for robot, pose in admitted.poses.items()}
        for robot, seen in self._newest.items():
            # Half a tick of grace: a period that is no multiple of the tick must not lose every other pose.
            if now - seen.t <= STALE and seen.t >= self._due[robot] - 0.005:
                self._due[robot] = max(self._due[robot] + self._periods[robot], seen.t + 0.5 * self._periods[robot])
                self._fleet[robot].send_pose(seen.pose.position, seen.pose.quaternion)
                self._sent.append(now)
                self._log.pose(robot, seen.t, seen.pose.position, seen.pose.quaternion)
        return incidents

    def send_no_more(self, robot: str) -> None:
        """Still look where a robot is, but send it no poses: nobody listens."""
        self._due[robot] = math.inf

    def located(self, robot: str) -> Located | None:
        """Where a robot is: seen by motion capture, or by its own estimate if there is none."""
        if self._source is not None:
            return self._newest.get(robot)
        estimate = self._fleet[robot].estimate
        return None if estimate is None else Located(estimate.t, Pose(estimate.position))

    def record_health(self, now: float) -> None:
        """Write the state of the motion capture to the log; about once a second."""
        if self._source is None:
            return
        since = now - HEALTH_OVER
        while self._arrivals and self._arrivals[0].t <= since:
            self._arrivals.popleft()
        while self._sent and self._sent[0] <= since:
            self._sent.popleft()
        # Frames may come out of order; what is sent is in the order of the flight clock.
        delays = [1000.0 * arrival.delay for arrival in self._arrivals if arrival.t > since]
        bodies = self._last.bodies if self._last else {}
        doubtful = self._last.doubtful if self._last else ()
        record = {
            "rate": len(delays) / HEALTH_OVER,
            "age": now - self._last.t if self._last else None,
            "latency_ms": sum(delays) / len(delays) if delays else None,
            "worst_latency_ms": max(delays, default=None),
            "stale": sum(delay > 1000.0 * STALE for delay in delays),
            "sent": len(self._sent) / HEALTH_OVER,
            "bodies": len(bodies),
            "points": len(self._last.points) if self._last else 0,
            "missing": [robot for robot, body in self._bodies.items() if body not in bodies],
            "doubtful": [robot for robot, body in self._bodies.items() if body in doubtful],
            "refused": list(self._gate.refused),
        }
        self._log.write("/mocap", now, record)

    def _word(self, robot: str) -> Word | None:
        """What a robot says of itself; those whose link is gone say nothing, by the age of what they said."""
        drone = self._fleet.get(robot)
        estimate = None if drone is None else drone.estimate
        return None if estimate is None else Word(estimate.t, estimate.position, estimate.velocity, estimate.rpy)


def heading(pose: Pose) -> float:
    """Yaw [rad] of a pose; 0 if its orientation is not known."""
    if pose.quaternion is None:
        return 0.0
    x, y, z, w = pose.quaternion
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
