"""A robot that swings about its trajectory: one narrow peak in the spectrum of its deviation."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from deploy.analysis.evidence import Evidence, Mask
from deploy.analysis.findings import Finding, Level
from missions.arrays import Array

_BAND = 0.6, 10.0  # Hz; slower deviations follow the trajectory, faster ones are noise
_AMPLITUDE = 0.015  # m that are seen from the edge of the room
_SHARE = 0.5  # of the power in the band that is in the peak
_LEAST = 3.0  # s
_CYCLES = 4.0
_LASTING = 0.4  # of the amplitude that each half has to show: a single blow is no oscillation
_REMEDIES = {
    "pid": "lower posCtlPid's and velCtlPid's Kp in {axis}, or look for a loose battery or a bent propeller",
    "mellinger": "lower ctrlMel.kp_{group} or raise kd_{group}, or look for a loose battery or a bent propeller",
}


class Swing(NamedTuple):
    """Frequency [Hz], amplitude [m], share of the band's power."""

    frequency: float
    amplitude: float
    share: float


def oscillation(e: Evidence) -> Iterator[Finding]:
    """Every robot's axis that swings."""
    for track, seen in e.followed():
        t = track.t
        if len(t) < 2 or t[seen][-1] - t[seen][0] < _LEAST or track.seen < 0.9:
            continue
        for axis, name in enumerate("xyz"):
            found = swing(t, _unexplained(t, track.deviation[:, axis], track.reference[:, axis], seen))
            if found is None:
                continue
            remedy = _REMEDIES[e.mission.flight.controller]
            yield Finding(
                Level.WARN,
                "oscillation",
                f"{track.robot} swings along {name} at {found.frequency:.1f} Hz by ±{found.amplitude * 100:.1f} cm",
                remedy.format(axis=name, group="z" if name == "z" else "xy"),
                (track.robot,),
                cause=True,
            )


def swing(t: Array, y: Array) -> Swing | None:
    """The oscillation in a signal y (S,) [m] at equal steps of time t (S,) [s], if there is one."""
    whole = _peak(t, y)
    if whole is None or whole.amplitude < _AMPLITUDE or whole.share < _SHARE:
        return None
    if whole.frequency * (t[-1] - t[0]) < _CYCLES:
        return None
    middle = len(t) // 2
    halves = [_power_at(whole.frequency, t[part], y[part]) for part in (slice(None, middle), slice(middle, None))]
    return whole if min(halves) >= _LASTING * whole.amplitude else None


def _unexplained(t: Array, deviation: Array, reference: Array, seen: Mask) -> Array:
    """What is left of a deviation without offset, drift, and what follows the reference's speed and acceleration."""
    y = np.interp(t, t[seen], deviation[seen])
    speed = np.gradient(reference, t)
    terms = np.stack([np.ones_like(t), t - t.mean(), speed, np.gradient(speed, t)], axis=1)
    left: Array = y - terms @ np.linalg.lstsq(terms, y, rcond=None)[0]
    return left


def _spectrum(t: Array, y: Array) -> tuple[Array, Array]:
    """Frequencies [Hz] and the variance at each of them [m²]."""
    window = np.hanning(len(y))
    power: Array = 2.0 * np.abs(np.fft.rfft((y - y.mean()) * window)) ** 2 / (len(y) * (window**2).sum())
    return np.arange(len(power)) / (len(y) * float(t[1] - t[0])), power


def _peak(t: Array, y: Array) -> Swing | None:
    frequency, power = _spectrum(t, y)
    band = (frequency >= _BAND[0]) & (frequency <= _BAND[1])
    if not band.any() or not power[band].sum() > 0.0:
        return None
    top = int(np.flatnonzero(band)[power[band].argmax()])
    near = power[max(0, top - 2) : top + 3].sum()  # a Hann window spreads a line over two bins on either side
    total = power[(frequency >= _BAND[0] / 2) & (frequency <= _BAND[1])].sum()
    return Swing(float(frequency[top]), float(np.sqrt(2.0 * near)), float(near / total))


def _power_at(at: float, t: Array, y: Array) -> float:
    """Amplitude [m] near a frequency [Hz]."""
    frequency, power = _spectrum(t, y)
    top = int(np.abs(frequency - at).argmin())
    return float(np.sqrt(2.0 * power[max(0, top - 2) : top + 3].sum()))
