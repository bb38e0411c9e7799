"""Stage 1 of 7: the records a mission file is parsed into.

Every field carries its unit, meaning and bounds in :func:`field` metadata; the loader validates with it, the JSON
Schema is generated from it, and error messages quote it. All records are frozen; arrays in them are read-only.
World frame: x, y in the workspace plane, z up, metres, radians unless a unit says otherwise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from missions.arrays import Array
from missions.mappings import FrozenMapping

Vector = tuple[float, ...]

NAME = "[A-Za-z0-9_][A-Za-z0-9_-]{0,63}"  # safe in file names, topics and on a command line


def field(
    doc: str,
    *,
    unit: str = "",
    default: Any = dataclasses.MISSING,  # noqa: ANN401 - a field's default has the field's type
    at_least: float | None = None,
    above: float | None = None,
    at_most: float | None = None,
    below: float | None = None,
    items: tuple[int, int] | None = None,
    pattern: str = "",
) -> Any:  # noqa: ANN401 - like dataclasses.field
    """A record field with its meaning, unit and what is allowed in it.

    Bounds apply to every number in the field, ``items`` is the least and largest length of a list, ``pattern`` a
    regular expression for the whole of a text.
    """
    meta = {
        "doc": doc,
        "unit": unit,
        "at_least": at_least,
        "above": above,
        "at_most": at_most,
        "below": below,
        "items": items,
        "pattern": pattern,
    }
    return dataclasses.field(default=default, metadata=MappingProxyType(meta))


# ------------------------------------------------------------------------------------------------ where and when


@dataclass(frozen=True)
class Workspace:
    """The box that is searched; robots stay inside it while they search."""

    lower: Vector = field("lower corner, one number an axis (2 or 3)", unit="m", items=(2, 3))
    upper: Vector = field("upper corner", unit="m", items=(2, 3))


@dataclass(frozen=True)
class Horizon:
    """Length and sampling of the search."""

    duration: float = field("length of the search", unit="s", above=0.0, at_most=3600.0)
    dt: float = field("planning time step", unit="s", above=0.0, at_most=10.0, default=0.1)


# ------------------------------------------------------------------------------------------------ information maps


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


InformationMap = GaussianMixtureMap | ImageMap | ArrayMap | UniformMap


@dataclass(frozen=True)
class Basis:
    """Cosine basis of the ergodic metric."""

    functions_per_axis: int = field("number of cosine functions an axis", at_least=2, at_most=50, default=10)


# ------------------------------------------------------------------------------------------------ constraints


@dataclass(frozen=True)
class ProbabilisticConnectivity:
    """Every pair's connection probability reaches a threshold in every sub-period (IMEC, Eq. 8)."""

    range: float = field("communication range R_c", unit="m", above=0.0)
    threshold: float = field("least connection probability ε_c", above=0.0, below=1.0)
    sub_periods: int = field("number of equal sub-periods N_p", at_least=1, default=1)
    indicator: Literal["gaussian"] = field("shape of the connection indicator Γ", default="gaussian")
    pairs: Literal["all"] = field("which pairs must connect", default="all")
    policy: Literal["probabilistic"] = "probabilistic"


@dataclass(frozen=True)
class NoConnectivity:
    """Robots need not meet (IMEC baseline B2); meetings are still reported if a range is given."""

    range: float | None = field("communication range, for reporting only", unit="m", above=0.0, default=None)
    policy: Literal["none"] = "none"


Connectivity = ProbabilisticConnectivity | NoConnectivity


@dataclass(frozen=True)
class CircleObstacle:
    """A vertical cylinder seen from above; robots' centres stay outside."""

    center: Vector = field("centre (x, y)", unit="m", items=(2, 2))
    radius: float = field("radius", unit="m", above=0.0)
    type: Literal["circle"] = "circle"


Obstacle = CircleObstacle


@dataclass(frozen=True)
class Limits:
    """What every robot may do while it searches."""

    acceleration: float = field("largest acceleration per axis, |u|", unit="m/s²", above=0.0, at_most=20.0)
    speed: float = field("largest speed (Euclidean norm)", unit="m/s", above=0.0, at_most=10.0, default=1.0)
    separation: float = field("smallest distance between two robots' centres", unit="m", at_least=0.0, default=0.3)


# ------------------------------------------------------------------------------------------------ robots and flight


@dataclass(frozen=True)
class Robot:
    """One Crazyflie."""

    name: str = field("unique name, used in files and logs: letters, digits, '_' and '-'", pattern=NAME)
    start: Vector = field("where the search starts", unit="m", items=(2, 3))
    uri: str = field("cflib link URI on hardware, e.g. radio://0/80/2M/E7E7E7E701", default="")
    pad: Vector | None = field(
        "(x, y) of the landing pad it takes off from; default: under the start", unit="m", default=None, items=(2, 2)
    )
    rigid_body: str = field("name of its body in the motion-capture system; default: the robot's name", default="")


