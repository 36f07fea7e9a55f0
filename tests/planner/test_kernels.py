"""Every kernel against autodiff of its definition, written out pair by pair."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner import kernels
from planner.bandwidth import median_bandwidth
from planner.problem import Kernel

kernel_terms = jax.jit(kernels.kernel_terms, static_argnums=0)

Pairwise = Callable[[jax.Array, jax.Array], jax.Array]


def candidates(count: int, knots: int, seed: int = 0) -> jax.Array:
    return jnp.asarray(np.random.default_rng(seed).uniform(size=(count, knots, 3)), jnp.float32)


def by_definition(kernel: Pairwise, particles: jax.Array) -> tuple[np.ndarray, np.ndarray]:
    """The Gram matrix and Σ_i ∇_{x_i} k(x_i, x_j), by autodiff."""

    @jax.jit
    def every_pair(x: jax.Array) -> tuple[jax.Array, jax.Array]:
        gradient = jax.value_and_grad(kernel)
        return jax.vmap(lambda one: jax.vmap(lambda other: gradient(one, other))(x))(x)

    gram, gradient = every_pair(particles)
    return np.asarray(gram), np.asarray(gradient.sum(axis=0))


def median_of(squared: np.ndarray, count: int) -> float:
    return float(np.median(squared)) / np.log(count + 1)


def rbf(particles: jax.Array) -> Pairwise:
    count = len(particles)
    flat = np.asarray(particles, float).reshape(count, -1)
    squared = [np.sum((flat[i] - flat[j]) ** 2) for i in range(count) for j in range(i)]
    bandwidth = median_of(np.array(squared), count)
    return lambda one, other: jnp.exp(-jnp.sum((one - other) ** 2) / bandwidth)


def markov(particles: jax.Array, reach: int) -> Pairwise:
    count, knots, _ = particles.shape
    assert knots <= 16, "with more knots the bandwidth is taken from some of them only"
    points = np.asarray(particles, float)
    squared = [np.sum((points[i] - points[j]) ** 2, axis=-1) for i in range(count) for j in range(i)]
    bandwidth = median_of(np.concatenate(squared), count)
    times = np.arange(knots)
    linked = np.abs(times[:, None] - times[None, :]) <= reach

    def kernel(one: jax.Array, other: jax.Array) -> jax.Array:
        squared = jnp.sum((one[:, None] - other[None]) ** 2, axis=-1)
        return jnp.sum(jnp.where(linked, jnp.exp(-squared / bandwidth), 0.0)) / linked.sum()

    return kernel


@pytest.mark.parametrize(
    ("kernel", "definition"),
    [
        (Kernel.RBF, rbf),
        (Kernel.MARKOV, lambda particles: markov(particles, 1)),
        (Kernel.MARKOV_COMPLETE, lambda particles: markov(particles, 99)),
    ],
)
@pytest.mark.parametrize(("count", "knots"), [(2, 5), (5, 8), (3, 1), (11, 4)])
def test_gram_and_repulsion_are_the_definitions(kernel: Kernel, definition, count: int, knots: int) -> None:
    particles = candidates(count, knots)
    gram, repulsion = kernel_terms(kernel, particles)
    expected_gram, expected_repulsion = by_definition(definition(particles), particles)
    np.testing.assert_allclose(gram, expected_gram, rtol=2e-5, atol=1e-7)
    np.testing.assert_allclose(repulsion, expected_repulsion, rtol=1e-4, atol=2e-5 * np.abs(expected_repulsion).max())


def test_the_identity_lets_each_descend_alone_and_the_constant_shares_everything() -> None:
    particles = candidates(4, 6)
    gram, repulsion = kernel_terms(Kernel.IDENTITY, particles)
    np.testing.assert_array_equal(gram, np.eye(4))
    np.testing.assert_array_equal(repulsion, np.zeros((4, 6, 3)))
    gram, repulsion = kernel_terms(Kernel.CONSTANT, particles)
    np.testing.assert_array_equal(gram, np.ones((4, 4)))
    np.testing.assert_array_equal(repulsion, np.zeros((4, 6, 3)))


@pytest.mark.parametrize("kernel", list(Kernel))
def test_one_candidate_alone_is_not_repelled(kernel: Kernel) -> None:
    gram, repulsion = kernel_terms(kernel, candidates(1, 7))
    assert gram.shape == (1, 1)
    assert float(gram[0, 0]) > 0.0
    # The neighbours of a Markov kernel belong to the path itself: they spread its own points.
    if kernel not in (Kernel.MARKOV, Kernel.MARKOV_COMPLETE):
        np.testing.assert_allclose(repulsion, 0.0, atol=1e-6)
    assert np.isfinite(repulsion).all()


@pytest.mark.parametrize("kernel", list(Kernel))
def test_coincident_candidates_stay_finite_and_alike(kernel: Kernel) -> None:
    particles = jnp.repeat(candidates(1, 40), 4, axis=0)
    gram, repulsion = kernel_terms(kernel, particles)
    assert np.isfinite(gram).all()
    assert np.isfinite(repulsion).all()
    if kernel is not Kernel.IDENTITY:
        np.testing.assert_allclose(gram, np.full((4, 4), gram[0, 0]), rtol=1e-4)


@pytest.mark.parametrize("kernel", [Kernel.RBF, Kernel.MARKOV, Kernel.MARKOV_COMPLETE, Kernel.SIGNATURE])
def test_repulsion_drives_two_close_candidates_apart(kernel: Kernel) -> None:
    time = np.linspace(0.0, 1.0, 30)
    path = np.stack([0.2 + 0.6 * time, 0.5 + 0.2 * np.sin(6.0 * time), np.full(30, 0.5)], axis=-1)
    bumped = path + 0.02 * np.sin(9.0 * time)[:, None] * np.array([0.0, 1.0, 0.5])
    far = path[:, [2, 0, 1]]
    particles = jnp.asarray(np.stack([path, bumped, far]), jnp.float32)
    gram, repulsion = kernel_terms(kernel, particles)
    moved = particles + 1e-3 * repulsion / jnp.abs(repulsion).max()
    gap = np.linalg.norm(particles[0] - particles[1])
    assert np.linalg.norm(moved[0] - moved[1]) > gap
    assert float(gram[0, 1]) > float(gram[0, 2])


@pytest.mark.parametrize("kernel", [Kernel.RBF, Kernel.MARKOV, Kernel.MARKOV_COMPLETE])
def test_the_gram_matrix_is_symmetric_and_positive(kernel: Kernel) -> None:
    gram = np.asarray(kernel_terms(kernel, candidates(9, 20))[0], float)
    np.testing.assert_allclose(gram, gram.T, atol=1e-6)
    assert np.linalg.eigvalsh(gram).min() > -1e-6


@pytest.mark.parametrize("count", [4, 12])
def test_a_set_far_from_the_origin_keeps_its_small_differences(count: int) -> None:
    close = 0.9 + 1e-3 * candidates(count, 50)
    near, _ = kernel_terms(Kernel.RBF, close)
    around_zero, _ = kernel_terms(Kernel.RBF, close - 0.9)
    np.testing.assert_allclose(near, around_zero, atol=2e-3)


def test_the_bandwidth_of_many_candidates_is_told_by_some_of_their_pairs() -> None:
    points = np.random.default_rng(4).normal(size=(300, 5))
    squared = ((points[:, None] - points) ** 2).sum(-1)
    pairs = squared[np.triu_indices(300, k=1)]
    assert float(median_bandwidth(jnp.asarray(squared, jnp.float32), 1e-3)) == pytest.approx(
        np.median(pairs) / np.log(301.0), rel=0.03
    )


def test_the_median_bandwidth_has_a_floor_and_no_gradient() -> None:
    assert float(median_bandwidth(jnp.zeros((3, 3)), 1e-3)) == pytest.approx(1e-3)
    squared = jnp.asarray([[0.0, 4.0], [4.0, 0.0]])
    assert float(median_bandwidth(squared, 1e-3)) == pytest.approx(4.0 / np.log(3.0))
    np.testing.assert_array_equal(jax.grad(lambda value: median_bandwidth(value, 1e-3))(squared), np.zeros((2, 2)))


def test_large_sets_compile_without_an_array_of_all_pairs_and_axes() -> None:
    particles = jax.ShapeDtypeStruct((64, 300, 3), jnp.float32)
    for kernel in (Kernel.RBF, Kernel.MARKOV, Kernel.SIGNATURE):
        compiled = jax.jit(lambda x, kernel=kernel: kernel_terms(kernel, x)).lower(particles).compile()
        memory = compiled.memory_analysis()
        assert memory.temp_size_in_bytes < 80e6, kernel
