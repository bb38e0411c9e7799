"""Information at given points: maps as functions of where one looks, not as coefficients."""

from __future__ import annotations

import numpy as np

from missions.arrays import Array
from missions.information import ArrayMap, Gaussian, GaussianMixtureMap, ImageMap, InformationMap


def information_at(information: InformationMap, x: Array, lower: Array, upper: Array) -> Array:
    """(J,) density of one map at points, in any unit.

    Args:
        information: the map, its file read.
        x: (J, ν) [m].
        lower: (ν,) corner of the box that maps from files are stretched over [m]; points beyond it count as its edge.
        upper: (ν,) and the other.
    """
    if isinstance(information, GaussianMixtureMap):
        return np.asarray(sum(_gaussian(component, x) for component in information.components))
    if isinstance(information, ImageMap | ArrayMap):
        if information.density is None:
            raise ValueError(f"information map {information.file!r} was not loaded: its density is missing")
        cells = np.array(information.density.shape)
        index = np.clip(((x - lower) / (upper - lower) * cells).astype(np.intp), 0, cells - 1)
        return np.asarray(information.density[tuple(index.T)])
    return np.ones(len(x))


def _gaussian(component: Gaussian, x: Array) -> Array:
    nu = x.shape[1]
    C = np.asarray(component.covariance, dtype=np.float64)
    C = C * np.eye(nu) if C.ndim == 0 else np.diag(C) if C.ndim == 1 else C
    away = x - np.array(component.mean)
    exponent = np.einsum("ja,ab,jb->j", away, np.linalg.inv(C), away)
    return np.asarray(component.weight / np.sqrt(np.linalg.det(2.0 * np.pi * C)) * np.exp(-0.5 * exponent))
