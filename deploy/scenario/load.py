"""Scenario file to :class:`Scenario`, checked against the mission that it is for."""

from __future__ import annotations

import dataclasses
from pathlib import Path

from deploy.radio.simulated.air.model import stations
from deploy.scenario.records import DONGLE, EVERYBODY, HAPPENINGS, PHASES, Aimed, Fault, MocapSwap, Scenario
from missions.files import read_text
from missions.records import RecordReader, did_you_mean
from missions.schema import Mission
from missions.yamltree import parse_yaml


def load_scenario(path: str | Path, mission: Mission) -> Scenario:
    """Read a scenario file.

    Raises:
        MissionError: anything wrong, in one line: ``file:line: path in the file: what, got, allowed``.
    """
    path = Path(path)
    return parse_scenario(read_text(path), path=str(path), mission=mission)


def parse_scenario(text: str, *, path: str, mission: Mission) -> Scenario:
    """Read a scenario from its text; ``path`` is its name in messages. Raises MissionError."""
    reader = RecordReader(path)
    scenario = reader.read_record(parse_yaml(text, file=path), Scenario)
    for i, event in enumerate(scenario.events):
        _check_time(event, f"events[{i}]", reader)
        _check_names(event, f"events[{i}]", reader, mission)
    return dataclasses.replace(scenario, text=text)


def targets(to: str, mission: Mission) -> tuple[str, ...]:
    """Names of the robots that ``to`` means; empty if it means nobody."""
    names = tuple(robot.name for robot in mission.robots)
    if to in names:  # a robot may be called "everybody"; whoever names it means it
        return (to,)
    if to.startswith(DONGLE):
        return tuple(name for name, station in stations(mission).items() if station.dongle == to.removeprefix(DONGLE))
    return names if to == EVERYBODY else ()


def _check_time(event: Fault, where: str, reader: RecordReader) -> None:
    if (event.at is None) == (not event.when):
        both = "both" if event.when else "neither"
        raise reader.error(f"got {both} 'at' and 'when'; allowed: one of them".replace("neither", "neither of"), where)
    known = (*PHASES, *HAPPENINGS)
    if event.when and event.when not in known:
        hint = did_you_mean(event.when, known)
        raise reader.error(
            f"got {event.when[:40]!r}; allowed: a phase ({', '.join(PHASES)}) or an event ({', '.join(HAPPENINGS)})"
            f"{hint}",
            f"{where}.when",
        )


def _check_names(event: Fault, where: str, reader: RecordReader, mission: Mission) -> None:
    names = [robot.name for robot in mission.robots]
    if isinstance(event, Aimed) and not targets(event.to, mission):
        dongles = sorted({f"{DONGLE}{station.dongle}" for station in stations(mission).values()})
        known = (*names, *dongles, EVERYBODY)
        raise reader.error(
            f"got {event.to[:40]!r}; allowed: {', '.join(known)}{did_you_mean(event.to, known)}", f"{where}.to"
        )
    if isinstance(event, Aimed) and event.packets and event.to not in names:
        raise reader.error(
            f"got {event.packets} with 'to: {event.to[:40]}'; allowed: with one robot by name", f"{where}.packets"
        )
    if isinstance(event, MocapSwap):
        if event.to not in names:
            raise reader.error(f"got {event.to[:40]!r}; allowed: one of {', '.join(names)}", f"{where}.to")
        if event.other not in names or event.other == event.to:
            others = ", ".join(name for name in names if name != event.to) or "nobody: there is one robot only"
            raise reader.error(f"got {event.other[:40]!r}; allowed: {others}", f"{where}.other")
