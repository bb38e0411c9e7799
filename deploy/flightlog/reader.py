"""Read a flight log into NumPy arrays: one call, also for a log that was never closed."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import numpy as np

from deploy.errors import LogFileError, PlanFileError
from deploy.flightlog.columns import columns
from deploy.flightlog.container import Contents, DamagedError, Messages, check_intact
from deploy.flightlog.encode import NANOSECONDS
from deploy.flightlog.recorder import FORMAT, PROFILE
from deploy.flightlog.schema import Topic
from deploy.flightlog.topics import find_topic
from missions.arrays import Array, frozen
from planner.flightplan import FlightPlan

PLAN = "plan.mcap"  # attachment that holds the flight plan
RECOVERED = "ergoflie.recovered"  # metadata of a log that ``recover.py`` has put together


@dataclass(frozen=True)
class Series:
    """One topic's records as columns, ordered by time.

    Attributes:
        t: (n,) flight clock [s].
        columns: by field name: (n,) numbers, (n, 3) vectors, (n, 4) quaternions; NaN where null or absent.
        texts: by field name, the columns that are texts or lists.
    """

    t: Array
    columns: Mapping[str, Array]
    texts: Mapping[str, tuple[object, ...]]

    def __getitem__(self, field: str) -> Array:
        return self.columns[field]

    def __len__(self) -> int:
        return len(self.t)


@dataclass(frozen=True)
class Event:
    """Something that happened at flight time ``t`` [s]; fields as in the topics table."""

    t: float
    name: str
    text: str
    phase: str = ""
    robot: str = ""
    level: str = "info"
    value: float | None = None
    kind: str = ""


@dataclass(frozen=True)
class FlightRecord:
    """A flight log.

    Attributes:
        path: the file. epoch: Unix time of flight clock zero [s].
        robots: names of the robots in the log, sorted.
        series: by topic.
        events: in order.
        attachments: by name. metadata: provenance given to the writer; summary: its counts at the end.
        complete: whether the log was closed and every byte of it is as it was written.
        problems: what is missing, one line each.
    """

    path: str
    epoch: float
    robots: tuple[str, ...]
    series: Mapping[str, Series]
    events: tuple[Event, ...]
    attachments: Mapping[str, bytes]
    metadata: Mapping[str, str]
    summary: Mapping[str, str]
    complete: bool
    problems: tuple[str, ...]

    @functools.cached_property
    def flight_plan(self) -> FlightPlan:
        """The plan that was flown.

        Raises:
            LogFileError: the log holds none, or a damaged one.
        """
        from deploy.planfile import read_plan_bytes

        if PLAN not in self.attachments:
            raise LogFileError(f"{self.path}: the log holds no flight plan")
        try:
            return read_plan_bytes(self.attachments[PLAN], name=f"{self.path}: {PLAN}")
        except PlanFileError as error:
            raise LogFileError(str(error)) from error

    @property
    def dropped(self) -> int:
        """Records the writer could not keep up with."""
        return int(self.summary.get("dropped", "0"))

    def of(self, robot: str, topic: str) -> Series | None:
        """A robot's series, e.g. ``of("cf1", "pose")``; None when there is none."""
        return self.series.get(f"/{robot}/{topic}")


