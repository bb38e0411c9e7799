"""The simulated world: every drone's body, battery, sensors, estimator and controller, moved by somebody else's clock.

Time runs in physics steps of 2 ms and control ticks of 10 ms. At a tick the world tells each firmware what its drone
knows (:class:`Telemetry`), receives :class:`Orders`, and runs what the firmware runs at 100 Hz; attitude control,
rotors and rigid bodies run at every step. Everything is computed for all drones at once, and everything random comes
from one seeded generator: the same seed and the same orders give the same flight, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from deploy.radio.simulated.interface import Firmware, Orders, Telemetry, Vec3
from deploy.radio.simulated.physics import ground
from deploy.radio.simulated.physics.algebra import GRAVITY, multiply
from deploy.radio.simulated.physics.autopilot import Autopilots
from deploy.radio.simulated.physics.battery import Batteries
from deploy.radio.simulated.physics.downwash import downwash
from deploy.radio.simulated.physics.estimator import Estimators
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from deploy.radio.simulated.physics.rotors import Rotors
from deploy.radio.simulated.physics.sensors import ACCELEROMETER_RANGE, InertialSensors, SensorNoise
from deploy.radio.simulated.physics.tumble import TumbleDetector
from missions.airframes import Airframe
from missions.arrays import Array, frozen

STEP = 0.002  # [s] physics and attitude control
STEPS_PER_TICK = 5
TICK = STEP * STEPS_PER_TICK
_NEAR_GROUND = 0.2  # [m] above it nothing reaches the floor within a tick (that takes 20 m/s)


class World:
    """All simulated drones.

    Args:
        airframes: one per drone.
        positions: (N, 3) where they stand at t = 0 [m].
        yaws: (N,) headings at t = 0 [rad].
        seed: of everything random.
        noise: sensor errors.
        charge: state of charge of the batteries at t = 0, 0..1.

    Raises:
        ValueError: shapes that do not belong together, or a start below the floor.
    """

    def __init__(
        self,
        airframes: Sequence[Airframe],
        positions: Array,
        yaws: Array,
        *,
        seed: int = 0,
        noise: SensorNoise | None = None,
        charge: float = 0.95,
    ) -> None:
        n = len(airframes)
        positions, yaws = np.asarray(positions, dtype=np.float64), np.asarray(yaws, dtype=np.float64)
        if n == 0 or positions.shape != (n, 3) or yaws.shape != (n,):
            raise ValueError(
                f"a world of {n} drones has positions ({n}, 3) and yaws ({n},); got {positions.shape} and {yaws.shape}"
            )
        if not (np.isfinite(positions).all() and np.isfinite(yaws).all() and (positions[:, 2] >= 0.0).all()):
            raise ValueError("positions and yaws must be finite and no drone below the floor (z >= 0)")
        self._n = n
        self._steps = 0
        self._mass = np.array([a.mass for a in airframes])
        self._thrust_max = np.array([a.motor_thrust_max for a in airframes])
        self.bodies = RigidBodies(airframes, positions, yaws, STEP)
        self.rotors = Rotors(airframes, STEP)
        self.batteries = Batteries(airframes, charge)
        self.estimators = Estimators(n)
        self.autopilots = Autopilots(airframes, STEP)
        self._sensors = InertialSensors(n, noise or SensorNoise(), np.random.default_rng(seed))
        self._tumble = TumbleDetector(n)
        self._gyro_error, self._accelerometer_error = self._sensors.draw(STEPS_PER_TICK)
        self._velocity_before = np.zeros((n, 3))
        self._force = np.tile([0.0, 0.0, GRAVITY], (n, 1))  # specific force, world frame, mean of the last tick
        self._near_ground = True
        self._firmwares: tuple[Firmware, ...] = ()
        self._observers: list[tuple[Callable[[float], None], int]] = []
        for i in range(n):
            self._reset_estimator(i, ((0.0, 0.0, 0.0), 0.0))

    @property
    def t(self) -> float:
        """World time [s]."""
        return self._steps * STEP

    @property
    def positions(self) -> Array:
        """True positions (N, 3) [m], a read-only copy."""
        return frozen(self.bodies.position)

    @property
    def velocities(self) -> Array:
        """True velocities (N, 3) [m/s], a read-only copy."""
        return frozen(self.bodies.velocity)

    @property
    def quaternions(self) -> Array:
        """True attitudes (N, 4), x, y, z, w, body to world, a read-only copy of unit length."""
        q = self.bodies.quaternion
        return frozen(q / np.linalg.norm(q, axis=1, keepdims=True))

    @property
    def motors(self) -> Array:
        """Motor commands (N, 4), 0..65535, a read-only copy."""
        return frozen(self.autopilots.command)

    def attach(self, firmwares: Sequence[Firmware]) -> None:
        """Give every drone its firmware, in the order of ``airframes``.

        Raises:
            ValueError: not one firmware per drone.
        """
        if len(firmwares) != self._n:
            raise ValueError(f"a world of {self._n} drones takes {self._n} firmwares; got {len(firmwares)}")
        self._firmwares = tuple(firmwares)

    def every(self, period: float, observe: Callable[[float], None]) -> None:
        """Call ``observe(t)`` whenever a multiple of ``period`` [s] has passed (e.g. a motion-capture camera).

        Raises:
            ValueError: the period is not a multiple of the physics step.
        """
        steps = round(period / STEP)
        if steps < 1 or abs(steps * STEP - period) > 1e-9:
            raise ValueError(f"an observer's period is a multiple of {STEP} s; got {period} s")
        self._observers.append((observe, steps))

    def advance(self, t: float) -> None:
        """Move the world to time t [s] (to the last physics step that is not after it)."""
        target = int(t / STEP + 1e-6)
        while self._steps < target:
            phase = self._steps % STEPS_PER_TICK
            if phase == 0 and self._frozen():
                self._skip(min(STEPS_PER_TICK, target - self._steps))
                continue
            self._step(phase)
            self._steps += 1
            self._after_step()

    def _frozen(self) -> bool:
        """Motors off, rotors stopped, everybody at rest on the floor: physics has nothing to do."""
        return self.autopilots.idle and not (
            self.rotors.thrust.max() > 1e-6
            or self.bodies.position[:, 2].max() > 0.0
            or np.abs(self.bodies.velocity).max() > 0.0
        )

    def _skip(self, steps: int) -> None:
        for _ in range(steps):
            self._steps += 1
            self._after_step()

    def _step(self, phase: int) -> None:
        bodies, rotors = self.bodies, self.rotors
        estimated = np.matmul(self.estimators.matrix, bodies.rotation)
        command = self.autopilots.steer(estimated, bodies.rates + self._gyro_error[phase])
        rotors.step(command)
        bodies.step(rotors.accelerations())
        if self._near_ground:
            ground.resolve(bodies, STEP)

    def _after_step(self) -> None:
        for observe, steps in self._observers:
            if self._steps % steps == 0:
                observe(self.t)
        if self._steps % STEPS_PER_TICK == 0:
            self._tick()

    def _tick(self) -> None:
        """The 100 Hz work at the end of a tick: sense, tell the firmwares, obey, aim."""
        bodies = self.bodies
        self._sense()
        if self._firmwares:
            telemetry = self._telemetry()
            orders = [f.tick(self.t, telemetry[i]) for i, f in enumerate(self._firmwares)]
            self._obey(orders)
        self.batteries.draw(self.rotors.thrust, TICK)
        self.rotors.limit(self.batteries.available_thrust())
        thrust = self._thrust_max * self.rotors.thrust.sum(axis=1)
        extra = np.zeros((self._n, 3))
        if self._n > 1:
            extra[:, 2] = -downwash(bodies.position, thrust) / self._mass
        bodies.refresh(extra)
        self._near_ground = bool(bodies.position[:, 2].min() < _NEAR_GROUND)
        position, velocity, rotation = self._estimates()
        for i in self.estimators.lost(position, velocity):
            self._reset_estimator(int(i), ((0.0, 0.0, 0.0), 0.0))
        self.autopilots.aim(position, velocity, rotation, TICK)
        self._velocity_before = bodies.velocity.copy()
        self._gyro_error, self._accelerometer_error = self._sensors.draw(STEPS_PER_TICK)

    def _sense(self) -> None:
        rotation = self.bodies.rotation
        self._force = (self.bodies.velocity - self._velocity_before) / TICK
        self._force[:, 2] += GRAVITY
        sensed = np.matmul(self._force[:, None, :], rotation)[:, 0] + self._accelerometer_error
        # In flight the firmware's filter takes only the thrust axis from the accelerometer (kalman_core.c, predictDt):
        # it leaves out drag, believes in too much speed, and the drone lags: most of Mellinger's recorded delay.
        sensed[self.autopilots.thrust > 0.0, :2] = 0.0
        world = np.matmul(rotation, np.stack([sensed, self._gyro_error.mean(axis=0)], axis=2))
        self.estimators.predict(self._force, world[:, :, 0], world[:, :, 1], TICK)

    def _estimates(self) -> tuple[Array, Array, Array]:
        e, bodies = self.estimators, self.bodies
        return (
            bodies.position + e.position_error,
            bodies.velocity + e.velocity_error,
            np.matmul(e.matrix, bodies.rotation),
        )

    def _telemetry(self) -> list[Telemetry]:
        e, bodies = self.estimators, self.bodies
        position, velocity, rotation = self._estimates()
        quaternion = multiply(e.rotation_error, bodies.quaternion)
        body_force = np.matmul(self._force[:, None, :], bodies.rotation)[:, 0] + self._accelerometer_error
        g = np.minimum(np.maximum(body_force / GRAVITY, -ACCELEROMETER_RANGE), ACCELEROMETER_RANGE)
        acceleration = np.matmul(rotation, (GRAVITY * g)[:, :, None])[:, :, 0] - (0.0, 0.0, GRAVITY)
        tumbled = self._tumble.update(g[:, 2], TICK)
        variance = np.einsum("nii->ni", e.covariance)
        columns = (
            position,
            velocity,
            acceleration,
            quaternion,
            bodies.rates + self._gyro_error[-1],
            g,
            variance[:, :3],
            variance[:, 3:6],
        )
        vectors = [[tuple(row) for row in column.tolist()] for column in columns]
        scalars = zip(
            [tuple(row) for row in self.autopilots.command.astype(np.int64).tolist()],
            self.autopilots.thrust.tolist(),
            self.batteries.voltage.tolist(),
            self.autopilots.saturated.tolist(),
            tumbled.tolist(),
            strict=True,
        )
        return [Telemetry(*vector, *scalar) for *vector, scalar in zip(*vectors, scalars, strict=True)]

    def _obey(self, orders: Sequence[Orders]) -> None:
        autopilots = self.autopilots
        for i, order in enumerate(orders):
            autopilots.setpoints.put(i, order.setpoint)
            autopilots.allowed[i] = order.motors_allowed
            autopilots.choose(i, order.controller)
            if order.reset_estimator:
                self._reset_estimator(i, order.initial_pose)
        rounds = max(len(order.measurements) for order in orders)
        for k in range(rounds):  # oldest first, one of each drone at a time
            now = [(i, order.measurements[k]) for i, order in enumerate(orders) if k < len(order.measurements)]
            self.estimators.correct(now, self.bodies.position, self.bodies.quaternion)

    def _reset_estimator(self, i: int, to: tuple[Vec3, float]) -> None:
        b = self.bodies
        self.estimators.reset(i, b.position[i], b.velocity[i], b.quaternion[i], to)
