"""Missions the planner's tests and benchmarks share, built from the records (no files)."""

from __future__ import annotations

import json
from pathlib import Path

from missions.obstacles import (
    BoxObstacle,
    CircleObstacle,
    CylinderObstacle,
    KeepInZone,
    KeepOutZone,
    PolygonObstacle,
)
from missions.schema import (
    Connectivity,
    Gaussian,
    GaussianMixtureMap,
    Horizon,
    Limits,
    Mission,
    NoConnectivity,
    ProbabilisticConnectivity,
    Robot,
    RobotLimits,
    SolverSettings,
    UniformMap,
    Workspace,
)

GOLDEN = Path(__file__).parents[1] / "golden"
NOTEBOOK_MEANS = ((1.0, 0.8), (0.5, 1.7), (2.0, 1.7), (2.5, 0.8))


def notebook() -> dict:
    """What the authors' code reached on their notebook case."""
    return json.loads((GOLDEN / "imec_notebook.json").read_text())


def imec(**changes) -> Mission:
    """The authors' notebook case."""
    fields = {
        "schema_version": 1,
        "name": "imec",
        "workspace": Workspace((0.0, 0.0), (3.0, 2.5)),
        "horizon": Horizon(30.0, 0.1),
        "information": GaussianMixtureMap(tuple(Gaussian(mean, 0.03, 0.25) for mean in NOTEBOOK_MEANS)),
        "robots": robots(*((0.5 + 0.7 * i, 0.3) for i in range(4))),
        "limits": Limits(0.5, 1.0, 0.3),
        "connectivity": ProbabilisticConnectivity(range=0.5, sub_periods=3, threshold=0.25),
        "obstacles": (CircleObstacle((1.3, 1.5), 0.3), CircleObstacle((1.8, 0.7), 0.3)),
    }
    return Mission(**{**fields, **changes})


def scaling(count: int, *, sub_periods: int = 1, stretched: bool = False, **changes) -> Mission:
    """The scaling experiment of IMEC VII-G: 10 × 10 m, 100 steps of 1 s; the map in the corner, or stretched."""
    scale = (10.0 / 3.0, 4.0) if stretched else (1.0, 1.0)
    gaussians = tuple(
        Gaussian((x * scale[0], y * scale[1]), (0.03 * scale[0] ** 2, 0.03 * scale[1] ** 2), 0.25)
        for x, y in NOTEBOOK_MEANS
    )
    pitch = 2.1 / (count - 1) if stretched else 0.7  # stretched: the notebook's span shared by all, times the scale
    starts = [((0.5 + pitch * i) * scale[0], 0.3 * scale[1]) for i in range(count)]
    fields = {
        "name": f"scaling-{count}",
        "workspace": Workspace((0.0, 0.0), (10.0, 10.0)),
        "horizon": Horizon(100.0, 1.0),
        "information": GaussianMixtureMap(gaussians),
        "robots": robots(*starts),
        "limits": Limits(0.5, 10.0, 0.3),
        "connectivity": ProbabilisticConnectivity(range=0.5, sub_periods=sub_periods, threshold=0.2),
        "obstacles": (),
    }
    return imec(**{**fields, **changes})


def small(connectivity: Connectivity | None = None, **changes) -> Mission:
    """Two drones, 8 s: solved in a fraction of a second."""
    return imec(
        **{
            "name": "small",
            "workspace": Workspace((-1.0, -1.0), (1.0, 1.0)),
            "horizon": Horizon(8.0, 0.1),
            "information": GaussianMixtureMap((Gaussian((-0.4, 0.2), 0.08, 1.0), Gaussian((0.5, -0.3), 0.05, 1.0))),
            "robots": robots((-0.6, -0.6), (0.6, -0.6)),
            "connectivity": NoConnectivity(range=0.5) if connectivity is None else connectivity,
            "obstacles": (CircleObstacle((0.0, 0.0), 0.2),),
            "solver": SolverSettings(time_limit=60.0),
            **changes,
        }
    )


def box(**changes) -> Mission:
    """Three drones in three dimensions."""
    return small(
        ProbabilisticConnectivity(range=0.6, sub_periods=2, threshold=0.2),
        **{
            "name": "box",
            "workspace": Workspace((-1.0, -1.0, 0.3), (1.0, 1.0, 1.5)),
            "information": UniformMap(),
            "robots": robots((-0.5, -0.5, 0.6), (0.5, -0.5, 0.6), (0.0, 0.6, 1.0)),
            **changes,
        },
    )


def furnished(**changes) -> Mission:
    """Three drones in a room full of everything: each kind of obstacle and zone, limits and ends of single robots."""
    quad = ((0.3, -0.9), (0.8, -0.8), (0.7, -0.4), (0.35, -0.5))
    return small(
        **{
            "name": "furnished",
            "workspace": Workspace((-1.0, -1.0, 0.3), (1.0, 1.0, 1.5)),
            "information": UniformMap(),
            "robots": (
                Robot("r0", (-0.8, -0.8, 0.6), end="start", limits=RobotLimits(acceleration=0.4)),
                Robot("r1", (0.9, -0.2, 0.6), velocity=(0.2, 0.1, -0.1), limits=RobotLimits(speed=0.7)),
                Robot("r2", (0.0, 0.8, 1.2), end=(-0.6, 0.7, 0.5)),
            ),
            "limits": Limits(0.5, 1.0, 0.3, vertical_separation=0.5),
            "obstacles": (
                CircleObstacle((0.0, 0.3), 0.2),
                CylinderObstacle((-0.3, -0.3), 0.25, height=0.8),
                BoxObstacle((0.4, 0.4, 0.6), (0.7, 0.7, 1.0), rotation=0.4),
                PolygonObstacle(quad, height=1.0),
            ),
            "zones": (
                KeepOutZone(((0.6, 1.0), (1.0, 1.0), (1.0, 0.6))),
                KeepInZone(((-1.0, -1.0), (0.5, -1.0), (0.5, 0.9), (-1.0, 0.9)), robots=("r0", "r2")),
            ),
            **changes,
        },
    )


def layered(**changes) -> Mission:
    """Three drones at heights of their own over the small problem's map."""
    return small(
        **{
            "name": "layered",
            "robots": (
                Robot("r0", (-0.6, -0.6), altitude=0.5),
                Robot("r1", (0.6, -0.6), altitude=0.7, end="start"),
                Robot("r2", (0.0, 0.6), altitude=1.3),
            ),
            "limits": Limits(0.5, 1.0, 0.3, vertical_separation=0.5),
            "obstacles": (CylinderObstacle((0.0, 0.0), 0.25, height=1.0),),
            **changes,
        }
    )


def robots(*starts: tuple[float, ...]) -> tuple[Robot, ...]:
    """Robots named r0, r1, .. at their starts."""
    return tuple(Robot(f"r{i}", start) for i, start in enumerate(starts))