@dataclass(frozen=True)
class Flight:
    """Everything around the search: heights, durations, on-board settings, rates."""

    altitude: float = field(
        "height of the search above the floor (2-D workspaces)",
        unit="m",
        above=0.0,
        at_most=10.0,
        default=0.6,
    )
    takeoff_duration: float = field("time to climb to the altitude", unit="s", at_least=0.5, at_most=30.0, default=3.0)
    landing_duration: float = field("time to descend to the floor", unit="s", at_least=0.5, at_most=30.0, default=3.0)
    transfer_speed: float = field(
        "mean speed of moves to the start points", unit="m/s", above=0.0, at_most=3.0, default=0.3
    )
    settle_time: float = field(
        "hover before the search starts and before landing", unit="s", at_least=0.0, at_most=60.0, default=2.0
    )
    airframe: str = field("an airframe of airframes.yaml", default="cf21")
    controller: Literal["pid", "mellinger"] = field("on-board controller", default="mellinger")
    pose_rate: float = field("external poses sent to each drone", unit="Hz", at_least=5.0, at_most=200.0, default=50.0)
    log_rate: float = field("rate of the drones' own telemetry", unit="Hz", at_least=1.0, at_most=100.0, default=10.0)
    battery_minimum: float = field(
        "least battery voltage for take-off", unit="V", at_least=2.8, at_most=4.3, default=3.7
    )
    geofence_margin: float = field(
        "how far outside the workspace a drone may be before all land",
        unit="m",
        at_least=0.05,
        at_most=10.0,
        default=0.3,
    )
    tracking_limit: float = field("tracking error at which all land", unit="m", above=0.0, at_most=5.0, default=0.3)
    parameters: Mapping[str, float] = field(
        "further on-board parameters to set, 'group.name: value'", default=FrozenMapping()
    )


@dataclass(frozen=True)
class TrajectorySettings:
    """How the plan becomes bytes."""

    tolerance: float = field(
        "largest deviation of what flies from the plan", unit="m", above=0.0, at_most=0.5, default=0.02
    )
    encoding: Literal["auto", "poly4d", "compressed"] = field("trajectory memory format", default="auto")


@dataclass(frozen=True)
class SolverSettings:
    """How long and how hard to search for a plan."""

    seed: int = field("seed of every random choice", at_least=0, default=0)
    time_limit: float = field("stop after this much time", unit="s", above=0.0, default=60.0)
    control_weight: float = field("R: weight of ½ mean u² against log10 E", at_least=0.0, default=0.005)


# ------------------------------------------------------------------------------------------------ the mission


@dataclass(frozen=True)
class MissionSource:
    """What the mission was read from: enough to read it again without the folder."""

    path: str
    text: str
    files: Mapping[str, bytes]  # every file the mission names, as it was when read

    @property
    def sha256(self) -> str:
        """Hash over the mission text and the files it names."""
        import hashlib

        digest = hashlib.sha256(self.text.encode())
        for name in sorted(self.files):
            digest.update(b"\0" + name.encode() + b"\0" + hashlib.sha256(self.files[name]).digest())
        return digest.hexdigest()


@dataclass(frozen=True)
class Mission:
    """A mission: where, what is worth seeing, who searches, under which rules."""

    schema_version: int = field("format of this file; 1", at_least=1, at_most=1)
    name: str = field("short name, used in file names: letters, digits, '_' and '-'", pattern=NAME)
    workspace: Workspace = field("the box that is searched")
    horizon: Horizon = field("length and sampling of the search")
    information: InformationMap = field("where there is something to see")
    robots: tuple[Robot, ...] = field("who searches (1 to 100)", items=(1, 100))
    limits: Limits = field("what every robot may do")
    description: str = field("free text", default="")
    connectivity: Connectivity = field("who has to meet", default=NoConnectivity())
    obstacles: tuple[Obstacle, ...] = field("what to stay out of", default=(), items=(0, 1000))
    basis: Basis = field("cosine basis of the ergodic metric", default=Basis())
    flight: Flight = field("take-off, rates, on-board settings", default=Flight())
    trajectory: TrajectorySettings = field("how the plan becomes bytes", default=TrajectorySettings())
    solver: SolverSettings = field("how to search for a plan", default=SolverSettings())
    source: MissionSource | None = dataclasses.field(
        default=None, repr=False, compare=False, metadata={"internal": True}
    )

    @property
    def dimension(self) -> int:
        """ν: 2 or 3 axes are planned."""
        return len(self.workspace.lower)

    @property
    def steps(self) -> int:
        """T: number of planning steps."""
        return round(self.horizon.duration / self.horizon.dt)
