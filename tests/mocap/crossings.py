"""Test sets for telling markers apart: who flies how, and what a camera system makes of it. Seeded, no files.

Every set is a swarm of markers with a stated smallest gap (centre to centre) and largest speed; :func:`film` turns it
into frames of unlabelled points with noise, dropouts and ghosts. ``python -m tests.benchmarks.crossings`` prints the
tables.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mocap.tracking import Settings, Tracker

Positions = Callable[[float], np.ndarray]  # time [s] to (N, 3) [m]
REST = 0.5  # s on the pads before anybody moves


@dataclass(frozen=True)
class Crossing:
    """A swarm's motion: positions at a time, how long it lasts [s], when its crossing is [s]."""

    name: str
    positions: Positions
    duration: float
    meeting: float

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(f"cf{i}" for i in range(len(self.positions(0.0))))

    def acceleration(self) -> float:
        """Largest acceleration [m/s²]."""
        tracks = np.stack([self.positions(t) for t in np.arange(0.0, self.duration, 0.01)])
        return float(np.linalg.norm(np.diff(tracks, n=2, axis=0), axis=2).max() / 0.01**2)

    def gap(self) -> float:
        """Smallest distance of two markers [m]."""
        tracks = np.stack([self.positions(t) for t in np.arange(0.0, self.duration, 0.01)])
        pairs = itertools.combinations(range(tracks.shape[1]), 2)
        return min(float(np.linalg.norm(tracks[:, i] - tracks[:, j], axis=1).min()) for i, j in pairs)


@dataclass(frozen=True)
class Camera:
    """What the system does to the markers.

    Attributes:
        rate: [Hz]. noise: per axis [m]. missing: share of markers not seen in a frame, independently.
        blind: all markers are unseen for this long round the crossing [s]. ghosts: false points a frame, in the mean.
        near: share of the ghosts that is within 0.15 m of a marker, the others anywhere in the room.
    """

    rate: float = 100.0
    noise: float = 0.001
    missing: float = 0.02
    blind: float = 0.0
    ghosts: float = 0.5
    near: float = 0.2


@dataclass(frozen=True)
class Score:
    """How it went.

    Attributes:
        swaps: poses given to a robot that are nearer to another one. wrong: poses more than 5 cm from the robot.
        located: share of the robots' frames with a pose, from the start of the motion.
        silence: longest time without a pose of a robot [s].
    """

    swaps: int
    wrong: int
    located: float
    silence: float


def film(crossing: Crossing, camera: Camera, seed: int) -> list[tuple[float, list[tuple[float, float, float]]]]:
    """Frames of unlabelled points in random order."""
    rng = np.random.default_rng(seed)
    frames = []
    for k in range(int(crossing.duration * camera.rate)):
        t = k / camera.rate
        truth = crossing.positions(t)
        points = truth + camera.noise * rng.standard_normal(truth.shape)
        seen = rng.random(len(points)) >= camera.missing
        if abs(t - crossing.meeting) < 0.5 * camera.blind:
            seen[:] = False
        count = rng.poisson(camera.ghosts)
        anywhere = rng.uniform((-3.0, -3.0, 0.0), (3.0, 3.0, 2.0), (count, 3))
        beside = truth[rng.integers(len(truth), size=count)] + rng.uniform(-0.09, 0.09, (count, 3))
        ghosts = np.where((rng.random(count) < camera.near)[:, None], beside, anywhere)
        everything = np.concatenate([points[seen], ghosts])
        frames.append((t, [tuple(p) for p in rng.permutation(everything).tolist()]))
    return frames


def score(crossing: Crossing, camera: Camera, seed: int, settings: Settings | None = None) -> Score:
    """Film a crossing, track it and compare with the truth."""
    names = crossing.names
    settings = settings or Settings.for_acceleration(crossing.acceleration())
    tracker = Tracker(dict(zip(names, map(tuple, crossing.positions(0.0)), strict=True)), settings)
    swaps = wrong = said = total = 0
    last = dict.fromkeys(names, REST)
    silence = 0.0
    for t, points in film(crossing, camera, seed):
        truth = crossing.positions(t)
        seen = tracker.update(t, points).positions
        for i, name in enumerate(names):
            if name in seen:
                apart = np.linalg.norm(truth - seen[name], axis=1)
                swaps += int(apart.argmin() != i)
                wrong += int(apart[i] > 0.05)
                silence = max(silence, t - last[name]) if t > REST else silence
                last[name] = max(t, REST)
            if t > REST:
                said, total = said + (name in seen), total + 1
    silence = max([silence, *(crossing.duration - t for t in last.values())])
    return Score(swaps, wrong, said / total, silence)


