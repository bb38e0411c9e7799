"""The disk side of the flight log: one thread that owns the file, fed through a bounded queue.

A disk may stall or fill up: nobody but this thread touches it, and a flight loses records rather than time. Chunks are
cut by the records' own time (every 0.25 s of flight) and at every event: the same records give the same bytes, and
``kill -9`` costs at most the last second. A disk that fails ends the log, not the flight; what was lost is counted.
"""

from __future__ import annotations

import os
import shutil
import threading
from collections import Counter, deque
from collections.abc import Mapping
from operator import itemgetter
from pathlib import Path
from typing import BinaryIO, TypeAlias

from deploy.errors import LogFileError
from deploy.flightlog.encode import log_line, to_json
from deploy.flightlog.mcapfile import McapFile
from deploy.flightlog.topics import find_topic

PROFILE = "ergoflie-flight"
ATTACHED = "attached:"  # begins the topic of what is no message but a file
FORMAT = 1  # raised when readers of the previous format could misread a log
FLUSH_INTERVAL = 250_000_000  # ns of flight time
CAPACITY = 100_000  # records waiting for the disk, a few dozen MB at most
PATIENCE = 1.0  # s to wait for room in the queue before looking whether the writer still lives
NAP = 0.05  # s the writer sleeps when it has nothing to do; events wake it, other records wait for company
IDLE_NAPS = 5  # naps without a record after which a flight's last records are written all the same
LEAST_FREE = 100_000_000  # bytes of free disk below which no flight starts: ten minutes of ten drones, twice
# One encoded record on its way to the disk: ns since the Unix epoch, topic, data. A plain tuple: there are thousands.
Item: TypeAlias = tuple[int, str, bytes]
_ORDER = itemgetter(0, 1)


