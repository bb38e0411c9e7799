"""Coefficients φ_k of information maps, normalised so that φ_0 = 1.

Gaussian mixtures are summed on the fine grid of the IMEC authors' published code (50 points a metre of the longest
side, both ends included, mixture unnormalised and cut off at the box), so that E compares to the last digit.
"""

from __future__ import annotations

import numpy as np

from missions.arrays import Array, frozen
from missions.information import (
    ArrayMap,
    Gaussian,
    GaussianMixtureMap,
    ImageMap,
    InformationMap,
    SeveralMaps,
    UniformMap,
)
from planner.ergodic.basis import CosineBasis
from planner.errors import PlannerError

GRID_POINTS_PER_METRE = 50  # authors' code
GRID_POINTS_RANGE = {2: (100, 1000), 3: (40, 120)}  # keeps tiny and huge boxes affordable


def information_coefficients(information: InformationMap, basis: CosineBasis) -> Array:
    """φ_k of a mission's information map over the basis' box, shape (n,)*ν, read-only.

    Of several maps, the weighted sum of their coefficients (SLES, Eq. 4): each counts by its weight, not by its mass.
    """
    if isinstance(information, SeveralMaps):
        weighted = zip(information.shares, information.maps, strict=True)
        return frozen(sum(w * information_coefficients(item.map, basis) for w, item in weighted))
    if isinstance(information, GaussianMixtureMap):
        return gaussian_mixture(information.components, basis)
    if isinstance(information, UniformMap):
        return uniform(basis)
    if isinstance(information, ImageMap | ArrayMap):
        if information.density is None:
            raise PlannerError(f"information map {information.file!r} was not loaded: its density is missing")
        return cell_density(information.density, basis)
    raise TypeError(f"unknown information map {type(information).__name__}")


def uniform(basis: CosineBasis) -> Array:
    """φ_k of the uniform density: exactly one non-zero coefficient."""
    phi_k = np.zeros((basis.n,) * basis.dimension)
    phi_k[(0,) * basis.dimension] = 1.0
    return frozen(phi_k)


def cell_density(density: Array, basis: CosineBasis) -> Array:
    """φ_k of a density given by cell, indexed [x, y(, z)]; cells tile the box, each counts at its centre.

    Raises:
        PlannerError: wrong number of axes, negative or no information at all.
    """
    density = np.asarray(density, dtype=np.float64)
    if density.ndim != basis.dimension:
        raise PlannerError(f"an information array needs {basis.dimension} axes; got shape {density.shape}")
    if not np.isfinite(density).all() or (density < 0.0).any() or density.sum() <= 0.0:
        raise PlannerError("an information array must be finite and non-negative, and not zero everywhere")
    w = [(np.arange(cells) + 0.5) / cells for cells in density.shape]
    return _sum_on_grid(density, w, basis)


def gaussian_mixture(components: tuple[Gaussian, ...], basis: CosineBasis) -> Array:
    """φ_k of a mixture of Gaussians (weights relative), on the authors' fine grid.

    Each component is weight · N(mean, covariance) up to the box's share of it, as in the authors' code.
    """
    side = basis.upper - basis.lower
    low, high = GRID_POINTS_RANGE[basis.dimension]
    points = min(max(int(side.max() * GRID_POINTS_PER_METRE), low), high)
    w = [np.linspace(0.0, 1.0, points)] * basis.dimension
    x = [basis.lower[d] + w[d] * side[d] for d in range(basis.dimension)]
    density = np.zeros((points,) * basis.dimension)
    for component in components:
        density += _gaussian(component, x)
    if density.sum() <= 0.0:
        raise PlannerError("the Gaussians put no information inside the workspace")
    return _sum_on_grid(density, w, basis)


def _gaussian(component: Gaussian, x: list[Array]) -> Array:
    """Weight · N(mean, covariance) on the grid spanned by the axes ``x``."""
    nu = len(x)
    covariance = np.asarray(component.covariance, dtype=np.float64)
    if covariance.ndim == 0:
        covariance = covariance * np.eye(nu)
    elif covariance.ndim == 1:
        covariance = np.diag(covariance)
    precision = np.linalg.inv(covariance)
    delta = np.stack(np.meshgrid(*[x[d] - component.mean[d] for d in range(nu)], indexing="ij"))
    exponent = np.einsum("a...,ab,b...->...", delta, precision, delta)
    scale = component.weight / np.sqrt(np.linalg.det(2.0 * np.pi * covariance))
    density: Array = scale * np.exp(-0.5 * exponent)
    return density


def _sum_on_grid(density: Array, w: list[Array], basis: CosineBasis) -> Array:
    """Σ density · F_k over a grid with unit-box axes ``w``, divided by its own k = 0 term."""
    phi_k = density
    for axis in w:  # each pass consumes the leading axis and appends a frequency axis
        phi_k = np.tensordot(phi_k, np.cos(np.pi * np.outer(axis, np.arange(basis.n))), axes=(0, 0))
    phi_k = phi_k / phi_k[(0,) * basis.dimension]
    return frozen(phi_k / basis.h_k)
