"""What the firmware's arithmetic and clock make of the bytes, bounded.

The high-level commander evaluates in float32, by Horner's rule, at float32 seconds since boot, 100 times a second
(crazyflie-firmware pptraj.c, crtp_commander_high_level.c). Everything else in the certificate is about the exact
polynomials of the same numbers; what lies between is bounded here and has to stay below the distances' tolerance.
Compressed pieces are first converted to powers of time, in float32 too; that error is not in the bound (4e-7 m in
recordings of the firmware, tests/golden/compressed.json.gz).
"""

from __future__ import annotations

import numpy as np

from planner.certificate.checks import DISTANCE_TOLERANCE, check
from planner.certificate.motion import Worst, largest_speed
from planner.certificate.record import Check
from planner.trajectory.piecewise import PiecewisePolynomial

UPTIME = 3600.0  # [s] since boot at which a search still may start; the clock gets coarser with time
TICK = 0.01  # [s] between two setpoints of the commander

_ROUNDOFF = 2.0**-24  # of one float32 operation, relative
_OPERATIONS = 14  # of Horner's rule in degree 7


def firmware_checks(name: str, flown: PiecewisePolynomial) -> list[Check]:
    """Rounding of positions, and pieces that the firmware may skip."""
    rounding = float32_rounding(flown)
    shortest = int(np.argmin(flown.durations))
    length, begin = float(flown.durations[shortest]), float(flown.knots()[shortest])
    return [
        check("float32 rounding", rounding.value, DISTANCE_TOLERANCE, "m", "<=", name, rounding.time),
        check("shortest piece", length, TICK, "s", ">=", name, begin, severity="warning"),
    ]


def float32_rounding(flown: PiecewisePolynomial) -> Worst:
    """Bound of how far float32 positions are from exact ones [m], and the beginning of the worst piece [s].

    Horner's rule in degree n errs by at most γ_2n Σ |c_k| t^k (Higham, Accuracy and Stability of Numerical
    Algorithms, section 5.1); the clock by the spacing of float32 at the time of evaluation, times the speed.
    """
    gamma = _OPERATIONS * _ROUNDOFF / (1.0 - _OPERATIONS * _ROUNDOFF)
    powers = flown.durations[:, None] ** np.arange(8)
    sizes = np.einsum("mak,mk->ma", np.abs(flown.coefficients[:, :3]), powers)
    evaluation = gamma * np.linalg.norm(sizes, axis=1)
    clock = largest_speed(flown).value * float(np.spacing(np.float32(UPTIME + flown.duration)))
    worst = int(np.argmax(evaluation))
    return Worst(float(evaluation[worst]) + clock, float(flown.knots()[worst]))