# ---------------------------------------------------------------------------------------------------- who flies how


def head_on(speed: float, gap: float) -> Crossing:
    """Two fly straight at each other's pad, this far beside each other, at this speed each."""
    half = 1.0
    return _legs(
        "head-on", [[(-half, gap / 2, 1), (half, gap / 2, 1)], [(half, -gap / 2, 1), (-half, -gap / 2, 1)]], speed
    )


def right_angle(speed: float, gap: float) -> Crossing:
    """Two cross at a right angle, one just before the other; closest at the gap."""
    late = gap * math.sqrt(2.0)
    return _legs("right angle", [[(-1, 0, 1), (1, 0, 1)], [(0, -1 - late, 1), (0, 1 - late, 1)]], speed)


def overtake(speed: float, gap: float) -> Crossing:
    """One overtakes another that flies the same way at half the speed, this far beside it."""
    slow = _moves([(-0.5, gap, 1), (0.5, gap, 1)], 2.0 / speed)
    fast = _moves([(-1, 0, 1), (1, 0, 1)], 2.0 / speed)
    return Crossing("overtaking", _together([slow, fast]), 2.0 / speed * _PEAK + 2.0 * REST, REST + _PEAK / speed)


def bounce(speed: float, gap: float) -> Crossing:
    """Two fly at each other, stop at this gap and fly back: a constant velocity would have them swap places."""
    there = [[(-1, 0, 1), (-gap / 2, 0, 1), (-1, 0, 1)], [(1, 0, 1), (gap / 2, 0, 1), (1, 0, 1)]]
    return _legs("bounce", there, speed)


def above(speed: float, gap: float) -> Crossing:
    """One flies over another's head and back, this far above it."""
    return _legs(
        "above", [[(0, 0, 1), (0, 0, 1), (0, 0, 1)], [(-1, 0, 1 + gap), (1, 0, 1 + gap), (-1, 0, 1 + gap)]], speed
    )


def antipodal(speed: float, gap: float, robots: int = 8) -> Crossing:
    """Everybody flies across a circle at once, straight, past the centre at the same side: closest at the gap there."""
    beside, half = 0.5 * gap / math.sin(math.pi / robots), 1.5
    places = []
    for i in range(robots):
        c, s = math.cos(2.0 * math.pi * i / robots), math.sin(2.0 * math.pi * i / robots)
        places.append([(c * x - s * beside, s * x + c * beside, 1.0) for x in (-half, half)])
    return _legs(f"{robots} antipodal", places, speed)


SETS: Sequence[Callable[[float, float], Crossing]] = (head_on, right_angle, overtake, bounce, above, antipodal)

_PEAK = 1.875  # peak over mean speed of a minimum-jerk move


def _legs(name: str, places: Sequence[Sequence[tuple[float, float, float]]], speed: float) -> Crossing:
    """Minimum-jerk moves from place to place, each as long as its longest needs to peak at this speed."""
    longest = max(math.dist(a, b) for path in places for a, b in itertools.pairwise(path))
    each = _PEAK * longest / speed
    legs = len(places[0]) - 1
    paths = [_moves(path, each / _PEAK) for path in places]
    meeting = REST + (0.5 * each if legs == 1 else each if name == "bounce" else 0.5 * each)
    return Crossing(name, _together(paths), legs * each + 2.0 * REST, meeting)


def _moves(path: Sequence[tuple[float, float, float]], mean: float) -> Positions:
    each = _PEAK * mean
    points = np.array(path, dtype=float)

    def at(t: float) -> np.ndarray:
        x = min(max((t - REST) / each, 0.0), len(points) - 1.0)
        k = min(int(x), len(points) - 2)
        s = x - k
        return points[k] + (points[k + 1] - points[k]) * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    return at


def _together(paths: Sequence[Positions]) -> Positions:
    return lambda t: np.stack([path(t) for path in paths])
