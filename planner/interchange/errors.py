"""Errors of interchange; see :mod:`planner.errors` for the tree they belong to."""

from __future__ import annotations

from planner.errors import PlannerError


class InterchangeError(PlannerError):
    """What somebody else planned is no search of this mission; str() is one line: file or robot: got, allowed."""
