"""Checks of what a mission says about planning anew in flight."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable
from itertools import pairwise

from missions.errors import MissionError
from missions.schema import DoubleIntegratorModel, FixedYaw, Mission
from missions.validate_information import check_information

ErrorAt = Callable[[str, str], MissionError]
SHORTEST = 8.0  # [s] between joints: while one leg flies, two versions of the next are uploaded


def check_replanning(mission: Mission, error: ErrorAt) -> None:
    """Check joints and changes.

    Raises:
        MissionError: the first thing found wrong.
    """
    replanning = mission.replanning
    if not replanning.joints:
        if replanning.changes:
            raise error("got changes without joints; allowed: joints at which they can be flown", "replanning.changes")
        return
    _check_kind(mission, error)
    _check_joints(mission, error)
    for number, change in enumerate(replanning.changes):
        where = f"replanning.changes[{number}]"
        before = replanning.changes[number - 1].time if number else 0.0
        if change.time < before:
            raise error(f"got {change.time:g}; allowed: {before:g} or later [s], in order", f"{where}.time")
        if change.time + replanning.budget >= replanning.joints[-1]:
            latest = replanning.joints[-1] - replanning.budget
            raise error(
                f"got {change.time:g}; allowed: before {latest:g} [s], a budget before the last joint", f"{where}.time"
            )
        changed = dataclasses.replace(mission, information=change.information)
        check_information(changed, lambda reason, inside, where=where: error(reason, f"{where}.{inside}"))  # type: ignore[misc]


def _check_kind(mission: Mission, error: ErrorAt) -> None:
    if mission.trajectory.encoding == "poly4d":
        reason = "got poly4d with joints to plan anew at; allowed: auto or compressed, of which two versions fit"
        raise error(reason, "trajectory.encoding")
    if not isinstance(mission.trajectory.yaw, FixedYaw):
        reason = f"got {mission.trajectory.yaw.type} with joints to plan anew at; allowed: fixed"
        raise error(reason, "trajectory.yaw")
    if mission.footprint is not None:
        raise error("got joints with a footprint; allowed: one of them", "replanning.joints")
    if not isinstance(mission.dynamics, DoubleIntegratorModel):
        raise error("got joints; allowed: with double-integrator dynamics, which fly", "replanning.joints")


def _check_joints(mission: Mission, error: ErrorAt) -> None:
    dt, duration = mission.horizon.dt, mission.horizon.duration
    for number, joint in enumerate(mission.replanning.joints):
        if not math.isclose(joint / dt, round(joint / dt), abs_tol=1e-6):
            raise error(f"got {joint:g}; allowed: whole multiples of dt = {dt:g} [s]", f"replanning.joints[{number}]")
    for number, (before, after) in enumerate(pairwise((0.0, *mission.replanning.joints, duration))):
        if after - before < SHORTEST - 1e-9:
            last = number == len(mission.replanning.joints)
            allowed = f"at least {SHORTEST:g} s from one to the next, and to the beginning and the end"
            raise error(f"got {before if last else after:g}; allowed: {allowed}", f"replanning.joints[{number - last}]")
