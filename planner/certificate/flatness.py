"""What a trajectory asks of a drone, by differential flatness (Mellinger and Kumar, ICRA 2011).

With mass m and linear drag D the motors have to push with m f, f = a + g e3 + (D/m) v: a polynomial. Its direction is
the body's z axis b3, so with s = |f|

    collective thrust    m s
    tilt                 atan(√(f_x² + f_y²) / f_z)
    roll and pitch rate  ω = |ḃ3| = |f × ḟ| / s²

Drag is taken alike along all body axes, its largest coefficient (Faessler et al., RA-L 2018: then flatness is exact);
at 1 m/s the difference is below 0.3 % of the weight. Bounds hold inside the pieces, in continuous time; joints have
checks of their own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.airframes import GRAVITY, Airframe
from missions.arrays import Array
from planner.certificate.bernstein import (
    derivative,
    elevate,
    halves,
    minimise,
    negative_root,
    product,
    root,
    square_sum,
)
from planner.certificate.motion import Worst
from planner.certificate.rational import largest_ratio
from planner.trajectory.bezier import control_points
from planner.trajectory.piecewise import PiecewisePolynomial

RESOLUTION = 1e-3  # [m/s²] of thrust per mass, [rad] of tilt, [rad/s] of rates
_HALVINGS = 3  # before the motors' bound, which is not closed any further
_FREE_FALL = 1e-3  # [m/s²] of thrust per mass: below it directions mean nothing


@dataclass(frozen=True)
class Demands:
    """What one trajectory asks of one drone: bounds that nothing exceeds, and when they are (nearly) reached.

    Attributes:
        thrust: largest collective thrust [N]. least_thrust: smallest [N].
        tilt: largest angle of the body's z axis from the vertical [rad]; π if it is not below 90°.
        rate: largest roll and pitch rate together [rad/s].
        yaw_rate: largest rate of the yaw angle [rad/s].
        motor: largest thrust of any motor [N]. least_motor: smallest [N].
    """

    thrust: Worst
    least_thrust: Worst
    tilt: Worst
    rate: Worst
    yaw_rate: Worst
    motor: Worst
    least_motor: Worst


def demands(trajectory: PiecewisePolynomial, airframe: Airframe) -> Demands:
    """Bounds of everything a trajectory asks of an airframe."""
    f = specific_thrust(trajectory, airframe)
    knots, h, m = trajectory.knots(), trajectory.durations, airframe.mass
    start, end, one = knots[:-1], knots[1:], np.zeros(len(h), dtype=np.intp)
    squares = square_sum(f)  # (M, 13)
    low = minimise(squares, start, end, one, 1, RESOLUTION, root)
    high = minimise(-squares, start, end, one, 1, RESOLUTION, negative_root)
    yaw = yaw_points(trajectory)
    turning = derivative(yaw, h)
    both = np.concatenate([turning, -turning])
    spin = minimise(both, np.tile(start, 2), np.tile(end, 2), np.tile(one, 2), 1, RESOLUTION)
    yaw_rate = Worst(-float(spin.bound[0]), float(spin.time[0]))
    least = Worst(m * float(low.bound[0]), float(low.time[0]))
    tilt = _tilt(f, start, end)
    if least.value <= m * _FREE_FALL or tilt.value >= 0.5 * np.pi:
        rate, motors = Worst(np.inf, least.time), (Worst(np.inf, least.time), Worst(-np.inf, least.time))
    else:
        rate = _rate(f, derivative(f, h), squares, start, end)
        motors = _motors(f, yaw, trajectory, airframe)
    return Demands(Worst(-m * float(high.bound[0]), float(high.time[0])), least, tilt, rate, yaw_rate, *motors)


def specific_thrust(trajectory: PiecewisePolynomial, airframe: Airframe) -> Array:
    """(M, 3, 7) Bernstein coefficients of f, the motors' thrust over the mass, in the world [m/s²]."""
    h = trajectory.durations
    velocity = derivative(control_points(trajectory.coefficients[:, :3], h), h)  # (M, 3, 7)
    f: Array = elevate(derivative(velocity, h), 1) + (max(airframe.drag) / airframe.mass) * velocity
    f[:, 2] += GRAVITY
    return f


def yaw_points(trajectory: PiecewisePolynomial) -> Array:
    """(M, 8) Bernstein coefficients of yaw [rad]."""
    return control_points(trajectory.coefficients[:, 3], trajectory.durations)


def _tilt(f: Array, start: Array, end: Array) -> Worst:
    one = np.zeros(len(f), dtype=np.intp)
    upright = minimise(f[:, 2], start, end, one, 1, RESOLUTION)
    if upright.bound[0] <= _FREE_FALL:
        return Worst(np.pi, float(upright.time[0]))
    aside, up = square_sum(f[:, :2]), square_sum(f[:, 2:])
    bound, _, time = largest_ratio(aside, up, start, end, RESOLUTION, lambda r: np.arctan(root(r)))
    return Worst(bound, time)


