"""Priors against scipy's densities and quadrature over their hyper-parameters."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import invgamma, multivariate_normal, norm

from planner.priors import GaussianPrior, OffsetPrior, Prior, ScalePrior, WalkPrior

REFERENCE = np.linspace(0.0, 1.0, 5)[:, None] * np.array([1.0, -2.0])
PRIORS: list[Prior] = [
    GaussianPrior(0.7, jnp.asarray(REFERENCE)),
    OffsetPrior(0.4, 0.9, jnp.asarray(REFERENCE)),
    ScalePrior(3.0, 0.8, jnp.asarray(REFERENCE)),
    WalkPrior(0.8, 0.3, jnp.asarray(REFERENCE)),
]
names = [type(prior).__name__ for prior in PRIORS]


def difference(prior: Prior, one: np.ndarray, other: np.ndarray) -> float:
    """Of log densities: what does not depend on constants."""
    with jax.enable_x64(True):
        return float(prior.log_density(jnp.asarray(one)) - prior.log_density(jnp.asarray(other)))


@pytest.fixture
def pair() -> tuple[np.ndarray, np.ndarray]:
    generator = np.random.default_rng(0)
    return REFERENCE + generator.normal(size=(5, 2)), REFERENCE + 0.3 * generator.normal(size=(5, 2))


def test_the_gaussian_prior_is_scipys(pair: tuple[np.ndarray, np.ndarray]) -> None:
    expected = [norm.logpdf(x - REFERENCE, scale=0.7).sum() for x in pair]
    assert difference(PRIORS[0], *pair) == pytest.approx(expected[0] - expected[1], rel=1e-5)


def test_the_walk_prior_is_the_density_of_its_increments(pair: tuple[np.ndarray, np.ndarray]) -> None:
    def expected(x: np.ndarray) -> float:
        off = x - REFERENCE
        return float(norm.logpdf(off[0], scale=0.8).sum() + norm.logpdf(np.diff(off, axis=0), scale=0.3).sum())

    assert difference(PRIORS[3], *pair) == pytest.approx(expected(pair[0]) - expected(pair[1]), rel=1e-5)


def test_the_offset_prior_is_the_integral_over_its_hyper_prior(pair: tuple[np.ndarray, np.ndarray]) -> None:
    def by_quadrature(x: np.ndarray) -> float:
        off = x - REFERENCE
        total = 0.0
        for axis in range(2):
            density = quad(
                lambda offset, axis=axis: np.prod(norm.pdf(off[:, axis], offset, 0.4)) * norm.pdf(offset, 0.0, 0.9),
                -9,
                9,
            )[0]
            total += np.log(density)
        return total

    assert difference(PRIORS[1], *pair) == pytest.approx(by_quadrature(pair[0]) - by_quadrature(pair[1]), rel=1e-5)


def test_the_scale_prior_is_the_integral_over_its_hyper_prior(pair: tuple[np.ndarray, np.ndarray]) -> None:
    def by_quadrature(x: np.ndarray) -> float:
        off = (x - REFERENCE).ravel()
        density = quad(
            lambda v: np.prod(norm.pdf(off, 0.0, np.sqrt(v))) * invgamma.pdf(v, 3.0, scale=0.8), 0.0, 40.0, limit=400
        )[0]
        return float(np.log(density))

    assert difference(PRIORS[2], *pair) == pytest.approx(by_quadrature(pair[0]) - by_quadrature(pair[1]), rel=1e-4)


@pytest.mark.parametrize("prior", PRIORS, ids=names)
def test_samples_have_the_covariance_of_the_density(prior: Prior) -> None:
    keys = jax.random.split(jax.random.key(0), 40_000)
    drawn = np.asarray(jax.jit(jax.vmap(lambda key: prior.sample(key, (5, 2))))(keys)) - REFERENCE
    first = drawn[:, :, 0]
    index = np.arange(5)
    match prior:
        case GaussianPrior():
            expected = 0.49 * np.eye(5)
        case OffsetPrior():
            expected = 0.16 * np.eye(5) + 0.81
        case ScalePrior():
            expected = 0.8 / 2.0 * np.eye(5)
        case WalkPrior():
            expected = 0.64 + 0.09 * np.minimum(index[:, None], index[None, :])
    np.testing.assert_allclose(np.cov(first.T), expected, atol=0.04)
    np.testing.assert_allclose(first.mean(axis=0), 0.0, atol=0.03)
    if not isinstance(prior, ScalePrior):
        density = multivariate_normal(np.zeros(5), expected)
        x = REFERENCE.copy()
        x[2, 0] += 1.0
        assert difference(prior, x, REFERENCE) == pytest.approx(
            density.logpdf(np.eye(5)[2]) - density.logpdf(np.zeros(5)), rel=1e-5
        )


def test_a_steady_turn_costs_little_under_an_offset_prior_and_jitter_costs_as_ever() -> None:
    plain, hierarchical = GaussianPrior(0.3), OffsetPrior(0.3, 1.0)
    steady, jitter = np.full((20, 1), 0.8), 0.8 * (-1.0) ** np.arange(20)[:, None]
    rest = np.zeros((20, 1))
    assert difference(hierarchical, steady, rest) > 0.1 * difference(plain, steady, rest)
    assert difference(hierarchical, jitter, rest) == pytest.approx(difference(plain, jitter, rest), rel=1e-4)
