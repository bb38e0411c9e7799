"""Outlines of footprints: how far what is seen reaches from a point on the ground, its centre, by direction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from missions.arrays import Array

LOWEST = 1e-3  # [m]: nearer the ground, what is seen stops shrinking


class Cast(NamedTuple):
    """Outlines on the ground of T·N looks, in P directions.

    Attributes:
        centre: (T·N, 2) [m]. radius: (T·N, P) [m] from the centre.
        pull: ``pull(by_centre, by_radius)`` is the gradient (T, N, 3) by the robots' positions.
    """

    centre: Array
    radius: Array
    pull: Callable[[Array, Array], Array]


class Outline(Protocol):
    """A star-shaped region of the ground, by where a robot is and how it moves."""

    def cast(self, x: Array, direction: Array) -> Cast:
        """Outlines seen from x (T, N, 3) [m] in directions (P,) [rad]."""


@dataclass(frozen=True)
class Disc:
    """All within a distance: of the same size everywhere, or a downward cone's, that widens with height (FEO, Eq. 4).

    Attributes:
        radius: [m] at the ground. slope: k_h, radius gained per metre of height.
    """

    radius: float = 0.0
    slope: float = 0.0

    def __post_init__(self) -> None:
        if min(self.radius, self.slope) < 0.0 or max(self.radius, self.slope) <= 0.0:
            raise ValueError(f"a disc needs a radius or a slope above 0; got {self.radius} m and {self.slope}")

    def size(self, height: Array) -> Array:
        """Radius [m] at heights [m]."""
        radius: Array = self.radius + self.slope * np.maximum(height, LOWEST)
        return radius

    def growth(self, height: Array) -> Array:
        """Its derivative by the height."""
        growth: Array = np.where(height > LOWEST, self.slope, 0.0)
        return growth

    def cast(self, x: Array, direction: Array) -> Cast:
        """See :class:`Outline`."""
        height, alike = x[..., 2].ravel(), np.ones_like(direction)
        return _level(x, np.outer(self.size(height), alike), np.outer(self.growth(height), alike))


@dataclass(frozen=True)
class Window:
    """What a level camera with a rectangular picture sees.

    Attributes:
        slopes: half the picture's length and width on the ground per metre of height.
        yaw: [rad] of its length, counter-clockwise from x.
    """

    slopes: tuple[float, float]
    yaw: float = 0.0

    def __post_init__(self) -> None:
        if min(self.slopes) <= 0.0:
            raise ValueError(f"a window needs slopes above 0; got {self.slopes}")

    def cast(self, x: Array, direction: Array) -> Cast:
        """See :class:`Outline`."""
        towards, height = direction - self.yaw, x[..., 2].ravel()
        with np.errstate(divide="ignore"):
            shape = np.minimum(self.slopes[0] / np.abs(np.cos(towards)), self.slopes[1] / np.abs(np.sin(towards)))
        return _level(
            x, np.outer(np.maximum(height, LOWEST), shape), np.outer(np.where(height > LOWEST, 1.0, 0.0), shape)
        )


def _level(x: Array, radius: Array, by_height: Array) -> Cast:
    """What lies straight below."""

    def pull(by_centre: Array, by_radius: Array) -> Array:
        by_z = np.einsum("mp,mp->m", by_radius, by_height)
        return np.concatenate((by_centre, by_z[:, None]), axis=-1).reshape(x.shape)

    return Cast(x[..., :2].reshape(-1, 2), radius, pull)
