"""One robot with a model of its own, as a library: a loss with weights, no mission and nothing that has to be flown.

    import numpy as np
    from planner.ergodic.basis import CosineBasis
    from planner.ergodic.metric import ErgodicMetric
    from planner.ergodic.target import cell_density
    from planner.single import DifferentialDrive, LossWeights, Task, search

    basis = CosineBasis(np.zeros(2), np.ones(2))
    drive = DifferentialDrive(start=(0.2, 0.2, 0.0), steps=100)
    task = Task(drive, ErgodicMetric(basis, cell_density(density, basis)), LossWeights(), end=(0.8, 0.8, 0.0))
    found = search(task)                                    # found.u (T, m), found.states (T, n), found.loss
    again = search(task.on(cell_density(changed, basis)), initial=found.u, first=10)  # ten steps were driven already

Swarms, obstacles, limits and connectivity are the business of missions; changing their maps is :mod:`planner.replan`'s.
"""

from planner.single.drive import DifferentialDrive
from planner.single.loss import Loss, LossWeights, Task
from planner.single.model import Model
from planner.single.search import Found, search

__all__ = ["DifferentialDrive", "Found", "Loss", "LossWeights", "Model", "Task", "search"]
