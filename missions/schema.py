"""Stage 1 of 7: the records a mission file is parsed into.

Every field carries its unit, meaning and bounds in :func:`field` metadata; the loader validates with it, the JSON
Schema is generated from it, and error messages quote it. All records are frozen; arrays in them are read-only.
World frame: x, y in the workspace plane, z up, metres, radians unless a unit says otherwise.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from missions.connectivity import AllTimeConnectivity as AllTimeConnectivity
from missions.connectivity import Connectivity as Connectivity
from missions.connectivity import GuaranteedConnectivity as GuaranteedConnectivity
from missions.connectivity import NoConnectivity as NoConnectivity
from missions.connectivity import PairThreshold as PairThreshold
from missions.connectivity import PeriodicConnectivity as PeriodicConnectivity
from missions.connectivity import ProbabilisticConnectivity as ProbabilisticConnectivity
from missions.connectivity import SimultaneousConnectivity as SimultaneousConnectivity
from missions.decks import DeckName
from missions.dynamics import CasadiModel as CasadiModel
from missions.dynamics import DoubleIntegratorModel as DoubleIntegratorModel
from missions.dynamics import MotionModel as MotionModel
from missions.dynamics import SingleIntegratorModel as SingleIntegratorModel
from missions.fields import NAME
from missions.fields import Vector as Vector
from missions.fields import field as field
from missions.flight import Flight as Flight
from missions.footprint import Footprint as Footprint
from missions.information import ArrayMap as ArrayMap
from missions.information import Gaussian as Gaussian
from missions.information import GaussianMixtureMap as GaussianMixtureMap
from missions.information import ImageMap as ImageMap
from missions.information import InformationMap as InformationMap
from missions.information import NamedMap as NamedMap
from missions.information import SeveralMaps as SeveralMaps
from missions.information import UniformMap as UniformMap
from missions.motion_capture import MotionCapture as MotionCapture
from missions.objects import InspectedObject as InspectedObject
from missions.obstacles import CircleObstacle as CircleObstacle
from missions.obstacles import Obstacle as Obstacle
from missions.obstacles import Zone
from missions.radio import Radio as Radio
from missions.replanning import MapChange as MapChange
from missions.replanning import Replanning as Replanning
from missions.safety import Safety as Safety
from missions.trajectory import FacingYaw as FacingYaw
from missions.trajectory import FixedYaw as FixedYaw
from missions.trajectory import PathYaw as PathYaw
from missions.trajectory import TrajectorySettings as TrajectorySettings
from missions.trajectory import Yaw as Yaw

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


@dataclass(frozen=True)
class Basis:
    """Cosine basis of the ergodic metric."""

    functions_per_axis: int = field("number of cosine functions an axis", at_least=2, at_most=50, default=10)


# ------------------------------------------------------------------------------------------------ constraints


@dataclass(frozen=True)
class Limits:
    """What every robot may do while it searches."""

    acceleration: float = field("largest acceleration per axis, |u|", unit="m/s²", above=0.0, at_most=20.0)
    speed: float = field("largest speed (Euclidean norm)", unit="m/s", above=0.0, at_most=10.0, default=1.0)
    separation: float = field("smallest distance between two robots' centres", unit="m", at_least=0.0, default=0.3)
    vertical_separation: float | None = field(
        "smallest distance of two robots one above the other: downwash reaches farther down than aside, so distances "
        "are kept in an ellipsoid with this half height; default: 'separation', a sphere",
        unit="m",
        above=0.0,
        default=None,
    )


# ------------------------------------------------------------------------------------------------ robots and flight


@dataclass(frozen=True)
class RobotLimits:
    """What one robot may do where it differs from the others."""

    acceleration: float | None = field(
        "largest acceleration per axis; default: the mission's", unit="m/s²", above=0.0, at_most=20.0, default=None
    )
    speed: float | None = field(
        "largest speed; default: the mission's", unit="m/s", above=0.0, at_most=10.0, default=None
    )


@dataclass(frozen=True)
class Robot:
    """One Crazyflie."""

    name: str = field("unique name, used in files and logs: letters, digits, '_' and '-'", pattern=NAME)
    start: Vector = field("where the search starts", unit="m", items=(2, 3))
    uri: str = field("cflib link URI on hardware, e.g. radio://0/80/2M/E7E7E7E701", default="")
    pad: Vector | None = field(
        "(x, y) of the landing pad it takes off from; default: under the start", unit="m", default=None, items=(2, 2)
    )
    end: Vector | Literal["start"] | None = field(
        "where its search ends, exactly: a point, or 'start' to come back; default: wherever is best",
        unit="m",
        default=None,
        items=(2, 3),
    )
    altitude: float | None = field(
        "its own height above the floor (2-D workspaces); default: flight.altitude",
        unit="m",
        above=0.0,
        at_most=10.0,
        default=None,
    )
    velocity: Vector | None = field(
        "velocity at the start of the search, for studies only: the certificate grants no flight from hover that "
        "begins in motion; default: at rest",
        unit="m/s",
        default=None,
        items=(2, 3),
    )
    limits: RobotLimits = field("where it differs from the mission's limits", default=RobotLimits())
    footprint: Footprint | None = field("what it sees; default: the mission's footprint", default=None)
    rigid_body: str = field("name of its body in the motion-capture system; default: the robot's name", default="")
    decks: tuple[DeckName, ...] = field(
        "expansion decks on it, which it has to find before it flies; what else it carries does not matter",
        default=(),
        items=(0, 7),
    )


@dataclass(frozen=True)
class SolverSettings:
    """How long and how hard to search for a plan."""

    method: Literal["fast", "imec"] = field(
        "fast: this project's; imec: the paper's Algorithm 1, the reference, many times slower", default="fast"
    )
    seed: int = field("seed of every random choice", at_least=0, default=0)
    time_limit: float = field("stop after this much time", unit="s", above=0.0, default=60.0)
    starts: int = field(
        "random first guesses that race in each process; 0: as many as suit the problem",
        at_least=0,
        at_most=1000,
        default=0,
    )
    processes: int = field(
        "searches at the same time, each with its own starts; the best plan wins", at_least=1, at_most=256, default=1
    )
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
    zones: tuple[Zone, ...] = field("where some or all robots stay out or in", default=(), items=(0, 1000))
    basis: Basis = field("cosine basis of the ergodic metric", default=Basis())
    footprint: Footprint | None = field(
        "what every robot sees of the floor, or of the object: the information is then on the floor, in two axes, or "
        "on the object, and what is seen is compared with it; default: robots are where they are, in as many axes as "
        "the workspace has",
        default=None,
    )
    object: InspectedObject | None = field(
        "a thing that cameras look at from all sides: the information is what the maps put on its surface", default=None
    )
    dynamics: MotionModel = field("how robots move when controlled", default=DoubleIntegratorModel())
    flight: Flight = field("take-off, rates, on-board settings", default=Flight())
    trajectory: TrajectorySettings = field("how the plan becomes bytes", default=TrajectorySettings())
    solver: SolverSettings = field("how to search for a plan", default=SolverSettings())
    radio: Radio = field("what the radio carries, and how punctual it is", default=Radio())
    motion_capture: MotionCapture = field(
        "how motion capture sees the robots, and in which frame", default=MotionCapture()
    )
    safety: Safety = field("what happens when something goes wrong", default=Safety())
    replanning: Replanning = field("maps that change in flight, and when new trajectories begin", default=Replanning())
    source: MissionSource | None = dataclasses.field(
        default=None, repr=False, compare=False, metadata={"internal": True}
    )

    @property
    def dimension(self) -> int:
        """ν: 2 or 3 axes are planned."""
        return len(self.workspace.lower)

    @property
    def footprints(self) -> tuple[Footprint, ...]:
        """What each robot sees of the floor; empty where robots do not look down at it."""
        if self.footprint is None:
            return ()
        return tuple(self.footprint if robot.footprint is None else robot.footprint for robot in self.robots)

    @property
    def information_axes(self) -> int:
        """Axes of the information: the workspace's, or the floor's two if robots look down at it."""
        return self.dimension if self.footprint is None or self.object is not None else 2

    @property
    def steps(self) -> int:
        """T: number of planning steps."""
        return round(self.horizon.duration / self.horizon.dt)
