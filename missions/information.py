"""Where there is something to see: one information map, or several that are weighed against each other."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from missions.arrays import Array
from missions.fields import NAME, Vector, field

MOST_MAPS = 6  # a front over more cannot be looked at, and covering its weights takes thousands of plans


@dataclass(frozen=True)
class Gaussian:
    """One component of a Gaussian mixture."""

    mean: Vector = field("centre", unit="m", items=(2, 3))
    covariance: float | Vector | tuple[Vector, ...] = field(
        "a number (isotropic), a diagonal, or a full matrix", unit="m²"
    )
    weight: float = field("share of the information", above=0.0, default=1.0)


@dataclass(frozen=True)
class GaussianMixtureMap:
    """Information as a sum of Gaussians; weights are normalised."""

    components: tuple[Gaussian, ...] = field("the Gaussians", items=(1, 1000))
    type: Literal["gaussians"] = "gaussians"


@dataclass(frozen=True)
class ImageMap:
    """Information as the brightness of a grayscale image stretched over the workspace (top row = upper y edge)."""

    file: str = field("PNG file, relative to the mission file")
    invert: bool = field("dark means much information", default=False)
    type: Literal["image"] = "image"
    density: Array | None = dataclasses.field(default=None, repr=False, compare=False, metadata={"internal": True})


@dataclass(frozen=True)
class ArrayMap:
    """Information as a NumPy array over the workspace, indexed [x, y(, z)], non-negative, cell-centred."""

    file: str = field(".npy file, relative to the mission file (pickled objects are refused)")
    type: Literal["array"] = "array"
    density: Array | None = dataclasses.field(default=None, repr=False, compare=False, metadata={"internal": True})


@dataclass(frozen=True)
class UniformMap:
    """The same information everywhere."""

    type: Literal["uniform"] = "uniform"


SingleMap = GaussianMixtureMap | ImageMap | ArrayMap | UniformMap


@dataclass(frozen=True)
class NamedMap:
    """One of several information maps."""

    name: str = field("what the map shows: letters, digits, '_' and '-'", pattern=NAME)
    map: SingleMap = field("where that is")


@dataclass(frozen=True)
class SeveralMaps:
    """Several information maps: a plan is for their weighted sum, a Pareto front covers all weights."""

    maps: tuple[NamedMap, ...] = field("the maps", items=(2, MOST_MAPS))
    weights: Vector | None = field(
        "what each map counts in a plan, and where a Pareto front begins; they sum to 1; default: all the same",
        at_least=0.0,
        at_most=1.0,
        items=(2, MOST_MAPS),
        default=None,
    )
    type: Literal["several"] = "several"

    @property
    def shares(self) -> Vector:
        """The weights, whether they are written out or not."""
        return self.weights if self.weights is not None else (1.0 / len(self.maps),) * len(self.maps)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the maps."""
        return tuple(item.name for item in self.maps)


InformationMap = GaussianMixtureMap | ImageMap | ArrayMap | UniformMap | SeveralMaps


def single_maps(information: InformationMap) -> Iterator[tuple[str, SingleMap]]:
    """Each map with its path in a mission file."""
    if isinstance(information, SeveralMaps):
        for number, item in enumerate(information.maps):
            yield f"information.maps[{number}].map", item.map
    else:
        yield "information", information


def with_maps(information: InformationMap, maps: tuple[SingleMap, ...]) -> InformationMap:
    """The same information with other maps in it, in the order of :func:`single_maps`."""
    if not isinstance(information, SeveralMaps):
        return maps[0]
    named = (dataclasses.replace(item, map=single) for item, single in zip(information.maps, maps, strict=True))
    return dataclasses.replace(information, maps=tuple(named))
