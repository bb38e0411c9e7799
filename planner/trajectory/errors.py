"""Errors of trajectory conversion."""

from __future__ import annotations


class TrajectoryError(ValueError):
    """A trajectory cannot be encoded, decoded or read: str() is one line saying what, got and allowed."""
