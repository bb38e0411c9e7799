"""What a drone's parameters say about how it is flown, for the world's controllers and estimator."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from deploy.radio.simulated.interface import Orders, Vec3
from deploy.radio.simulated.parameters import Parameters

_STEERING = frozenset({"posCtlPid", "velCtlPid", "pid_attitude", "pid_rate", "ctrlMel", "kalman"})  # groups
_DEFAULT = Orders()


class Steering:
    """Read again only when a parameter was written.

    Args:
        parameters: the drone's. notify: tells the client that the firmware itself changed one, by name.

    Attributes:
        controller, initial_pose, tuning: as in :class:`Orders`. crash_g: supervisor.crashDetectGs [g].
    """

    def __init__(self, parameters: Parameters, notify: Callable[[str], None]) -> None:
        self.controller, self.crash_g = _DEFAULT.controller, 0.0
        self.initial_pose: tuple[Vec3, float] = _DEFAULT.initial_pose
        self.tuning: Mapping[str, float] = _DEFAULT.tuning
        self._parameters, self._notify = parameters, notify
        self._read = -1  # version of the parameters

    def refresh(self) -> bool:
        """Take note of what was written; whether the estimator has to start again."""
        parameters = self._parameters
        if parameters.version == self._read:
            return False
        reset = bool(parameters["kalman.resetEstimation"])
        if reset:
            parameters.set("kalman.resetEstimation", 0)
            self._notify("kalman.resetEstimation")
        x, y, z, yaw = (parameters[f"kalman.initial{axis}"] for axis in ("X", "Y", "Z", "Yaw"))
        self.controller, self.initial_pose = int(parameters["stabilizer.controller"]), ((x, y, z), yaw)
        self.crash_g = parameters["supervisor.crashDetectGs"]
        tuning = parameters.changed(_STEERING)
        if tuning != self.tuning:
            self.tuning = tuning
        self._read = parameters.version
        return reset
