"""Frames that do not agree: a constant turn or shift between motion capture, plan, and the drones' own estimates."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from deploy.analysis.evidence import Evidence, Mask
from deploy.analysis.findings import Finding, Level
from deploy.analysis.headings import heading_offsets
from deploy.analysis.tracking import Tracking
from missions.arrays import Array

_LEAST = 2.0  # s of flight that are told anything by
_SHIFT = 0.02  # m
_TURN = math.radians(1.0)
_EXPLAINED = 0.4  # of the mean square deviation may be left
_HALVES = 0.3  # by how much, relatively, the two halves of a flight may differ: what changes is no frame
_HEADING = math.radians(4.0)
_BESIDE = 0.03  # m between a drone's own estimate and motion capture


class Fit(NamedTuple):
    """A turn [rad] about ``centre`` [m] and a shift (3,) [m] from plan to flight; ``left`` of the mean square."""

    turn: float
    shift: Array
    centre: Array
    left: float
    before: float


def frames(e: Evidence) -> Iterator[Finding]:
    """The whole swarm's frame, then single robots' rigid bodies."""
    tracks = [(track, seen) for track, seen in e.followed() if _long(track, seen)]
    if not tracks:
        return
    motions = [_motion(track, seen) for track, seen in tracks]
    fit = _constant(motions)
    if fit is not None and (len(tracks) > 1 or abs(fit.turn) > _TURN):
        yield _frame(fit)
        told = set(e.names)
    else:
        bodies = {track.robot: _constant([motion], False) for (track, _), motion in zip(tracks, motions, strict=True)}
        yield from (_body(robot, own) for robot, own in bodies.items() if own is not None)
        told = {robot for robot, own in bodies.items() if own is not None}
    yield from _headings(e, told)


def fitted(r: Array, q: Array, turning: bool = True) -> Fit:
    """The turn about the vertical and the shift that bring r (S, 3) nearest to q (S, 3), by least squares."""
    centre = r.mean(axis=0)
    x, y = r - centre, q - q.mean(axis=0)
    cross = (x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]).sum()
    turn = math.atan2(cross, (x[:, :2] * y[:, :2]).sum()) if turning else 0.0
    shift = q.mean(axis=0) - centre
    c, s = math.cos(turn), math.sin(turn)
    moved = centre + shift + x @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    before = float(((q - r) ** 2).sum(axis=1).mean())
    left = float(((q - moved) ** 2).sum(axis=1).mean())
    return Fit(turn, shift, centre, left / before if before > 0.0 else 1.0, before)


def _long(track: Tracking, seen: Mask) -> bool:
    return bool(track.t[seen][-1] - track.t[seen][0] >= _LEAST)


def _motion(track: Tracking, seen: Mask) -> tuple[Array, Array]:
    """Where a robot should have been, as late as it flew, and where it was: (S, 3) each [m]."""
    lag = 0.0 if math.isnan(track.mean_lag) else track.mean_lag
    speed = np.gradient(track.reference, track.t, axis=0)
    return (track.reference - lag * speed)[seen], (track.reference + track.deviation)[seen]


def _constant(motions: list[tuple[Array, Array]], turning: bool = True) -> Fit | None:
    """What everybody's deviation is explained by from beginning to end; None if nothing does."""
    whole = fitted(*_joined(motions), turning)
    if whole.left > _EXPLAINED or (np.abs(whole.shift).max() < _SHIFT and abs(whole.turn) < _TURN):
        return None
    halves = [
        fitted(*_joined([(r[part], q[part]) for r, q in motions for part in [_half(len(r), late)]]), turning)
        for late in (False, True)
    ]
    size = max(float(np.linalg.norm(whole.shift)), _SHIFT)
    steady = all(
        np.linalg.norm(half.shift - whole.shift) < _HALVES * size + _reach(whole, half)
        and abs(half.turn - whole.turn) < max(_HALVES * abs(whole.turn), _TURN)
        for half in halves
    )
    return whole if steady else None


def _reach(whole: Fit, half: Fit) -> float:
    """How much the shift of a half differs only because that half turns about another centre [m]."""
    return abs(whole.turn) * float(np.linalg.norm(half.centre - whole.centre))


def _half(n: int, late: bool) -> slice:
    return slice(n // 2, None) if late else slice(None, n // 2)


def _joined(motions: list[tuple[Array, Array]]) -> tuple[Array, Array]:
    return np.concatenate([r for r, _ in motions]), np.concatenate([q for _, q in motions])


def _frame(fit: Fit) -> Finding:
    parts = []
    if abs(fit.turn) >= _TURN:
        x, y = fit.centre[:2]
        parts.append(f"turned by {math.degrees(fit.turn):+.1f}° about ({x:.1f}, {y:.1f}) m")
    if np.abs(fit.shift).max() >= _SHIFT:
        parts.append(f"shifted by {_centimetres(fit.shift)}")
    text = f"everybody flew the plan {' and '.join(parts)}: motion capture and plan do not share a frame"
    remedy = "calibrate the origin and axes again, or set motion_capture.origin and yaw"
    return Finding(Level.WARN, "frame alignment", text, remedy, cause=True)


def _body(robot: str, fit: Fit) -> Finding:
    text = f"{robot} flew {_centimetres(fit.shift)} beside its trajectory all along"
    remedy = "its rigid body's centre is not the drone's, or it is out of trim: define the body again"
    return Finding(Level.WARN, "rigid body", text, remedy, (robot,), cause=True)


def _centimetres(shift: Array) -> str:
    x, y, z = (round(100.0 * value, 1) + 0.0 for value in shift.tolist())  # + 0.0: no "-0.0"
    return f"({x:+.1f}, {y:+.1f}, {z:+.1f}) cm"


def _headings(e: Evidence, told: set[str]) -> Iterator[Finding]:
    """What motion capture and the drones' own estimates disagree about; shifts that are ``told`` are not told again."""
    for name in e.names:
        found = heading_offsets(e.record, name, e.window)
        if found is None:
            continue
        if abs(found.yaw) > _HEADING:
            text = f"{name}'s rigid body is turned by {math.degrees(found.yaw):+.0f}° against the drone's own heading"
            remedy = "define it while the drone looks along x, or start the drone with the body's heading"
            yield Finding(Level.WARN, "frame alignment", text, remedy, (name,), cause=True)
        if found.tilt > _HEADING:
            text = f"{name}'s rigid body is tilted by {math.degrees(found.tilt):.0f}° against the drone"
            yield Finding(
                Level.WARN, "frame alignment", text, "define it while the drone stands level", (name,), cause=True
            )
        if found.beside > _BESIDE and name not in told:
            text = f"{name} believed to be {found.beside * 100:.0f} cm beside where motion capture saw it, all along"
            remedy = "one of its position sources is calibrated wrongly: fly with one, or align both"
            yield Finding(Level.WARN, "frame alignment", text, remedy, (name,), cause=True)
