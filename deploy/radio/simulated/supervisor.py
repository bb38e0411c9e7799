"""The supervisor: may it fly, does it fly, why not (firmware supervisor.c, supervisor_state_machine.c).

The state machine is the table ``_TRANSITIONS``: in each state the first rule whose condition holds wins. One step every
40 ms.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum
from typing import NamedTuple

PERIOD = 0.04  # [s] between steps
_FLYING_MEMORY = 2.0  # [s] a drone still counts as flying after its motors idled
_SETPOINT_WARNING, _SETPOINT_TIMEOUT = 0.5, 2.0  # [s] age of the setpoint
_WATCHDOG = 1.0  # [s] after the latest feeding


class State(Enum):
    """Supervisor states; values as the firmware prints them."""

    NOT_INITIALIZED = "Not initialized"
    CHECKS_NOT_PASSED = "Pre-flight checks not passed"
    CHECKS_PASSED = "Pre-flight checks passed"
    ARMING = "Arming"
    READY = "Ready to fly"
    FLYING = "Flying"
    LANDED = "Landed"
    RESET = "Reset"
    LEVEL_OUT = "Warning, level out"
    FREE_FALL = "Exception, free fall"
    LOCKED = "Locked"
    CRASHED = "Crashed"


class Conditions(NamedTuple):
    """What the state machine looks at."""

    armed: bool = False
    flying: bool = False
    tumbled: bool = False
    impact: bool = False
    crashed: bool = False
    setpoint_old: bool = False
    setpoint_dead: bool = False
    emergency: bool = False
    preflight_timeout: bool = False
    landed_timeout: bool = False


Rule = tuple[Callable[[Conditions], bool], State]


def _always(_: Conditions) -> bool:
    return True


_EMERGENCY: Rule = (lambda c: c.emergency, State.FREE_FALL)
_TRANSITIONS: dict[State, tuple[Rule, ...]] = {
    State.NOT_INITIALIZED: ((_always, State.CHECKS_NOT_PASSED),),
    State.CHECKS_NOT_PASSED: (_EMERGENCY, (lambda c: not c.tumbled, State.CHECKS_PASSED)),
    State.CHECKS_PASSED: (
        _EMERGENCY,
        (lambda c: c.tumbled, State.CHECKS_NOT_PASSED),
        (lambda c: c.armed, State.ARMING),
    ),
    State.ARMING: (
        _EMERGENCY,
        (lambda c: c.tumbled or not c.armed, State.CHECKS_NOT_PASSED),
        (_always, State.READY),
    ),
    State.READY: (
        _EMERGENCY,
        (lambda c: c.tumbled or not c.armed or c.preflight_timeout, State.CHECKS_NOT_PASSED),
        (lambda c: c.flying, State.FLYING),
    ),
    State.FLYING: (
        (lambda c: c.setpoint_dead or c.emergency, State.FREE_FALL),
        (lambda c: c.tumbled or c.impact, State.CRASHED),
        (lambda c: not c.armed, State.RESET),
        (lambda c: c.setpoint_old, State.LEVEL_OUT),
        (lambda c: not c.flying, State.LANDED),
    ),
    State.LANDED: (
        _EMERGENCY,
        (lambda c: c.landed_timeout or not c.armed, State.RESET),
        (lambda c: c.flying, State.FLYING),
    ),
    State.RESET: ((_always, State.CHECKS_NOT_PASSED),),
    State.LEVEL_OUT: (
        (lambda c: c.setpoint_dead or c.emergency or c.tumbled or not c.armed, State.FREE_FALL),
        (lambda c: not c.setpoint_old, State.FLYING),
    ),
    State.FREE_FALL: ((_always, State.LOCKED),),
    State.LOCKED: (),
    State.CRASHED: (
        (lambda c: c.emergency, State.LOCKED),
        (lambda c: not c.crashed and not c.tumbled, State.CHECKS_NOT_PASSED),
    ),
}
_MOTORS_ALLOWED = frozenset({State.READY, State.FLYING, State.LEVEL_OUT, State.LANDED})
_STAYS_ARMED = _MOTORS_ALLOWED | {State.ARMING}


class Inputs(NamedTuple):
    """One step's view of the rest of the firmware. Times in [s] since boot.

    Attributes:
        motors_running: a motor turns above idle thrust.
        tumbled: on its side or back for long enough.
        impact: a harder blow was felt than parameter supervisor.crashDetectGs allows.
        setpoint_time: when the setpoint in force arrived.
        stop: parameter stabilizer.stop.
        preflight_timeout, landed_timeout: parameters, [s].
        planner_bits: bits 8 to 10 of the bit field.
    """

    motors_running: bool = False
    tumbled: bool = False
    impact: bool = False
    setpoint_time: float = 0.0
    stop: bool = False
    preflight_timeout: float = 30.0
    landed_timeout: float = 3.0
    planner_bits: int = 0


class Supervisor:
    """One drone's supervisor.

    Args:
        auto_arm: arm as soon as the checks pass (Crazyflie 2.x); False waits for a request (Brushless, Bolt).
        say: where messages for the console go.
    """

    def __init__(self, auto_arm: bool, say: Callable[[str], None]) -> None:
        self.state = State.NOT_INITIALIZED
        self.can_fly = False
        self.armed = False
        self.info = 0x0004 if auto_arm else 0
        self._auto_arm, self._say = auto_arm, say
        self._crashed = self._tumbled = self._emergency = False
        self._motors_time: float | None = None
        self._fed: float | None = None
        self._ready_since = self._landed_since = 0.0

    @property
    def is_flying(self) -> bool:
        """Whether the drone counts as flying."""
        return self.state in (State.FLYING, State.LEVEL_OUT)

    @property
    def is_crashed(self) -> bool:
        """Whether a recovery request is needed."""
        return self._crashed

    def request_arming(self, arm: bool) -> bool:
        """Arm or disarm; whether the request was granted."""
        if arm != self.armed:
            if arm and self.state is not State.CHECKS_PASSED:
                return False
            self.armed = arm
        return True

    def request_recovery(self) -> bool:
        """Clear a crash; only granted when upright."""
        if self._crashed and self._tumbled:
            return False
        self._crashed = False
        return True

    def emergency_stop(self) -> None:
        """Cut the motors for good."""
        self._emergency = True

    def feed_watchdog(self, t: float) -> None:
        """From the first feeding on, a second without another is an emergency stop."""
        self._fed = t

    def settle(self, t: float) -> None:
        """Pass through the start-up states at once: it is ``t`` seconds since boot, and nothing is amiss."""
        while self.state not in (State.READY, State.CHECKS_PASSED) or (self._auto_arm and not self.can_fly):
            self.step(t, Inputs(setpoint_time=t, planner_bits=0x0200))

    def step(self, t: float, inputs: Inputs) -> None:
        """One step of the state machine at ``t`` seconds since boot."""
        if inputs.motors_running:
            self._motors_time = t
        self._tumbled = inputs.tumbled
        conditions = self._conditions(t, inputs)
        for holds, target in _TRANSITIONS[self.state]:
            if holds(conditions):
                self._enter(target, t)
                break
        self.info = self._bits() | inputs.planner_bits

    def _conditions(self, t: float, inputs: Inputs) -> Conditions:
        age = t - inputs.setpoint_time
        return Conditions(
            armed=self.armed,
            flying=self._motors_time is not None and t - self._motors_time < _FLYING_MEMORY,
            tumbled=inputs.tumbled,
            impact=inputs.impact,
            crashed=self._crashed,
            setpoint_old=age > _SETPOINT_WARNING,
            setpoint_dead=age > _SETPOINT_TIMEOUT,
            emergency=self._emergency or inputs.stop or (self._fed is not None and t >= self._fed + _WATCHDOG),
            preflight_timeout=t - self._ready_since > inputs.preflight_timeout,
            landed_timeout=t - self._landed_since > inputs.landed_timeout,
        )

    def _enter(self, state: State, t: float) -> None:
        self.state, self.can_fly = state, state in _MOTORS_ALLOWED
        if state is State.READY:
            self._ready_since = t
        elif state is State.LANDED:
            self._landed_since = t
        elif state is State.LOCKED:
            self._say("SUP: Locked, reboot required\n")
        elif state is State.CRASHED:
            self._crashed = True
            self._say("SUP: Crashed, recovery required\n")
        if state not in _STAYS_ARMED:
            self.armed = self._auto_arm and state is State.CHECKS_PASSED

    def _bits(self) -> int:
        return (
            (self.state is State.CHECKS_PASSED)
            | self.armed << 1
            | self._auto_arm << 2
            | self.can_fly << 3
            | self.is_flying << 4
            | self._tumbled << 5
            | (self.state is State.LOCKED) << 6
            | self._crashed << 7
        )
