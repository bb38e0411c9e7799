"""Unlabelled markers to robots: prediction, optimal assignment, and when to say nothing."""

from mocap.tracking.settings import Settings
from mocap.tracking.tracker import Seen, Tracker

__all__ = ["Seen", "Settings", "Tracker"]
