"""Gyroscope and accelerometer: truth plus white noise plus a constant left-over bias.

Sizes of a BMI088 behind the firmware's low-pass filters, vibration of running motors included (estimate); the firmware
removes the gyro's bias on the ground, a little of it stays.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from missions.arrays import Array

_TICKS = 50  # whose errors are drawn together
ACCELEROMETER_RANGE = 24.0  # [g], the firmware's setting


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of a single reading and of the biases between drones.

    Attributes:
        gyro, gyro_bias: [rad/s].
        accelerometer, accelerometer_bias: [m/s²].
    """

    gyro: float = 0.0025
    gyro_bias: float = 0.0005
    accelerometer: float = 0.05
    accelerometer_bias: float = 0.02

    @staticmethod
    def none() -> SensorNoise:
        """Perfect sensors."""
        return SensorNoise(0.0, 0.0, 0.0, 0.0)


class InertialSensors:
    """Errors of all drones' sensors, drawn many ticks at a time (one call of the generator instead of many)."""

    def __init__(self, n: int, noise: SensorNoise, rng: np.random.Generator) -> None:
        self._n, self._noise, self._rng = n, noise, rng
        self._gyro_bias = noise.gyro_bias * rng.standard_normal((n, 3))
        self._drawn: list[tuple[Array, Array]] = []
        self._accelerometer_bias = noise.accelerometer_bias * rng.standard_normal((n, 3))

    def draw(self, steps: int) -> tuple[Array, Array]:
        """Errors of one tick: gyro (steps, N, 3) [rad/s], and accelerometer (N, 3) [m/s²] averaged over the tick."""
        if not self._drawn:
            raw = self._rng.standard_normal((_TICKS, steps + 1, self._n, 3))
            gyro = self._noise.gyro * raw[:, :steps] + self._gyro_bias
            force = (self._noise.accelerometer / np.sqrt(steps)) * raw[:, steps] + self._accelerometer_bias
            self._drawn = list(zip(gyro, force, strict=True))
        return self._drawn.pop()
