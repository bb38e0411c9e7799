"""Where the drones are: motion capture, real, simulated or replayed."""

from mocap.errors import MocapConnectError, MocapError, MocapLost, MocapUnavailable
from mocap.source import MocapFrame, MocapSource, Pose

__all__ = [
    "MocapConnectError",
    "MocapError",
    "MocapFrame",
    "MocapLost",
    "MocapSource",
    "MocapUnavailable",
    "Pose",
]
