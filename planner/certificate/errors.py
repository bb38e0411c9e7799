"""Errors of certificates."""

from __future__ import annotations

from planner.errors import PlannerError


class CertificateError(PlannerError):
    """A certificate does not belong to these trajectories, or these trajectories not to this mission."""