def _rate(f: Array, f1: Array, squares: Array, start: Array, end: Array) -> Worst:
    """√(|f × ḟ|² / |f|⁴): degrees 22 and 24."""
    cross = np.stack([product(f[:, i], f1[:, j]) - product(f[:, j], f1[:, i]) for i, j in ((1, 2), (2, 0), (0, 1))], 1)
    bound, _, time = largest_ratio(
        elevate(square_sum(cross), 2), product(squares, squares), start, end, RESOLUTION, root
    )
    return Worst(bound, time)


# ------------------------------------------------------------------------------------------------ motors


def _motors(f: Array, yaw: Array, trajectory: PiecewisePolynomial, airframe: Airframe) -> tuple[Worst, Worst]:
    """Largest and smallest thrust of any motor [N]: a quarter of the thrust, and what the torques add at most.

    Each factor is bounded by itself, over eighths of pieces: on the safe side, not tight.
    """
    h, knots = trajectory.durations, trajectory.knots()
    f1 = derivative(f, h)
    f2 = derivative(f1, h)
    turn = derivative(yaw, h)
    turn1 = derivative(turn, h)
    parts = [_eighths(points) for points in (f, f1, f2, turn[:, None], turn1[:, None])]
    s_high, f1_high, f2_high, turn_high, turn1_high = (np.sqrt(square_sum(p).max(axis=-1)) for p in parts)
    s_low = np.sqrt(np.maximum(square_sum(parts[0]).min(axis=-1), _FREE_FALL**2))
    tilt = np.arctan2(np.sqrt(square_sum(parts[0][:, :2]).max(axis=-1)), np.maximum(parts[0][:, 2].min(axis=-1), 1e-9))
    roll_pitch, around_z = _torques(s_low, f1_high, f2_high, turn_high, turn1_high, tilt, airframe)
    lever = airframe.arm / np.sqrt(2.0)  # X configuration: both axes see the arm at 45 degrees
    share = 0.25 * (np.sqrt(2.0) * roll_pitch / lever + around_z / airframe.torque_per_thrust)
    high = 0.25 * airframe.mass * s_high + share
    low = 0.25 * airframe.mass * s_low - share
    times = np.concatenate([knots[:-1] + h * (k + 0.5) / 2**_HALVINGS for k in range(2**_HALVINGS)])
    top, bottom = int(np.argmax(high)), int(np.argmin(low))
    return Worst(float(high[top]), float(times[top])), Worst(float(low[bottom]), float(times[bottom]))


def _torques(
    s: Array, f1: Array, f2: Array, turn: Array, turn1: Array, tilt: Array, frame: Airframe
) -> tuple[Array, Array]:
    """Bounds of the torque in roll and pitch together, and in yaw [N m], from bounds of what causes them.

    ω = |ḃ3| ≤ |ḟ|/s and |b̈3| across b3 ≤ |f̈|/s + 2|ḟ|ω/s. The yaw angle ψ (Z-Y-X, roll φ, pitch θ, both within the
    tilt) gives r = ψ̇ cos θ/cos φ − q tan φ; with |φ̇|, |θ̇| ≤ E = (ω + |ψ̇| sin tilt)/cos tilt its derivative is bounded
    term by term. ω̇ across b3 ≤ |b̈3| + ω|r|. Euler's equation τ = J ω̇ + ω × J ω.

    Args:
        s: (B,) smallest |f|.
        f1: (B,) largest |ḟ|.
        f2: (B,) largest |f̈|.
        turn: (B,) largest |ψ̇|.
        turn1: (B,) largest |ψ̈|.
        tilt: (B,) largest.
        frame: the drone.
    """
    cosine, sine = np.cos(tilt), np.sin(tilt)
    w = f1 / s
    r = (turn + w * sine) / cosine
    w1 = f2 / s + 2.0 * f1 * w / s + w * r
    euler = (w + turn * sine) / cosine
    r1 = turn1 / cosine + 2.0 * turn * sine * euler / cosine**2 + w1 * sine / cosine + w * euler / cosine**2
    jx, jy, jz = frame.inertia
    return max(jx, jy) * w1 + (jz - min(jx, jy)) * w * r, jz * r1 + abs(jy - jx) * w**2


def _eighths(points: Array) -> Array:
    """Bernstein coefficients on all eighths of the pieces, ordered by eighth, then piece."""
    left, right = halves(points.shape[-1] - 1)
    parts = [points]
    for _ in range(_HALVINGS):
        parts = [part @ half.T for part in parts for half in (left, right)]
    return np.concatenate(parts)
