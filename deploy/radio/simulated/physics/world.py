"""The simulated world: every drone's body, battery, sensors, estimator and controller, moved by somebody else's clock.

Time runs in physics steps of 2 ms and control ticks of 10 ms. At a tick the world tells each firmware what its drone
knows (:class:`Telemetry`), receives :class:`Orders`, and runs what the firmware runs at 100 Hz; attitude control,
rotors and rigid bodies run at every step. Everything is computed for all drones at once, and everything random comes
from one seeded generator: the same seed and the same orders give the same flight, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from deploy.radio.simulated.interface import Firmware, Orders, Telemetry, Vec3
from deploy.radio.simulated.physics import ground
from deploy.radio.simulated.physics.algebra import GRAVITY, multiply
from deploy.radio.simulated.physics.autopilot import Autopilots
from deploy.radio.simulated.physics.battery import Batteries
from deploy.radio.simulated.physics.downwash import downwash
from deploy.radio.simulated.physics.estimator import Estimates, Estimators
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from deploy.radio.simulated.physics.rotors import Rotors
from deploy.radio.simulated.physics.sensors import ACCELEROMETER_RANGE, InertialSensors, SensorNoise
from deploy.radio.simulated.physics.tumble import TumbleDetector
from missions.airframes import Airframe
from missions.arrays import Array, frozen

STEP = 0.002  # [s] physics and attitude control
STEPS_PER_TICK = 5
TICK = STEP * STEPS_PER_TICK
_BATTERY_STEPS = 5 * STEPS_PER_TICK  # voltages move slowly: rotors spin up within 50 ms, and the firmware averages
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
        # Body frame, one column each: specific force as the filter takes it, gyro error, specific force as measured.
        self._inputs = np.zeros((n, 3, 3))
        self._near_ground = True
        self._firmwares: tuple[Firmware, ...] = ()
        self._orders: Sequence[Orders] = [Orders()] * n
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
        with np.errstate(all="ignore"):  # clients may send anything; the firmware's floats do not trap either
            self._advance(target)

    def _advance(self, target: int) -> None:
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
        command = self.autopilots.steer(bodies.rotation, bodies.rates + self._gyro_error[phase])
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
        bodies, estimators = self.bodies, self.estimators
        readings = self._sense()
        state = estimators.estimates(bodies)
        if self._firmwares and self._obey(self._ask(readings, state)):
            state = estimators.estimates(bodies)
        if self._steps % _BATTERY_STEPS == 0:
            self.batteries.draw(self.rotors.thrust, _BATTERY_STEPS * STEP)
            self.rotors.limit(self.batteries.available_thrust())
        bodies.refresh(self._wakes())
        self._near_ground = bool(np.minimum.reduce(bodies.position[:, 2]) < _NEAR_GROUND)
        for i in estimators.lost(state):
            self._reset_estimator(int(i), ((0.0, 0.0, 0.0), 0.0))
            state = estimators.estimates(bodies)
        self.autopilots.aim(state, TICK)
        self._velocity_before[:] = bodies.velocity
        self._gyro_error, self._accelerometer_error = self._sensors.draw(STEPS_PER_TICK)

    def _sense(self) -> _Readings:
        """What the sensors read in this tick; the filters take it in."""
        bodies, inputs = self.bodies, self._inputs
        force = (bodies.velocity - self._velocity_before) / TICK  # specific, world frame, mean of the tick
        force[:, 2] += GRAVITY
        body = np.matmul(force[:, None, :], bodies.rotation)[:, 0]
        body += self._accelerometer_error
        g = np.minimum(np.maximum(body / GRAVITY, -ACCELEROMETER_RANGE), ACCELEROMETER_RANGE)
        # In flight the firmware's filter takes only the thrust axis from the accelerometer (kalman_core.c, predictDt):
        # it leaves out drag, believes in too much speed, and the drone lags: most of Mellinger's recorded delay.
        inputs[:, :, 0] = body
        inputs[:, :2, 0] *= (self.autopilots.thrust <= 0.0)[:, None]
        np.multiply(np.add.reduce(self._gyro_error, 0), 1.0 / STEPS_PER_TICK, out=inputs[:, :, 1])
        np.multiply(g, GRAVITY, out=inputs[:, :, 2])
        world = np.matmul(np.matmul(self.estimators.matrix, bodies.rotation), inputs)
        self.estimators.predict(force, world[:, :, 0], world[:, :, 1], TICK)
        acceleration = world[:, :, 2]
        acceleration[:, 2] -= GRAVITY
        return _Readings(g, bodies.rates + self._gyro_error[-1], acceleration)

    def _wakes(self) -> Array:
        """Accelerations (N, 3) by the wakes of other drones [m/s²]."""
        out = np.zeros((self._n, 3))
        if self._n > 1:
            thrust = self._thrust_max * np.add.reduce(self.rotors.thrust, 1)
            out[:, 2] = downwash(self.bodies.position, thrust) / -self._mass
        return out

    def _ask(self, readings: _Readings, state: Estimates) -> list[Orders]:
        """Tell every firmware what its drone knows; their orders."""
        e, autopilots = self.estimators, self.autopilots
        quaternion = multiply(e.rotation_error, self.bodies.quaternion)
        tumbled = self._tumble.update(readings.g, TICK)
        block = np.concatenate(
            [
                state.position,
                state.velocity,
                readings.acceleration,
                readings.gyro,
                readings.g,
                e.variances,
                quaternion,
                autopilots.asked,
                autopilots.moments,
                autopilots.thrust[:, None],
                self.batteries.voltage[:, None],
                self.bodies.position[:, 2:],
            ],
            axis=1,
        )
        rows = zip(
            self._firmwares,
            block.tolist(),
            autopilots.command.astype(np.int64).tolist(),
            autopilots.saturated.tolist(),
            tumbled.tolist(),
            strict=True,
        )
        t = self.t
        return [firmware.tick(t, _telemetry(*row)) for firmware, *row in rows]

    def _obey(self, orders: Sequence[Orders]) -> bool:
        """Carry out what the firmwares ordered; whether anybody's estimate jumped."""
        autopilots = self.autopilots
        autopilots.setpoints.take([order.setpoint for order in orders])
        rounds, reset = 0, False
        for i, (order, before) in enumerate(zip(orders, self._orders, strict=True)):
            rounds = max(rounds, len(order.measurements))
            if order.motors_allowed is not before.motors_allowed or order.controller != before.controller:
                autopilots.allowed[i] = order.motors_allowed
                autopilots.choose(i, order.controller)
            if order.tuning is not before.tuning:
                autopilots.tune(i, order.tuning)
                self.estimators.tune(i, order.tuning)
            if order.reset_estimator:
                self._reset_estimator(i, order.initial_pose)
                reset = True
        self._orders = orders
        for k in range(rounds):  # oldest first, one of each drone at a time
            now = [(i, order.measurements[k]) for i, order in enumerate(orders) if k < len(order.measurements)]
            self.estimators.correct(now, self.bodies.position, self.bodies.quaternion)
        return reset or rounds > 0

    def _reset_estimator(self, i: int, to: tuple[Vec3, float]) -> None:
        b = self.bodies
        self.estimators.reset(i, b.position[i], b.velocity[i], b.quaternion[i], to)


