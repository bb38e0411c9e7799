"""The figures the papers report, of any sampled motion: planned, certified or flown."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from missions import fleet
from missions.arrays import Array
from missions.connectivity import ProbabilisticConnectivity, SimultaneousConnectivity
from missions.indicator import Indicator
from missions.schema import Mission
from missions.shapes import solid
from missions.topology import sub_period_steps, sub_period_times
from planner.certificate.record import Indicators, PairConnection
from planner.connectivity.all_times import log_probability
from planner.connectivity.forwarding import Contact, arrival_tables, by_pair, sampled_contacts
from planner.connectivity.pairs import all_pairs
from planner.connectivity.quadrature import every_step
from planner.connectivity.same_time import same_time_log_probability
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.ergodic.target import information_coefficients
from planner.footprint.metric import FootprintMetric
from planner.footprint.mission import footprint_of
from planner.surface.metric import SurfaceMetric
from planner.surface.mission import surface_metric

MOST_TERMS = 4_000_000  # of double sums worked out at once: 100 MB


MissionMetric = ErgodicMetric | FootprintMetric | SurfaceMetric


def ergodic_metric(mission: Mission) -> MissionMetric:
    """The mission's ergodic metric: basis on its workspace, coefficients of its information map.

    Of what robots see of the floor or of an object, if the mission says what that is (FEO, Eq. 26).
    """
    if mission.object is not None:
        return surface_metric(mission)
    box, axes = mission.workspace, mission.information_axes
    basis = CosineBasis(np.array(box.lower[:axes]), np.array(box.upper[:axes]), mission.basis.functions_per_axis)
    phi_k = information_coefficients(mission.information, basis)
    if mission.footprint is None:
        return ErgodicMetric(basis, phi_k)
    footprints = tuple(footprint_of(footprint, mission.horizon.dt) for footprint in mission.footprints)
    altitude = fleet.altitudes(mission) if mission.dimension == 2 else None
    return FootprintMetric(basis, phi_k, footprints, altitude=altitude)


def indicators(mission: Mission, t: Array, q: Array, contacts: Sequence[Contact] | None = None) -> Indicators:
    """Indicators of sampled positions.

    E and P are defined at the planning step: positions are interpolated linearly to t = 0, dt, .., (T−1) dt. Meetings,
    shares, separation and clearance count every sample given, so sample finely.

    Args:
        mission: what was asked for.
        t: (S,) [s] since the start of the search, increasing, from about 0 to about the duration.
        q: (S, N, ≥ν) positions [m]; axes beyond the mission's ν are ignored.
        contacts: when pairs are within range, if that is known better than the samples say.

    Raises:
        ValueError: shapes, order or values that make no motion.
    """
    t, q = _checked(mission, t, q)
    q_planned = resample(t, q, np.arange(mission.steps, dtype=np.float64) * mission.horizon.dt)
    within, distance = _within(mission, q)
    if contacts is None:
        contacts = sampled_contacts(t, within, all_pairs(len(mission.robots)))
    pairs = _pair_connections(mission, t, q_planned, within, distance, contacts)
    arrivals, by_period = arrival_tables(len(mission.robots), contacts, sub_period_times(mission))
    has_range = mission.connectivity.range is not None
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
        arrivals=arrivals if has_range else (),
        arrivals_by_period=by_period if has_range else (),
    )


def smallest_clearance(mission: Mission, q: Array) -> float:
    """Smallest distance [m] of any sample q (S, N, ≥ν) to any obstacle, negative inside; inf without obstacles."""
    x = np.moveaxis(fleet.in_space(mission, q[..., : mission.dimension]), -1, 0)
    return min((float(solid(obstacle).value(x).min()) for obstacle in mission.obstacles), default=math.inf)


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


def _pair_connections(
    mission: Mission,
    t: Array,
    q_planned: Array,
    within: NDArray[np.bool_],
    distance: Array,
    contacts: Sequence[Contact],
) -> tuple[PairConnection, ...]:
    names, R_c = [robot.name for robot in mission.robots], mission.connectivity.range
    index = all_pairs(len(names))
    if len(index) == 0:
        return ()
    edges = sub_period_times(mission)
    period = np.clip(np.searchsorted(edges, t + 1e-9, side="right") - 1, 0, len(edges) - 2)
    met = np.stack([within[period == p].any(axis=0) for p in range(len(edges) - 1)], axis=-1)
    P, same_time = _probabilities(mission, q_planned)
    spans = by_pair(contacts)
    return tuple(
        PairConnection(
            robots=(names[i], names[j]),
            probability=tuple(float(value) for value in P[pair]),
            met=tuple(bool(value) for value in met[pair]),
            connected_share=float(within[:, pair].mean()) if R_c is not None else math.nan,
            smallest_distance=float(distance[:, pair].min()),
            same_time_probability=tuple(float(value) for value in same_time[pair]),
            contacts=tuple((c.begin, c.end) for c in spans.get((int(i), int(j)), ())),
        )
        for pair, (i, j) in enumerate(index)
    )


def _within(mission: Mission, q: Array) -> tuple[NDArray[np.bool_], Array]:
    """(S, pairs) whether pairs are within range, and their distances [m], heights included."""
    index, x = all_pairs(len(mission.robots)), fleet.in_space(mission, q)
    distance: Array = np.linalg.norm(x[:, index[:, 0]] - x[:, index[:, 1]], axis=-1)
    R_c = mission.connectivity.range
    return distance <= (-1.0 if R_c is None else R_c), distance


def _probabilities(mission: Mission, q: Array) -> tuple[Array, Array]:
    """P and P̃ (pairs, sub-periods) at the planning step, with the policy's indicator; (pairs, 0) without a range."""
    policy, index = mission.connectivity, all_pairs(len(mission.robots))
    if policy.range is None:
        return np.empty((len(index), 0)), np.empty((len(index), 0))
    indicator = Indicator()
    if isinstance(policy, ProbabilisticConnectivity | SimultaneousConnectivity):
        indicator = Indicator(policy.indicator, policy.steepness)
    quadrature = every_step(sub_period_steps(mission))
    terms = math.prod(quadrature.nodes.shape) * quadrature.nodes.shape[1]
    blocks = np.array_split(index, max(1, math.ceil(len(index) * terms / MOST_TERMS)))
    P = [np.exp(log_probability(q, policy.range, indicator, block, quadrature, exact=True).log_P) for block in blocks]
    same_time = same_time_log_probability(q, policy.range, indicator, index, quadrature)
    return np.concatenate(P), np.exp(same_time.log_P)
