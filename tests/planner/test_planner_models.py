"""Every model of motion behind the one seam: transposes, sensitivities, plans."""

import builtins
import dataclasses
import importlib

import numpy as np
import pytest

from missions import MissionError, parse_mission
from missions.dynamics import CasadiModel, SingleIntegratorModel, expression_fault, fault
from missions.reach import reach
from missions.schema import Horizon, NoConnectivity, ProbabilisticConnectivity, SolverSettings
from planner.dynamics import Cotangent, DoubleIntegrator, SingleIntegrator
from planner.dynamics.casadi_model import casadi_dynamics
from planner.errors import NotFlyableError, PlannerError
from planner.models import mission_dynamics
from planner.pipeline import make_flight_plan
from planner.problem import build_problem
from planner.solver.solve import solve
from tests.planner.problems import small

STARTS = np.array([[0.5, 0.3], [1.2, 0.4], [-0.3, 0.1]])
DRIVE = CasadiModel(
    states=("x", "y", "theta"),
    controls=("v", "w"),
    derivative=("v * cos(theta)", "v * sin(theta)", "w"),
    lower=(0.0, -1.5),
    upper=(0.5, 1.5),
    initial=(0.7,),
)
INTEGRATOR = CasadiModel(
    states=("x", "y", "vx", "vy"),
    controls=("ax", "ay"),
    derivative=("vx", "vy", "ax", "ay"),
    lower=(-1.0, -1.0),
    upper=(1.0, 1.0),
)
MODELS = {
    "double integrator": DoubleIntegrator(STARTS, 20, 0.1, substeps=3),
    "single integrator": SingleIntegrator(STARTS, 20, 0.1, substeps=3),
    "differential drive": casadi_dynamics(DRIVE, STARTS, 20, 0.1, substeps=3),
}


@pytest.fixture(params=MODELS.values(), ids=MODELS)
def model(request):
    return request.param


def test_pull_is_the_transpose_of_the_rollouts_derivative(model):
    rng = np.random.default_rng(0)
    u, du = 0.5 * rng.standard_normal((2, *model.controls_shape))
    motion, h = model.rollout(u), 1e-6
    ahead, behind = model.rollout(u + h * du), model.rollout(u - h * du)
    for part in range(len(motion)):
        cotangent = Cotangent.zeros_like(motion)
        cotangent[part][...] = rng.standard_normal(motion[part].shape)
        numeric = np.vdot(cotangent[part], ahead[part] - behind[part]) / (2.0 * h)
        size = np.linalg.norm(cotangent[part]) * np.linalg.norm(ahead[part] - behind[part]) / (2.0 * h)
        assert abs(np.vdot(model.pull(motion, cotangent), du) - numeric) <= 1e-6 * size, motion._fields[part]


def test_linearisation_predicts_where_a_small_change_leads(model):
    """In continuous time, so to first order in the step only."""
    rng = np.random.default_rng(1)
    u, du = 0.3 * rng.standard_normal((2, *model.controls_shape))
    motion = model.rollout(u)
    A, B = model.linearise(motion)
    x = np.zeros((len(STARTS), A.shape[-1], 1))
    for t in range(model.steps):
        a, b = A[t % len(A)], B[t % len(B)]
        x = x + model.dt * (a @ x + b @ du[t][..., None])
    h = 1e-6
    true = (model.rollout(u + h * du).q[-1] - model.rollout(u - h * du).q[-1]) / (2.0 * h)
    assert np.abs(x[:, :2, 0] - true).max() <= 0.15 * np.abs(true).max()


def test_rollouts_start_where_the_robots_are(model):
    motion = model.rollout(np.full(model.controls_shape, 0.1))
    np.testing.assert_allclose(motion.q[0], STARTS)
    np.testing.assert_allclose(motion.q_fine[::3], motion.q, atol=1e-14)


def test_a_double_integrator_in_casadi_is_the_double_integrator():
    u = np.random.default_rng(2).standard_normal((20, 3, 2))
    ours, theirs = MODELS["double integrator"], casadi_dynamics(INTEGRATOR, STARTS, 20, 0.1, substeps=3)
    for ours_part, theirs_part in zip(ours.rollout(u), theirs.rollout(u), strict=True):
        np.testing.assert_allclose(theirs_part, ours_part, atol=1e-12)
    rng, motion = np.random.default_rng(3), ours.rollout(u)
    cotangent = Cotangent(*(rng.standard_normal(part.shape) for part in motion))
    np.testing.assert_allclose(theirs.pull(motion, cotangent), ours.pull(motion, cotangent), atol=1e-11)


