"""Robots that sink while another one passes above them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np

from deploy.analysis.evidence import Evidence, Mask
from deploy.analysis.findings import Finding, Level
from deploy.analysis.tracking import Tracking
from missions.arrays import Array

_ASIDE = 0.3  # m: how far beside the upper one's wake is felt
_BELOW = 0.1, 1.5  # m under it
_SUNK, _DEEP = 0.03, 0.075  # m below the usual height: worth a word, worth a warning
_LASTS = 0.4  # s for which a wake shows after a passage
_CLEAR = 3.0  # times the usual scatter of heights


def downwash(e: Evidence) -> Iterator[Finding]:
    """The deepest sinking of each pair."""
    for a, b in itertools.combinations(e.tracking, 2):
        for upper, lower in ((a, b), (b, a)):
            yield from _sunk(e, upper, lower)


def _sunk(e: Evidence, upper: Tracking, lower: Tracking) -> Iterator[Finding]:
    # Measured from the height where the lower one should be: who falls out of the sky gets under everybody.
    apart = (upper.reference + upper.deviation) - (lower.reference + lower.deviation * [1.0, 1.0, 0.0])
    aside, above = np.hypot(apart[:, 0], apart[:, 1]), apart[:, 2]
    with np.errstate(invalid="ignore"):
        under = (aside < _ASIDE) & (above > _BELOW[0]) & (above < _BELOW[1])
    if e.window is None or not under.any() or under.mean() > 0.5:
        return
    late = _widened(lower.t, under)
    z = lower.deviation[:, 2]
    elsewhere, here = z[~late & np.isfinite(z)], np.where(late, z, np.nan)
    if not len(elsewhere) or not np.isfinite(here).any():
        return
    k = int(np.nanargmin(here))
    sunk = float(np.median(elsewhere) - z[k])
    if sunk < _SUNK or sunk < _CLEAR * float(elsewhere.std()):
        return
    t = e.window.start + float(lower.t[k])
    text = (
        f"{lower.robot} sank {sunk * 100:.0f} cm {e.when(t)} under {upper.robot}, "
        f"{float(above[under].min()):.2f} m above it"
    )
    remedy = "raise limits.vertical_separation (Crazyflies need about 0.6 m), or search in layers further apart"
    level = Level.WARN if sunk >= _DEEP else Level.PASS
    yield Finding(level, "downwash", text, remedy, (lower.robot, upper.robot), t, cause=True)


def _widened(t: Array, mask: Mask) -> Mask:
    """The mask, held on for as long as a wake shows."""
    times = t[mask]
    last = np.searchsorted(times, t, side="right") - 1
    since = np.where(last >= 0, t - times[np.maximum(last, 0)], np.inf)
    held: Mask = since <= _LASTS
    return held
