"""The flight recorder: records in, a crash-safe MCAP file out, and the flight never waits for the disk.

Callers only encode and append; ``recorder.Recorder`` owns the file and the thread that writes it.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

from deploy.flightlog.encode import NANOSECONDS, log_line, pose_to_json, to_json, vectors_to_json
from deploy.flightlog.events import Level
from deploy.flightlog.recorder import ATTACHED, Recorder
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

    Attributes:
        path: the log that is asked for.
        tap: is told every record, ``tap(ns since the Unix epoch, topic, JSON)``; must return quickly.

    Raises:
        LogFileError: the file exists, the folder cannot be written, or the disk is nearly full.
    """

    tap: Callable[[int, str, bytes], None] | None = None

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
        self._put(topic, self._nanoseconds(t), to_json(record))

    def pose(self, robot: str, t: float, position: Sequence[float], quaternion: Sequence[float] | None = None) -> None:
        """A robot's measured pose: position [m], quaternion x, y, z, w (body to world)."""
        time = self._nanoseconds(t)
        self._put(f"/{robot}/pose", time, pose_to_json(time, position, quaternion))

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
        data = vectors_to_json(("position", "velocity", "attitude"), (position, velocity, attitude), {"tick": tick})
        self._put(f"/{robot}/estimate", self._nanoseconds(t), data)

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
        numbers = {"yaw_rate": yaw_rate, "tick": tick}
        data = vectors_to_json(("position", "velocity"), (position, velocity), numbers)
        self._put(f"/{robot}/setpoint", self._nanoseconds(t), data)

    def reference(
        self, robot: str, t: float, position: Sequence[float], velocity: Sequence[float] | None = None
    ) -> None:
        """Where the certified trajectory is: [m], [m/s]."""
        data = vectors_to_json(("position", "velocity"), (position, velocity), {})
        self._put(f"/{robot}/reference", self._nanoseconds(t), data)

    def battery(
        self, robot: str, t: float, voltage: float, level: float | None = None, state: int | None = None
    ) -> None:
        """Battery: [V], [%], pm.state."""
        data = vectors_to_json((), (), {"voltage": voltage, "level": level, "state": state})
        self._put(f"/{robot}/battery", self._nanoseconds(t), data)

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

    def light(self, robot: str, t: float, colour: Sequence[int], spread: float) -> None:
        """What a robot's LED ring fades to: red, green, blue, 0 to 255 each; what it shows [m]."""
        numbers = dict(zip(("red", "green", "blue"), colour, strict=True))
        self._put(f"/{robot}/light", self._nanoseconds(t), vectors_to_json((), (), {**numbers, "spread": spread}))

    def supervisor(self, robot: str, t: float, bits: int, names: Sequence[str] = ()) -> None:
        """The firmware's supervisor state."""
        self._put(f"/{robot}/supervisor", self._nanoseconds(t), _supervisor_to_json(bits, tuple(names)))

    def motors(self, robot: str, t: float, power: Sequence[int]) -> None:
        """What each motor is commanded: m1 to m4, 0..65535."""
        numbers = {f"m{k}": value for k, value in enumerate(power, 1)}
        self._put(f"/{robot}/motors", self._nanoseconds(t), vectors_to_json((), (), numbers))

    def event(
        self,
        t: float,
        name: str,
        text: str,
        *,
        phase: str = "",
        robot: str = "",
        level: Level = "info",
        value: float | None = None,
        kind: str = "",
    ) -> None:
        """Something that happened, also as a line of ``/log``; on disk at once."""
        record = {"phase": phase, "robot": robot, "level": level, "name": name, "text": text, "value": value}
        self.write("/log", t, log_line(self._nanoseconds(t), level, robot or phase, text))
        self.write("/events", t, {**record, "kind": kind})

    def picture(self, topic: str, t: float, draw: Callable[[int], Mapping[str, object]]) -> None:
        """A message for viewers (``scene.py``), which carries its own time: ``draw`` gets it [ns]."""
        time = self._nanoseconds(t)
        self._put(topic, time, to_json(draw(time)))

    def attach(self, name: str, t: float, data: bytes) -> None:
        """Embed a file at flight time t [s]; of several of one name, readers take the last."""
        self._recorder.put((self._nanoseconds(t), ATTACHED + name, data))

    # ------------------------------------------------------------------------------------------------ state

    @property
    def dropped(self) -> int:
        """Records lost because the disk could not keep up."""
        return self._recorder.dropped

    @property
    def failure(self) -> str:
        """Why writing stopped (a full disk, say); empty while all is well. The flight goes on without a log."""
        return self._recorder.failure

    @property
    def file(self) -> Path:
        """Where the log is now: ``<path>.part`` until it is closed without failure."""
        return self._recorder.file

    def close(self) -> None:
        """Write what is left, finish the file and give it its name. May be called again.

        Never an error: a flight is over by then. If the disk refused, ``failure`` says so, and the unfinished
        ``.part`` file, which is ``file``, stays and can be read.
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

    def _put(self, topic: str, time: int, data: bytes) -> None:
        find_topic(topic)
        self._recorder.put((time, topic, data))
        if self.tap is not None:
            self.tap(time, topic, data)

    def _nanoseconds(self, t: float) -> int:
        # Added as integers: a double holding today's Unix time resolves no better than 0.2 µs.
        return self._epoch + round(t * NANOSECONDS)


@functools.lru_cache(maxsize=256)
def _supervisor_to_json(bits: int, names: tuple[str, ...]) -> bytes:
    """There are few states of a supervisor, and each is written ten times a second."""
    return to_json({"bits": bits, "names": names})
