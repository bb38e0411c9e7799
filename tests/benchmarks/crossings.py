"""How hard crossings may be for the marker tracker: ``python -m tests.benchmarks.crossings``.

Swaps and wrong poses are what must not happen; silence is what happens instead.
"""

from __future__ import annotations

from dataclasses import replace

from tests.mocap.crossings import SETS, Camera, Crossing, Score, score

SEEDS = range(5)
SPEEDS_AND_GAPS = ((1.0, 0.3), (2.0, 0.3), (1.0, 0.1), (2.0, 0.1))
CAMERAS = (
    ("good", Camera()),
    ("poor", Camera(noise=0.002, missing=0.2, ghosts=2.0)),
    ("blind 0.2 s", Camera(blind=0.2)),
    ("blind 0.4 s", Camera(blind=0.4)),
)


def worst(crossing: Crossing, camera: Camera) -> Score:
    """Swaps and wrong poses added up over the seeds, the least located, the longest silence."""
    scores = [score(crossing, camera, seed) for seed in SEEDS]
    return Score(
        sum(s.swaps for s in scores),
        sum(s.wrong for s in scores),
        min(s.located for s in scores),
        max(s.silence for s in scores),
    )


def run() -> None:
    """Print the table, then how far it goes on."""
    print(f"Marker tracker: crossings, 100 Hz, {len(SEEDS)} seeds; speed of each, smallest gap")
    for name, camera in CAMERAS:
        print(
            f"  {name}: noise {camera.noise * 1e3:g} mm, {camera.missing:.0%} missing, {camera.ghosts:g} ghosts a frame"
        )
    print(
        f"{'set':<14}{'m/s':>5}{'m/s²':>6}{'m':>6}  {'camera':<12}{'swaps':>6}{'wrong':>6}{'located':>9}{'silence':>9}"
    )
    for make in SETS:
        for speed, gap in SPEEDS_AND_GAPS:
            for label, camera in CAMERAS:
                _print(make(speed, gap), speed, gap, label, worst(make(speed, gap), camera))
    print("\nUntil it breaks: 8 antipodal at 2 m/s, poor camera, ever closer and blinder")
    for gap in (0.1, 0.05, 0.03, 0.02, 0.01):
        for blind in (0.0, 0.1):
            crossing = SETS[-1](2.0, gap)
            _print(crossing, 2.0, gap, f"poor, {blind:g} s", worst(crossing, replace(CAMERAS[1][1], blind=blind)))


def _print(crossing: Crossing, speed: float, gap: float, camera: str, s: Score) -> None:
    figures = f"{s.swaps:>6}{s.wrong:>6}{s.located:>9.1%}{s.silence:>7.2f} s"
    print(f"{crossing.name:<14}{speed:>5g}{crossing.acceleration():>6.1f}{gap:>6g}  {camera:<12}{figures}")


if __name__ == "__main__":
    run()
