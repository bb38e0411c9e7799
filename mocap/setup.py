"""From what a mission's capture system reports to what flights need: robots' centres in the world frame, by name.

:func:`seen_by` is the way back: what the system that the mission describes would report of simulated bodies. Rehearsals
use both, one after the other, so that a mission's frame, units and markers are rehearsed with everything else.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from missions.fleet import accelerations, pads
from missions.schema import Mission
from missions.schema import MotionCapture as Setup
from mocap.frames import CaptureFrame, MappedSource, RigidTransform, Vec3
from mocap.source import MocapFrame, MocapSource, Pose
from mocap.system import SystemMocap
from mocap.systems import library_for
from mocap.tracking.settings import Settings
from mocap.tracking.source import MarkerSource
from mocap.tracking.tracker import Tracker

Reference = Callable[[str, float], Vec3 | None]


def open_system(system: str, host: str, mission: Mission, now: Callable[[], float]) -> MocapSource:
    """Connect to a system, in the way a mission's robots are tracked.

    Args:
        system: its name, e.g. ``vicon``.
        host: address of its server; empty: the library's default.
        mission: says how robots are tracked.
        now: the flight clock's time [s].

    Raises:
        MocapUnavailable: nothing talks to it, or what does is not installed. MocapConnectError: no connection.
    """
    library = library_for(system, mission.motion_capture.tracking)
    return SystemMocap(system, {"hostname": host} if host else {}, now, library=library)


def in_world(source: MocapSource, mission: Mission, reference: Reference | None = None) -> MocapSource:
    """The poses of a mission's robots.

    Args:
        source: what the system reports, in its own frame and units; closed with the result.
        mission: says how robots are tracked and what that frame is.
        reference: where a robot should be at a time [m], None if nobody knows; helps where markers are confused.

    Returns:
        A source of the robots' centres in the world frame, under the names of their bodies.
    """
    setup = mission.motion_capture
    if setup == Setup():
        return source
    world: MocapSource = MappedSource(source, _frame_of(setup).to_world)
    if setup.tracking == "markers":
        marker = None if reference is None else _marker_of(mission, reference)
        settings = Settings.for_acceleration(math.sqrt(mission.dimension) * float(accelerations(mission).max()))
        world = MarkerSource(world, Tracker(_markers_on_pads(mission), settings, marker))
    return MappedSource(world, lambda frame: _centred(frame, setup))


def seen_by(source: MocapSource, mission: Mission, seed: int = 0) -> MocapSource:
    """What the mission's capture system would report of bodies.

    Args:
        source: robots' centres in the world frame; closed with the result.
        mission: says what the system is like.
        seed: of the order of unlabelled markers.
    """
    setup = mission.motion_capture
    if setup == Setup():
        return source
    rng, capture = np.random.default_rng(seed), _frame_of(setup)

    def report(frame: MocapFrame) -> MocapFrame:
        frame = replace(frame, t=frame.t + setup.latency)
        raised = {name: _shifted(pose, setup.height) for name, pose in frame.bodies.items()}
        if setup.tracking == "bodies":
            return capture.from_world(replace(frame, bodies=raised))
        if setup.tracking == "positions":
            return capture.from_world(
                replace(frame, bodies={name: Pose(pose.position) for name, pose in raised.items()})
            )
        points = [pose.position for pose in raised.values()]
        order = rng.permutation(len(points)).tolist()
        return capture.from_world(replace(frame, bodies={}, points=tuple(points[i] for i in order)))

    return MappedSource(source, report)


def _frame_of(setup: Setup) -> CaptureFrame:
    x, y, z = setup.origin
    return CaptureFrame(RigidTransform.from_yaw(setup.yaw, (x, y, z)), setup.up, setup.unit)


def _markers_on_pads(mission: Mission) -> dict[str, Vec3]:
    """Where the markers are while everybody stands [m], by rigid body."""
    names = [robot.rigid_body or robot.name for robot in mission.robots]
    height = mission.motion_capture.height
    return {name: (float(x), float(y), height) for name, (x, y) in zip(names, pads(mission), strict=True)}


def _marker_of(mission: Mission, reference: Reference) -> Reference:
    """Where the marker of a rigid body should be, from where its robot's centre should be."""
    height = mission.motion_capture.height
    robots = {robot.rigid_body or robot.name: robot.name for robot in mission.robots}

    def marker(body: str, t: float) -> Vec3 | None:
        centre = reference(robots[body], t)
        return None if centre is None else (centre[0], centre[1], centre[2] + height)

    return marker


def _centred(frame: MocapFrame, setup: Setup) -> MocapFrame:
    """The robots' centres when they were seen, with orientations only where they mean something."""
    bodies = {name: _shifted(pose, -setup.height) for name, pose in frame.bodies.items()}
    if setup.tracking != "bodies":
        bodies = {name: Pose(pose.position) for name, pose in bodies.items()}
    return replace(frame, t=frame.t - setup.latency, bodies=bodies)


def _shifted(pose: Pose, height: float) -> Pose:
    """Along the body's own z axis, or straight up where its orientation is not known."""
    if height == 0.0:
        return pose
    x, y, z = RigidTransform(pose.quaternion or (0.0, 0.0, 0.0, 1.0), pose.position).point((0.0, 0.0, height))
    return Pose((x, y, z), pose.quaternion)
