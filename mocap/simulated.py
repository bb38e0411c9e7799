"""A motion-capture system that watches the simulated world.

The world tells it where everybody is (:meth:`SimulatedMocap.observe`); frames come out at the system's own rate, with
its noise and latency, as virtual time passes. Idealised: no reflections, no marker model; a body is seen or it is not.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence

import numpy as np

from mocap.source import MocapFrame, Pose

_SLACK = 1e-9  # [s] times are multiples of a tick up to rounding


class SimulatedMocap:
    """Frames of simulated bodies.

    Args:
        rate: frames per second.
        noise_position: standard deviation per axis [m].
        noise_angle: standard deviation of the rotation vector per axis [rad].
        latency: from exposure to arrival [s].
        seed: of the noise; the same observations and seed give the same frames.

    Raises:
        ValueError: a rate that is not positive, or something else negative.
    """

    def __init__(
        self,
        rate: float = 100.0,
        *,
        noise_position: float = 0.0003,
        noise_angle: float = 0.002,
        latency: float = 0.005,
        seed: int = 0,
    ) -> None:
        if not rate > 0.0 or min(noise_position, noise_angle, latency) < 0.0:
            raise ValueError(
                f"a simulated capture system has a positive rate and nothing negative; got rate {rate}, noise "
                f"{noise_position} m and {noise_angle} rad, latency {latency} s"
            )
        self._period, self._latency = 1.0 / rate, latency
        self._noise_position, self._noise_angle = noise_position, noise_angle
        self._rng = np.random.default_rng(seed)
        self._now = 0.0
        self._count = 0  # exposures since t = 0, taken or missed: frame k is due at k periods
        self._under_way: deque[MocapFrame] = deque()
        self._hidden: frozenset[str] = frozenset()
        self._open = True

    def hide(self, names: frozenset[str] | set[str]) -> None:
        """Lose sight of these bodies, and see all others again."""
        self._hidden = frozenset(names)

    def due(self, t: float) -> bool:
        """Note the time [s]; whether an exposure is due, i.e. whether :meth:`observe` would use what it is told."""
        self._now = t
        return self._open and t >= self._count * self._period - _SLACK

    def observe(self, t: float, bodies: Mapping[str, Pose]) -> None:
        """Tell what there is to see at time t [s]; called by the world at least as often as ``rate``."""
        if not self.due(t):
            return
        self._count = math.floor(t / self._period + 1e-6) + 1
        # Noise is drawn for hidden bodies too: hiding one must not change what is seen of the others.
        noise = self._rng.standard_normal((len(bodies), 6)).tolist()
        seen = {name: self._blur(pose, row) for (name, pose), row in zip(bodies.items(), noise, strict=True)}
        visible = {name: pose for name, pose in seen.items() if name not in self._hidden}
        self._under_way.append(MocapFrame(t, self._count, visible))

    def poll(self) -> Sequence[MocapFrame]:
        """Frames that arrived by now, oldest first."""
        arrived: list[MocapFrame] = []
        while self._under_way and self._under_way[0].t + self._latency <= self._now + _SLACK:
            arrived.append(self._under_way.popleft())
        return arrived

    def close(self) -> None:
        """Stop looking."""
        self._open = False
        self._under_way.clear()

    def _blur(self, pose: Pose, noise: Sequence[float]) -> Pose:
        """A pose with six standard normal numbers of noise on it (plain floats: a body at a time, arrays cost more)."""
        spread, turn = self._noise_position, 0.5 * self._noise_angle
        x, y, z = pose.position
        position = (x + spread * noise[0], y + spread * noise[1], z + spread * noise[2])
        if pose.quaternion is None:
            return Pose(position)
        qx, qy, qz, qw = pose.quaternion
        hx, hy, hz = turn * noise[3], turn * noise[4], turn * noise[5]
        a = qx + hx * qw + hy * qz - hz * qy
        b = qy - hx * qz + hy * qw + hz * qx
        c = qz + hx * qy - hy * qx + hz * qw
        d = qw - hx * qx - hy * qy - hz * qz
        length = math.sqrt(a * a + b * b + c * c + d * d)
        return Pose(position, (a / length, b / length, c / length, d / length))
