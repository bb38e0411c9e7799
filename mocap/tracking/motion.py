"""How markers move: constant velocity with white-noise acceleration, one Kalman filter a robot.

The noise is the same along all three axes and so is the covariance, so each filter is a 2 x 2 matrix whatever the
heading (Bar-Shalom, Li and Kirubarajan, Estimation with Applications to Tracking and Navigation, 2001, section 6.2.2,
"continuous white noise acceleration"):

    p' = p + dt v,    Q = q [[dt³/3, dt²/2], [dt²/2, dt]]
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array


class Motion:
    """Positions and velocities of N markers.

    Args:
        position: (N, 3) where they are [m], at rest.
        deviation: standard deviation of that per axis [m].
        density: q, spectral density of the acceleration noise [m²/s³].

    Attributes:
        position, velocity: (N, 3) [m], [m/s].
        pp, pv, vv: (N,) covariance of position and velocity per axis [m²], [m²/s], [m²/s²].
    """

    def __init__(self, position: Array, deviation: float, density: float) -> None:
        self.position = np.array(position, dtype=np.float64).reshape(-1, 3)
        self.velocity = np.zeros_like(self.position)
        n = len(self.position)
        self.pp, self.pv, self.vv = np.full(n, deviation**2), np.zeros(n), np.zeros(n)
        self._density = density

    def predict(self, dt: float, moving: Array) -> None:
        """Let dt [s] pass for those robots that are ``moving`` (N,)."""
        dt_ = np.where(moving, dt, 0.0)
        q = self._density * dt_
        self.position += dt_[:, None] * self.velocity
        self.pp += dt_ * (2.0 * self.pv + dt_ * self.vv) + q * dt_ * dt_ / 3.0
        self.pv += dt_ * self.vv + 0.5 * q * dt_
        self.vv += q

    def correct(self, i: int, measured: Array, variance: float) -> None:
        """Take the marker of robot i as measured (3,) [m] with this variance per axis [m²]."""
        s = self.pp[i] + variance
        gain_p, gain_v = self.pp[i] / s, self.pv[i] / s
        innovation = measured - self.position[i]
        self.position[i] += gain_p * innovation
        self.velocity[i] += gain_v * innovation
        self.vv[i] -= gain_v * self.pv[i]
        self.pv[i] -= gain_p * self.pv[i]
        self.pp[i] -= gain_p * self.pp[i]

    def restart(self, i: int, position: Array, velocity: Array, deviations: tuple[float, float]) -> None:
        """Start the filter of robot i anew; deviations of position [m] and velocity [m/s]."""
        self.position[i], self.velocity[i] = position, velocity
        self.pp[i], self.pv[i], self.vv[i] = deviations[0] ** 2, 0.0, deviations[1] ** 2
