"""Telemetry of one Crazyflie as it arrives: cflib's threads put samples in, the flight loop takes records out."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Mapping
from typing import Any

from cflib.crazyflie.log import LogConfig

from deploy.clock import Clock
from deploy.errors import CommandRefused, LinkError
from deploy.radio import telemetry

_DEADLINE = 3.0  # [s] of wall time


class Stream:
    """The log blocks of ``telemetry.BLOCKS``.

    Args:
        crazyflie: cflib's object. clock: the flight's; stamps everything that arrives. name: for error messages.

    Attributes:
        estimate, target, status, variance: newest records that :meth:`poll` returned; None before the first.
    """

    def __init__(self, crazyflie: Any, clock: Clock, name: str) -> None:  # noqa: ANN401 - untyped library
        self._crazyflie, self._clock, self._name = crazyflie, clock, name
        self._samples: deque[telemetry.Sample] = deque()
        self._tick = 0
        self._blocks: dict[str, Any] = {}
        self.estimate: telemetry.Estimate | None = None
        self.target: telemetry.Target | None = None
        self.status: telemetry.Status | None = None
        self.variance: telemetry.Variance | None = None

    def start(self, rate: float) -> None:
        """Have every block logged at ``rate`` [Hz] until the link ends; blocks until all of them run.

        Raises:
            CommandRefused: the drone lacks a variable or refuses a block. LinkError: no answer.
        """
        period = min(2540, max(10, round(1000.0 / rate / 10.0) * 10))
        for name, variables in telemetry.BLOCKS.items():
            self._blocks[name] = block = self._block(name, variables, period)
            waited = time.monotonic() + _DEADLINE
            started = threading.Event()
            block.started_cb.add_callback(lambda _, on, event=started: event.set() if on else None)
            block.error_cb.add_callback(lambda _, message, event=started: event.set())
            block.start()
            if not started.wait(waited - time.monotonic()):
                raise LinkError(f"{self._name}: log block '{name}': no answer within {_DEADLINE:.0f} s")
            if not block.started:
                raise CommandRefused(f"{self._name}: log block '{name}': refused with error {block.err_no}")

    def pause(self, name: str) -> None:
        """Have a block, a key of ``telemetry.BLOCKS``, sent no longer."""
        self._blocks[name].stop()

    def resume(self, name: str) -> None:
        """Have a paused block sent again."""
        self._blocks[name].start()

    def poll(self) -> tuple[telemetry.Record, ...]:
        """Records that arrived since the last call, oldest first; also updates the attributes."""
        if not self._samples:
            return ()
        records = []
        while self._samples:
            record = telemetry.to_record(self._samples.popleft())
            if isinstance(record, telemetry.Estimate):
                self.estimate = record
            elif isinstance(record, telemetry.Target):
                self.target = record
            elif isinstance(record, telemetry.Status):
                self.status = record
            else:
                self.variance = record
            records.append(record)
        return tuple(records)

    # ------------------------------------------------------------------------------------------------ inside

    def _block(self, name: str, variables: tuple[tuple[str, str], ...], period: int) -> Any:  # noqa: ANN401
        block = LogConfig(name, period)
        for variable, kind in variables:
            block.add_variable(variable, kind or None)
        try:
            self._crazyflie.log.add_config(block)
        except (KeyError, AttributeError) as error:
            raise CommandRefused(f"{self._name}: log block '{name}': {error.args[0]}") from error
        block.data_received_cb.add_callback(self._logged)
        return block

    def _logged(self, tick: int, values: Mapping[str, float], block: Any) -> None:  # noqa: ANN401 - untyped library
        self._tick = telemetry.unwrap(tick, self._tick)
        self._samples.append(telemetry.Sample(block.name, self._clock.now(), self._tick, values))
