"""Geometric tracking controller (controller_mellinger.c), for all drones at once.

D. Mellinger, V. Kumar: Minimum snap trajectory generation and control for quadrotors, ICRA 2011, with the firmware's
integrals and angular-acceleration term. Gains are the defaults that the recorded firmware reports (ctrlMel.*).

The firmware runs all of it at 500 Hz. Here the force loop runs at 100 Hz, the rate at which high-level setpoints and
poses change; the attitude loop, which is what is fast, runs at every step.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import GRAVITY, Index
from deploy.radio.simulated.physics.estimator import Estimates
from deploy.radio.simulated.physics.setpoints import SetpointTable
from deploy.radio.simulated.physics.tuning import Tuning
from deploy.radio.simulated.platform_defaults import platform_defaults
from missions.airframes import Airframe
from missions.arrays import Array, frozen

# Gains by parameter, ctrlMel.*: position [N/m], velocity [N s/m], integral [N/(m s)] and its range [m s]; ki_z as the
# recorded firmware reports it. Then counts of attitude (of an error that is twice the angle), counts s/rad of rates,
# counts s²/rad of roll and pitch acceleration, and the attitude's integral.
_DEFAULTS = {
    "kp_xy": 0.4, "kp_z": 1.25, "kd_xy": 0.2, "kd_z": 0.4,
    "ki_xy": 0.05, "ki_z": 0.05, "i_range_xy": 2.0, "i_range_z": 0.4,
    "kR_xy": 70000.0, "kR_z": 60000.0, "kw_xy": 20000.0, "kw_z": 12000.0, "kd_omega_rp": 200.0,
    "ki_m_xy": 0.0, "ki_m_z": 500.0, "i_range_m_xy": 1.0, "i_range_m_z": 1500.0,
}  # fmt: skip
_MOMENT_MAX = 32000.0
# vee(A - Aᵀ) as a linear map of A's nine entries.
_VEE = frozen(
    [
        [0, 0, 0],
        [0, 0, -1],
        [0, 1, 0],
        [0, 0, 1],
        [0, 0, 0],
        [-1, 0, 0],
        [0, -1, 0],
        [1, 0, 0],
        [0, 0, 0],
    ]
)
# The same of A = G R: linear in R's entries by a matrix (3, 9) that is linear in G's, e_k = Σ vee_ilk G_ij R_jl.
_VEE_OF_PRODUCT = frozen(np.einsum("ilk,jm->ijkml", _VEE.reshape(3, 3, 3), np.eye(3)).reshape(9, 27))


class Mellinger:
    """State of N controllers. ``aim`` at 100 Hz, ``moments`` at every step."""

    def __init__(self, airframes: Sequence[Airframe], dt: float) -> None:
        n = len(airframes)
        self._dt = dt
        self._parameters = {name: np.full(n, value) for name, value in _DEFAULTS.items()}
        for name in ("mass", "massThrust"):
            self._parameters[name] = np.array([platform_defaults(a)["ctrlMel." + name] for a in airframes])
        self._tuning = Tuning({"ctrlMel." + name: column for name, column in self._parameters.items()})
        self._integral = np.zeros((n, 3))
        self._attitude_error = np.zeros((n, 3, 9))
        self._omega = np.zeros((n, 3))
        # Columns: attitude error, rate error, rate error before, attitude's integral: one product gives the moments.
        self._errors = np.zeros((n, 12))
        self._off_attitude, self._off_rates = self._errors[:, :3, None], self._errors[:, 3:6]
        self._off_attitude_row = self._errors[:, :3]
        self._off_rates_before, self._moment_integral = self._errors[:, 6:9], self._errors[:, 9:]
        self._moments = np.zeros((n, 3))
        self._tuned()

    def tune(self, index: int, changed: Mapping[str, float]) -> None:
        """Take one drone's parameters ctrlMel.*."""
        if self._tuning.put(index, changed):
            self._tuned()

    def _tuned(self) -> None:
        """What follows from the parameters."""
        p = self._parameters
        names = ("kp", "kd", "ki", "i_range", "i_range_m", "kR", "kw", "ki_m")
        self._kp, self._kd, self._ki, self._i_range, self._i_range_m, attitude, rate, integral = (
            np.stack([p[name + "_xy"], p[name + "_xy"], p[name + "_z"]], axis=1) for name in names
        )
        self._mass, self._weight = p["mass"][:, None], p["mass"] * GRAVITY
        jerk = p["kd_omega_rp"][:, None] * np.array([1.0, 1.0, 0.0]) / self._dt
        gains = np.concatenate(
            [g[:, :, None] * np.eye(3) for g in (-attitude, rate + jerk, -jerk, integral)], axis=1
        )  # (N, 12, 3)
        self._alike = bool((gains == gains[0]).all())  # then one product does for all
        self._gains = gains[0] if self._alike else gains

    def aim(self, target: SetpointTable, state: Estimates, dt: float) -> Array:
        """Force loop: desired attitudes for :meth:`moments`; returns the thrust commands (N,) in counts.

        Args:
            target: what to follow.
            state: what the drones believe.
            dt: time since the last call [s].
        """
        error = target.position - state.position
        integral = self._integral
        integral += error * dt
        np.minimum(np.maximum(integral, -self._i_range, out=integral), self._i_range, out=integral)
        integral = self._moment_integral
        integral -= dt * self._off_attitude_row
        np.minimum(np.maximum(integral, -self._i_range_m, out=integral), self._i_range_m, out=integral)
        force = self._kp * error + self._kd * (target.ahead[:, 0:3] - state.velocity) + self._ki * self._integral
        force += self._mass * target.ahead[:, 3:6]
        yaw = target.yaw
        if not target.all_by_position:
            # Modes that this controller does not know: it levels out at the height in the setpoint.
            force[~target.by_position, :2] = 0.0
            turn = target.attitude_only * (self._dt * target.omega[:, 2])
            yaw = np.where(target.by_position, yaw, algebra.heading(state.rotation) + turn)
        force[:, 2] += self._weight
        desired = _attitude(algebra.normalised(force), yaw)
        thrust: Array = self._parameters["massThrust"] * np.add.reduce(force * state.rotation[:, :, 2], 1)
        if target.any_manual:
            manual = target.attitude_only
            desired[manual] = _tilted(target.attitude[manual], yaw[manual])
            thrust = np.where(target.manual, target.thrust, thrust)
        # The estimated attitude is D R, with the true R and a D that stays for the tick: the error of the attitude is
        # then a linear map of R alone.
        turn = np.matmul(desired.transpose(0, 2, 1), state.misalignment)
        self._attitude_error = turn.reshape(-1, 9).dot(_VEE_OF_PRODUCT).reshape(-1, 3, 9)
        self._omega = target.ahead[:, 6:9]
        if np.minimum.reduce(thrust) <= 0.0:
            self.reset(np.flatnonzero(thrust <= 0.0))
        np.maximum(thrust, 0.0, out=thrust)
        return thrust

    def moments(self, rotation: Array, rates: Array) -> Array:
        """Moments (N, 3) about body x, y, z in counts from true attitudes (N, 3, 3) and measured rates [rad/s].

        The array is the same one at every call.
        """
        moments = self._moments
        self._off_rates_before[:] = self._off_rates
        np.matmul(self._attitude_error, rotation.reshape(-1, 9, 1), out=self._off_attitude)
        np.subtract(self._omega, rates, out=self._off_rates)
        if self._alike:
            np.dot(self._errors, self._gains, out=moments)
        else:
            np.matmul(self._errors[:, None, :], self._gains, out=moments[:, None, :])
        np.maximum(moments, -_MOMENT_MAX, out=moments)
        np.minimum(moments, _MOMENT_MAX, out=moments)
        return moments

    def reset(self, index: Index) -> None:
        """Forget the integrals of some drones (motors off)."""
        self._integral[index] = 0.0
        self._moment_integral[index] = 0.0


def _attitude(z_axis: Array, yaw: Array) -> Array:
    """Matrices (N, 3, 3) with the given z axes and headings."""
    ahead = np.zeros((len(yaw), 3))
    np.cos(yaw, out=ahead[:, 0])
    np.sin(yaw, out=ahead[:, 1])
    out = np.empty((len(yaw), 3, 3))
    y_axis = algebra.normalised(algebra.cross(z_axis, ahead))
    out[:, :, 0], out[:, :, 1], out[:, :, 2] = algebra.cross(y_axis, z_axis), y_axis, z_axis
    return out


def _tilted(attitude: Array, yaw: Array) -> Array:
    """Matrices of roll, pitch (N, 2) and yaw (N,): Rz(yaw) Ry(pitch) Rx(roll)."""
    zero = np.zeros_like(yaw)
    q = algebra.exponential(np.stack([attitude[:, 0], zero, zero], axis=1))
    q = algebra.multiply(algebra.exponential(np.stack([zero, attitude[:, 1], zero], axis=1)), q)
    return algebra.rotation_matrices(algebra.multiply(algebra.yaw_quaternions(yaw), q))
