"""Who steers: setpoints by priority (firmware commander.c)."""

from __future__ import annotations

from enum import IntEnum

from deploy.radio.simulated.interface import Setpoint, SetpointMode
from deploy.radio.simulated.supervisor import State, Supervisor

_OFF = Setpoint()


class Priority(IntEnum):
    """A lower priority never replaces a higher one."""

    HIGH_LEVEL = 1
    CRTP = 2


class Commander:
    """The setpoint in force, since when, and by whose right."""

    def __init__(self) -> None:
        self.setpoint = Setpoint()
        self.priority = Priority.HIGH_LEVEL
        self.updated = 0.0  # [s] since boot

    def offer(self, setpoint: Setpoint, priority: Priority, t: float) -> bool:
        """Take the setpoint over unless a higher priority holds; whether it was taken."""
        if priority < self.priority:
            return False
        self.setpoint, self.priority, self.updated = setpoint, priority, t
        return True

    def allowed(self, supervisor: Supervisor) -> Setpoint:
        """The setpoint as the supervisor lets it pass."""
        wanted = self.setpoint
        # Not-a-number in a setpoint makes a real drone's motor commands garbage; here its motors stop.
        if not supervisor.can_fly or not wanted.is_finite():
            return _OFF
        return levelled_out(wanted) if supervisor.state is State.LEVEL_OUT else wanted

    def relax(self) -> None:
        """Let anybody take over: what a client's "notify setpoint stop" does, and nothing else."""
        self.priority = Priority.HIGH_LEVEL


def levelled_out(wanted: Setpoint) -> Setpoint:
    """What becomes of a setpoint that is too old (supervisor.c, supervisorOverrideSetpoint).

    Roll, pitch and yaw rate are zero then; z stays as it is.
    """
    if wanted.mode is SetpointMode.OFF:
        return wanted
    if wanted.mode in (SetpointMode.ATTITUDE, SetpointMode.RATES):
        return Setpoint(SetpointMode.ATTITUDE, thrust=wanted.thrust)
    if wanted.mode in (SetpointMode.VELOCITY, SetpointMode.CLIMB):
        return Setpoint(SetpointMode.CLIMB, velocity=(0.0, 0.0, wanted.velocity[2]))
    return Setpoint(SetpointMode.HEIGHT, position=(0.0, 0.0, wanted.position[2]))
