"""How markers are seen and how they move, in numbers."""

from __future__ import annotations

from dataclasses import dataclass

_PERSISTENCE, _CALMEST = 0.3, 2.0  # [s] an acceleration lasts, [m/s²]


@dataclass(frozen=True)
class Settings:
    """How markers are seen and how they move.

    Attributes:
        noise: standard deviation of a marker's measured position per axis [m].
        agility: spectral density of the acceleration [m²/s³], about its square x how long it lasts: 2 m/s² for 0.3 s.
        detection: probability that a marker is seen in a frame. ghosts: density of false points [1/m³].
        gate: largest distance of what is seen from what is predicted, in standard deviations.
        reach: the same at most [m], however long a robot was not seen.
        coasting: a robot not seen for this long is sought [s].
        confirmation: frames a new marker is followed before it may be a robot that is sought.
        margin: least log-likelihood ratio against the next best identities; e^9 is about 10⁴ to 1.
        pad: a robot is sought on its pad within this radius [m], but at most half the distance of two pads.
        speed, acceleration: no marker moves faster [m/s], [m/s²].
        reference: standard deviation of a robot that is not seen from its reference, per axis [m].
        forgotten: who was not seen for this long is not sought any more but on his pad [s].
    """

    noise: float = 0.001
    agility: float = _PERSISTENCE * _CALMEST**2
    detection: float = 0.95
    ghosts: float = 0.1
    gate: float = 5.0
    reach: float = 0.5
    coasting: float = 0.05
    confirmation: int = 5
    margin: float = 9.0
    pad: float = 0.15
    speed: float = 5.0
    acceleration: float = 20.0
    reference: float = 0.1
    forgotten: float = 2.0

    @staticmethod
    def for_acceleration(largest: float) -> Settings:
        """For robots that accelerate by no more than this [m/s²]; below 2 m/s² gusts and controllers count for more."""
        return Settings(agility=_PERSISTENCE * max(_CALMEST, largest) ** 2)
