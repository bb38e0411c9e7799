"""A small flight for tests: two drones on short smooth moves, on the simulated radio."""

import contextlib
import functools

import numpy as np

from deploy.errors import DeployError
from deploy.execute import Equipment, fly
from deploy.flightlog.writer import FlightLog
from deploy.operator import Interrupts
from deploy.rehearsal import Stage
from missions.fleet import altitudes
from missions.loader import parse_mission
from missions.schema import Flight, Gaussian, GaussianMixtureMap, Horizon, Limits, Mission, Robot, Workspace
from planner.certificate.certify import certify
from planner.flightplan import FlightPlan
from planner.plan import Plan
from planner.trajectory.encode import decode, encode
from planner.trajectory.piecewise import PiecewisePolynomial
from planner.transfer.plan import plan_transfers

# Rest to rest with zero acceleration and jerk at both ends: 35 s⁴ − 84 s⁵ + 70 s⁶ − 20 s⁷.
SMOOTH = np.array([0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0])
STARTS = {"cf1": (0.5, 0.5), "cf2": (1.5, 0.5)}
PADS = {"cf1": (0.5, 0.4), "cf2": (1.5, 0.4)}
SHIFT = (0.3, 0.5)
DURATION = 3.0
TEXT = """
schema_version: 1
name: small
workspace: {{lower: [0.0, 0.0], upper: [2.5, 2.0]}}
horizon: {{duration: 3.0, dt: 0.1}}
information: {{type: gaussians, components: [{{mean: [1.0, 1.0], covariance: 0.1}}]}}
robots:
  - {{name: cf1, start: [0.5, 0.5], pad: [0.5, 0.4]{cf1}}}
  - {{name: cf2, start: [1.5, 0.5], pad: [1.5, 0.4]{cf2}}}
limits: {{acceleration: 1.0, speed: 1.0, separation: 0.3}}
flight: {{takeoff_duration: 1.2, landing_duration: 1.2, settle_time: 0.5}}
{more}"""


def small_text(cf1="", cf2="", more=""):
    """The small mission as a file; ``cf1``, ``cf2``: more of a robot, a comma first; ``more``: more of the mission."""
    return TEXT.format(cf1=cf1, cf2=cf2, more=more)


def parsed(text, name="small.yaml"):
    return parse_mission(text, path=name, read_file={}.__getitem__)


def small_mission(**flight):
    return Mission(
        schema_version=1,
        name="small",
        workspace=Workspace((0.0, 0.0), (2.5, 2.0)),
        horizon=Horizon(DURATION, 0.1),
        information=GaussianMixtureMap((Gaussian((1.0, 1.0), 0.1),)),
        robots=tuple(Robot(name, start, pad=PADS[name]) for name, start in STARTS.items()),
        limits=Limits(acceleration=1.0, speed=1.0, separation=0.3),
        flight=Flight(**{"takeoff_duration": 1.2, "landing_duration": 1.2, "settle_time": 0.5, **flight}),
    )


def small_plan(mission=None):
    mission = mission or small_mission()
    high = zip(mission.robots, altitudes(mission), strict=True)
    moves = {robot.name: encode(_move(robot.start, altitude)) for robot, altitude in high}
    return certified(mission, moves)


@functools.cache
def usual_plan():
    return small_plan()


def certified(mission, trajectories):
    """A flight plan of these bytes; its samples are of no consequence."""
    t = np.linspace(0.0, mission.horizon.duration, mission.steps + 1)
    q = np.zeros((len(t), len(mission.robots), 2))
    plan = Plan(t, q, q.copy(), np.zeros((len(t) - 1, len(mission.robots), 2)), 0.0, 0.0)
    transfers = plan_transfers(mission, {name: decode(item) for name, item in trajectories.items()})
    return FlightPlan(
        mission, plan, trajectories, certify(mission, trajectories, transfers), {"ergoflie": "test"}, transfers
    )


def _move(start, altitude):
    scale = DURATION ** -np.arange(8.0)
    coefficients = np.zeros((1, 4, 8))
    for axis, (begin, shift) in enumerate(zip(start, SHIFT, strict=True)):
        coefficients[0, axis] = shift * SMOOTH * scale
        coefficients[0, axis, 0] += begin
    coefficients[0, 2, 0] = altitude
    return PiecewisePolynomial(np.array([DURATION]), coefficients)


@contextlib.contextmanager
def stage(tmp_path, plan, seed=1, **kwargs):
    """A stage and a log; flying is up to the test."""
    with Stage(plan.mission, seed=seed, label=f"bench{seed}", **kwargs) as ready:
        path = tmp_path / f"flight-{seed}-{len(list(tmp_path.iterdir()))}.mcap"
        with FlightLog(path, ready.clock.epoch, {}, {}, when_full="wait") as log:
            ready.log = log
            yield ready


def equipment(ready, cache=None, **kwargs):
    """What a stage offers, unless the test has something else."""
    offered = {"uris": ready.swarm.uris(), "mocap": ready.mocap, "clock": ready.clock, "log": ready.log}
    return Equipment(**{**offered, "toc_cache": cache, **kwargs})


def fly_on(ready, plan, cache=None, **kwargs):
    return fly(plan, equipment(ready, cache, **kwargs))


class At(Interrupts):
    """Presses Ctrl-C when the flight's clock says so."""

    def __init__(self, *times):
        super().__init__()
        self.times = list(times)

    def bind(self, clock):
        self.clock = clock
        return self

    def land_requested(self):
        while self.times and self.clock.now() >= self.times[0]:
            self.times.pop(0)
            self.request()
        return super().land_requested()


def fly_watched(folder, cache, plan=None, prepare=lambda ready: None, on=None, **kwargs):
    """Fly, as a rule the small plan.

    Returns the outcome or what was raised, the stage, and the truth (n, drones, 3) every 0.1 s.
    """
    plan = plan or usual_plan()
    with stage(folder, on or plan) as ready:
        truth = []
        ready.world.every(0.1, lambda t: truth.append(ready.world.positions))
        prepare(ready)
        operator = kwargs.get("operator")
        if isinstance(operator, At):
            operator.bind(ready.clock)
        try:
            outcome = fly_on(ready, plan, cache, **kwargs)
        except (DeployError, ZeroDivisionError) as error:  # every test looks at what it is
            outcome = error
        ready.path = ready.log.path
        ready.final = ready.world.positions
        ready.spinning = bool(ready.world.motors.any())
        assert ready.clock.stalls == 0
    return outcome, ready, np.array(truth)


def on_the_ground(ready):
    return ready.final[:, 2].max() < 0.02 and not ready.spinning


def gentle(truth):
    """Nobody fell: no more than 2 m/s downwards."""
    return np.diff(truth[:, :, 2], axis=0).min() > -0.2
