"""Errors of the deployment side.

::

    DeployError               base: str() is one line for a person
    ├── PlanFileError         a plan file that cannot be trusted (cut, edited, foreign)
    ├── LogFileError          a flight log that cannot be read
    ├── LinkError             a drone cannot be reached, or was lost
    ├── CommandRefused        a drone refused or did not acknowledge a command
    ├── UploadError           the trajectory memory does not hold what was written
    ├── PreflightError        one or more pre-flight checks failed
    └── FlightAborted         the flight ended early, everybody is on the ground as far as we know
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from deploy.preflight import PreflightCheck


class DeployError(Exception):
    """Base of the deployment errors."""


class PlanFileError(DeployError):
    """A plan file cannot be trusted."""


class LogFileError(DeployError):
    """A flight log cannot be read."""


class LinkError(DeployError):
    """A drone cannot be reached, or was lost."""


class CommandRefused(DeployError):
    """A drone refused or did not acknowledge a command."""


class UploadError(DeployError):
    """The trajectory memory does not hold what was written."""


class PreflightError(DeployError):
    """One or more pre-flight checks failed.

    Attributes:
        checks: every check that was made, passed or not.
    """

    def __init__(self, message: str, checks: Sequence[PreflightCheck] = ()) -> None:
        super().__init__(message)
        self.checks = tuple(checks)


class FlightAborted(DeployError):
    """The flight ended early."""
