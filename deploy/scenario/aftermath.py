"""What drones do when nobody talks to them any more."""

from __future__ import annotations

import itertools
import math

from deploy.radio.supervisor import Supervisor
from deploy.scenario.effects import Props

_TICK = 0.1  # [s]
_DOWN = 0.05  # [m]
_TOUCHING = 0.1  # [m] between centres of two drones


def watch_alone(props: Props, seconds: float) -> tuple[str, ...]:
    """Let the world go on for so long, or until everybody is down; one line a drone, and one for collisions.

    Only simulated time passes; no motion capture reaches anybody.
    """
    world, names = props.world, list(props.bodies)
    began = world.t
    down: dict[str, float] = {}
    speed = dict.fromkeys(names, 0.0)
    closest = math.inf
    while world.t - began < seconds - 1e-6 and len(down) < len(names):
        world.advance(world.t + _TICK)
        positions, velocities, motors = world.positions, world.velocities, world.motors
        aloft = [i for i, name in enumerate(names) if name not in down]
        for i in aloft:
            if positions[i, 2] < _DOWN and not motors[i].any():
                down[names[i]] = world.t - began
            else:
                speed[names[i]] = max(speed[names[i]], -float(velocities[i, 2]))
        for a, b in itertools.combinations(aloft, 2):
            closest = min(closest, math.dist(positions[a], positions[b]))
    lines = [_line(props, name, down, speed[name], world.t - began) for name in names]
    if closest < _TOUCHING:
        lines.append("two of them met in the air")
    return tuple(lines)


def _line(props: Props, name: str, down: dict[str, float], speed: float, seconds: float) -> str:
    x, y, z = props.world.positions[props.index(name)].tolist()
    if name in down:
        place = f"({x:.2f}, {y:.2f}) m"
        return f"{name} was on the ground {down[name]:.1f} s later at {place}, falling at up to {speed:.1f} m/s"
    state = Supervisor(props.swarm.drones[name].info)
    doing = state.fault or ("flying" if state.flying else "motors off")
    return f"{name} was still at ({x:.2f}, {y:.2f}, {z:.2f}) m {seconds:.0f} s later, {doing}"
