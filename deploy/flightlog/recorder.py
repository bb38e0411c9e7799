"""The disk side of the flight log: one thread that owns the MCAP writer, fed through a bounded queue.

``mcap.writer.Writer`` is not thread-safe, and a disk may stall: nobody but this thread touches either. Chunks are cut
by the records' own time (every 0.25 s of flight) and at every event, never by wall time: the same records give the
same bytes, and ``kill -9`` costs at most the last quarter of a second.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections import Counter, deque
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO, NamedTuple

from mcap.writer import CompressionType, Writer

from deploy.errors import LogFileError
from deploy.flightlog.encode import log_line, to_json
from deploy.flightlog.topics import find_topic, json_schema

PROFILE = "ergoflie-flight"
FORMAT = 1  # raised when readers of the previous format could misread a log
FLUSH_INTERVAL = 250_000_000  # ns of flight time
CAPACITY = 100_000  # records waiting for the disk, a few dozen MB at most
PATIENCE = 1.0  # s to wait for room in the queue before looking whether the writer still lives
NAP = 0.05  # s the writer sleeps when it has nothing to do; events wake it, other records wait for company
LEAST_FREE = 100_000_000  # bytes of free disk below which no flight starts: ten minutes of ten drones, twice


class Item(NamedTuple):
    """One encoded record on its way to the disk."""

    time: int  # ns since the Unix epoch
    topic: str
    data: bytes


class Recorder:
    """Writes items to ``<path>.part`` in its own thread; :meth:`close` finishes the file and gives it its name.

    Args:
        path: the log. epoch: flight clock zero [ns since the Unix epoch]. attachments, metadata: embedded at once.
        wait: whether :meth:`put` waits for a slow disk; otherwise it drops the item and counts it.

    Raises:
        LogFileError: the file exists, the folder cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, epoch: int, attachments: Mapping[str, bytes], metadata: Mapping[str, str], wait: bool
    ) -> None:
        self.failure = ""  # why writing stopped; empty while all is well
        self._path, self._part = path, path.with_name(path.name + ".part")
        self._wait = wait
        self._wake = threading.Event()
        self._room = threading.Event()
        # A deque and not a queue.Queue: appending takes no lock, and this is done a thousand times a second.
        self._items: deque[Item | None] = deque()
        self._dropped: Counter[str] = Counter()
        self._dropped_lock = threading.Lock()
        self._reported = 0
        self._closed = False
        self._channels: dict[str, int] = {}
        self._sequences: Counter[int] = Counter()
        self._schemas: dict[str, int] = {}
        self._last = epoch
        self._stream = _open(path, self._part)
        self._writer = Writer(self._stream, compression=CompressionType.ZSTD, enable_data_crcs=True)
        try:
            self._begin(epoch, attachments, metadata)
        except OSError as error:
            self._stream.close()
            self._part.unlink(missing_ok=True)
            raise LogFileError(f"{path}: cannot write the flight log: {error.strerror or error}") from error
        self._thread = threading.Thread(target=self._run, name="flight-log", daemon=True)
        self._thread.start()

    def put(self, item: Item) -> None:
        """Hand over an item; returns at once unless asked to wait."""
        while not (self._closed or self.failure):
            if len(self._items) < CAPACITY:
                self._items.append(item)
                if item.topic == "/events":
                    self._wake.set()
                return
            self._room.clear()
            self._wake.set()
            if not self._wait:
                break
            self._room.wait(PATIENCE)  # with a timeout: a writer that failed meanwhile will never make room
        self._drop(item)

    @property
    def dropped(self) -> int:
        """Items lost because the disk could not keep up."""
        with self._dropped_lock:
            return self._dropped.total()

    def close(self) -> None:
        """Write what is left and finish the file. May be called again.

        Raises:
            LogFileError: the disk refused; the unfinished ``.part`` file stays and can be read.
        """
        if self._closed:
            return
        self._write_the_rest()
        try:
            if not self.failure:
                self._finish()
        except OSError as error:
            self.failure = error.strerror or str(error)
        finally:
            self._stream.close()
        if self.failure:
            raise LogFileError(f"{self._part}: the flight log is incomplete: {self.failure}")

    def abandon(self) -> None:
        """Stop as if the process had died: what was handed over is in the ``.part`` file, which stays unfinished."""
        if self._closed:
            return
        self._write_the_rest()
        self._stream.close()

    def _write_the_rest(self) -> None:
        self._closed = True
        self._items.append(None)
        self._wake.set()
        self._thread.join()

    def _drop(self, item: Item) -> None:
        with self._dropped_lock:
            self._dropped[item.topic] += 1

    def _begin(self, epoch: int, attachments: Mapping[str, bytes], metadata: Mapping[str, str]) -> None:
        self._writer.start(profile=PROFILE, library="ergoflie")
        head = {**metadata, "format": str(FORMAT), "clock_epoch_ns": str(epoch)}
        self._writer.add_metadata("ergoflie.flight", dict(sorted(head.items())))
        for name in sorted(attachments):
            media = "application/octet-stream"
            self._writer.add_attachment(epoch, epoch, name, media, attachments[name])
        self._flush(sync=True)

    def _run(self) -> None:
        """The writer thread. Should it die of a bug, the log says so instead of looking complete."""
        done = False
        try:
            self._write_batches()
            done = True
        finally:
            if not done:
                self.failure = "the log's writer thread ended with an error"

    def _write_batches(self) -> None:
        """Batches of records, sorted by time and topic, one chunk each."""
        batch: list[Item] = []
        while (item := self._next()) is not None:
            if self.failure:
                self._drop(item)
                continue
            batch.append(item)
            if item.topic == "/events" or item.time >= self._last + FLUSH_INTERVAL:
                self._commit(batch, item.time)
                batch = []
        self._commit(batch, self._last)

    def _next(self) -> Item | None:
        """The next record. A thread that slept on the queue would be woken, and interrupt the flight, by every one."""
        while True:
            try:
                return self._items.popleft()
            except IndexError:
                self._room.set()
                self._wake.wait(NAP)
                self._wake.clear()

    def _commit(self, batch: list[Item], time: int) -> None:
        if self.failure:
            return
        try:
            # Records of one instant come from several threads; sorting makes their order a property of the flight.
            for item in sorted(batch, key=lambda item: item[:2]):
                self._add(item)
            self._report_drops(time)
            self._flush(sync=any(item.topic == "/events" for item in batch))
        except OSError as error:
            self.failure = error.strerror or str(error)
        self._last = max(self._last, time)

    def _report_drops(self, time: int) -> None:
        dropped = self.dropped
        if dropped > self._reported:
            text = f"the log lost {dropped - self._reported} records: the disk cannot keep up"
            self._add(Item(time, "/log", to_json(log_line(time, "warning", "flight-log", text))))
            self._reported = dropped

    def _add(self, item: Item) -> None:
        channel = self._channels.get(item.topic) or self._register(item.topic)
        self._writer.add_message(channel, item.time, item.data, item.time, self._sequences[channel])
        self._sequences[channel] += 1

    def _register(self, name: str) -> int:
        topic, robot = find_topic(name)
        if topic.schema not in self._schemas:
            self._schemas[topic.schema] = self._writer.register_schema(
                topic.schema, "jsonschema", json_schema(topic).encode()
            )
        about = {"frame": topic.frame, "clock": topic.clock, "rate": topic.rate, "doc": topic.doc, "robot": robot}
        self._channels[name] = self._writer.register_channel(name, "json", self._schemas[topic.schema], about)
        return self._channels[name]

    def _flush(self, sync: bool) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        if sync:
            os.fsync(self._stream.fileno())

    def _finish(self) -> None:
        written = self._sequences.total()
        dropped = {f"dropped.{topic}": str(count) for topic, count in sorted(self._dropped.items())}
        self._writer.add_metadata(
            "ergoflie.summary", {"written": str(written), "dropped": str(self.dropped), **dropped}
        )
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._stream.flush()
        os.fsync(self._stream.fileno())
        self._stream.close()
        if self._path.exists():
            raise FileExistsError(17, f"'{self._path}' appeared during the flight")
        self._part.rename(self._path)


def _open(path: Path, part: Path) -> BinaryIO:
    """Create the unfinished file, or say why it cannot be."""
    if path.suffix != ".mcap":
        raise LogFileError(f"{path}: a flight log's name ends in .mcap")
    for taken in (path, part):
        if taken.exists():
            raise LogFileError(f"{taken}: exists already; flight logs are never overwritten")
    try:
        free = shutil.disk_usage(path.parent).free
        if free < LEAST_FREE:
            raise LogFileError(
                f"{path}: {free / 1e6:.0f} MB left on the disk; a flight log needs {LEAST_FREE / 1e6:.0f} MB"
            )
        return part.open("xb")
    except OSError as error:
        raise LogFileError(f"{path}: cannot write the flight log: {error.strerror or error}") from error
