"""Gyroscope and accelerometer: truth plus white noise plus a constant left-over bias.

Sizes of a BMI088 behind the firmware's low-pass filters, vibration of running motors included (estimate); the firmware
removes the gyro's bias on the ground, a little of it stays.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from missions.arrays import Array

_TICKS = 50  # whose errors are drawn together
_READING = 0.002  # [s] that SensorNoise is about
ACCELEROMETER_RANGE = 24.0  # [g], the firmware's setting


@dataclass(frozen=True)
class SensorNoise:
    """Standard deviations of a single reading, at 500 Hz, and of the biases between drones.

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


class Errors(NamedTuple):
    """Sensor errors of all drones in one tick.

    Attributes:
        gyro: (steps, N, 3) [rad/s]; turn: (N, 3) their mean. accelerometer: (N, 3) mean of the tick [m/s²].
    """

    gyro: Array
    turn: Array
    accelerometer: Array


class InertialSensors:
    """Errors of all drones' sensors, drawn many ticks at a time (one call of the generator instead of many).

    Args:
        n: drones. noise: how large. rng: where they are drawn. step: time that a reading stands for [s]: a longer one
            is the mean of several.
    """

    def __init__(self, n: int, noise: SensorNoise, rng: np.random.Generator, step: float) -> None:
        self._n, self._noise, self._rng = n, noise, rng
        self._share = np.sqrt(_READING / step)
        self._gyro_bias = noise.gyro_bias * rng.standard_normal((n, 3))
        self._drawn: list[Errors] = []
        self._accelerometer_bias = noise.accelerometer_bias * rng.standard_normal((n, 3))

    def draw(self, steps: int) -> Errors:
        """Errors of one tick of so many steps."""
        if not self._drawn:
            raw = self._share * self._rng.standard_normal((_TICKS, steps + 1, self._n, 3))
            gyro = self._noise.gyro * raw[:, :steps] + self._gyro_bias
            force = (self._noise.accelerometer / np.sqrt(steps)) * raw[:, steps] + self._accelerometer_bias
            self._drawn = [Errors(*tick) for tick in zip(gyro, gyro.mean(axis=1), force, strict=True)]
        return self._drawn.pop()