def read_log(path: str | Path) -> FlightRecord:
    """Read a flight log, finished (``.mcap``) or not (``.mcap.part``).

    Of a damaged or unfinished log everything is read that can be; ``complete`` and ``problems`` say what is missing.

    Raises:
        LogFileError: missing, not a flight log, of a newer format, or too short to hold anything.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
        contents = Contents(data)
    except OSError as error:
        raise LogFileError(f"{path}: cannot read the flight log: {error.strerror or error}") from error
    except DamagedError as error:
        raise LogFileError(f"{path}: cannot read the flight log: {error}") from error
    if contents.finished and not contents.problems:
        contents.problems += _damage(data)
    metadata = contents.metadata.get("ergoflie.flight")
    if metadata is None:
        what = contents.profile or "nothing readable"
        raise LogFileError(f"{path}: not a flight log: found {what!r}; allowed: {PROFILE!r}")
    if metadata.get("format") != str(FORMAT):
        raise LogFileError(f"{path}: format {metadata.get('format')!r} of the log; this version reads {FORMAT}")
    return _record(path, contents, metadata)


def robots_in(path: str | Path) -> tuple[str, ...]:
    """Names of the robots in a flight log or a plan file, sorted.

    Raises:
        LogFileError: neither of them, or there are no robots in it.
    """
    path = Path(path)
    try:
        topics = Contents(path.read_bytes()).messages
    except OSError as error:
        raise LogFileError(f"{path}: cannot read the file: {error.strerror or error}") from error
    except DamagedError as error:
        raise LogFileError(f"{path}: cannot read the file: {error}") from error
    robots: set[str] = set()
    for name in topics:
        try:
            robots.add(find_topic(name)[1])
        except ValueError:
            continue
    if not robots - {""}:
        raise LogFileError(f"{path}: no plan and no flight log: there are no robots in it")
    return tuple(sorted(robots - {""}))


def _damage(data: bytes) -> list[str]:
    """What the checksums of a finished file say; damage to an index, say, is seen by nothing else."""
    try:
        check_intact(data)
    except DamagedError as error:
        return [str(error)]
    return []


def _record(path: Path, contents: Contents, metadata: Mapping[str, str]) -> FlightRecord:
    try:
        epoch = int(metadata["clock_epoch_ns"])
    except (KeyError, ValueError) as error:
        raise LogFileError(f"{path}: the log's head is damaged: no time of its beginning") from error
    series: dict[str, Series] = {}
    robots: set[str] = set()
    problems = list(contents.problems)
    if RECOVERED in contents.metadata:
        problems.append(f"recovered from a damaged log: {contents.metadata[RECOVERED].get('problems', '')}")
    for name in sorted(contents.messages):
        try:
            topic, robot = find_topic(name)
        except ValueError:
            problems.append(f"topic {name} is unknown to this version")
            continue
        try:
            series[name] = _series(topic, contents.messages.pop(name), epoch)
        except (ValueError, LookupError, TypeError, AttributeError):
            problems.append(f"topic {name} does not hold what this version writes")
            continue
        robots |= {robot} if robot else set()
    return FlightRecord(
        path=str(path),
        epoch=epoch / NANOSECONDS,
        robots=tuple(sorted(robots)),
        series=MappingProxyType(series),
        events=_events(series.get("/events")),
        attachments=MappingProxyType(contents.attachments),
        metadata=MappingProxyType(dict(metadata)),
        summary=MappingProxyType(contents.metadata.get("ergoflie.summary", {})),
        complete=not contents.problems and "ergoflie.summary" in contents.metadata,
        problems=tuple(problems),
    )


def _series(topic: Topic, messages: Messages, epoch: int) -> Series:
    """A topic's records, ordered by time; they mostly are already."""
    times = np.array(messages.times, dtype=np.int64) - epoch
    numbers, texts = columns(topic, bytes(messages.data), len(times))
    if (np.diff(times) < 0).any():
        order = np.argsort(times, kind="stable")
        times = times[order]
        numbers = {name: frozen(column[order]) for name, column in numbers.items()}
        texts = {name: tuple(column[i] for i in order) for name, column in texts.items()}
    return Series(frozen(times / NANOSECONDS), MappingProxyType(numbers), MappingProxyType(texts))


def _events(series: Series | None) -> tuple[Event, ...]:
    if series is None:
        return ()
    text = {name: [str(item or "") for item in column] for name, column in series.texts.items()}
    return tuple(
        Event(
            t=float(series.t[i]),
            name=text["name"][i],
            text=text["text"][i],
            phase=text["phase"][i],
            robot=text["robot"][i],
            level=text["level"][i],
            value=None if np.isnan(series["value"][i]) else float(series["value"][i]),
            kind=text["kind"][i],
        )
        for i in range(len(series))
    )
