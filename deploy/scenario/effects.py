"""What every fault does to the simulated parts, and how it is undone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from deploy.flightlog.writer import FlightLog
from deploy.operator import Interrupts
from deploy.radio.simulated.air.air import Air
from deploy.radio.simulated.air.line import Line
from deploy.radio.simulated.physics.world import World
from deploy.radio.simulated.swarm import SimulatedSwarm
from deploy.scenario.killed import ProcessKilled
from deploy.scenario.records import (
    BatteryLow,
    Fault,
    Loss,
    MocapDropout,
    MocapOutlier,
    MocapSwap,
    MotorFailure,
    OperatorAbort,
    ProcessKill,
    Reboot,
    Reconnect,
    Silence,
    SlowLink,
    Tumble,
)
from mocap.simulated import SimulatedMocap

Undo = Callable[[], None]
_UNPLUGGED = "Error communicating with crazy radio ,it has probably been unplugged!"  # cflib's words


@dataclass(frozen=True)
class Props:
    """Everything that can be broken.

    Attributes:
        bodies: rigid body by robot, in the world's order.
    """

    bodies: dict[str, str]
    world: World
    mocap: SimulatedMocap
    swarm: SimulatedSwarm
    air: Air
    operator: Interrupts

    def index(self, robot: str) -> int:
        """Its row in the world's arrays."""
        return list(self.bodies).index(robot)


def begin(fault: Fault, names: Sequence[str], props: Props, log: FlightLog) -> Undo | None:
    """Let a fault happen to these robots now; returns what ends it, if it can end.

    Raises:
        ProcessKilled: that was the fault.
    """
    match fault:
        case Loss() | Silence() | Reconnect() | SlowLink():
            return _together([_on_line(fault, props.air.lines[name]) for name in names])
        case MocapDropout() | MocapSwap() | MocapOutlier():
            return _in_mocap(fault, names, props)
        case OperatorAbort():
            for _ in range(fault.times):
                props.operator.request()
        case ProcessKill():
            log.abandon()
            props.swarm.hang_up("the host's process was killed")
            raise ProcessKilled(fault.watch)
        case _:
            return _together([_on_drone(fault, name, props) for name in names])
    return None


def _on_line(fault: Loss | Silence | Reconnect | SlowLink, line: Line) -> Undo:
    match fault:
        case Loss():
            return line.disturb(fault.rate, fault.burst)
        case SlowLink():
            return line.slow_down(fault.latency)
        case Silence():
            return line.silence()
        case Reconnect():
            undo = line.silence()
            line.cut(_UNPLUGGED)
            return undo


def _in_mocap(fault: MocapDropout | MocapSwap | MocapOutlier, names: Sequence[str], props: Props) -> Undo:
    mocap, bodies = props.mocap, props.bodies
    match fault:
        case MocapDropout() if len(names) == len(bodies):
            return mocap.blind()
        case MocapDropout():
            return _together([mocap.cover(bodies[name]) for name in names])
        case MocapSwap():
            return mocap.swap(bodies[fault.to], bodies[fault.other])
        case MocapOutlier():
            x, y, z = fault.offset
            return _together([mocap.displace(bodies[name], (x, y, z)) for name in names])


def _on_drone(fault: Reboot | BatteryLow | MotorFailure | Tumble, name: str, props: Props) -> Undo:
    world, i = props.world, props.index(name)
    match fault:
        case Reboot():
            props.swarm.drones[name].reboot()
        case BatteryLow():
            world.batteries.charge[i] = min(fault.charge, world.batteries.charge[i])
        case MotorFailure():
            world.rotors.health[i, fault.motor - 1] = fault.left
            return lambda: world.rotors.health.__setitem__((i, fault.motor - 1), 1.0)
        case Tumble():
            world.bodies.rates[i, 0] += fault.rate
            world.bodies.update()
    return lambda: None


def _together(undos: Sequence[Undo]) -> Undo:
    def undo() -> None:
        for one in undos:
            one()

    return undo
