"""The figures the papers report, of any sampled motion: planned, certified or flown."""

from __future__ import annotations

import math

import numpy as np

from missions import fleet
from missions.arrays import Array
from missions.schema import Mission, NoConnectivity
from missions.shapes import solid
from planner.certificate.record import Indicators, PairConnection
from planner.connectivity.pairs import all_pairs, sub_period_bounds
from planner.connectivity.probability import connection_probability
from planner.connectivity.quadrature import every_step
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.ergodic.target import information_coefficients


def ergodic_metric(mission: Mission) -> ErgodicMetric:
    """The mission's ergodic metric: basis on its workspace, coefficients of its information map."""
    box = mission.workspace
    basis = CosineBasis(np.array(box.lower), np.array(box.upper), mission.basis.functions_per_axis)
    return ErgodicMetric(basis, information_coefficients(mission.information, basis))


def indicators(mission: Mission, t: Array, q: Array) -> Indicators:
    """Indicators of sampled positions.

    E and P are defined at the planning step: positions are interpolated linearly to t = 0, dt, .., (T−1) dt. Meetings,
    shares, separation and clearance count every sample given, so sample finely.

    Args:
        mission: what was asked for.
        t: (S,) [s] since the start of the search, increasing, from about 0 to about the duration.
        q: (S, N, ≥ν) positions [m]; axes beyond the mission's ν are ignored.

    Raises:
        ValueError: shapes, order or values that make no motion.
    """
    t, q = _checked(mission, t, q)
    q_planned = resample(t, q, np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt)
    pairs = _pair_connections(mission, t, q, q_planned)
    probabilities = [P for pair in pairs for P in pair.probability]
    shares = [pair.connected_share for pair in pairs]
    return Indicators(
        ergodicity=ergodic_metric(mission).value(q_planned),
        connected_share=float(np.mean(shares)) if shares else math.nan,
        probability_worst=min(probabilities, default=math.nan),
        probability_mean=float(np.mean(probabilities)) if probabilities else math.nan,
        all_met=all(all(pair.met) for pair in pairs),
        smallest_separation=min((pair.smallest_distance for pair in pairs), default=math.inf),
        smallest_clearance=smallest_clearance(mission, q),
        pairs=pairs,
    )


def smallest_clearance(mission: Mission, q: Array) -> float:
    """Smallest distance [m] of any sample q (S, N, ≥ν) to any obstacle, negative inside; inf without obstacles."""
    x = np.moveaxis(fleet.in_space(mission, q[..., : mission.dimension]), -1, 0)
    return min((float(solid(obstacle).distance(x).value.min()) for obstacle in mission.obstacles), default=math.inf)


def resample(t: Array, q: Array, times: Array) -> Array:
    """Positions (len(times), N, ν) at ``times`` by linear interpolation between samples; ends are held."""
    later = np.clip(np.searchsorted(t, times, side="right"), 1, len(t) - 1)
    fraction = np.clip((times - t[later - 1]) / (t[later] - t[later - 1]), 0.0, 1.0)
    # Sample times computed as k·dt in another order differ in the last digit: they are the samples themselves.
    fraction = np.where(np.abs(fraction - np.round(fraction)) < 1e-9, np.round(fraction), fraction)[:, None, None]
    positions: Array = q[later - 1] * (1.0 - fraction) + q[later] * fraction
    return positions


def _checked(mission: Mission, t: Array, q: Array) -> tuple[Array, Array]:
    t, q = np.asarray(t, dtype=np.float64), np.asarray(q, dtype=np.float64)
    robots, nu = len(mission.robots), mission.dimension
    if q.ndim != 3 or t.shape != q.shape[:1] or q.shape[1] != robots or q.shape[2] < nu or len(t) < 2:
        raise ValueError(
            f"indicators need t (S,) and q (S, {robots}, {nu}) with S of 2 or more; got {t.shape} and {q.shape}"
        )
    if not (np.isfinite(t).all() and np.isfinite(q).all() and (np.diff(t) > 0.0).all()):
        raise ValueError("indicators need finite positions at increasing times")
    return t, q[..., :nu]


def _pair_connections(mission: Mission, t: Array, q: Array, q_planned: Array) -> tuple[PairConnection, ...]:
    policy, names = mission.connectivity, [robot.name for robot in mission.robots]
    index = all_pairs(len(names))
    if len(index) == 0:
        return ()
    R_c = policy.range
    sub_periods = 1 if isinstance(policy, NoConnectivity) else policy.sub_periods
    distance = np.linalg.norm(q[:, index[:, 0]] - q[:, index[:, 1]], axis=-1)  # (S, pairs)
    connected = distance <= R_c if R_c is not None else np.zeros_like(distance, dtype=bool)
    edges = np.linspace(0.0, mission.horizon.duration, sub_periods + 1)
    period = np.clip(np.searchsorted(edges, t + 1e-9, side="right") - 1, 0, sub_periods - 1)
    met = [[bool(connected[period == p, pair].any()) for p in range(sub_periods)] for pair in range(len(index))]
    P = np.empty((len(index), 0))
    if R_c is not None:
        quadrature = every_step(sub_period_bounds(mission.steps, sub_periods))
        P = connection_probability(q_planned, R_c, index, quadrature)
    return tuple(
        PairConnection(
            robots=(names[i], names[j]),
            probability=tuple(float(value) for value in P[pair]),
            met=tuple(met[pair]),
            connected_share=float(connected[:, pair].mean()) if R_c is not None else math.nan,
            smallest_distance=float(distance[:, pair].min()),
        )
        for pair, (i, j) in enumerate(index)
    )