def test_a_differential_drive_turns_in_circles():
    """Radius v / w = 0.4 m about the point to its left, exact for constant controls up to the integrator's order."""
    model = casadi_dynamics(DRIVE, STARTS[:1], 100, 0.1)
    motion = model.rollout(np.tile([0.4, 1.0], (100, 1, 1)))
    centre = STARTS[0] + 0.4 * np.array([-np.sin(0.7), np.cos(0.7)])
    np.testing.assert_allclose(np.linalg.norm(motion.q_fine - centre, axis=-1), 0.4, atol=1e-7)
    np.testing.assert_allclose(np.linalg.norm(motion.v, axis=-1), 0.4, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("model", [SingleIntegratorModel(), DRIVE], ids=["single integrator", "differential drive"])
def test_the_fast_solver_plans_with_any_model(model):
    mission = small(
        ProbabilisticConnectivity(range=0.5, sub_periods=2, threshold=0.25),
        horizon=Horizon(8.0, 0.2),
        dynamics=model,
    )
    done = solve(build_problem(mission), SolverSettings(time_limit=120.0, starts=1))
    assert done.status.feasible
    again = mission_dynamics(mission).rollout(done.plan.u)
    np.testing.assert_allclose(again.q, done.plan.q, atol=1e-12)
    assert np.linalg.norm(done.plan.v, axis=-1).max() <= 1.0
    if model is DRIVE:
        assert done.plan.u[..., 0].min() >= -0.005
        assert np.abs(done.plan.u[..., 1]).max() <= 1.5 * 1.01


@pytest.mark.parametrize("model", [SingleIntegratorModel(), DRIVE], ids=lambda m: m.type)
def test_what_no_polynomial_follows_is_not_flown(model):
    with pytest.raises(NotFlyableError, match=f"type {model.type} are for studies"):
        make_flight_plan(small(NoConnectivity(), dynamics=model))


def test_without_casadi_the_error_says_how_to_install_it(monkeypatch):
    def absent(name, *rest):
        if name == "casadi":
            raise ImportError(name)
        return original(name, *rest)

    original = importlib.import_module
    monkeypatch.setattr(importlib, "import_module", absent)
    with pytest.raises(PlannerError, match=r"pip install 'ergoflie\[casadi\]'"):
        casadi_dynamics(DRIVE, STARTS, 5, 0.1)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("v * cos(theta)", None),
        ("-v ** 2 / (1 + pi) + atan2(v, 1.5)", None),
        ("__import__('os')", "call of '__import__'|unknown name"),
        ("v.real", "Attribute"),
        ("(lambda: v)()", "Lambda|call of"),
        ("open", "unknown name 'open'"),
        ("cos(v, v)", "2 arguments"),
        ("'v'", "allowed: numbers"),
        ("True", "allowed: numbers"),
        ("v +", "allowed: an expression"),
        ("v if v else v", "IfExp"),
        ("1" * 501, "at most 500"),
    ],
)
def test_expressions_are_arithmetic_and_nothing_else(text, named, monkeypatch):
    monkeypatch.setattr(builtins, "eval", None)
    reason = expression_fault(text, ("v", "theta"))
    if named is None:
        assert reason is None
    else:
        import re

        assert re.search(named, reason)


@pytest.mark.parametrize(
    ("changes", "where"),
    [
        ({"derivative": ("v", "w")}, "derivative"),
        ({"lower": (0.0,)}, "lower"),
        ({"upper": (0.0, 1.0)}, "upper[0]"),
        ({"initial": (0.0, 0.0)}, "initial"),
        ({"states": ("x", "y", "v")}, "states"),
        ({"states": ("x", "y", "sin")}, "states"),
        ({"derivative": ("v", "w", "q")}, "derivative[2]"),
    ],
)
def test_faults_of_a_model_are_placed(changes, where):
    assert fault(DRIVE, 2) is None
    assert fault(dataclasses.replace(DRIVE, **changes), 2)[0] == where


MISSION = """
schema_version: 1
name: cart
workspace: {lower: [0.0, 0.0], upper: [2.0, 2.0]}
horizon: {duration: 5.0}
limits: {acceleration: 0.5}
information: {type: uniform}
robots: [{name: cart, start: [0.5, 0.5]}]
dynamics:
  type: casadi
  states: [px, py, theta]
  controls: [v, w]
  derivative: [v * cos(theta), v * sin(theta), w]
  lower: [0.0, -1.0]
  upper: [0.5, 1.0]
"""


def test_reach_of_models_without_acceleration_limits_is_their_speed():
    t = np.array([0.0, 0.1, 3.0])
    np.testing.assert_allclose(reach(small(dynamics=SingleIntegratorModel()), t), t * 1.0)
    assert (reach(small(), t)[1:] < t[1:]).all()


def test_a_mission_file_writes_its_model_down():
    mission = parse_mission(MISSION, path="cart.yaml", read_file={}.__getitem__)
    assert build_problem(mission).dynamics.controls_shape == (50, 1, 2)
    broken = MISSION.replace("cos(theta)", "cos(thetta)")
    with pytest.raises(MissionError, match=r"dynamics\.derivative\[0\]: unknown name 'thetta'"):
        parse_mission(broken, path="cart.yaml", read_file={}.__getitem__)
