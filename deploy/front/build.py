"""A front to one self-contained HTML page that needs no network and no library; looks and tools are the report's."""

from __future__ import annotations

import math
from html import escape

import numpy as np

from deploy.heat import map_image
from deploy.report.packing import packed
from deploy.report.page import Kind, fill
from missions.information import InformationMap, SeveralMaps
from missions.schema import Mission
from missions.shapes import outline
from planner.pareto.episodes import widest_gap
from planner.pareto.front import Front, FrontPoint

MOST_SAMPLES = 40_000  # positions of all plans of a page; with more, plans are drawn more coarsely
_OWN = ("front", "scatter", "parallel", "trajectories", "choose")
_FRONT = Kind("front/front.html", ("report/page.js", *(f"front/{name}.js" for name in _OWN)), style="front/front.css")


def build_front_page(front: Front, file: str) -> str:
    """The page. Everything in it is inline; a content security policy forbids it to ask for more.

    Args:
        front: what is shown.
        file: name of the front's file, for the command that picks a plan from it.
    """
    mission = front.mission
    robots = len(mission.robots)
    return fill(
        _FRONT,
        _data(front, file),
        title=escape(f"{mission.name}: front"),
        kind="Pareto front",
        name=escape(mission.name),
        under={"lede": escape(mission.description), "facts": escape(_facts(front, robots))},
        gap=escape(_gap(front)),
        notes="".join(f"<li>{escape(note)}</li>" for note in front.notes),
        bound=" Dashed: what no plan can be below." if len(front.names) == 2 else "",
    )


def _facts(front: Front, robots: int) -> str:
    return (
        f"{robots} robot{'s' if robots > 1 else ''} · {len(front.names)} map{'s' if len(front.names) > 1 else ''} · "
        f"{len(front.points)} plans, {len(front.best)} of which no other beats on every map · "
        f"hyper-volume {front.hypervolume:.4f}"
    )


def _gap(front: Front) -> str:
    """Where another plan would tell most, in a sentence."""
    gap = widest_gap(front)
    if gap is None:
        return ""
    weights = ", ".join(f"{weight:.2f} {name}" for weight, name in zip(gap.weights, front.names, strict=True))
    share = f"{gap.gain:.1%}"
    return (
        f"Thinnest at weights {weights}: a plan there would add about {share} of what is between the ends (--refine)."
    )


def _data(front: Front, file: str) -> dict[str, object]:
    mission = front.mission
    every = max(
        1, math.ceil(sum(point.plan.q.shape[0] * point.plan.q.shape[1] for point in front.points) / MOST_SAMPLES)
    )
    kept = {index: name for name, index in reversed(front.named.items())}
    return {
        "playback": _clock(front.points[0], every),  # what the report's page.js keeps its time by
        "file": file,
        "names": front.names,
        "ideal": front.distances.tolist(),
        "robots": [robot.name for robot in mission.robots],
        "lower": mission.workspace.lower[:2],
        "upper": mission.workspace.upper[:2],
        "obstacles": [np.round(outline(obstacle), 4).tolist() for obstacle in mission.obstacles],
        "maps": [map_image(single, mission) for single in _singles(mission)],
        "points": [
            {
                "weights": np.round(point.weights, 6).tolist(),
                "vector": point.vector.tolist(),
                "best": index in front.best,
                "name": kept.get(index, ""),
                "parent": point.parent,
                "status": point.status,
                "q": packed(point.plan.q[::every, :, :2].ravel()),
            }
            for index, point in enumerate(front.points)
        ],
        "named": front.named,
    }


def _clock(point: FrontPoint, every: int) -> dict[str, object]:
    t = point.plan.t[::every]
    return {"t0": 0.0, "dt": float(t[1] - t[0]), "n": len(t), "duration": float(t[-1])}


def _singles(mission: Mission) -> list[InformationMap]:
    information = mission.information
    return [item.map for item in information.maps] if isinstance(information, SeveralMaps) else [information]
