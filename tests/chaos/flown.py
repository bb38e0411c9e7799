"""Flies a case, and sees what really happened: true positions and motors, hundred times a second."""

import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from deploy.analysis.analyse import analyse
from deploy.errors import DeployError
from deploy.flightlog.reader import read_log
from deploy.rehearsal import rehearse
from deploy.scenario.load import parse_scenario
from tests.chaos.arena import arena_plan

PERIOD = 0.01  # s


@dataclass(frozen=True)
class Flown:
    """A flight that is over.

    Attributes:
        case: what went wrong. ended: the outcome, or the DeployError. log: what was written. analysis: of that.
        t: (T,) [s]. position: (T, N, 3) true positions [m]. turning: (T, N) whether a motor turns.
    """

    case: object
    ended: object
    log: object
    analysis: object
    t: np.ndarray
    position: np.ndarray
    turning: np.ndarray


def fly(case):
    """One case, from the first packet to the last."""
    plan, rows = arena_plan(case.on_host_loss, case.policy), []
    scenario = parse_scenario(case.text, path="chaos.yaml", mission=plan.mission)

    def witness(stage):
        world = stage.world
        world.every(PERIOD, lambda t: rows.append((t, world.positions, world.motors.any(axis=1))))

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        try:
            ended, _ = rehearse(plan, log_path=path, seed=scenario.seed, scenario=scenario, witness=witness)
        except DeployError as error:
            ended = error
        log = read_log(path if path.exists() else path.with_name(path.name + ".part"))
    t, position, turning = (np.array(column) for column in zip(*rows, strict=True))
    return Flown(case, ended, log, analyse(log), t, position, turning)
