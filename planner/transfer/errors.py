"""Errors of the way to the search and back."""

from __future__ import annotations

from planner.errors import PlannerError


class TransferError(PlannerError):
    """There is no safe way to the starts or back: str() is one line that names the robot and what is in the way."""
