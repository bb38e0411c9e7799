"""Port 8's commands and the 100 Hz goal (firmware crtp_commander_high_level.c)."""

from __future__ import annotations

import errno
import math
import struct
from collections.abc import Callable, Mapping

import numpy as np

from deploy.radio.simulated.high_level.compressed import CompressedTrajectory
from deploy.radio.simulated.high_level.evaluation import Evaluation
from deploy.radio.simulated.high_level.planner import OK, Foresight, Planner, PlannerState
from deploy.radio.simulated.high_level.trajectory import PolynomialTrajectory, TrajectoryMemory
from deploy.radio.simulated.interface import ZERO, Setpoint, SetpointMode, Telemetry
from deploy.radio.simulated.parameters import Parameters

TRAJECTORIES = 31  # descriptors
_IN_MEMORY, _POLY4D, _COMPRESSED = 1, 0, 1
_NULL = Setpoint()

Fields = tuple[float, ...]


class HighLevelCommander:
    """Plans on command, gives the goal on every tick.

    Args:
        memory: trajectory memory.
        parameters: group mask and default velocities live there.
        now: seconds since boot.
    """

    def __init__(self, memory: TrajectoryMemory, parameters: Parameters, now: Callable[[], float]) -> None:
        self.planner = Planner()
        self._memory, self._parameters, self._now = memory, parameters, now
        self._descriptors: dict[int, Fields] = {}
        # The last goal, or the estimate while there is none: where the next plan starts.
        self._position, self._velocity, self._yaw = ZERO, ZERO, 0.0
        self._foreseen: Foresight | None = None
        self._blocked = True  # until the supervisor speaks: before the first tick the drone does not know where it is
        self._commands: Mapping[int, tuple[struct.Struct, bool, Callable[[Fields], int]]] = {
            # command: (layout after the command byte, needs permission to fly, action)
            0x00: (struct.Struct("<B"), False, self._set_group_mask),
            0x01: (struct.Struct("<Bff"), True, lambda f: self._takeoff(f[1], 0.0, f[2])),
            0x02: (struct.Struct("<Bff"), True, lambda f: self._land(f[1], 0.0, f[2])),
            0x03: (struct.Struct("<B"), False, self._stop),
            0x04: (struct.Struct("<B?fffff"), True, lambda f: self._go_to(f[1], False, f[2:])),
            0x05: (struct.Struct("<B??Bf"), True, lambda f: self._start(f[1], False, f[2], int(f[3]), f[4])),
            0x06: (struct.Struct("<BBBIB"), False, self._define),
            0x07: (struct.Struct("<Bff?f"), True, lambda f: self._takeoff(f[1], self._heading(f[2], f[3]), f[4])),
            0x08: (struct.Struct("<Bff?f"), True, lambda f: self._land(f[1], self._heading(f[2], f[3]), f[4])),
            0x09: (struct.Struct("<Bf?f?f"), True, self._takeoff_with_velocity),
            0x0A: (struct.Struct("<Bf?f?f"), True, self._land_with_velocity),
            0x0B: (struct.Struct("<B??fffff"), True, self._spiral),
            0x0C: (struct.Struct("<B??fffff"), True, lambda f: self._go_to(f[1], f[2], f[3:])),
            0x0D: (struct.Struct("<B???Bf"), True, lambda f: self._start(f[1], f[2], f[3], int(f[4]), f[5])),
        }

    @property
    def is_active(self) -> bool:
        """Whether the planner gives goals (supervisor.info bit 8)."""
        return self.planner.state in (PlannerState.FLYING, PlannerState.LANDING)

    @property
    def is_finished(self) -> bool:
        """Whether the latest trajectory has ended (supervisor.info bit 9)."""
        with np.errstate(all="ignore"):
            return self.planner.is_finished(self._t)

    @property
    def is_disabled(self) -> bool:
        """Whether the planner gives nothing at all (supervisor.info bit 10)."""
        return self.planner.state is PlannerState.DISABLED

    def command(self, data: bytes) -> int:
        """Carry out a packet (command byte first); the return code of the answer, an errno or 1 for "refused"."""
        layout, needs_permission, action = self._commands.get(data[0], (None, False, None))
        if layout is None or action is None:
            return errno.ENOEXEC
        if needs_permission and self._blocked:
            return errno.EBUSY
        fields = layout.unpack_from(data.ljust(layout.size + 1, b"\0"), 1)
        if action not in (self._set_group_mask, self._define) and not self._is_in_group(int(fields[0])):
            return OK
        with np.errstate(all="ignore"):  # clients may send anything; the firmware's floats do not trap either
            return action(fields)

    def block(self, blocked: bool) -> None:
        """The supervisor's word: blocked means no flight commands, and the planner stops."""
        self._blocked = blocked
        if blocked:
            self.planner.stop()

    def setpoint(self, telemetry: Telemetry) -> Setpoint | None:
        """The setpoint of this tick; None when the planner has nothing to say."""
        goal = self._follow()
        if goal is not None:
            return Setpoint(SetpointMode.FULL, *goal)
        self._position, self._velocity = telemetry.position, telemetry.velocity
        x, y, z, w = telemetry.quaternion
        self._yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
        return _NULL if self.planner.state is PlannerState.IDLE else None

    @property
    def foreseen(self) -> Foresight | None:
        """What the latest setpoint is part of; None if setpoints have to be asked for tick by tick."""
        foreseen = self._foreseen
        return foreseen if foreseen is not None and foreseen.finite and self.is_active else None

    def catch_up(self) -> None:
        """Nobody asked for the latest ticks' setpoints: what comes next starts from there all the same."""
        if self.foreseen is not None:
            self._follow()

    def _follow(self) -> Evaluation | None:
        self._foreseen, goal = self.planner.follow(self._now())
        if goal is not None:
            self._position, self._velocity, self._yaw = goal.position, goal.velocity, goal.yaw
        return goal

    @property
    def _t(self) -> np.float32:
        """Seconds since boot; float32 as in the firmware (a quarter of a millisecond after an hour)."""
        return np.float32(self._now())

    def _is_in_group(self, mask: int) -> bool:
        return mask == 0 or bool(mask & int(self._parameters["hlCommander.groupmask"]))

    def _heading(self, yaw: float, use_current: float) -> float:
        return self._yaw if use_current else yaw

    def _current(self) -> Evaluation:
        goal = self.planner.goal(self._t)
        return goal or Evaluation(self._position, self._velocity, yaw=self._yaw)

    def _set_group_mask(self, f: Fields) -> int:
        self._parameters.set("hlCommander.groupmask", f[0])
        return OK

    def _takeoff(self, height: float, yaw: float, duration: float) -> int:
        return self.planner.takeoff(self._t, self._position, self._yaw, height, yaw, duration)

    def _land(self, height: float, yaw: float, duration: float) -> int:
        return self.planner.land(self._t, self._position, self._yaw, height, yaw, duration)

    def _takeoff_with_velocity(self, f: Fields) -> int:
        _, height, relative, yaw, use_current, velocity = f
        height += self._position[2] if relative else 0.0
        velocity = velocity if velocity > 0 else self._parameters["hlCommander.vtoff"]
        return self._takeoff(height, self._heading(yaw, use_current), self._climb_time(height, velocity))

    def _land_with_velocity(self, f: Fields) -> int:
        _, height, relative, yaw, use_current, velocity = f
        height = self._position[2] - height if relative else height
        velocity = velocity if velocity > 0 else self._parameters["hlCommander.vland"]
        return self._land(height, self._heading(yaw, use_current), self._climb_time(height, velocity))

    def _climb_time(self, height: float, velocity: float) -> float:
        return abs(height - self._position[2]) / velocity if velocity else math.inf

    def _stop(self, _: Fields) -> int:
        self.planner.stop()
        return OK

    def _go_to(self, relative: float, linear: float, goal: Fields) -> int:
        x, y, z, yaw, duration = goal
        return self.planner.go_to(self._t, self._current(), (x, y, z), yaw, duration, bool(relative), bool(linear))

    def _spiral(self, f: Fields) -> int:
        _, sideways, clockwise, angle, radius, end_radius, ascent, duration = f
        return self.planner.spiral(
            self._t, self._current(), angle, radius, end_radius, ascent, duration, bool(sideways), bool(clockwise)
        )

    def _define(self, f: Fields) -> int:
        if f[0] >= TRAJECTORIES:
            return errno.ENOEXEC
        self._descriptors[int(f[0])] = f[1:]
        return OK

    def _start(self, relative: float, relative_yaw: float, reverse: float, trajectory_id: int, timescale: float) -> int:
        """Start a defined trajectory; an undefined one, or one of unknown kind, is answered with 0 and ignored."""
        location, kind, offset, pieces = self._descriptors.get(trajectory_id, (0, 0, 0, 0))
        if location != _IN_MEMORY or kind not in (_POLY4D, _COMPRESSED):
            return OK
        if kind == _COMPRESSED:
            if timescale != 1.0 or reverse:
                return errno.ENOEXEC
            compressed = CompressedTrajectory(self._memory, int(offset), self._t)
            if relative:
                compressed.start_at(self._position)
            return self.planner.start(compressed)
        trajectory = PolynomialTrajectory(
            self._memory, int(offset), int(pieces), self._t, np.float32(timescale), bool(reverse)
        )
        if relative:
            trajectory.start_at(self._position, self._yaw if relative_yaw else None)
        return self.planner.start(trajectory)
