"""Data for the maps side by side: what was to be searched, what was, and the difference."""

from __future__ import annotations

import numpy as np

from deploy.analysis.record import FlightAnalysis
from deploy.heat import top_view
from missions.arrays import Array
from planner.indicators import ergodic_metric


def maps_data(analysis: FlightAnalysis) -> dict[str, object]:
    """The map's coefficients in the metric's own basis; the page works out the flight's, up to its time cursor.

    A 3-D search is shown from above: what is left of a cosine series summed over z are its terms with k_z = 0. Of a
    search around an object, maps show the object's surface.
    """
    mission = analysis.flight_plan.mission
    metric = ergodic_metric(mission)
    lower, upper = metric.basis.lower[:2], metric.basis.upper[:2]
    surface = mission.object.surface if mission.object is not None else None
    return {
        "given": top_view(surface, lower, upper) if surface is not None else None,
        "functions": metric.basis.n,
        "phi": [float(f"{value:.7g}") for value in _planar(metric.phi_k).ravel()],
        "weights": [float(f"{value:.7g}") for value in _planar(metric.basis.Lambda_k).ravel()],
        "lower": lower.tolist(),
        "upper": upper.tolist(),
        "planar": mission.information_axes == 2,
        "seen": _seen(analysis),
    }


def _seen(analysis: FlightAnalysis) -> dict[str, object] | None:
    """Mission times [s] and what was seen until then, where robots look at something."""
    covered = analysis.coverage
    if covered.flown_statistics is None:
        return None
    statistics = covered.flown_statistics
    flat = np.stack([_planar(c_k).ravel() for c_k in statistics])
    known = np.isfinite(flat).all(axis=1)
    rows = flat[known]
    return {"t": covered.t[known].tolist(), "c": [[float(f"{value:.4g}") for value in row] for row in rows]}


def _planar(values: Array) -> Array:
    """(n, n) of coefficients (n, n) or (n, n, n)."""
    return np.asarray(values[..., 0] if values.ndim == 3 else values)
