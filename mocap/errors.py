"""Errors of the motion-capture side.

::

    MocapError                base: str() is one line for a person
    ├── MocapUnavailable      the software for this system is not installed, or does not know it
    ├── MocapConnectError     the system did not answer, or refused
    └── MocapLost             frames stopped coming
"""

from __future__ import annotations


class MocapError(Exception):
    """Base of the motion-capture errors."""


class MocapUnavailable(MocapError):
    """The software for this system is not installed, or does not know it."""


class MocapConnectError(MocapError):
    """The system did not answer, or refused."""


class MocapLost(MocapError):
    """Frames stopped coming."""
