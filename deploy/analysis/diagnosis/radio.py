"""Bad radio that lost nobody: interference on a channel, one weak link, a radio that is slow without losses."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence

import numpy as np

from deploy.analysis.evidence import Evidence
from deploy.analysis.findings import Finding, Level
from deploy.analysis.health import LinkUse
from missions.radio import dongle_of
from missions.schema import Robot

_DROP = 1.5  # % by which losses have to rise to be more than chance
_BAD = 97.0  # % of attempts that a link should have acknowledged at least
_SLOW = 50.0  # ms, as pre-flight warns
_TOGETHER = 0.8  # of a channel's robots: not one robot's antenna but the channel


def radio(e: Evidence) -> Iterator[Finding]:
    """One finding a channel, or one a robot."""
    lost = {event.robot for event in e.record.events if event.name == "link" and event.level == "fault"}
    groups: dict[str, list[LinkUse]] = defaultdict(list)
    for robot, link in zip(e.mission.robots, e.links, strict=True):
        if link.reports and robot.name not in lost:
            groups[channel_of(robot)].append(link)
    for channel, links in groups.items():
        lossy = [link for link in links if _lossy(link)]
        if lossy and len(lossy) >= max(2.0, _TOGETHER * len(links)):
            yield _interference(e, channel, lossy)
        else:
            yield from (_weak(e, channel, link) for link in lossy)
        slow = [link for link in links if link.latency_p95 > _SLOW and link not in lossy]
        if slow:
            yield _slow(channel, slow)


def channel_of(robot: Robot) -> str:
    """What a robot's radio shares with others': ``channel 80``, or its dongle where no URI says more."""
    parts = robot.uri.removeprefix("radio://").split("/")
    if robot.uri.startswith("radio://") and len(parts) > 1:
        return f"channel {parts[1]}"
    return f"dongle {dongle_of(robot) or 0}"


def _lossy(link: LinkUse) -> bool:
    usual = 100.0 - link.quality_median
    worst = 100.0 - link.quality_smallest
    return bool(link.quality_smallest < _BAD or worst > max(_DROP, 2.0 * usual))


def _worst(e: Evidence, links: Sequence[LinkUse]) -> tuple[LinkUse, float]:
    """The worst of these links, and when it was worst [s]."""
    worst = min(links, key=lambda link: link.quality_smallest)
    series = e.record.of(worst.robot, "link")
    assert series is not None  # noqa: S101 - there are reports
    return worst, float(series.t[int(np.nanargmin(series["quality"]))])


def _interference(e: Evidence, channel: str, links: Sequence[LinkUse]) -> Finding:
    worst, t = _worst(e, links)
    text = (
        f"everybody on {channel} lost packets at the same time: quality fell to {worst.quality_smallest:.1f} % "
        f"({worst.robot}, {e.when(t)})"
    )
    remedy = "move to a channel away from Wi-Fi (above 80), or bring the dongle closer"
    return Finding(_level(worst), "interference", text, remedy, tuple(link.robot for link in links), t, cause=True)


def _weak(e: Evidence, channel: str, link: LinkUse) -> Finding:
    _, t = _worst(e, [link])
    text = f"{link.robot} alone on {channel} lost packets: quality fell to {link.quality_smallest:.1f} %, {e.when(t)}"
    remedy = "look at its antenna, or fly it closer to the dongle"
    return Finding(_level(link), "weak link", text, remedy, (link.robot,), t, cause=True)


def _level(link: LinkUse) -> Level:
    return Level.WARN if link.quality_smallest < _BAD or link.latency_largest > _SLOW else Level.PASS


def _slow(channel: str, links: Sequence[LinkUse]) -> Finding:
    worst = max(links, key=lambda link: link.latency_p95)
    text = (
        f"{channel} was slow without losing packets: 95 % of {worst.robot}'s answers within {worst.latency_p95:.0f} ms"
    )
    remedy = "fewer drones on the dongle, lower flight.log_rate and pose_rate, or a faster USB port"
    return Finding(Level.WARN, "slow link", text, remedy, tuple(link.robot for link in links), cause=True)
