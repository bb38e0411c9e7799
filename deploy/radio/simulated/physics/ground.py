"""A flat floor at z = 0.

Idealised: the drone's reference point touches (as in the flight recordings, where a landed drone has z = 0), impacts do
not bounce, friction is Coulomb's, and an upright drone settles on its legs while a toppled one stays as it lies.
"""

from __future__ import annotations

import numpy as np

from deploy.radio.simulated.physics import algebra
from deploy.radio.simulated.physics.algebra import GRAVITY
from deploy.radio.simulated.physics.rigid_body import RigidBodies

FRICTION = 0.5  # estimate: plastic legs on a hall's floor
_SETTLING = 0.05  # [s] time constant of rocking back onto the legs: about √(arm/g)
_TOPPLED = 0.5  # cosine of the tilt beyond which the legs do not catch the drone


def resolve(bodies: RigidBodies, dt: float) -> None:
    """Push bodies out of the floor after a step of dt."""
    height = bodies.position[:, 2]
    if np.minimum.reduce(height) > 0.0:
        return
    index = np.flatnonzero(height <= 0.0)
    bodies.position[index, 2] = 0.0
    velocity = bodies.velocity[index]
    resting = velocity[:, 2] <= 0.0
    if not resting.any():
        return
    index, velocity = index[resting], velocity[resting]
    # The floor gave back the vertical momentum; friction may use FRICTION times as much on the horizontal one.
    impulse = np.maximum(-velocity[:, 2], 0.0)
    sliding = np.hypot(velocity[:, 0], velocity[:, 1])
    kept = 1.0 - np.minimum(1.0, FRICTION * np.maximum(impulse, GRAVITY * dt) / np.maximum(sliding, 1e-12))
    velocity[:, :2] *= kept[:, None]
    velocity[:, 2] = 0.0
    bodies.velocity[index] = velocity
    bodies.rates[index] = 0.0
    upright = index[bodies.rotation[index, 2, 2] > _TOPPLED]
    if len(upright):
        level = algebra.yaw_quaternions(algebra.heading(bodies.rotation[upright]))
        attitude = bodies.quaternion[upright]
        level *= np.sign((level * attitude).sum(axis=1, keepdims=True))  # the same hemisphere: the short way
        blended = algebra.normalised(attitude + (dt / _SETTLING) * (level - attitude))
        bodies.quaternion[upright] = blended
    bodies.update()