class Recorder:
    """Writes items to ``<path>.part`` in its own thread; :meth:`close` finishes the file and gives it its name.

    Args:
        path: the log. epoch: flight clock zero [ns since the Unix epoch]. attachments, metadata: embedded at once.
        wait: whether :meth:`put` waits for a slow disk; otherwise it drops the item and counts it.

    Attributes:
        file: where the log is: ``<path>.part`` until it is closed without failure.
        failure: why writing stopped; empty while all is well.

    Raises:
        LogFileError: the file exists, the folder cannot be written, or the disk is nearly full.
    """

    def __init__(
        self, path: Path, epoch: int, attachments: Mapping[str, bytes], metadata: Mapping[str, str], wait: bool
    ) -> None:
        self.failure = ""
        self.file, self._final = path.with_name(path.name + ".part"), path
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
        self._last = epoch
        self._stream = _create(self._final, self.file)
        try:
            self._mcap = McapFile(self._stream, PROFILE)
            self._begin(epoch, attachments, metadata)
        except OSError as error:
            _discard(self._stream, self.file)
            raise LogFileError(f"{path}: cannot write the flight log: {error.strerror or error}") from error
        self._thread = threading.Thread(target=self._run, name="flight-log", daemon=True)
        self._thread.start()

    def put(self, item: Item) -> None:
        """Hand over an item; returns at once unless asked to wait."""
        while not (self._closed or self.failure):
            if len(self._items) < CAPACITY:
                self._items.append(item)
                if item[1] == "/events":
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
        """Items lost because the disk could not keep up, or failed."""
        with self._dropped_lock:
            return self._dropped.total()

    def close(self) -> None:
        """Write what is left and finish the file; ``file`` and ``failure`` say what became of it. May be repeated."""
        if self._closed:
            return
        self._write_the_rest()
        try:
            if not self.failure:
                self._finish()
        except OSError as error:
            self._fail(error)
        finally:
            _close(self._stream)

    def abandon(self) -> None:
        """Stop as if the process had died: what was handed over is in the ``.part`` file, which stays unfinished."""
        if self._closed:
            return
        self._write_the_rest()
        _close(self._stream)

    def _write_the_rest(self) -> None:
        self._closed = True
        self._items.append(None)
        self._wake.set()
        self._thread.join()

    def _drop(self, item: Item) -> None:
        with self._dropped_lock:
            self._dropped[item[1]] += 1

    def _fail(self, error: OSError) -> None:
        self.failure = error.strerror or str(error)

    def _begin(self, epoch: int, attachments: Mapping[str, bytes], metadata: Mapping[str, str]) -> None:
        self._mcap.describe("ergoflie.flight", {**metadata, "format": str(FORMAT), "clock_epoch_ns": str(epoch)})
        for name in sorted(attachments):
            self._mcap.attach(name, attachments[name], epoch)
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
        while (item := self._next(batch)) is not None:
            if self.failure:
                self._drop(item)
                continue
            batch.append(item)
            if item[1] == "/events" or item[0] >= self._last + FLUSH_INTERVAL:
                self._commit(batch, item[0])
        self._commit(batch, self._last)

    def _next(self, batch: list[Item]) -> Item | None:
        """The next record. A thread that slept on the queue would be woken, and interrupt the flight, by every one."""
        naps = 0
        while True:
            try:
                return self._items.popleft()
            except IndexError:
                self._room.set()
            if not self._wake.wait(NAP):
                naps += 1
            self._wake.clear()
            # Where time is wall time, what waits for company must not wait for ever. Rehearsals repeat byte by byte.
            if batch and naps == IDLE_NAPS and not self._wait:
                self._commit(batch, batch[-1][0])

    def _commit(self, batch: list[Item], time: int) -> None:
        """Write a batch and empty it; what a failing disk does not take is counted."""
        try:
            if not self.failure:
                self._write(batch, time)
        except OSError as error:
            self._fail(error)
        if self.failure:
            for item in batch:
                self._drop(item)
        self._last = max(self._last, time)
        batch.clear()

    def _write(self, batch: list[Item], time: int) -> None:
        # Records of one instant come from several threads; sorting makes their order a property of the flight.
        batch.sort(key=_ORDER)
        channels = self._channels
        for when, topic, data in batch:
            if topic.startswith(ATTACHED):
                self._mcap.attach(topic.removeprefix(ATTACHED), data, when)
        messages = [
            (when, channels.get(topic) or self._register(topic), data)
            for when, topic, data in batch
            if not topic.startswith(ATTACHED)
        ]
        dropped = self.dropped
        if dropped > self._reported:
            text = f"the log lost {dropped - self._reported} records: the disk cannot keep up"
            line = to_json(log_line(time, "warning", "flight-log", text))
            messages.append((time, channels.get("/log") or self._register("/log"), line))
            self._reported = dropped
        self._mcap.chunk(messages)
        self._flush(sync=any(item[1] == "/events" for item in batch))

    def _register(self, name: str) -> int:
        topic, robot = find_topic(name)
        self._channels[name] = self._mcap.channel(name, topic, robot)
        return self._channels[name]

    def _flush(self, sync: bool) -> None:
        self._stream.flush()
        if sync:
            os.fsync(self._stream.fileno())

    def _finish(self) -> None:
        dropped = {f"dropped.{topic}": str(count) for topic, count in sorted(self._dropped.items())}
        counts = {"written": str(self._mcap.written), "dropped": str(self.dropped)}
        self._mcap.describe("ergoflie.summary", counts | dropped)
        self._mcap.finish()
        self._flush(sync=True)
        self._stream.close()
        if self._final.exists():
            raise FileExistsError(17, f"'{self._final}' appeared during the flight")
        self.file.rename(self._final)
        self.file = self._final


def _create(path: Path, part: Path) -> BinaryIO:
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


def _close(stream: BinaryIO) -> None:
    """Close a stream whose disk may refuse the last bytes: that has been said already."""
    try:
        stream.close()
    except OSError:
        return


def _discard(stream: BinaryIO, part: Path) -> None:
    """Take back a file that was hardly begun."""
    _close(stream)
    part.unlink(missing_ok=True)
