"""The link to one Crazyflie: opened, watched, counted, closed; cflib's threads report here.

Whoever opens a link blocks, with a deadline; everything else returns at once.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from deploy.clock import Clock
from deploy.errors import LinkError
from deploy.radio.drivers import NO_DONGLE
from deploy.radio.ping import Pings, is_foreign


@dataclass(frozen=True)
class LinkState:
    """Quality of one link.

    Attributes:
        latency: longest of the last round trips [ms]; NaN before the first answer.
        quality: share of packets acknowledged [%]; NaN if the driver does not say. rssi: [dBm], NaN likewise.
        sent, received: packets so far. unanswered: pings that were lost.
        heard: flight time of the last packet [s]; -inf before the first.
        lost: why the link is gone; empty while it is up.
    """

    latency: float = math.nan
    quality: float = math.nan
    rssi: float = math.nan
    sent: int = 0
    received: int = 0
    unanswered: int = 0
    heard: float = -math.inf
    lost: str = ""


class Link:
    """One link.

    Args:
        crazyflie: cflib's object.
        clock: the flight's.
        pings: of this link.

    Attributes:
        lost: why it is gone; empty while it is up.
        heard: flight time of the last packet [s]; -inf before the first.
    """

    def __init__(self, crazyflie: Any, clock: Clock, pings: Pings) -> None:  # noqa: ANN401 - untyped library
        self.lost, self.heard = "", -math.inf
        self._crazyflie, self._clock, self._pings = crazyflie, clock, pings
        self._ready = threading.Event()  # connected for good, or failed
        self._connected = False
        self._failure = ""
        self._statistics = {"quality": math.nan, "rssi": math.nan}
        self._sent = self._received = 0
        self._listen()

    @property
    def up(self) -> bool:
        """Whether it is."""
        return self._connected and not self.lost

    @property
    def state(self) -> LinkState:
        """Its quality as of now."""
        return LinkState(
            self._pings.latency,
            **self._statistics,
            sent=self._sent,
            received=self._received,
            unanswered=self._pings.lost,
            heard=self.heard,
            lost=self.lost,
        )

    def open(self, uri: str, deadline: float) -> None:
        """Connect and fetch the drone's tables; blocks for at most ``deadline`` seconds of wall time.

        Raises:
            LinkError: it did not come up, or was closed meanwhile.
        """
        self.lost = ""
        self._dial(uri, deadline, self._crazyflie.close_link)

    def reopen(self, uri: str, deadline: float) -> None:
        """Connect again to a drone that may be flying; as :meth:`open`, but hangs up without a farewell.

        cflib's own way to close a link begins with a zero thrust setpoint: a fall. Until the link is up it counts as
        lost.

        Raises:
            LinkError: it did not come up.
        """
        self._dial(uri, deadline, self._drop)

    def close(self) -> None:
        """Hang up, whatever the drone does; may be called again."""
        was_open = self._connected or self._crazyflie.link is not None
        self._connected = False
        self._failure = self._failure or "closed"  # whoever still waits for the connection need not
        self._ready.set()
        if was_open:
            self._crazyflie.close_link()

    # ------------------------------------------------------------------------------------------------ inside

    def _dial(self, uri: str, deadline: float, hang_up: Callable[[], None]) -> None:
        self._connected, self._failure = False, ""
        self._ready.clear()
        self._crazyflie.open_link(uri)
        if not self._ready.wait(deadline):
            self._failure = f"not connected within {deadline:.0f} s (is the drone on, and at this address?)"
        if self._failure:
            hang_up()
            raise LinkError(self._failure)
        self.lost, self._connected = "", True
        # Ten pings a second and drone are a fifth of a dongle's packets for ten drones; ours, twice a second, will do.
        self._crazyflie.link_statistics.latency.stop()

    def _drop(self) -> None:
        """Hang up without a word."""
        driver, self._crazyflie.link = self._crazyflie.link, None
        if driver is not None:
            driver.close()

    def _listen(self) -> None:
        crazyflie = self._crazyflie
        # cflib would now read every parameter, most of a cached connection's packets; who needs one asks for it.
        crazyflie.param.request_update_of_all_params = lambda: None
        crazyflie.connected.add_callback(lambda uri: self._ready.set())
        crazyflie.connection_failed.add_callback(lambda uri, message: self._fail(message))
        crazyflie.connection_lost.add_callback(lambda uri, message: self._lose(message))
        crazyflie.packet_sent.add_callback(self._count_sent)
        crazyflie.packet_received.add_callback(self._count_received)
        statistics = crazyflie.link_statistics
        for caller, key in (
            (statistics.link_quality_updated, "quality"),
            (statistics.uplink_rssi_updated, "rssi"),
        ):
            caller.add_callback(lambda value, key=key: self._statistics.__setitem__(key, float(value)))

    def _fail(self, message: str) -> None:
        # cflib appends a traceback to what went wrong; the first line is for people.
        first = message.split("\n")[0].removeprefix("Couldn't load link driver: ")
        self._failure = NO_DONGLE if "Cannot find a Crazyradio" in first else first
        self._ready.set()

    def _lose(self, message: str) -> None:
        self.lost = message.split("\n")[0] or "the link broke"
        self._failure = self._failure or self.lost
        self._ready.set()

    # cflib pings by wall time. Counting its packets would make a rehearsal's log, and the moment at which a silent
    # drone is missed, those of the computer; telemetry and our own pings say as much.
    def _count_sent(self, packet: Any) -> None:  # noqa: ANN401 - untyped library
        self._sent += not is_foreign(packet)

    def _count_received(self, packet: Any) -> None:  # noqa: ANN401 - untyped library
        if not is_foreign(packet):
            self._received += 1
            self.heard = self._clock.now()
