"""The signature kernel against Bessel functions, truncated signatures and finite differences on rough paths."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import signax
from scipy.special import i0, j0

from planner import signature_kernel as module
from planner.signature_kernel import MOST_KNOTS, goursat, static_kernel_of, window_means
from tests.planner.finite_differences import numeric_gradient

signature_kernel = jax.jit(module.signature_kernel, static_argnames=("bandwidth", "dyadic_order"))
signature_terms = jax.jit(module.signature_terms)


def segment(*direction: float) -> jax.Array:
    return jnp.asarray([np.zeros(len(direction)), direction], jnp.float32)


def rough(count: int, knots: int, seed: int = 0, step: float = 0.3) -> np.ndarray:
    """Random walks: as rough as a path of knots can be."""
    return np.cumsum(step * np.random.default_rng(seed).normal(size=(count, knots, 3)), axis=1)


def spread(paths: np.ndarray) -> float:
    """Root mean square distance of a set from its mean."""
    return float(np.sqrt(np.mean(np.sum((paths - paths.mean(axis=0)) ** 2, axis=-1))))


@pytest.mark.parametrize(("other", "expected"), [((1.0, 0.0), i0(2.0)), ((-1.0, 0.0), j0(2.0)), ((0.0, 1.0), 1.0)])
def test_two_straight_segments_give_the_bessel_functions(other: tuple[float, float], expected: float) -> None:
    found = signature_kernel(segment(1.0, 0.0), segment(*other), dyadic_order=6)
    assert float(found) == pytest.approx(expected, abs=2e-4)


def test_the_reference_figures_are_met() -> None:
    assert i0(2.0) == pytest.approx(2.27958530, abs=1e-8)
    assert j0(2.0) == pytest.approx(0.22389078, abs=1e-8)


def test_the_error_falls_by_four_with_each_refinement() -> None:
    with jax.enable_x64(True):
        delta = jnp.asarray([[2.0]])
        found = [jax.jit(goursat, static_argnums=1)(delta, order) for order in (4, 5, 6)]
    errors = [abs(float(value) - i0(2.0 * np.sqrt(2.0))) for value in found]
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.06)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.04)


def test_paths_of_different_lengths_give_the_inner_product_of_their_signatures() -> None:
    one, other = rough(1, 6, 1)[0], rough(1, 9, 2)[0]
    depth = 9
    signatures = [signax.signature(jnp.asarray(path, jnp.float32), depth) for path in (one, other)]
    expected = 1.0 + float(jnp.dot(*signatures))
    found = float(signature_kernel(jnp.asarray(one), jnp.asarray(other), dyadic_order=4))
    assert found == pytest.approx(expected, rel=2e-3)


def test_another_pace_and_a_moved_path_are_the_same_path() -> None:
    path = rough(1, 8)[0]
    halves = np.concatenate([path, 0.5 * (path[1:] + path[:-1])])
    slow = np.stack([p for pair in zip(path[:-1], halves[len(path) :], strict=True) for p in pair] + [path[-1]])
    other = jnp.asarray(rough(1, 7, 3)[0])
    plain = float(signature_kernel(jnp.asarray(path), other, dyadic_order=4))
    assert float(signature_kernel(jnp.asarray(slow), other, dyadic_order=4)) == pytest.approx(plain, rel=1e-3)
    assert float(signature_kernel(jnp.asarray(path + 5.0), other, dyadic_order=4)) == pytest.approx(plain, rel=1e-3)


def test_the_gradient_on_a_rough_path_equals_finite_differences() -> None:
    with jax.enable_x64(True):
        one, other = (jnp.asarray(path) for path in rough(2, 12, 5))

        def value(x: jax.Array) -> jax.Array:
            return module.signature_kernel(x, other, bandwidth=0.7, scale=1.3, dyadic_order=1)

        gradient = np.asarray(jax.jit(jax.grad(value))(one)).ravel()
        np.testing.assert_allclose(gradient, numeric_gradient(value, one), rtol=1e-5, atol=1e-8)


def test_the_repulsion_between_rough_paths_equals_finite_differences_of_the_kernel() -> None:
    with jax.enable_x64(True):
        paths = jnp.asarray(rough(3, 10, 7, step=0.1))
        bandwidth, scale = static_kernel_of(paths)
        gram, repulsion = signature_terms(paths)

        def raw(one: jax.Array, other: jax.Array) -> jax.Array:
            return module.signature_kernel(one, other, bandwidth=bandwidth, scale=scale)

        def squared(one: jax.Array, fixed: jax.Array) -> jax.Array:
            return 2.0 - 2.0 * raw(one, fixed) / jnp.sqrt(raw(one, one) * raw(fixed, fixed))

        measured = jax.jit(squared)
        width = np.median([float(measured(paths[i], paths[j])) for i, j in ((0, 1), (0, 2), (1, 2))]) / np.log(4.0)

        def summed(moved: jax.Array, fixed: jax.Array) -> jax.Array:
            return jnp.sum(jnp.stack([jnp.exp(-squared(one, fixed) / width) for one in moved]))

        assert float(gram[0, 1]) == pytest.approx(float(jax.jit(summed)(paths[:1], paths[1])), rel=1e-9)
        size = int(np.prod(paths.shape[1:]))
        shifts = 1e-6 * np.eye(size).reshape(size, *paths.shape[1:])
        sums = jax.jit(jax.vmap(summed, in_axes=(0, None)))
        for particle in range(3):
            above = sums(paths + shifts[:, None], paths[particle])
            below = sums(paths - shifts[:, None], paths[particle])
            numeric = (above - below) / 2e-6
            np.testing.assert_allclose(np.asarray(repulsion[particle]).ravel(), numeric, rtol=1e-5, atol=1e-7)


def test_nearly_alike_paths_are_told_apart_as_well_as_unlike_ones() -> None:
    time = np.linspace(0.0, 1.0, 24)[:, None]
    bows = np.sin(np.pi * time) * np.random.default_rng(3).normal(size=(12, 1, 3))
    line = 0.1 + 0.8 * time * np.ones(3)
    for height in (0.02, 0.1, 0.3):
        gram, repulsion = signature_terms(jnp.asarray(line + height * bows, jnp.float32))
        # Each candidate weighs as much as all others: neither the mean of all scores nor none but its own.
        assert np.median(np.asarray(gram)[np.triu_indices(12, k=1)]) == pytest.approx(1.0 / 13.0, rel=1e-2)
        away = np.asarray(repulsion) / np.abs(repulsion).max()
        assert spread(line + height * bows + 0.1 * height * away) > spread(line + height * bows)


def test_candidates_are_normalised_and_their_gram_matrix_is_positive() -> None:
    time = np.linspace(0.0, 1.0, 120)
    rng = np.random.default_rng(0)
    waves = rng.normal(size=(10, 5, 3))
    modes = np.cos(np.pi * np.arange(1, 6)[:, None] * time)
    paths = 0.5 + 0.15 * np.einsum("nmd,mt->ntd", waves, modes)
    gram, repulsion = signature_terms(jnp.asarray(paths, jnp.float32))
    np.testing.assert_allclose(np.diag(gram), 1.0, rtol=1e-5)
    assert np.linalg.eigvalsh(np.asarray(gram, float)).min() > 0.0
    off = np.asarray(gram)[np.triu_indices(10, k=1)]
    assert 0.02 < np.median(off) < 0.5
    assert repulsion.shape == paths.shape


def test_a_path_against_its_way_back_is_unlike_and_against_a_copy_alike() -> None:
    path = rough(1, 20, 4, step=0.05)[0] + 0.5
    gram, _ = signature_terms(jnp.asarray(np.stack([path, path[::-1], path + 1e-3]), jnp.float32))
    assert float(gram[0, 1]) < 0.5
    assert float(gram[0, 2]) > 0.99


def test_windows_average_and_keep_the_mean() -> None:
    np.testing.assert_array_equal(window_means(7, MOST_KNOTS), np.eye(7))
    windows = window_means(100, MOST_KNOTS)
    assert windows.shape == (MOST_KNOTS, 100)
    np.testing.assert_allclose(windows.sum(axis=1), 1.0, rtol=1e-6)
    np.testing.assert_allclose(windows.mean(axis=0), 0.01, rtol=1e-5)


def test_paths_that_stand_still_are_alike_and_finite() -> None:
    gram, repulsion = signature_terms(jnp.full((3, 12, 3), 0.5))
    np.testing.assert_allclose(gram, 1.0)
    assert np.isfinite(repulsion).all()


def test_a_path_of_one_knot_is_refused() -> None:
    with pytest.raises(ValueError, match="two knots or more"):
        signature_kernel(jnp.zeros((1, 3)), jnp.zeros((4, 3)))
