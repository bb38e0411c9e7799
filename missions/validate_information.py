"""Checks of the information maps: each by itself, and several of them against each other."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from missions.arrays import Array
from missions.errors import MissionError
from missions.information import ArrayMap, Gaussian, GaussianMixtureMap, ImageMap, SeveralMaps, single_maps
from missions.schema import Mission

ErrorAt = Callable[[str, str], MissionError]
SUM_TOLERANCE = 1e-6  # of weights written by people, e.g. three times 0.3333333
_OUTSIDE_SIGMAS = 6.0


def check_information(mission: Mission, error: ErrorAt) -> None:
    """Check the maps as they are written, before files are read.

    Raises:
        MissionError: the first thing found wrong.
    """
    for i, robot in enumerate(mission.robots):
        if robot.footprint is not None and mission.footprint is None:
            reason = "got a robot's own where the mission has none; allowed: beside a footprint of the mission"
            raise error(reason, f"robots[{i}].footprint")
    for where, single in single_maps(mission.information):
        if isinstance(single, GaussianMixtureMap):
            for i, component in enumerate(single.components):
                _check_gaussian(mission, component, f"{where}.components[{i}]", error)
    if isinstance(mission.information, SeveralMaps):
        _check_names(mission.information, error)
        _check_weights(mission.information, error)


def check_sizes(mission: Mission, error: ErrorAt) -> None:
    """Check that maps read from files have as many cells an axis: else one of them is of another place or scale.

    Raises:
        MissionError: names the first that differs from the first map that was read from a file.
    """
    first: tuple[str, tuple[int, ...]] | None = None
    for where, single in single_maps(mission.information):
        if not isinstance(single, ImageMap | ArrayMap) or single.density is None:
            continue
        shape = single.density.shape
        if first is not None and shape != first[1]:
            reason = f"got a map of {_cells(shape)} cells; allowed: {_cells(first[1])}, as {first[0]!r} has"
            raise error(reason, f"{where}.file")
        first = first or (single.file, shape)


def _cells(shape: tuple[int, ...]) -> str:
    return " × ".join(map(str, shape))


def _check_names(information: SeveralMaps, error: ErrorAt) -> None:
    for number, name in enumerate(information.names):
        if name in information.names[:number]:
            raise error(f"got {name!r} twice; allowed: a name for each map", f"information.maps[{number}].name")


def _check_weights(information: SeveralMaps, error: ErrorAt) -> None:
    if (weights := information.weights) is None:
        return
    if len(weights) != len(information.maps):
        allowed = f"{len(information.maps)}, one for each map"
        raise error(f"got {len(weights)} weights; allowed: {allowed}", "information.weights")
    if abs(math.fsum(weights) - 1.0) > SUM_TOLERANCE:
        raise error(f"got weights that sum to {math.fsum(weights):g}; allowed: a sum of 1", "information.weights")


def _check_gaussian(mission: Mission, gaussian: Gaussian, where: str, error: ErrorAt) -> None:
    nu = mission.information_axes
    if len(gaussian.mean) != nu:
        whose = "workspace" if mission.footprint is None else "floor, which is looked at,"
        raise error(f"got {len(gaussian.mean)} numbers; allowed: {nu}, as the {whose} has", f"{where}.mean")
    matrix = _covariance(gaussian, nu)
    if matrix is None:
        allowed = f"a number, {nu} numbers, or a {nu} × {nu} matrix [m²]"
        raise error(f"got {str(gaussian.covariance)[:60]}; allowed: {allowed}", f"{where}.covariance")
    if not np.allclose(matrix, matrix.T, rtol=1e-9, atol=0.0):
        raise error("got a matrix that is not symmetric; allowed: a symmetric one [m²]", f"{where}.covariance")
    least = float(np.linalg.eigvalsh(matrix)[0])
    if not least > 1e-12 * float(np.abs(matrix).max()):
        raise error(
            f"not positive definite (least eigenvalue {least:.3g}); allowed: above 0 [m²]", f"{where}.covariance"
        )
    lower, upper = mission.workspace.lower[:nu], mission.workspace.upper[:nu]
    if mission.object is not None:
        lower = (*lower[:2], 0.0)  # things stand on the floor, below where robots fly
    box = zip(lower, upper, gaussian.mean, np.diag(matrix), strict=True)
    for low, high, mean, variance in box:
        # All of the Gaussian that is in the workspace is in this slab, so less than 1e-9 of it is in the workspace.
        if max(low - mean, mean - high) > _OUTSIDE_SIGMAS * math.sqrt(variance):
            raise error("this Gaussian has nothing inside the workspace; is its centre right?", f"{where}.mean")


def _covariance(gaussian: Gaussian, nu: int) -> Array | None:
    """The full covariance matrix; None if the shape is wrong."""
    value = gaussian.covariance
    if isinstance(value, float):
        return value * np.eye(nu)
    if any(isinstance(row, tuple) and len(row) != nu for row in value):
        return None
    array = np.array(value, dtype=np.float64)
    if array.shape == (nu,):
        return np.diag(array)
    return array if array.shape == (nu, nu) else None