class _Readings(NamedTuple):
    """Sensors of all drones in one tick.

    Attributes:
        g: (N, 3) accelerometers [g].
        gyro: (N, 3) [rad/s].
        acceleration: (N, 3) what the drones make of it: world frame, without gravity [m/s²].
    """

    g: Array
    gyro: Array
    acceleration: Array


def _telemetry(row: list[float], motors: list[int], saturated: bool, tumbled: bool) -> Telemetry:
    x, y, z, vx, vy, vz, ax, ay, az, p, q, r, gx, gy, gz = row[:15]
    px, py, pz, dx, dy, dz, sx, sy, sz, qx, qy, qz, qw = row[15:28]
    roll, pitch, yaw, rx, ry, rz, mx, my, mz, thrust, volt, height = row[28:]
    m1, m2, m3, m4 = motors
    return Telemetry(
        (x, y, z),
        (vx, vy, vz),
        (ax, ay, az),
        (qx, qy, qz, qw),
        (p, q, r),
        (gx, gy, gz),
        (px, py, pz),
        (sx, sy, sz),
        (m1, m2, m3, m4),
        thrust,
        volt,
        saturated,
        tumbled,
        (dx, dy, dz),
        (roll, pitch, yaw),
        (rx, ry, rz),
        (mx, my, mz),
        height,
    )
