"""The flight recorder: records in, a crash-safe MCAP file out, and the flight never waits for the disk.

Callers only encode and append; ``recorder.Recorder`` owns the file and the thread that writes it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from deploy.flightlog.encode import NANOSECONDS, log_line, pose_to_json, to_json, vector
from deploy.flightlog.recorder import Item, Recorder
from deploy.flightlog.topics import find_topic


class FlightLog:
    """Writes one flight's records to ``<path>.part``, renamed to ``path`` by :meth:`close`.

    Methods may be called from any thread. A context manager.

    Args:
        path: the log to write, ending in ``.mcap``; neither it nor its ``.part`` may exist.
        clock_epoch: Unix time [s] at which the flight clock was zero.
        attachments: files to embed, by name; the flight plan goes under ``plan.mcap``.
        metadata: provenance: versions, seed, back-end.
        when_full: what :meth:`write` does when the disk cannot keep up: ``drop`` the record and count it (a flight
            must not wait), or ``wait`` (a rehearsal can).

    Raises:
        LogFileError: the file exists, the folder cannot be written, or the disk is nearly full.
    """

    def __init__(
        self,
        path: str | Path,
        clock_epoch: float,
        attachments: Mapping[str, bytes],
        metadata: Mapping[str, str],
        when_full: Literal["drop", "wait"] = "drop",
    ) -> None:
        self.path = Path(path)
        self._epoch = round(clock_epoch * NANOSECONDS)
        self._recorder = Recorder(self.path, self._epoch, attachments, metadata, wait=when_full == "wait")

    # ------------------------------------------------------------------------------------------------ records

    def write(self, topic: str, t: float, record: Mapping[str, object]) -> None:
        """Record something at flight time ``t`` [s].

        Raises:
            ValueError: the topic is not in ``topics.TOPICS``.
            TypeError: a value of the record has no JSON form.
        """
        find_topic(topic)
        self._recorder.put(Item(self._nanoseconds(t), topic, to_json(record)))

    def pose(self, robot: str, t: float, position: Sequence[float], quaternion: Sequence[float] | None = None) -> None:
        """A robot's measured pose: position [m], quaternion x, y, z, w (body to world)."""
        topic, time = f"/{robot}/pose", self._nanoseconds(t)
        find_topic(topic)
        self._recorder.put(Item(time, topic, pose_to_json(time, position, quaternion)))

    def estimate(
        self,
        robot: str,
        t: float,
        position: Sequence[float],
        velocity: Sequence[float],
        attitude: Sequence[float],
        tick: int | None = None,
    ) -> None:
        """The drone's own estimate: [m], [m/s], roll, pitch, yaw [rad], its time stamp [ms]."""
        record = {"position": vector(position), "velocity": vector(velocity), "attitude": vector(attitude)}
        self.write(f"/{robot}/estimate", t, {**record, "tick": tick})

    def setpoint(
        self,
        robot: str,
        t: float,
        position: Sequence[float],
        velocity: Sequence[float] | None = None,
        yaw_rate: float | None = None,
        tick: int | None = None,
    ) -> None:
        """What the drone's controller is asked for: [m], [m/s], [rad/s], its time stamp [ms]."""
        record: dict[str, object] = {"position": vector(position), "yaw_rate": yaw_rate, "tick": tick}
        if velocity is not None:
            record["velocity"] = vector(velocity)
        self.write(f"/{robot}/setpoint", t, record)

    def reference(
        self, robot: str, t: float, position: Sequence[float], velocity: Sequence[float] | None = None
    ) -> None:
        """Where the certified trajectory is: [m], [m/s]."""
        record: dict[str, object] = {"position": vector(position)}
        if velocity is not None:
            record["velocity"] = vector(velocity)
        self.write(f"/{robot}/reference", t, record)

    def battery(
        self, robot: str, t: float, voltage: float, level: float | None = None, state: int | None = None
    ) -> None:
        """Battery: [V], [%], pm.state."""
        self.write(f"/{robot}/battery", t, {"voltage": voltage, "level": level, "state": state})

    def link(
        self,
        robot: str,
        t: float,
        *,
        latency_ms: float | None = None,
        quality: float | None = None,
        rssi: float | None = None,
        sent: int | None = None,
        received: int | None = None,
        lost: int | None = None,
    ) -> None:
        """Radio statistics; None for what is not known."""
        record = {"latency_ms": latency_ms, "quality": quality, "rssi": rssi}
        self.write(f"/{robot}/link", t, {**record, "sent": sent, "received": received, "lost": lost})

    def supervisor(self, robot: str, t: float, bits: int, names: Sequence[str] = ()) -> None:
        """The firmware's supervisor state."""
        self.write(f"/{robot}/supervisor", t, {"bits": bits, "names": list(names)})

    def motors(self, robot: str, t: float, power: Sequence[int]) -> None:
        """What each motor is commanded: m1 to m4, 0..65535."""
        self.write(f"/{robot}/motors", t, {"power": list(power)})

    def event(
        self,
        t: float,
        name: str,
        text: str,
        *,
        phase: str = "",
        robot: str = "",
        level: Literal["info", "warning", "fault"] = "info",
        value: float | None = None,
    ) -> None:
        """Something that happened, also as a line of ``/log``; on disk at once."""
        record = {"phase": phase, "robot": robot, "level": level, "name": name, "text": text, "value": value}
        self.write("/log", t, log_line(self._nanoseconds(t), level, robot or phase, text))
        self.write("/events", t, record)

    # ------------------------------------------------------------------------------------------------ state

    @property
    def dropped(self) -> int:
        """Records lost because the disk could not keep up."""
        return self._recorder.dropped

    @property
    def failure(self) -> str:
        """Why writing stopped (a full disk, say); empty while all is well. The flight goes on without a log."""
        return self._recorder.failure

    def close(self) -> None:
        """Write what is left, finish the file and give it its name. May be called again.

        Raises:
            LogFileError: the disk refused; the unfinished ``.part`` file stays and can be read.
        """
        self._recorder.close()

    def abandon(self) -> None:
        """Stop as if the process had died; the unfinished ``.part`` file stays, and later records are lost."""
        self._recorder.abandon()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _nanoseconds(self, t: float) -> int:
        # Added as integers: a double holding today's Unix time resolves no better than 0.2 µs.
        return self._epoch + round(t * NANOSECONDS)
