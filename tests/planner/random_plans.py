"""Random plans at rest at both ends, missions that ask for them, and looks at the polynomials that follow them."""

import dataclasses
import itertools

import numpy as np

from missions.schema import Flight, Horizon, Limits, Mission, Robot, UniformMap, Workspace
from planner.plan import Plan

LIMIT = 0.5
DT = 0.1


def plan_of(seed, steps=300, robots=1, axes=2, cap=0.475, band=0.4, ramp=5):
    """A rest-to-rest double integrator with random controls within the cap, eased in and out over ``ramp`` steps."""
    rng = np.random.default_rng(seed)
    t = np.arange(steps)[:, None, None] * DT
    u = np.zeros((steps, robots, axes))
    for frequency in np.arange(0.03, band, 0.03):
        u += rng.normal(size=(1, robots, axes)) * np.sin(
            2 * np.pi * frequency * t + rng.uniform(0, 2 * np.pi, (1, robots, axes))
        )
    u *= cap / u.std()
    ease = np.minimum(1.0, np.minimum(np.arange(steps), np.arange(steps)[::-1]) / max(ramp, 1) + (ramp == 0))
    bound = cap * ease[:, None, None]
    for _ in range(300):  # rest at the end: the controls' sum vanishes
        u = np.clip(u, -bound, bound)
        u -= u.sum(axis=0) / ease.sum() * ease[:, None, None]
    v = np.concatenate([np.zeros((1, robots, axes)), np.cumsum(u, axis=0) * DT])
    q = np.cumsum(np.concatenate([np.zeros((1, robots, axes)), v[:-1] * DT + u * DT**2 / 2]), axis=0)
    return Plan(np.arange(steps + 1) * DT, q - q.mean(axis=0), v, u, 0.0, 0.0)


def mission_of(plan, **changes):
    axes = plan.q.shape[2]
    mission = Mission(
        schema_version=1,
        name="test",
        workspace=Workspace((-60.0,) * axes, (60.0,) * axes),
        horizon=Horizon(float(plan.t[-1]), plan.dt),
        information=UniformMap(),
        robots=tuple(Robot(f"r{i}", tuple(plan.q[0, i])) for i in range(plan.q.shape[1])),
        limits=Limits(acceleration=LIMIT),
        flight=Flight(altitude=0.8),
    )
    return dataclasses.replace(mission, **changes)


def dense(trajectory, count=20):
    """Times inside every piece, ends included: 1 µs inside, so that the piece itself answers."""
    knots = trajectory.knots()
    return np.concatenate([np.linspace(a + 1e-6, b - 1e-6, count) for a, b in itertools.pairwise(knots)])


def sides_of_joints(trajectory, order):
    """Values of a derivative at the ends of the pieces before joints and at the starts of those after."""
    powers = np.polynomial.polynomial.polyder(np.moveaxis(trajectory.coefficients, -1, 0), order)  # (8-order, M, 4)
    ends = sum(c * trajectory.durations[:, None] ** k for k, c in enumerate(powers))
    return ends[:-1], powers[0, 1:]
