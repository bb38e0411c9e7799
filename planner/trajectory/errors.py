"""Errors of trajectory conversion."""

from __future__ import annotations

from planner.errors import PlannerError


class TrajectoryError(PlannerError):
    """A trajectory cannot be encoded, decoded or read: str() is one line saying what, got and allowed."""
