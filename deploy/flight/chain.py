"""The legs of one robot in flight: each uploaded while the one before it flies, and started on time.

::

    leg k-1 begins ──► seen flying ──► leg k: written, read back, compared, defined ──► ready ──► start sent
                                       └─ into the half of the memory that leg k-2 has left

A start is never repeated: a second copy would fly the leg again from its first point.

A leg that was planned anew is offered: it is uploaded the same way, beside the next leg, once that is ready. Whatever
goes wrong with it ends the offer, not the mission.
"""

from __future__ import annotations

from dataclasses import dataclass

from deploy.errors import CommandRefused, LinkError, UploadError
from deploy.flight.loop import TICK
from deploy.flight.talk import Talk
from deploy.flight.timing import heard
from deploy.radio import highlevel
from deploy.radio.drone import Drone
from deploy.radio.memory import TRAJECTORY
from deploy.radio.requests import Reply
from deploy.upload import loading, trajectory_id
from missions.schema import Mission
from planner.certificate.radio import LEGS_ON_THE_GROUND
from planner.certificate.switching import READY_BEFORE, SEEN_AFTER, seen_within
from planner.trajectory.encoded import EncodedTrajectory, Leg
from planner.trajectory.timeline import Timeline

_ANSWERED_WITHIN = 0.1  # s; after that the drone's telemetry has to say whether it heard the start


@dataclass
class Offer:
    """A leg that may take the next one's place.

    Attributes:
        number: of the leg. leg: its bytes. since: when it is offered [s, flight clock].
        upload: under way. ready: whether it was read back equal and defined. failure: why it will not be.
    """

    number: int
    leg: Leg
    since: float
    upload: Talk | None = None
    ready: bool = False
    failure: str = ""


class Chain:
    """The legs of one robot.

    Args:
        drone: who flies them. trajectory: its legs. timeline: where it is in them; the first one has begun.
        start: scheduled start of the first [s, flight clock]. mission: what it says of radio and telemetry.
        rate: acknowledged requests a second that uploads may take.
    """

    def __init__(
        self,
        drone: Drone,
        trajectory: EncodedTrajectory,
        timeline: Timeline,
        start: float,
        mission: Mission,
        rate: float,
    ) -> None:
        self.drone, self.legs, self.timeline = drone, trajectory.legs, timeline
        self._start, self._rate = start, rate
        self._latency, self._patience = mission.radio.latency, seen_within(mission)
        self._memory = drone.memory(TRAJECTORY)
        self.ready = min(len(self.legs), LEGS_ON_THE_GROUND)  # legs that were read back equal so far
        self.offer: Offer | None = None
        self._upload: Talk | None = None
        self._starting: Reply | None = None
        self._credit, self._last = 0.0, start

    @property
    def flying(self) -> int:
        """Number of the leg that flies, from 0."""
        return self.timeline.begun - 1

    def due(self, number: int) -> float:
        """When a leg should begin [s, flight clock]."""
        return self._start + self.timeline.times[number]

    def turn(self, now: float) -> float | None:
        """Do what is due; returns how late the next leg has begun [s] when that has just become known.

        Raises:
            DeployError: the mission cannot go on, with the reason.
        """
        if self.flying + 1 == len(self.legs):
            return None
        if self._starting is not None:
            return self._follow_start(self._starting, now)
        following = self.flying + 1
        if self.ready <= following:
            self._load(following, now)
        elif self.offer is not None and self.offer.number == following:
            self._load_offer(self.offer, now)
        if now >= self.due(following) - self._latency - 0.5 * TICK:
            self._starting = self.drone.send(highlevel.start_trajectory(trajectory_id(following, self.legs[following])))
        return None

    def _load(self, number: int, now: float) -> None:
        """Carry the upload of a leg on, as fast as the radio's share allows."""
        name, left = self.drone.name, self.due(number) - now
        if left < READY_BEFORE:
            raise UploadError(
                f"{name}: leg {number + 1} of {len(self.legs)} is not in its memory {READY_BEFORE:g} s before its start"
            )
        if self._upload is None:
            if not self._seen_flying(now):
                return
            self._upload = self._talk(number, self.legs[number], now)
        self._carry_on(self._upload, now)
        if self._upload.over:
            self._upload, self.ready = None, number + 1

    def _load_offer(self, offer: Offer, now: float) -> None:
        """The same for a leg that is offered; it may fail."""
        if offer.ready or offer.failure or now < offer.since:
            return
        if offer.upload is None:
            if not self._seen_flying(now):
                return
            offer.upload = self._talk(offer.number, offer.leg, now)
        try:
            self._carry_on(offer.upload, now)
        except (LinkError, UploadError, CommandRefused) as error:
            offer.failure = str(error)
            return
        offer.ready = offer.upload.over

    def _talk(self, number: int, leg: Leg, now: float) -> Talk:
        self._credit, self._last = 1.0, now
        return Talk(self.drone, loading(self.drone.name, self._memory, leg, trajectory_id(number, leg)))

    def _carry_on(self, upload: Talk, now: float) -> None:
        # Room for two: a rate a little below one packet a tick must not become one every other tick.
        self._credit = min(2.0, self._credit + (now - self._last) * self._rate)
        self._last = now
        if self._credit >= 1.0 - 1e-6 and upload.step(now):
            self._credit -= 1.0

    def take_over(self, trajectory: EncodedTrajectory) -> None:
        """From the next leg on, fly what was offered; its first leg is ready."""
        self.legs, self.offer = trajectory.legs, None

    def withdraw(self) -> None:
        """Offer nothing any more."""
        if self.offer is not None and self.offer.upload is not None and not self.offer.upload.over:
            self.offer.upload.end()
        self.offer = None

    def _seen_flying(self, now: float) -> bool:
        """Whether the drone's own word, from after the start, says that its leg flies: then the other half is free."""
        flies = self._flies(self.flying)
        if flies is False:
            raise CommandRefused(
                f"{self.drone.name}: leg {self.flying + 1} of {len(self.legs)}: "
                "its start was accepted, but the drone holds"
            )
        return flies is True

    def _flies(self, number: int) -> bool | None:
        """Whether a leg that was started flies, by the drone's own word; None as long as that is from before."""
        status = self.drone.status
        if status is None or status.t < self.due(number) + SEEN_AFTER:
            return None
        return status.supervisor.manoeuvring

    def _follow_start(self, reply: Reply, now: float) -> float | None:
        number = self.flying + 1
        which = f"{self.drone.name}: start of leg {number + 1} of {len(self.legs)}"
        if not reply.here:
            flies, silent = self._flies(number), now - reply.sent
            if silent < _ANSWERED_WITHIN - 1e-9 or (flies is None and silent < self._patience):
                return None
            self.drone.forget(reply)
            if not flies:
                raise CommandRefused(f"{which}: no answer" + (", and the drone holds" if flies is False else ""))
            return self._begin(number, heard(reply, self._latency))
        code = highlevel.return_code(reply.payload)
        if code:
            raise CommandRefused(f"{which}: {highlevel.meaning(code)}")
        return self._begin(number, heard(reply, self._latency))

    def _begin(self, number: int, t: float) -> float:
        """A leg began at t; returns how late that was [s]."""
        self._starting = None
        self.timeline.begin(t)
        return t - self.due(number)

    def end(self) -> None:
        """Wait for no answer any more."""
        self.withdraw()
        if self._upload is not None:
            self._upload.end()
