import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from deploy.flight.reference import Reference
from planner.trajectory.piecewise import PiecewisePolynomial

DURATIONS = np.array([0.5, 1.25, 0.75])
TRAJECTORY = PiecewisePolynomial(DURATIONS, np.random.default_rng(4).normal(size=(3, 4, 8)))
KNOTS = TRAJECTORY.knots().tolist()


@given(st.floats(-1.0, 4.0) | st.sampled_from(KNOTS))
def test_single_times_give_what_the_arrays_give(t):
    reference = Reference(TRAJECTORY)
    np.testing.assert_allclose(reference.position(t), TRAJECTORY.evaluate(np.array([t]))[0, :3], rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(
        reference.velocity(t), TRAJECTORY.evaluate(np.array([t]), 1)[0, :3], rtol=1e-12, atol=1e-12
    )
