"""The separable metric against the paper's double loop, autodiff and closed forms."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner.information import gaussians, raster, samples, uniform
from planner.problem import Covered, MetricWeights
from planner.spectral_metric import SpectralMetric, mean_basis, mode_weights
from planner.workspace import Workspace
from tests.planner.compiled import value_and_slope_of, value_of

MODES = (5, 4, 3)


@pytest.fixture
def workspace() -> Workspace:
    return Workspace(np.array([-3.0, 2.0, 10.0]), np.array([5.0, 4.0, 40.0]))


def paper_metric(path: np.ndarray, target: np.ndarray, weights: np.ndarray) -> float:
    """SVES eqs. (1)–(3) as three nested loops."""
    total = 0.0
    for k in np.ndindex(target.shape):
        h = np.prod([1.0 if index == 0 else np.sqrt(0.5) for index in k])
        c = np.mean([np.prod(np.cos(np.pi * np.array(k) * w)) / h for w in path])
        total += weights[k] * (c - target[k]) ** 2
    return total


def test_the_separable_metric_equals_the_papers_double_loop() -> None:
    rng = np.random.default_rng(0)
    path, target = rng.uniform(size=(11, 3)), rng.normal(size=MODES) * 0.1
    for convention in MetricWeights:
        metric = SpectralMetric.of(target, convention)
        found = float(value_of(metric, path, np.full(11, 1.0 / 11.0)))
        assert found == pytest.approx(paper_metric(path, target, mode_weights(MODES, convention)), rel=2e-5)


@pytest.mark.parametrize("modes", [(8, 8, 8), (7, 5, 1), (1, 9, 2)])
def test_the_analytic_gradient_equals_autodiff_of_the_product(modes: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(1)
    path = rng.uniform(-0.05, 1.05, size=(40, 3))
    weight = rng.dirichlet(np.ones(40))
    covered = Covered(rng.normal(size=modes) * 0.2, 3.0)
    metric = SpectralMetric.of(rng.normal(size=modes) * 0.1, MetricWeights.LINEAR, covered, 5.0)
    k = np.stack(np.meshgrid(*[np.arange(n) for n in modes], indexing="ij"), -1).reshape(-1, 3)
    h = np.prod(np.where(k == 0, 1.0, np.sqrt(0.5)), axis=-1)

    def naive(x: jax.Array) -> jax.Array:
        c = weight @ (jnp.prod(jnp.cos(jnp.pi * k[None] * x[:, None, :]), axis=-1) / h)
        c = metric.covered_share * metric.covered_mean.ravel() + (1 - metric.covered_share) * c
        return jnp.sum(metric.weights.ravel() * (c - metric.target.ravel()) ** 2)

    value, gradient = value_and_slope_of(metric, path, weight)
    naive_value, naive_gradient = jax.jit(jax.value_and_grad(naive))(path)
    assert float(value) == pytest.approx(float(naive_value), rel=1e-5)
    np.testing.assert_allclose(gradient, naive_gradient, atol=3e-6 * float(np.abs(naive_gradient).max()))


def test_weights_follow_both_conventions_and_leave_out_axes_with_one_mode() -> None:
    assert mode_weights((3, 3, 3), MetricWeights.LINEAR)[2, 0, 0] == pytest.approx((1 + 2) ** -2.0)
    assert mode_weights((3, 3, 3), MetricWeights.SQUARED)[2, 0, 0] == pytest.approx((1 + 4) ** -2.0)
    assert mode_weights((3, 3, 1), MetricWeights.LINEAR)[1, 1, 0] == pytest.approx((1 + np.sqrt(2)) ** -1.5)


def test_memory_makes_two_halves_equal_the_whole() -> None:
    rng = np.random.default_rng(2)
    path, target = rng.uniform(size=(60, 3)), rng.normal(size=MODES) * 0.1
    covered = Covered(mean_basis(path[:20], np.full(20, 1 / 20), MODES), 20.0)
    rest = SpectralMetric.of(target, MetricWeights.LINEAR, covered, 40.0)
    whole = SpectralMetric.of(target, MetricWeights.LINEAR)
    found = float(value_of(rest, path[20:], np.full(40, 1 / 40)))
    assert found == pytest.approx(float(value_of(whole, path, np.full(60, 1 / 60))), rel=1e-5)


def test_a_uniform_density_has_only_the_constant_coefficient(workspace: Workspace) -> None:
    phi = uniform(workspace).coefficients((6, 6, 6))
    assert phi[0, 0, 0] == pytest.approx(1.0)
    phi[0, 0, 0] = 0.0
    assert np.abs(phi).max() < 1e-12


def test_coefficients_of_gaussians_agree_with_quadrature(workspace: Workspace) -> None:
    from scipy.integrate import quad

    mean, std = np.array([0.0, 3.5, 20.0]), np.array([1.0, 0.7, 6.0])
    phi = gaussians(workspace, mean[None], std[None], np.array([2.0])).coefficients((4, 4, 4))
    expected = np.ones((4, 4, 4))
    for axis in range(3):
        low, length = workspace.box_min_m[axis], workspace.lengths_m[axis]

        def density(w: float, low: float = low, length: float = length, axis: int = axis) -> float:
            return float(np.exp(-0.5 * ((low + w * length - mean[axis]) / std[axis]) ** 2))

        norm = quad(density, 0, 1)[0]
        for k in range(4):
            part = quad(lambda w, k=k: density(w) * np.cos(np.pi * k * w), 0, 1)[0] / norm
            shape = [1, 1, 1]
            shape[axis] = 4
            factor = np.ones(4)
            factor[k] = part * (np.sqrt(2) if k else 1.0)
            expected = expected * factor.reshape(shape)
    # Cells of the grid are the only difference.
    np.testing.assert_allclose(phi, expected, atol=3e-3)


def test_a_raster_keeps_its_mass_where_it_lies(workspace: Workspace) -> None:
    values = np.zeros((4, 2))
    values[3, 1] = 5.0
    grid = raster(workspace, values, workspace.box_min_m[:2], workspace.lengths_m[:2] / np.array([4, 2]))
    centers = grid.centers_m()[grid.mass > 0]
    assert (centers[:, 0] > 3.0).all()
    assert (centers[:, 1] > 3.0).all()
    assert grid.mass.sum() == pytest.approx(1.0)


def test_a_raster_larger_than_the_box_is_cut_by_area(workspace: Workspace) -> None:
    values = np.array([[1.0, 1.0], [1.0, 1.0]])
    grid = raster(workspace, values, workspace.box_min_m[:2] - 3.0, np.array([20.0, 20.0]))
    np.testing.assert_allclose(grid.mass, 1.0 / grid.mass.size)


def test_samples_outside_the_box_do_not_count(workspace: Workspace) -> None:
    points = np.array([[0.0, 3.0, 20.0], [100.0, 3.0, 20.0]])
    grid = samples(workspace, points, np.array([1.0, 9.0]))
    inside = grid.centers_m()[grid.mass > 0]
    assert inside.shape == (1, 3)
    assert (np.abs(inside[0] - points[0]) <= grid.cell_m / 2 + 1e-9).all()


def test_information_without_mass_is_refused(workspace: Workspace) -> None:
    with pytest.raises(ValueError, match="no information in the box"):
        samples(workspace, np.array([[100.0, 3.0, 20.0]]), np.array([1.0]))
    with pytest.raises(ValueError, match="finite"):
        raster(workspace, np.array([[np.nan]]), np.zeros(2), np.ones(2))
