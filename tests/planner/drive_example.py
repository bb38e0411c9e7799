"""PlanetaryRobotics' published example: one differential drive in the unit square, two Gaussians, a 500 × 500 map."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.single import DifferentialDrive, LossWeights, Task

PIXELS, VARIANCE = 500, 0.01
MEANS = np.array([[0.2, 0.8], [0.8, 0.2]])
START, END, STEPS = (0.2, 0.2, 0.0), (0.8, 0.8, 0.0), 100
WEIGHTS = LossWeights()
BASIS = CosineBasis(np.zeros(2), np.ones(2), 10, exponent=-2.0)


def density(means: Array = MEANS) -> Array:
    """(500, 500) the map as the authors draw it: at the lower corners of its pixels."""
    axis = np.arange(PIXELS) / PIXELS
    x, y = (np.exp(-((axis - means[:, d : d + 1]) ** 2) / (2.0 * VARIANCE)) for d in range(2))
    return x.T @ y


def transform(density: Array) -> Array:
    """φ_k (10, 10) as the authors transform it: pixels from corner to corner."""
    cosine = np.cos(np.pi * np.outer(np.linspace(0.0, 1.0, PIXELS), np.arange(BASIS.n)))
    sums = cosine.T @ density @ cosine
    return sums / sums[0, 0] / BASIS.h_k


def task(phi_k: Array | None = None, *, weights: LossWeights = WEIGHTS) -> Task:
    """The example, on its own map or another."""
    metric = ErgodicMetric(BASIS, transform(density()) if phi_k is None else phi_k)
    return Task(DifferentialDrive(START, STEPS), metric, weights, END)
