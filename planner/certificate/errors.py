"""Errors of certificates."""

from __future__ import annotations


class CertificateError(ValueError):
    """A certificate does not belong to these trajectories, or these trajectories not to this mission."""
