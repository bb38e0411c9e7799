"""Point a simulated motion-capture system at the simulated world."""

from __future__ import annotations

from collections.abc import Sequence

from deploy.radio.simulated.physics.world import World
from mocap.simulated import SimulatedMocap


def film(world: World, names: Sequence[str], mocap: SimulatedMocap, period: float = 0.005) -> None:
    """Let ``mocap`` see the world's drones under these names, from now on.

    Args:
        world: what there is to see.
        names: rigid-body name of every drone, in the world's order.
        mocap: who looks.
        period: how often it may look [s]; the physics step at the shortest.

    Raises:
        ValueError: not one name per drone.
    """
    if len(names) != len(world.bodies.position):
        raise ValueError(f"one name per drone: got {len(names)} names for {len(world.bodies.position)} drones")

    def observe(t: float) -> None:
        if mocap.due(t):
            mocap.observe(t, names, world.bodies.position, world.bodies.quaternion)

    world.every(period, observe)
    observe(world.t)
