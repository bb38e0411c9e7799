"""What drones tell of motors and attitude, as arrays."""

from __future__ import annotations

import numpy as np

from deploy.flightlog.reader import FlightRecord
from missions.arrays import Array

MOTOR_RANGE = 65535.0


def motor_share(record: FlightRecord, robot: str) -> tuple[Array, Array]:
    """Flight clock (S,) [s] and what each motor was commanded (S, 4), 0 to 1; empty without such telemetry."""
    series = record.of(robot, "motors")
    if series is None:
        return np.empty(0), np.empty((0, 4))
    share = np.stack([series[f"m{k}"] for k in (1, 2, 3, 4)], axis=1) / MOTOR_RANGE
    known = np.isfinite(share).all(axis=1)
    return series.t[known], share[known]


def tilt_angles(record: FlightRecord, robot: str) -> tuple[Array, Array]:
    """Flight clock (S,) [s] and the angle between the drone's vertical and the world's (S,) [rad]."""
    series = record.of(robot, "estimate")
    if series is None:
        return np.empty(0), np.empty(0)
    roll, pitch = series["attitude"][:, 0], series["attitude"][:, 1]
    known = np.isfinite(roll) & np.isfinite(pitch)
    return series.t[known], np.arccos(np.clip(np.cos(roll[known]) * np.cos(pitch[known]), -1.0, 1.0))
