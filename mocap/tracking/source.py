"""Frames of unlabelled markers, with the names that a tracker gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from mocap.source import MocapFrame, MocapSource, Pose
from mocap.tracking.tracker import Tracker


class MarkerSource:
    """A source whose bodies are the markers of another, as far as it is known whose they are.

    Args:
        source: of the markers; closed with this one.
        tracker: gives the names.
    """

    def __init__(self, source: MocapSource, tracker: Tracker) -> None:
        self._source, self._tracker = source, tracker

    def poll(self) -> Sequence[MocapFrame]:
        """New frames, oldest first; bodies have positions only."""
        return [self._named(frame) for frame in self._source.poll()]

    def close(self) -> None:
        """Close the source."""
        self._source.close()

    def _named(self, frame: MocapFrame) -> MocapFrame:
        seen = self._tracker.update(frame.t, frame.points)
        bodies = {name: Pose(position) for name, position in seen.positions.items()}
        return replace(frame, bodies=bodies, doubtful=seen.ambiguous)
