"""One drone's radio link: queues at both ends, retries, losses, and when it counts as lost.

As cflib's RadioDriver with safelink: a packet is tried until it is acknowledged, so losses make packets late, not
disappear; after 100 exchanges in a row without an answer the link is lost. What the drone has to say rides in the
acknowledgements, one packet an exchange.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from typing import Protocol, TypeVar

from deploy.radio.simulated.air.fading import Fading
from deploy.radio.simulated.air.model import AirModel, Station
from deploy.radio.simulated.air.packets import Debt, Down, Up

LOST_IN_A_ROW = 100  # cflib: _nr_of_retries
LONGEST_WAIT = 2.0  # [s] cflib: a packet that nobody fetches for so long is a link error
TRANSMIT_QUEUE = 200  # packets the firmware keeps; what comes then is dropped
_ATTENTIVE = 0.01  # [s] between polls of a drone that has nothing to say (cflib, after ten empty answers)
_RELAXED = 0.05  # [s] the same while nothing disturbs its channel: what such polls would tell is known
_REMEMBERED = 0.02  # share of the newest exchange in the link quality (cflib: mean of 100)
_LOCALIZATION = 6
_LOG_DATA = (5, 2)
# Log blocks have timers of their own (firmware log.c), started whenever the client's packet came: they do not leave
# on the stabiliser's tick, on which the model computes them, nor all together.
_TIMERS = (0.0007, 0.0040, 0.0073, 0.0024, 0.0057, 0.0090)  # [s] after that tick, by number of the block

T = TypeVar("T")
Deliver = Callable[[int, int, bytes], None]
Lose = Callable[[str], None]
LOST = "Too many packets lost"
STUCK = "RadioDriver: Could not send packet to copter"


class Receiver(Protocol):
    """What a line needs of a drone."""

    @property
    def is_alive(self) -> bool:
        """False while it reboots."""

    def receive(self, header: int, data: bytes) -> None:
        """A packet from the client."""


class Line:
    """The link of one drone.

    Args:
        drone: who is at the other end.
        model: of the radio. station: how the drone is reached.
        seed: of its losses.
        held: whether time stands still for somebody's work (a connection, an upload): then packets are handed over at
            once, and what they would have taken is owed.

    Attributes:
        t: what time it is at the drone's end of the line [s]; kept by whoever moves the line.
        due: when it wants its next exchange [s].
        fading: its losses.
        dropped: packets the firmware had no room for. quality: share of attempts that succeed [%], as cflib has it.
        debt: time that is owed; whoever lets it pass clears it.
        falling: exchanged, not yet at the client.
    """

    def __init__(
        self, drone: Receiver, model: AirModel, station: Station, seed: str, held: Callable[[], bool] = lambda: False
    ) -> None:
        self.station, self.fading = station, Fading(seed, model.loss)
        self.t, self.due = 0.0, math.inf
        self.dropped, self.quality, self.debt = 0, 100.0, Debt()
        self._silenced, self._delay = 0, 0.0
        self._poll = 0.0  # [s] when to poll a drone that has nothing to say
        self._drone, self._model, self._held = drone, model, held
        self._lock = threading.RLock()
        self._deliver: Deliver | None = None
        self._lose: Lose | None = None
        self._period = 0.0
        self._failures = 0
        self._at_once = False
        self._sent = 0
        self._trips: list[tuple[int, Callable[[], None]]] = []
        self._waiting: deque[Up] = deque()  # for an exchange
        self._rising: deque[Up] = deque()  # exchanged, not yet at the drone
        self._answers: deque[Down] = deque()  # for an exchange
        self.falling: deque[Down] = deque()

    @property
    def reachable(self) -> bool:
        """Whether anything could get through."""
        return not self._silenced and self._drone.is_alive

    # ------------------------------------------------------------------------------------------------ faults

    def silence(self) -> Callable[[], None]:
        """Nothing gets through until what this returns is called."""
        self._silenced += 1
        self._look()

        def end() -> None:
            self._silenced -= 1

        return end

    def disturb(self, rate: float, burst: float = 0.0) -> Callable[[], None]:
        """Attempts fail at this rate, see :class:`Fading`, until what this returns is called."""
        self.fading.disturb(self.t, rate, burst)
        self._look()
        return self.fading.calm

    def slow_down(self, latency: float) -> Callable[[], None]:
        """Every packet takes so much longer [s], each way, until what this returns is called."""
        self._delay += latency

        def end() -> None:
            self._delay -= latency

        return end

    def trip(self, packets: int, act: Callable[[], None]) -> None:
        """Call ``act`` before the client's so many-th packet from now on is sent, in the thread that sends it."""
        self._trips.append((self._sent + packets, act))

    # ------------------------------------------------------------------------------------------------ client's end

    def open(self, deliver: Deliver, lose: Lose, rate_limit: float | None = None) -> None:
        """A client connects: it is given packets by ``deliver``, and told by ``lose`` why there is no link any more."""
        with self._lock:
            self._forget()
            self._deliver, self._lose = deliver, lose
            limit = rate_limit or self.station.rate_limit
            self._period = 1.0 / limit if limit else 0.0
            self.due = self.t

    def close(self) -> None:
        """The client hangs up; may be called again."""
        with self._lock:
            self._deliver = self._lose = None
            self.due = math.inf

    def send(self, header: int, data: bytes) -> None:
        """The client has a packet for the drone.

        A position that still waits is replaced by a newer one: cflib's queue holds one packet, its sender waits, and
        what it then sends is new.
        """
        self._sent += 1
        for item in [item for item in self._trips if item[0] <= self._sent]:
            self._trips.remove(item)
            item[1]()
        with self._lock:
            if self._deliver is None:
                return
            if self._held():
                lost = not self._hand_over(header, data)
            else:
                lost = False
                last = self._waiting[-1] if self._waiting else None
                if last is not None and header >> 4 == _LOCALIZATION and last.header == header:
                    self._waiting[-1] = Up(last.t, header, data)
                else:
                    self._waiting.append(Up(self.t, header, data))
                self.due = min(self.due, self.t)
        if lost:
            self.cut(LOST)

    def cut(self, reason: str) -> None:
        """Tell the client that the link is gone."""
        lose = self._lose
        self.close()
        if lose is not None:
            lose(reason)

    # ------------------------------------------------------------------------------------------------ drone's end

    def answer(self, port: int, channel: int, data: bytes) -> None:
        """The drone has a packet for the client."""
        with self._lock:
            if self._deliver is None:
                return
            if self._at_once:
                self._owe(self._model.downlink)
                self._deliver(port, channel, data)
            elif len(self._answers) >= TRANSMIT_QUEUE:
                self.dropped += 1
            else:
                leaves = self.t
                if (port, channel) == _LOG_DATA:
                    leaves += _TIMERS[data[0] % len(_TIMERS)]
                if self._answers:
                    leaves = max(leaves, self._answers[-1].t)
                self._answers.append(Down(leaves, port, channel, data))
                self.due = min(self.due, leaves)

    # ------------------------------------------------------------------------------------------------ on the air

    def exchange(self, now: float, slot: float) -> float:
        """One poll of the drone that begins at ``now`` and takes ``slot`` [s] unless it is repeated; when it ends."""
        self.settle(now)
        if now < self._poll and not (self._failures or self._waiting or (self._answers and self._answers[0].t <= now)):
            self.due = self._next_wish(now)
            return now
        tries, end, failed = 0, now + slot, True
        while tries <= self._model.retries and (failed := not self.reachable or self.fading.fails(now)):
            tries += 1
        end += min(tries, self._model.retries) * self._model.retry
        self.quality += _REMEMBERED * (100.0 - 10.0 * min(tries, self._model.retries) - self.quality)
        if failed:
            self._failures += 1
            if not self._drone.is_alive:
                self._answers.clear()  # what a rebooting drone had to say is forgotten
            self.due = end + self._period
            if self._failures >= LOST_IN_A_ROW:
                self.cut(LOST)
            return end
        self._failures = 0
        if self._waiting:
            packet = self._waiting.popleft()
            self._rising.append(Up(self._arrival(self._rising, end, self._model.uplink), packet.header, packet.data))
        if self._answers and self._answers[0].t <= now:
            _, port, channel, data = self._answers.popleft()
            self.falling.append(Down(self._arrival(self.falling, end, self._model.downlink), port, channel, data))
        self._poll = end + max(self._period, _ATTENTIVE if self.fading.is_disturbed else _RELAXED)
        self.due = end + self._period if self._waiting else self._next_wish(end + self._period)
        return end

    def settle(self, now: float) -> None:
        """Everything that has arrived by ``now`` [s] is at the drone."""
        while self._rising and self._rising[0].t <= now:
            packet = self._rising.popleft()
            self.t = max(self.t, packet.t)
            self._drone.receive(packet.header, packet.data)
        self.t = max(self.t, now)
        if self._waiting and now - self._waiting[0].t > LONGEST_WAIT:
            self.cut(STUCK)

    def hand_out(self, now: float) -> None:
        """Everything that has arrived by ``now`` [s] is at the client."""
        while self.falling and self.falling[0].t <= now:
            _, port, channel, data = self.falling.popleft()
            if self._deliver is not None:
                self._deliver(port, channel, data)

    # ------------------------------------------------------------------------------------------------ inside

    def _look(self) -> None:
        if self._deliver is not None:
            self._poll = self.due = self.t

    def _next_wish(self, earliest: float) -> float:
        """When a line whose client has nothing to say is looked at: for a packet at the drone or from it, or to poll.

        ``earliest``: when it may exchange again [s].
        """
        wish = min(self._poll, max(earliest, self._answers[0].t)) if self._answers else self._poll
        return min(wish, self._rising[0].t) if self._rising else wish

    def _arrival(self, before: deque[Up] | deque[Down], end: float, latency: float) -> float:
        """When a packet exchanged by ``end`` arrives: never before one that was exchanged earlier."""
        t = end + latency + self._delay
        return max(t, before[-1].t) if before else t

    def _hand_over(self, header: int, data: bytes) -> bool:
        """Everything under way arrives now, this packet last, and so do its answers; False if the drone is silent."""
        if not self._owe(self._model.uplink):
            return False
        self._at_once = True
        try:
            for old in (*_drain(self.falling), *_drain(self._answers)):
                if self._deliver is not None:
                    self._deliver(old.port, old.channel, old.data)
            for packet in (*_drain(self._rising), *_drain(self._waiting)):
                self._drone.receive(packet.header, packet.data)
            self._drone.receive(header, data)
        finally:
            self._at_once = False
        return True

    def _owe(self, latency: float) -> bool:
        """One packet's exchange, repeated until it succeeds, and its way; False if the link is lost before."""
        model, tries = self._model, 0
        attempts = LOST_IN_A_ROW * (model.retries + 1)
        while tries < attempts and (not self.reachable or self.fading.fails(self.t)):
            tries += 1
        exchanges = min(tries // (model.retries + 1) + 1, LOST_IN_A_ROW)
        air = exchanges / model.packet_rate + tries * model.retry
        own = max(air, exchanges * self._period) + latency + self._delay
        self.debt = Debt(self.debt.line + own, self.debt.dongle + air)
        return tries < attempts

    def _forget(self) -> None:
        for queue in (self._waiting, self._rising, self._answers, self.falling):
            queue.clear()
        self._failures, self.quality = 0, 100.0


def _drain(queue: deque[T]) -> list[T]:
    items = list(queue)
    queue.clear()
    return items
