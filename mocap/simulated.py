"""A motion-capture system that watches the simulated world.

The world tells it where everybody is (:meth:`SimulatedMocap.observe`); frames come out at the system's own rate, with
its noise and latency, as virtual time passes. Idealised: no reflections, no marker model; a body is seen or it is not.
It can be made to fail as such systems do: blind, without some bodies, taking one for another, or beside the truth.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Callable, Sequence
from typing import TypeVar

import numpy as np

from missions.arrays import Array, frozen
from mocap.source import MocapFrame, Pose

Vec3 = tuple[float, float, float]
T = TypeVar("T")
_SLACK = 1e-9  # [s] times are multiples of a tick up to rounding
# (12, 4): outer(h, q) times this is the quaternion product (h, 0) q.
_PRODUCT = frozen(
    np.array(
        [
            *[(0, 0, 0, -1), (0, 0, 1, 0), (0, -1, 0, 0), (1, 0, 0, 0)],
            *[(0, 0, -1, 0), (0, 0, 0, -1), (1, 0, 0, 0), (0, 1, 0, 0)],
            *[(0, 1, 0, 0), (-1, 0, 0, 0), (0, 0, 0, -1), (0, 0, 1, 0)],
        ],
        dtype=np.float64,
    )
)


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
        self._covered: Counter[str] = Counter()
        self._swaps: list[tuple[str, str]] = []
        self._offsets: list[tuple[str, Vec3]] = []
        self._blindings = 0
        self._open = True

    def hide(self, names: frozenset[str] | set[str]) -> None:
        """Lose sight of these bodies, and see all others again."""
        self._hidden = frozenset(names)

    # Faults; each lasts until what the method returns is called.

    def blind(self) -> Callable[[], None]:
        """No frames at all."""
        self._blindings += 1

        def end() -> None:
            self._blindings -= 1

        return end

    def cover(self, name: str) -> Callable[[], None]:
        """Lose sight of a body."""
        self._covered[name] += 1

        def end() -> None:
            self._covered[name] -= 1

        return end

    def swap(self, a: str, b: str) -> Callable[[], None]:
        """Take two bodies for each other."""
        return _listed(self._swaps, (a, b))

    def displace(self, name: str, offset: Vec3) -> Callable[[], None]:
        """See a body beside where it is [m]."""
        return _listed(self._offsets, (name, offset))

    def due(self, t: float) -> bool:
        """Note the time [s]; whether an exposure is due, i.e. whether :meth:`observe` would use what it is told."""
        self._now = t
        return self._open and t >= self._count * self._period - _SLACK

    def observe(self, t: float, bodies: Sequence[str], positions: Array, quaternions: Array | None = None) -> None:
        """Tell what there is to see at time t [s]; called by the world at least as often as ``rate``.

        Args:
            t: world time [s].
            bodies: names.
            positions: (N, 3) where they are [m].
            quaternions: (N, 4) x, y, z, w of unit length, body to world; None: only positions can be seen.
        """
        if not self.due(t):
            return
        self._count = math.floor(t / self._period + 1e-6) + 1
        # Noise is drawn for hidden bodies too: hiding one must not change what is seen of the others.
        noise = self._rng.standard_normal((len(bodies), 6))
        places = map(tuple, (positions + self._noise_position * noise[:, :3]).tolist())
        if quaternions is None:
            seen = dict(zip(bodies, map(Pose, places), strict=True))
        else:
            attitudes = map(tuple, self._turned(quaternions, noise[:, 3:]).tolist())
            seen = dict(zip(bodies, map(Pose, places, attitudes), strict=True))
        self._mistake(seen)
        if self._hidden or self._covered:
            seen = {name: pose for name, pose in seen.items() if name not in self._hidden and not self._covered[name]}
        if not self._blindings:
            self._under_way.append(MocapFrame(t, self._count, seen))

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

    def _mistake(self, seen: dict[str, Pose]) -> None:
        for name, (dx, dy, dz) in self._offsets:
            x, y, z = seen[name].position
            seen[name] = Pose((x + dx, y + dy, z + dz), seen[name].quaternion)
        for a, b in self._swaps:
            seen[a], seen[b] = seen[b], seen[a]

    def _turned(self, quaternions: Array, noise: Array) -> Array:
        """Attitudes (N, 4) after small turns, ``noise`` (N, 3) standard normal numbers a rotation vector's axis."""
        half = (0.5 * self._noise_angle) * noise
        turned = quaternions + (half[:, :, None] * quaternions[:, None, :]).reshape(-1, 12).dot(_PRODUCT)
        out: Array = turned / np.sqrt(np.add.reduce(turned * turned, 1, keepdims=True))
        return out


def _listed(items: list[T], item: T) -> Callable[[], None]:
    """Put an item on a list; returns what takes it off again."""
    items.append(item)
    return lambda: items.remove(item)
