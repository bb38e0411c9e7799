"""One line of the pre-flight table, and all of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from deploy.errors import PreflightError

Result = Literal["pass", "warning", "failure"]


@dataclass(frozen=True)
class PreflightCheck:
    """One line of the pre-flight table.

    Attributes:
        name: what was checked. robot: on whom; empty for the whole flight.
        result: a failure keeps everybody on the ground.
        value: what was found. limit: what is allowed.
        remedy: what to do if it did not pass.
    """

    name: str
    robot: str
    result: Result
    value: str
    limit: str
    remedy: str = ""

    @property
    def text(self) -> str:
        """All but the robot, in one line."""
        return f"{self.name}: {self.value} (allowed: {self.limit})" + (f"; {self.remedy}" if self.remedy else "")

    def __str__(self) -> str:
        return f"{self.robot}: {self.text}" if self.robot else self.text


@dataclass(frozen=True)
class PreflightReport:
    """Every check that was made."""

    checks: tuple[PreflightCheck, ...] = ()

    @property
    def failures(self) -> tuple[PreflightCheck, ...]:
        """Those that keep the swarm on the ground."""
        return tuple(check for check in self.checks if check.result == "failure")

    def require(self) -> None:
        """Raise PreflightError, which carries all checks, unless there is no failure."""
        if self.failures:
            listing = "; ".join(str(check) for check in self.failures)
            raise PreflightError(f"{len(self.failures)} pre-flight checks failed: {listing}", self.checks)


def judge(name: str, robot: str, good: bool, value: str, limit: str, remedy: str) -> PreflightCheck:
    """A check that passes or keeps the swarm on the ground; the remedy is only told if it does."""
    return PreflightCheck(name, robot, "pass" if good else "failure", value, limit, "" if good else remedy)
