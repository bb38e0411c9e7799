"""One simulated Crazyflie's firmware: packets in, packets out, a tick every 10 ms."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping, MutableMapping

from deploy.radio.simulated.commander import Commander, Priority
from deploy.radio.simulated.decks import decks as decks_named
from deploy.radio.simulated.high_level.commander import HighLevelCommander
from deploy.radio.simulated.high_level.planner import Foresight
from deploy.radio.simulated.high_level.trajectory import TrajectoryMemory
from deploy.radio.simulated.interface import Course, Orders, PoseMeasurement, Setpoint, Telemetry
from deploy.radio.simulated.led_ring import LedRing
from deploy.radio.simulated.parameters import Parameters
from deploy.radio.simulated.platform_defaults import platform_defaults
from deploy.radio.simulated.ports import (
    FirmwareAssertion,
    console,
    high_level,
    link,
    localization,
    log,
    memory,
    param,
    platform,
    setpoint,
    supervisor,
)
from deploy.radio.simulated.ports.memories import memories
from deploy.radio.simulated.steering import Steering
from deploy.radio.simulated.supervisor import PERIOD, Inputs, Supervisor
from deploy.radio.simulated.toc import log_toc, param_toc
from deploy.radio.simulated.variables import Snapshot, live_variables
from missions.airframes import Airframe

BOOT_TIME = 1.15  # [s] from reset to the first packet (recorded firmware: 1.34 s to "ready to fly")
_LINK_TIMEOUT = 1.0  # [s] without a client after which log blocks are deleted (CONFIG_RADIO_ACTIVITY_TIMEOUT_MS)
_LOW_BATTERY_TIME = 5.0  # [s] below pm.lowVoltage before pm.state says so
BROWN_OUT = 2.5  # [V] below which processors and radio stop (estimate: 2.8 V regulators, reset level of the STM32)
_SLACK = 1e-9  # [s] times are multiples of a tick up to rounding
# Their packets change nothing that was foreseen. cflib's pings come by wall time: physics must not notice them.
_IDLE = (localization.PORT, link.PORT)
_GROUNDED = Orders()

Receiver = Callable[[int, int, bytes], None]


class SimulatedCrazyflie:
    """Firmware of one drone; implements :class:`interface.Firmware`.

    Packets come from cflib's threads, ticks from the clock's: one lock keeps them apart.

    Args:
        name: for messages.
        address: last byte of the radio address, the drone's id in packed localisation packets.
        auto_arm: arm as soon as pre-flight checks pass (Crazyflie 2.x); False for Brushless and Bolt.
        hardware: with the log and parameter groups that only hardware has (battery, radio, decks).
        uptime: seconds it has been switched on at time 0; it is then ready to fly.
        storage: persistent parameters by name; kept over reboots.
        airframe: whose firmware is flashed; None: the Crazyflie 2.1's.
        decks: board names of what is plugged in, see :mod:`deploy.radio.simulated.decks`; hardware only.

    Raises:
        ValueError: an unknown deck.
    """

    def __init__(
        self,
        name: str,
        address: int = 0xE7,
        *,
        auto_arm: bool = True,
        hardware: bool = True,
        uptime: float = 10.0,
        storage: MutableMapping[str, bytes] | None = None,
        airframe: Airframe | None = None,
        decks: tuple[str, ...] = (),
    ) -> None:
        self.name, self.address = name, address
        self.storage: MutableMapping[str, bytes] = {} if storage is None else storage
        self._auto_arm, self._hardware = auto_arm, hardware
        self._decks = decks_named(decks) if hardware else ()
        values = {} if airframe is None else dict(platform_defaults(airframe))
        values |= {f"deck.{name}": 1.0 for deck in self._decks for name in deck.parameters}
        self._toc = param_toc(hardware, tuple(sorted(values.items())))
        self._lock = threading.RLock()
        self._receiver: Receiver | None = None
        self._t, self._booted, self._closed_at = 0.0, -uptime, 0.0
        self.reboots = 0
        self._due: float  # [s] world time from which on telemetry is needed
        self._start()
        self._supervisor.settle(self._uptime())  # it was switched on a while ago
        self._next_supervision = self._uptime()

    @property
    def is_alive(self) -> bool:
        """False while it reboots: it neither hears nor answers."""
        return self._t >= self._booted

    @property
    def info(self) -> int:
        """The supervisor's bit field."""
        return self._supervisor.info

    @property
    def light(self) -> tuple[float, float, float]:
        """What its LED ring shines like now: red, green, blue, up to 255 each; dark without a ring."""
        with self._lock:
            return (0.0, 0.0, 0.0) if self._ring is None else self._ring.run(self._uptime())

    def attach(self, receiver: Receiver | None) -> None:
        """Connect a client: ``receiver(port, channel, data)`` gets every packet sent. None disconnects."""
        with self._lock:
            self._receiver, self._closed_at = receiver, self._t
            self._snapshot.connected = receiver is not None

    def receive(self, header: int, data: bytes) -> None:
        """A packet from the client: header byte (port << 4 | channel) and up to 30 bytes.

        Answers reach the receiver before this returns.
        """
        with self._lock:
            if not self.is_alive:
                return
            self._snapshot.packets_received = self._snapshot.packets_received + 1 & 0xFFFF
            handle = self._ports.get(header >> 4)
            if handle is None:
                return
            if self._ring is not None and header >> 4 == param.PORT:
                self._ring.run(self._uptime())  # up to now it was as its parameters said before
            if header >> 4 not in _IDLE and self._due > -math.inf:
                self._high_level.catch_up()
                self._due = -math.inf
            try:
                handle(header & 0x03, data)
            except FirmwareAssertion:
                self._reboot()

    def sense(self, measurement: PoseMeasurement) -> None:
        """A positioning deck on board has measured the pose; the estimator takes it in at the next tick."""
        with self._lock:
            if self.is_alive:
                self._localization.add(measurement)

    def glance(self, t: float) -> tuple[PoseMeasurement, ...] | None:
        """See :meth:`interface.Firmware.glance`: on the ground and along a trajectory most ticks bring nothing new."""
        self._t = t
        if t >= self._due - _SLACK:
            return None
        if not self._localization.waiting:  # nearly always: no lock for that
            return ()
        with self._lock:
            return self._measurements()

    def tick(self, t: float, telemetry: Telemetry) -> Orders:
        """Run the 100 Hz work at world time ``t`` [s]."""
        with self._lock:
            self._t, self._due = t, -math.inf
            uptime = t - self._booted
            if telemetry.battery_voltage < BROWN_OUT:
                self._brown_out()
                return _GROUNDED
            if uptime < 0.0:
                return _GROUNDED
            snapshot = self._snapshot
            snapshot.telemetry = telemetry
            crash_g = self._steering.crash_g
            if crash_g:
                self._crashed |= abs(math.hypot(*telemetry.accelerometer) - 1.0) > crash_g
            goal = self._high_level.setpoint(telemetry)
            if goal is not None:
                self._commander.offer(goal, Priority.HIGH_LEVEL, uptime)
            if uptime >= self._next_supervision - 1e-9:
                self._supervise(telemetry)
            snapshot.setpoint, snapshot.info = self._commander.allowed(self._supervisor), self._supervisor.info
            orders = self._orders(snapshot.setpoint, goal)
            snapshot.controller, snapshot.uptime = orders.controller, uptime
            if self._receiver is None and t - self._closed_at > _LINK_TIMEOUT:
                self._log.reset()
            self._log.run()
            if self._receiver is not None and not crash_g:
                # Log blocks go by whole milliseconds, see _milliseconds.
                due: float = min(self._next_supervision, (self._log.due - 0.5) / 1000.0)
                self._due = min(self._booted + due, orders.hold_until(telemetry))
            return orders

    def _measurements(self) -> tuple[PoseMeasurement, ...]:
        """Poses that arrived since the last tick."""
        taken = self._localization.take()
        if taken:
            self._snapshot.measurement, self._snapshot.measured = self._localization.latest, self._uptime()
        return taken

    def _start(self) -> None:
        """Everything a boot begins afresh."""
        self._snapshot = Snapshot(connected=self._receiver is not None, decks=self._decks)
        self._parameters = Parameters(self._toc, self.storage)
        self._memory = TrajectoryMemory()
        self._high_level = HighLevelCommander(self._memory, self._parameters, self._uptime)
        self._commander = Commander()
        self._console = console.ConsolePort(self._send)
        self._supervisor = Supervisor(self._auto_arm, self._console.write)
        self._localization = localization.LocalizationPort(
            self._parameters, self._supervisor, self.address, self._uptime
        )
        self._param = param.ParamPort(self._send, self._parameters)
        getters = live_variables(self._snapshot)
        self._ring = LedRing(self._parameters) if any(deck.leds for deck in self._decks) else None
        self._log = log.LogPort(self._send, log_toc(self._hardware), getters, self._milliseconds)
        self._steering = Steering(self._parameters, self._param.notify)
        self._crashed = False  # a blow was felt since the supervisor's last step
        self._due = -math.inf
        self._foreseen: tuple[Foresight, Course] | None = None
        self._next_supervision = 0.0
        self._battery_good = 0.0
        self._ports: Mapping[int, Callable[[int, bytes], None]] = self._port_table()

    def _port_table(self) -> Mapping[int, Callable[[int, bytes], None]]:
        setpoints = setpoint.SetpointPorts(self._commander, self._high_level, self._parameters, self._uptime)
        stores = memories(self._memory, self._count_tester_error, self._decks, self._hardware)
        return {
            console.PORT: self._console.receive,
            param.PORT: self._param.receive,
            setpoint.LEGACY_PORT: setpoints.receive_legacy,
            memory.PORT: memory.MemoryPort(self._send, stores).receive,
            log.PORT: self._log.receive,
            localization.PORT: self._localization.receive,
            setpoint.GENERIC_PORT: setpoints.receive_generic,
            high_level.PORT: high_level.HighLevelPort(self._send, self._high_level).receive,
            supervisor.PORT: supervisor.SupervisorPort(self._send, self._supervisor, self._uptime).receive,
            platform.PORT: platform.PlatformPort(self._send, self._supervisor).receive,
            link.PORT: link.LinkPort(self._send).receive,
        }

    def reboot(self) -> None:
        """Restart as after a dip of the battery's voltage."""
        with self._lock:
            self._reboot()

    def _reboot(self) -> None:
        """The firmware asserted: everything but persistent parameters is lost, the link is silent meanwhile."""
        self.reboots += 1
        self._booted = self._t + BOOT_TIME
        self._start()

    def _brown_out(self) -> None:
        """Too little voltage to run: it boots when there is enough again."""
        if self.is_alive:
            self._reboot()
        else:
            self._booted = self._t + BOOT_TIME

    def _send(self, port: int, channel: int, data: bytes) -> None:
        if self._receiver is not None:
            self._receiver(port, channel, data)

    def _uptime(self) -> float:
        return self._t - self._booted

    def _milliseconds(self) -> int:
        return round(self._uptime() * 1000.0)

    def _count_tester_error(self) -> None:
        self._snapshot.tester_errors += 1

    def _supervise(self, telemetry: Telemetry) -> None:
        now, parameters, planner = self._uptime(), self._parameters, self._high_level
        idle = parameters["powerDist.idleThrust"]
        bits = planner.is_active << 8 | planner.is_finished << 9 | planner.is_disabled << 10
        inputs = Inputs(
            motors_running=max(telemetry.motors) > idle,
            tumbled=telemetry.tumbled and bool(parameters["supervisor.tmblChckEn"]),
            impact=self._crashed,
            setpoint_time=self._commander.updated,
            stop=bool(parameters["stabilizer.stop"]),
            preflight_timeout=parameters["supervisor.prefltTimeout"] / 1000.0,
            landed_timeout=parameters["supervisor.landedTimeout"] / 1000.0,
            planner_bits=bits,
        )
        self._supervisor.step(now, inputs)
        self._crashed = False
        self._high_level.block(not self._supervisor.can_fly)
        self._next_supervision = max(self._next_supervision + PERIOD, now)
        if telemetry.battery_voltage > parameters.get("pm.lowVoltage", 3.2):
            self._battery_good = now
        self._snapshot.battery_low = now - self._battery_good > _LOW_BATTERY_TIME

    def _orders(self, allowed: Setpoint, goal: Setpoint | None) -> Orders:
        reset, steering = self._steering.refresh(), self._steering
        course = self._course() if goal is not None and allowed is goal else None
        return Orders(
            allowed,
            self._supervisor.can_fly,
            steering.controller,
            self._measurements(),
            reset,
            steering.initial_pose,
            steering.tuning,
            course,
        )

    def _course(self) -> Course | None:
        """The trajectory that is followed, in world time; the same object as long as it is the same."""
        foreseen = self._high_level.foreseen
        if foreseen is None:
            return None
        if self._foreseen is None or self._foreseen[0] is not foreseen:
            self._foreseen = foreseen, Course(self._booted + foreseen.begin, foreseen.goals)
        return self._foreseen[1]
