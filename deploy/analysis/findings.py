"""What is said about a flight: one finding a line, and the verdict that is the worst of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

_REASONS = 3  # that a verdict is summed up in


class Level(IntEnum):
    """How serious a finding is; the verdict is the worst of them."""

    PASS = 0
    WARN = 1
    FAIL = 2


@dataclass(frozen=True)
class Finding:
    """One thing that was judged, or diagnosed.

    Attributes:
        level: how serious. name: what about. text: one line for a person.
        remedy: what to do about it; empty where nothing is.
        robots: whom it is about; empty: everybody.
        t: when, on the flight clock [s]; None: all along.
        cause: whether it says why, and not only what: a diagnosis.
    """

    level: Level
    name: str
    text: str
    remedy: str = ""
    robots: tuple[str, ...] = ()
    t: float | None = None
    cause: bool = False


@dataclass(frozen=True)
class Verdict:
    """All findings: most serious first, among equals causes first."""

    findings: tuple[Finding, ...]

    @property
    def level(self) -> Level:
        """The worst of them."""
        return max((finding.level for finding in self.findings), default=Level.FAIL)

    @property
    def diagnoses(self) -> tuple[Finding, ...]:
        """The findings that say why."""
        return tuple(finding for finding in self.findings if finding.cause)

    @property
    def reasons(self) -> tuple[Finding, ...]:
        """The three findings that matter: of what is wrong, one of each name first; of a good flight, the first."""
        wrong = [finding for finding in self.findings if finding.level is not Level.PASS or finding.cause]
        return tuple(list(_varied(wrong or list(self.findings)))[:_REASONS])


def ordered(findings: list[Finding]) -> Verdict:
    """A verdict of these findings."""
    return Verdict(tuple(sorted(findings, key=lambda finding: (-finding.level, not finding.cause))))


def _varied(findings: list[Finding]) -> Iterator[Finding]:
    """The first of every name, then the rest."""
    seen: set[str] = set()
    rest = []
    for finding in findings:
        if finding.name in seen:
            rest.append(finding)
            continue
        seen.add(finding.name)
        yield finding
    yield from rest
