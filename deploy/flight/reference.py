"""Where one robot should be at one time after another, as the flight asks for it twenty times a second."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass

from planner.trajectory.piecewise import PiecewisePolynomial

Vec3 = tuple[float, float, float]
_ZERO: Vec3 = (0.0, 0.0, 0.0)


class Reference:
    """Position and velocity of a trajectory at single times.

    The same answers as :meth:`PiecewisePolynomial.evaluate`, in plain floats: arrays pay off for many times at once,
    and cost thirty times as much for one.

    Args:
        trajectory: what to follow.
    """

    def __init__(self, trajectory: PiecewisePolynomial) -> None:
        self._knots = trajectory.knots().tolist()
        self._durations = trajectory.durations.tolist()
        # Descending powers, for Horner's rule; x, y, z only.
        self._pieces = [[axis[::-1] for axis in piece[:3]] for piece in trajectory.coefficients.tolist()]

    def position(self, t: float) -> Vec3:
        """Where it is [m] at t [s] after its start; the first or last point before and after."""
        piece, tau = self._locate(t)
        x, y, z = (_value(axis, tau) for axis in self._pieces[piece])
        return x, y, z

    def velocity(self, t: float) -> Vec3:
        """How fast it moves [m/s]; zero before and after."""
        if not 0.0 <= t <= self._knots[-1]:
            return _ZERO
        piece, tau = self._locate(t)
        x, y, z = (_slope(axis, tau) for axis in self._pieces[piece])
        return x, y, z

    def _locate(self, t: float) -> tuple[int, float]:
        """The piece that answers (at a joint the later one) and the time since its start."""
        piece = min(max(bisect_right(self._knots, t) - 1, 0), len(self._pieces) - 1)
        return piece, min(max(t - self._knots[piece], 0.0), self._durations[piece])


@dataclass(frozen=True)
class Way:
    """A straight move from rest to rest, as the high-level commander flies it (planner/transfers.py).

    Attributes:
        origin, target: [m]. begun: by flight clock [s]. duration: [s].
    """

    origin: Vec3
    target: Vec3
    begun: float
    duration: float

    def position(self, t: float) -> Vec3:
        """Where it is [m] at a flight time [s]; the first or last point before and after."""
        s = min(max((t - self.begun) / self.duration, 0.0), 1.0)
        share = s**4 * (35.0 - s * (84.0 - s * (70.0 - s * 20.0)))
        x, y, z = (a + share * (b - a) for a, b in zip(self.origin, self.target, strict=True))
        return x, y, z


def _value(descending: list[float], t: float) -> float:
    value = 0.0
    for coefficient in descending:
        value = value * t + coefficient
    return value


def _slope(descending: list[float], t: float) -> float:
    slope, degree = 0.0, len(descending) - 1
    for power, coefficient in zip(range(degree, 0, -1), descending, strict=False):
        slope = slope * t + power * coefficient
    return slope
