"""The planner as a library: PlanetaryRobotics' published example, cold and after changes of the map."""

from __future__ import annotations

import statistics
import time

import numpy as np

from planner.single import search
from tests.planner import drive_example as example

ENOUGH = 3.5e-3  # loss that is asked for; the authors' re-plans end at 5e-3
SHIFT, CHANGES = 0.02, 12  # [m] by which the map moves each time, as often as was measured on theirs


def run() -> None:
    """Print the table."""
    print("Planner as a library: differential drive, 100 steps, 500 × 500 map, 10 × 10 basis; CPU seconds")
    print(f"  {'':38} {'loss':>9} {'CPU s':>8} {'evaluations':>12}")
    began = time.process_time()
    found = search(example.task(example.transform(example.density())), enough=ENOUGH)
    _row("cold, the map's transform included", found.loss.total, time.process_time() - began, found.evaluations)
    print("    theirs: 0.004996 in 1.63 + 2.80 of set-up, 0.003552 in 3.35 + 2.80; asked: 0.0035 in 0.2")
    rng, means, u = np.random.default_rng(0), example.MEANS, found.u
    losses, seconds, evaluations = [], [], []
    for _ in range(CHANGES):
        means = means + rng.uniform(-SHIFT, SHIFT, means.shape)
        density = example.density(means)
        began = time.process_time()
        again = search(example.task(example.transform(density)), initial=u, enough=ENOUGH)
        seconds.append(time.process_time() - began)
        losses.append(again.loss.total)
        evaluations.append(again.evaluations)
        u = again.u
    word = f"{CHANGES} re-plans, median, transform included"
    _row(word, statistics.median(losses), statistics.median(seconds), round(statistics.median(evaluations)))
    print("    theirs: 0.03 to 0.40 to a loss of 0.005, and 1.1 for the transform; asked: 0.02")


def _row(name: str, loss: float, seconds: float, evaluations: int) -> None:
    print(f"  {name:38} {loss:9.6f} {seconds:8.3f} {evaluations:12d}")


if __name__ == "__main__":
    run()
