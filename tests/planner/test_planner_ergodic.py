import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from missions.schema import ArrayMap, Gaussian, UniformMap
from planner.ergodic import target
from planner.ergodic.basis import CosineBasis
from planner.ergodic.metric import ErgodicMetric
from planner.ergodic.panels import panels
from planner.ergodic.target import cell_density
from planner.errors import PlannerError
from planner.indicators import ergodic_metric
from tests.planner.problems import imec, notebook

AUTHORS = notebook()
POSITIONS = np.array(AUTHORS["positions_by_step_robot"])


def authors_order(coefficients):
    return coefficients.T.ravel()  # their first frequency runs fastest


class TestAuthorsFigures:
    metric = ergodic_metric(imec())

    def test_map_coefficients(self):
        np.testing.assert_allclose(authors_order(self.metric.phi_k), AUTHORS["phi_k"], rtol=0, atol=1e-9)

    def test_trajectory_coefficients(self):
        np.testing.assert_allclose(authors_order(self.metric.statistics(POSITIONS)), AUTHORS["c_k"], rtol=0, atol=1e-9)

    def test_weights_and_norms(self):
        basis = self.metric.basis
        np.testing.assert_allclose(authors_order(basis.Lambda_k), AUTHORS["lambda_k"], rtol=1e-12)
        np.testing.assert_allclose(authors_order(basis.h_k), AUTHORS["h_k"], rtol=1e-12)

    def test_ergodicity(self):
        E = AUTHORS["measured"]["ergodicity"]
        assert self.metric.value(POSITIONS) == pytest.approx(E, abs=1e-12)
        assert self.metric.evaluate(POSITIONS).value == pytest.approx(E, abs=1e-12)


def midpoints(lower, upper, count):
    axes = [lo + (np.arange(count) + 0.5) / count * (up - lo) for lo, up in zip(lower, upper, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, len(lower))


@pytest.mark.parametrize(("lower", "upper"), [((-1.0, 2.0), (2.0, 4.5)), ((-1.0, 2.0, 0.5), (0.0, 5.0, 1.0))])
def test_the_basis_is_orthonormal_on_a_box_away_from_the_origin(lower, upper):
    basis = CosineBasis(np.array(lower), np.array(upper), 5)
    f = basis.functions(midpoints(lower, upper, 12)).reshape(-1, 5 ** len(lower))
    np.testing.assert_allclose(f.T @ f / len(f), np.eye(f.shape[1]), atol=1e-12)


@pytest.mark.parametrize("nu", [2, 3])
def test_statistics_are_the_mean_of_the_functions(nu):
    rng = np.random.default_rng(3)
    lower, upper = -np.ones(nu), np.arange(1.0, nu + 1.0)
    basis = CosineBasis(lower, upper, 6)
    points = rng.uniform(lower, upper, (40, nu))
    np.testing.assert_allclose(
        basis.statistics(basis.tables(points).cosine), basis.functions(points).mean(axis=0), atol=1e-13
    )
    k = np.stack(np.meshgrid(*[np.arange(6)] * nu, indexing="ij"), axis=-1)
    theta = np.pi * (points[0] - lower) / (upper - lower)
    np.testing.assert_allclose(basis.functions(points)[0], np.cos(k * theta).prod(axis=-1) / basis.h_k, atol=1e-13)


def test_uniform_coverage_of_a_uniform_map_is_perfect():
    basis = CosineBasis(np.array([0.0, -2.0]), np.array([4.0, 1.0]), 8)
    metric = ErgodicMetric(basis, target.information_coefficients(UniformMap(), basis))
    assert metric.value(midpoints(basis.lower, basis.upper, 20)[:, None]) < 1e-25


@given(st.floats(0.1, 50.0), st.floats(-20.0, 20.0))
@settings(max_examples=20, deadline=None)
def test_ergodicity_depends_neither_on_units_nor_on_the_origin(scale, shift):
    rng = np.random.default_rng(0)
    q = rng.uniform(0.0, 1.0, (30, 2, 2))
    density = rng.uniform(size=(9, 7))
    values = []
    for a, b in ((1.0, 0.0), (scale, shift)):
        basis = CosineBasis(np.array([b, b]), np.array([a + b, a + b]))
        values.append(ErgodicMetric(basis, target.cell_density(density, basis)).value(a * q + b))
    assert values[1] == pytest.approx(values[0], rel=1e-8)


def test_an_array_is_indexed_x_then_y():
    basis = CosineBasis(np.zeros(2), np.array([2.0, 1.0]), 6)
    density = np.zeros((40, 20))
    density[30, 5] = 1.0  # centre of the cell: (1.525, 0.275)
    phi_k = target.information_coefficients(ArrayMap("x.npy", density=density), basis)
    np.testing.assert_allclose(phi_k, basis.functions(np.array([[1.525, 0.275]]))[0], atol=1e-12)


def test_a_gaussian_and_its_own_picture_have_the_same_coefficients():
    basis = CosineBasis(np.array([0.0, 1.0]), np.array([3.0, 3.5]), 8)
    gaussian = Gaussian((1.2, 2.1), ((0.05, 0.02), (0.02, 0.04)), 0.3)
    points = midpoints(basis.lower, basis.upper, 200)
    delta = points - gaussian.mean
    picture = np.exp(-0.5 * np.einsum("pa,ab,pb->p", delta, np.linalg.inv(gaussian.covariance), delta))
    np.testing.assert_allclose(
        target.gaussian_mixture((gaussian,), basis), target.cell_density(picture.reshape(200, 200), basis), atol=1e-4
    )


def test_weights_are_shares_of_the_information_whatever_the_covariance():
    basis = CosineBasis(np.zeros(2), np.full(2, 10.0), 4)
    wide, narrow = Gaussian((3.0, 5.0), 0.2, 1.0), Gaussian((7.0, 5.0), 0.05, 1.0)
    both = target.gaussian_mixture((wide, narrow), basis)
    each = [target.gaussian_mixture((one,), basis) for one in (wide, narrow)]
    np.testing.assert_allclose(both, 0.5 * (each[0] + each[1]), atol=1e-9)


@pytest.mark.parametrize("density", [np.zeros((3, 3)), -np.ones((3, 3)), np.ones(3), np.full((3, 3), np.nan)])
def test_a_density_that_is_none_is_refused(density):
    with pytest.raises(PlannerError):
        target.cell_density(density, CosineBasis(np.zeros(2), np.ones(2)))


@pytest.mark.parametrize("nu", [2, 3])
def test_four_panels_show_map_coefficients_trajectory_and_difference(nu):
    """A map of one basis function is kept as it is; a reconstruction has the coefficients that it was made of."""
    basis = CosineBasis(np.zeros(nu), np.full(nu, 2.0), 4)
    w = [(np.arange(40) + 0.5) / 40] * nu
    density = 1.0 + 0.8 * np.cos(np.pi * 2 * w[0]).reshape(-1, *[1] * (nu - 1)) * np.ones((40,) * nu)
    metric = ErgodicMetric(basis, cell_density(density, basis))
    q = np.random.default_rng(0).uniform(0.0, 2.0, (50, 2, nu))
    shown = panels(metric, q, density, cells=40)
    assert np.allclose(shown.given, density / density.mean())
    assert np.allclose(shown.kept, shown.given, atol=1e-9)
    assert np.allclose(cell_density(shown.made + 10.0, basis).ravel()[1:] * 11.0, metric.statistics(q).ravel()[1:])
    assert np.allclose(shown.difference, shown.kept - shown.made)
