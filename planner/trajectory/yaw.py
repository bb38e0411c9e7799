"""Where robots look: the heading as a motion of its own, fitted on the knots of the way.

What is wanted (along the path, at a point) says nothing where the robot hardly moves or stands on the point, and jumps
by half a turn where it reverses. So the wish is made a motion that can be flown, in three steps on a fine grid:

1. unwrapped, with directions from less than :data:`SLOW` m/s (or metres) faded out by their neighbours;
2. no faster than the limit: half way between the least function above and the greatest below that turn no faster
   (θ⁺(t) = min over s of θ(s) + ω|t − s|, θ⁻(t) = max over s of θ(s) − ω|t − s|), which begins to turn in time;
3. averaged over a window with a kernel that is three times continuous, ends at rest.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array
from missions.trajectory import FacingYaw, FixedYaw, Yaw
from planner.trajectory.regression import Motion

SLOW = 0.1  # [m/s] or [m], below which a direction means little
WINDOW = 0.6  # [s] half width of the average
RESERVE = 0.9  # share of the rate limit that the wish may use; the rest is the fit's
_STEP = 0.05  # [s] of the grid, at most
_MEMORY = 1.0  # [s] over which directions that mean something fill gaps


@dataclass(frozen=True)
class Heading:
    """A heading between samples, with its first two derivatives; constant before and after.

    Attributes:
        t: (K,) equal steps [s]. angle, rate, bend: (K,) [rad], [rad/s], [rad/s²].
    """

    t: Array
    angle: Array
    rate: Array
    bend: Array

    def __call__(self, t: Array, derivative: int = 0) -> Array:
        """(len(t), 1) values of a derivative, up to the second."""
        return np.interp(t, self.t, (self.angle, self.rate, self.bend)[derivative])[:, None]


def heading(way: Motion, end: float, wanted: Yaw, rate: float) -> Heading:
    """The heading that comes closest to what is wanted and can be flown.

    Args:
        way: positions of the robot [m], x and y first.
        end: how long it lasts [s].
        wanted: where to look.
        rate: fastest turn [rad/s].
    """
    count = int(np.ceil(end / _STEP)) + 1
    t = np.linspace(0.0, end, count)
    if isinstance(wanted, FixedYaw):
        zero = np.zeros(count)
        return Heading(t, zero + wanted.angle, zero, zero)
    arrow = np.asarray(wanted.point) - way(t)[:, :2] if isinstance(wanted, FacingYaw) else way(t, 1)[:, :2]
    step = end / (count - 1)
    angle = _limited(_direction(arrow, step), RESERVE * rate * step)
    return _smoothed(t, angle, step)


def _direction(arrow: Array, step: float) -> Array:
    """(K,) unwrapped angle of arrows (K, 2); short ones point where their neighbours do, the more the shorter."""
    length = np.linalg.norm(arrow, axis=1)
    trust = length**2 / (length**2 + SLOW**2)
    unit = arrow / np.maximum(length, 1e-12)[:, None]
    reach = int(np.ceil(4 * _MEMORY / step))
    kernel = np.exp(-0.5 * (np.arange(-reach, reach + 1) * step / _MEMORY) ** 2)
    around = np.stack([np.convolve(trust * unit[:, axis], kernel)[reach : reach + len(length)] for axis in (0, 1)], 1)
    around /= np.maximum(np.linalg.norm(around, axis=1), 1e-12)[:, None]
    blend = trust[:, None] * unit + (1.0 - trust[:, None]) * around
    return np.unwrap(np.arctan2(blend[:, 1], blend[:, 0]))


def _limited(angle: Array, turn: float) -> Array:
    """(K,) the angle half way between its two hulls that change by at most ``turn`` a sample."""
    ramp = turn * np.arange(len(angle))
    above = np.minimum(
        np.minimum.accumulate(angle - ramp) + ramp, (np.minimum.accumulate((angle + ramp)[::-1])[::-1]) - ramp
    )
    below = np.maximum(
        np.maximum.accumulate(angle + ramp) - ramp, (np.maximum.accumulate((angle - ramp)[::-1])[::-1]) + ramp
    )
    return np.asarray(0.5 * (above + below))


def _smoothed(t: Array, angle: Array, step: float) -> Heading:
    """Averaged over ±:data:`WINDOW`; constant over that window at the ends, so that it starts and ends at rest."""
    half = max(1, min(round(WINDOW / step), (len(angle) - 1) // 4))
    calm = angle.copy()
    calm[:half], calm[len(angle) - half :] = angle[half], angle[-half - 1]
    padded = np.concatenate([np.full(half, calm[0]), calm, np.full(half, calm[-1])])
    u = np.arange(-half, half + 1) / (half + 1)
    weight = (1.0 - u**2) ** 3
    mean = np.convolve(padded, weight / weight.sum(), mode="valid")
    rate = np.gradient(mean, step)
    rate[[0, -1]] = 0.0
    return Heading(t, mean, rate, np.gradient(rate, step))
