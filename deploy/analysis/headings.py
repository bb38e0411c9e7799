"""How motion capture and a drone's own estimate disagree, all along."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from deploy.analysis.align import MissionWindow, sample
from deploy.flightlog.reader import FlightRecord
from missions.arrays import Array

_LEAST = 20  # samples
_STEADY = 3.0  # an offset is this many times its scatter


class Offsets(NamedTuple):
    """Of one robot: yaw of its pose less its own [rad], tilt between the two [rad], distance between the two [m]."""

    yaw: float
    tilt: float
    beside: float


def heading_offsets(record: FlightRecord, robot: str, window: MissionWindow | None) -> Offsets | None:
    """Constant disagreements over the search; what changes counts as none. None without both sources."""
    pose, estimate = record.of(robot, "pose"), record.of(robot, "estimate")
    if window is None or pose is None or estimate is None:
        return None
    use = (estimate.t >= window.start) & (estimate.t <= window.end)
    t = estimate.t[use]
    if len(t) < _LEAST or len(pose) < _LEAST:
        return None
    apart = estimate["position"][use] - sample(pose, "position", t)
    beside = _constant(apart[np.isfinite(apart).all(axis=1)])
    quaternions = pose["orientation"]
    if np.ptp(quaternions, axis=0).max() < 1e-6:  # positions only: their orientation says nothing
        return Offsets(0.0, 0.0, float(np.linalg.norm(beside)))
    nearest = np.clip(np.searchsorted(pose.t, t), 0, len(pose) - 1)
    angles = _angles(quaternions[nearest]) - estimate["attitude"][use]
    angles = (angles + np.pi) % (2.0 * np.pi) - np.pi
    roll, pitch, yaw = _constant(angles[np.isfinite(angles).all(axis=1)])
    return Offsets(float(yaw), float(np.hypot(roll, pitch)), float(np.linalg.norm(beside)))


def _constant(values: Array) -> Array:
    """Medians (3,) where they are beyond their scatter, else zero."""
    if len(values) < _LEAST:
        return np.zeros(3)
    middle = np.median(values, axis=0)
    scatter = np.median(np.abs(values - middle), axis=0)
    out: Array = np.where(np.abs(middle) > _STEADY * scatter, middle, 0.0)
    return out


def _angles(q: Array) -> Array:
    """Roll, pitch, yaw (S, 3) [rad] of quaternions x, y, z, w (S, 4), body to world."""
    x, y, z, w = q.T
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x**2 + y**2))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y**2 + z**2))
    return np.stack([roll, pitch, yaw], axis=1)
