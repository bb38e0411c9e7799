"""Information maps as images: the floor of the playback, and of viewers of plans and logs."""

from __future__ import annotations

import base64
import functools
from collections.abc import Sequence

import numpy as np

from missions.arrays import Array
from missions.information import ArrayMap, Gaussian, GaussianMixtureMap, ImageMap, InformationMap, SeveralMaps
from missions.objects import Surface
from missions.schema import Mission

_LONG_SIDE = 120  # pixels
_POINTS_ACROSS = 16  # cells across a surface: of points there are few


def heat_image(mission: Mission) -> dict[str, object]:
    """Brightness 0..255, row 0 at the lower y edge: ``{"width", "height", "data"}``; 3-D maps summed over z."""
    return map_image(mission.information, mission)


def map_image(information: InformationMap, mission: Mission) -> dict[str, object]:
    """The same for one of several maps, over the mission's workspace; dark where it is an object that is looked at."""
    return _image(np.zeros((2, 2)) if mission.object is not None else _density(information, mission))


def top_view(surface: Surface, lower: Array, upper: Array) -> dict[str, object]:
    """The information on a surface seen from above, over a box with corners (2,) [m]."""
    side = upper - lower
    cells = np.maximum(2, np.round(_POINTS_ACROSS * side / side.max()).astype(np.intp))
    x, y = np.clip((surface.points[:, :2] - lower) / side * cells, 0, cells - 1).astype(np.intp).T
    density = np.zeros((cells[0], cells[1]))
    np.add.at(density, (x, y), surface.share)
    return _image(density)


def _image(density: Array) -> dict[str, object]:
    top = float(density.max())
    pixels = np.round(255.0 * density / top if top > 0.0 else density).astype(np.uint8).T  # (y, x)
    height, width = pixels.shape
    return {"width": width, "height": height, "data": base64.b64encode(pixels.tobytes()).decode()}


def _density(information: InformationMap, mission: Mission) -> Array:
    """(W, H) density, not normalised, at cell centres of the floor."""
    if isinstance(information, SeveralMaps):
        return _weighted([_density(item.map, mission) for item in information.maps], information.shares)
    if isinstance(information, ImageMap | ArrayMap) and information.density is not None:
        flat = information.density.sum(axis=2) if information.density.ndim == 3 else information.density
        step = max(1, max(flat.shape) // (2 * _LONG_SIDE))
        return flat[::step, ::step]
    lower, upper = np.array(mission.workspace.lower[:2]), np.array(mission.workspace.upper[:2])
    side = upper - lower
    cells = np.maximum(2, np.round(_LONG_SIDE * side / side.max()).astype(int))
    x, y = (lower[d] + side[d] * (np.arange(cells[d]) + 0.5) / cells[d] for d in range(2))
    if not isinstance(information, GaussianMixtureMap):
        return np.full((cells[0], cells[1]), 0.15)  # the same everywhere: a faint tint
    return functools.reduce(np.add, (_gaussian(component, x, y) for component in information.components))


def _weighted(densities: Sequence[Array], weights: Sequence[float]) -> Array:
    """The weighted sum of densities that each count the same, on the cells of the finest."""
    finest = max((density.shape for density in densities), key=lambda shape: shape[0] * shape[1])
    total = np.zeros(finest)
    for density, weight in zip(densities, weights, strict=True):
        x, y = ((np.arange(cells) + 0.5) / cells for cells in finest)
        nearest = density[np.ix_(*((w * n).astype(int) for w, n in zip((x, y), density.shape, strict=True)))]
        total += weight * nearest / nearest.sum()
    return total


def _gaussian(component: Gaussian, x: Array, y: Array) -> Array:
    """A component's marginal in the plane, which for a Gaussian is that part of its covariance."""
    C = np.asarray(component.covariance, dtype=np.float64)
    C = (C * np.eye(2) if C.ndim == 0 else np.diag(C) if C.ndim == 1 else C)[:2, :2]
    offset = np.stack(np.meshgrid(x - component.mean[0], y - component.mean[1], indexing="ij"), axis=-1)
    exponent = np.einsum("xyi,ij,xyj->xy", offset, np.linalg.inv(C), offset)
    values: Array = component.weight / np.sqrt(np.linalg.det(C)) * np.exp(-0.5 * exponent)
    return values
