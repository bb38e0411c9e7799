"""The simulated world: every drone's body, battery, sensors, estimator and controller, moved by somebody else's clock.

Time runs in physics steps of 5 ms and control ticks of 10 ms. At a tick the world hears the firmwares (:mod:`.crew`)
and runs what they run at 100 Hz; attitude control, rotors and rigid bodies run at every step. Everything is computed
for all drones at once, and everything random comes from one seeded generator: the same seed and the same orders give
the same flight, bit for bit.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from deploy.radio.simulated.interface import PERIOD, Firmware, Orders, Vec3
from deploy.radio.simulated.physics import ground
from deploy.radio.simulated.physics.algebra import GRAVITY
from deploy.radio.simulated.physics.autopilot import Autopilots
from deploy.radio.simulated.physics.battery import Batteries
from deploy.radio.simulated.physics.crew import Crew, Readings, knowledge
from deploy.radio.simulated.physics.downwash import CLEAR, downwash
from deploy.radio.simulated.physics.estimator import Estimators
from deploy.radio.simulated.physics.rigid_body import RigidBodies
from deploy.radio.simulated.physics.rotors import Rotors
from deploy.radio.simulated.physics.sensors import ACCELEROMETER_RANGE, InertialSensors, SensorNoise
from deploy.radio.simulated.physics.tumble import TumbleDetector
from missions.airframes import Airframe
from missions.arrays import Array, frozen

STEPS_PER_TICK = 2
TICK = PERIOD
STEP = TICK / STEPS_PER_TICK  # [s] physics and attitude control
_BATTERY_STEPS = 5 * STEPS_PER_TICK  # voltages move slowly: rotors spin up within 50 ms, and the firmware averages
_RANGE = ACCELEROMETER_RANGE * GRAVITY  # [m/s²]
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
        self._sensors = InertialSensors(n, noise or SensorNoise(), np.random.default_rng(seed), STEP)
        self._tumble = TumbleDetector(n)
        self._errors = self._sensors.draw(STEPS_PER_TICK)
        self._velocity_before = np.zeros((n, 3))
        # Body frame, one column each: specific force as the filter takes it, gyro error, specific force as measured.
        self._inputs = np.zeros((n, 3, 3))
        self._near_ground = True
        self._crew = Crew(n)
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
        self._crew.attach(firmwares)

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
        command = self.autopilots.steer(bodies.rotation, bodies.rates + self._errors.gyro[phase])
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
        self._crew.consult(
            self.t, lambda: knowledge(readings, bodies, estimators, self.autopilots, self.batteries), self._obey
        )
        self.autopilots.setpoints.turn(self._steps // STEPS_PER_TICK)
        for measured in self._crew.measurements():
            estimators.correct(measured, bodies)
        state = estimators.estimates(bodies)
        if self._steps % _BATTERY_STEPS == 0:
            self.batteries.draw(self.rotors.thrust, _BATTERY_STEPS * STEP)
            self.rotors.limit(self.batteries.available_thrust())
        bodies.refresh(self._wakes())
        for i in estimators.lost(state):
            self._reset_estimator(int(i), ((0.0, 0.0, 0.0), 0.0))
            state = estimators.estimates(bodies)
        self.autopilots.aim(state, TICK)
        self._velocity_before[:] = bodies.velocity
        self._errors = self._sensors.draw(STEPS_PER_TICK)

    def _sense(self) -> Readings:
        """What the sensors read in this tick; the filters take it in."""
        bodies, inputs, errors = self.bodies, self._inputs, self._errors
        force = bodies.velocity - self._velocity_before  # specific, world frame, mean of the tick
        force *= 1.0 / TICK
        force[:, 2] += GRAVITY
        body = np.matmul(force[:, None, :], bodies.rotation)[:, 0]
        body += errors.accelerometer
        np.minimum(np.maximum(body, -_RANGE, out=inputs[:, :, 2]), _RANGE, out=inputs[:, :, 2])
        # In flight the firmware's filter takes only the thrust axis from the accelerometer (kalman_core.c, predictDt):
        # it leaves out drag, believes in too much speed, and the drone lags: most of Mellinger's recorded delay.
        inputs[:, :, 0] = body
        inputs[:, :2, 0] *= self.autopilots.resting
        inputs[:, :, 1] = errors.turn
        world = np.matmul(np.matmul(self.estimators.matrix, bodies.rotation), inputs)
        self.estimators.predict(force, world[:, :, 0], world[:, :, 1], TICK)
        tumbled = self._tumble.update(inputs[:, :, 2], TICK)
        return Readings(inputs[:, :, 2], errors.gyro[-1], world[:, :, 2], tumbled)

    def _wakes(self) -> Array | None:
        """Upward accelerations (N,) by the wakes of other drones [m/s²]; None if nobody is above anybody."""
        height = self.bodies.position[:, 2]
        lowest = float(np.minimum.reduce(height))
        self._near_ground = lowest < _NEAR_GROUND
        if np.maximum.reduce(height) - lowest < CLEAR:
            return None
        thrust = self._thrust_max * np.add.reduce(self.rotors.thrust, 1)
        out: Array = downwash(self.bodies.position, thrust) / -self._mass
        return out

    def _obey(self, i: int, order: Orders, before: Orders) -> None:
        """Carry out what a firmware ordered."""
        autopilots = self.autopilots
        autopilots.setpoints.take(i, order.setpoint, order.course)
        if order.motors_allowed is not before.motors_allowed or order.controller != before.controller:
            autopilots.allow(i, order.motors_allowed)
            autopilots.choose(i, order.controller)
        if order.tuning is not before.tuning:
            autopilots.tune(i, order.tuning)
            self.estimators.tune(i, order.tuning)
        if order.reset_estimator:
            self._reset_estimator(i, order.initial_pose)

    def _reset_estimator(self, i: int, to: tuple[Vec3, float]) -> None:
        b = self.bodies
        self.estimators.reset(i, b.position[i], b.velocity[i], b.quaternion[i], to)
