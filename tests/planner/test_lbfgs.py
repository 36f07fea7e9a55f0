"""L-BFGS against closed forms and scipy."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import rosen

from planner import lbfgs


def run(objective, start, steps):
    value_and_gradient = jax.value_and_grad(objective)

    def body(state, _):
        state, info = lbfgs.step(value_and_gradient, state)
        return state, (state.value, info.accepted)

    state = lbfgs.init(start, 0.1)
    return jax.jit(lambda state: jax.lax.scan(body, state, None, length=steps))(state)


def test_the_first_step_looks_at_the_start_and_the_second_moves_by_the_length_asked_for() -> None:
    start = jnp.array([3.0, 4.0])
    looked, _ = run(lambda x: 0.5 * jnp.sum(x**2), start, 1)
    np.testing.assert_array_equal(looked.position, start)
    assert float(looked.value) == 12.5
    assert float(looked.curvature.max()) == 0.0
    moved, _ = run(lambda x: 0.5 * jnp.sum(x**2), start, 2)
    np.testing.assert_allclose(moved.position, start * (1.0 - 0.1 / 5.0), rtol=1e-6)
    assert int(moved.refused) == 0


def test_a_quadratic_is_minimised_to_its_closed_form() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(20, 20))
    matrix = jnp.asarray(root @ root.T + np.eye(20), jnp.float32)
    target = jnp.asarray(rng.normal(size=20), jnp.float32)
    state, _ = run(lambda x: 0.5 * x @ matrix @ x - target @ x, jnp.zeros(20), 120)
    np.testing.assert_allclose(state.position, np.linalg.solve(matrix, target), atol=2e-3)


def test_rosenbrocks_valley_is_followed_to_its_end() -> None:
    def valley(x: jax.Array) -> jax.Array:
        return jnp.sum(100.0 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2)

    state, _ = run(valley, jnp.full(6, -0.5), 400)
    assert rosen(np.asarray(state.position)) < 1e-4


def test_the_value_never_rises_and_every_member_of_a_batch_moves_at_its_own_pace() -> None:
    def bowl(x: jax.Array) -> jax.Array:
        return jnp.sum(jnp.cosh(jnp.arange(1.0, 5.0) * x))

    starts = jnp.stack([jnp.full(4, 0.1), jnp.full(4, 2.0)])
    state, (values, _) = jax.vmap(lambda start: run(bowl, start, 60))(starts)
    assert (jnp.diff(values, axis=1) <= 1e-5 * values[:, :-1]).all()
    np.testing.assert_allclose(state.value, 4.0, rtol=1e-5)


@pytest.mark.filterwarnings("ignore:overflow")
def test_a_region_without_finite_values_is_stepped_back_from() -> None:
    def walled(x: jax.Array) -> jax.Array:
        return jnp.sum(x**2 - jnp.log(1.0 - x))

    state, _ = run(walled, jnp.full(3, 0.99), 60)
    assert jnp.isfinite(state.position).all()
    gradient = jax.grad(walled)(state.position)
    assert float(jnp.abs(gradient).max()) < 1e-2
