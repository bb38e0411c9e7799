"""When attempts on the air fail: independently, or in bursts (Gilbert-Elliott, in continuous time).

In bursts the channel is bad for exponentially distributed times, and nothing gets through; in between it is as good
as the rest of the model. The share of bad time is the rate asked for.
"""

from __future__ import annotations

import math
from random import Random


class Fading:
    """The channel of one drone.

    Args:
        seed: any text; the same text gives the same losses.
        loss: probability that an attempt fails while the channel is good.
    """

    def __init__(self, seed: str, loss: float) -> None:
        self._rng = Random(seed)
        self._base = self._loss = loss
        self._mean_good = self._mean_bad = math.inf  # [s]
        self._bad = False
        self._until = math.inf  # [s] when the state changes

    @property
    def mean_loss(self) -> float:
        """Share of attempts that fail, on average."""
        if math.isinf(self._mean_good):
            return self._loss
        bad = self._mean_bad / (self._mean_bad + self._mean_good)
        return bad + (1.0 - bad) * self._loss

    @property
    def is_disturbed(self) -> bool:
        """Whether it is not as in the beginning."""
        return self._loss != self._base or math.isfinite(self._mean_good)

    def disturb(self, t: float, rate: float, burst: float = 0.0) -> None:
        """From ``t`` [s] on, fail at this rate (0..1): independently, or in bursts of a mean length [s]."""
        if burst <= 0.0 or rate >= 1.0:
            self.calm()
            self._loss = rate
            return
        self._loss, self._mean_bad = self._base, burst
        self._mean_good = burst * (1.0 - rate) / rate if rate > 0.0 else math.inf
        self._bad = False
        self._until = t + self._draw(self._mean_good)

    def calm(self) -> None:
        """As in the beginning."""
        self._loss, self._bad = self._base, False
        self._mean_good = self._mean_bad = self._until = math.inf

    def fails(self, t: float) -> bool:
        """Whether an attempt at ``t`` [s] fails; times may not go back."""
        while t >= self._until:
            self._bad = not self._bad
            self._until += self._draw(self._mean_bad if self._bad else self._mean_good)
        return self._bad or self._rng.random() < self._loss

    def _draw(self, mean: float) -> float:
        return self._rng.expovariate(1.0 / mean) if math.isfinite(mean) else math.inf
