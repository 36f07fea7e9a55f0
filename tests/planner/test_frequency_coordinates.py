"""The polish's coordinates: what moves a path by its gradient there descends on the path."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.fft

from planner.frequency_coordinates import FrequencyCoordinates

KNOTS = 12
SCALE = jnp.asarray(np.linspace(1.0, 0.1, KNOTS)[:, None] * np.ones(3), jnp.float32)


def coordinates() -> FrequencyCoordinates:
    cosines = scipy.fft.idct(np.eye(KNOTS), norm="ortho", axis=0)
    return FrequencyCoordinates(jnp.asarray(cosines, jnp.float32), SCALE)


def test_the_gradient_is_that_of_the_moved_path() -> None:
    rng = np.random.default_rng(0)
    y, aim = rng.normal(size=(2, 4, KNOTS, 3))

    def loss(y: jax.Array) -> jax.Array:
        return jnp.sum((coordinates().move(y) - aim) ** 2)

    by_knot = 2.0 * (coordinates().move(jnp.asarray(y)) - aim)
    np.testing.assert_allclose(coordinates().gradient(by_knot), jax.grad(loss)(jnp.asarray(y)), rtol=1e-4, atol=1e-4)


def test_a_unit_moves_a_path_as_far_as_its_scale_says() -> None:
    for frequency in (0, 3, KNOTS - 1):
        y = jnp.zeros((KNOTS, 3)).at[frequency, 1].set(1.0)
        assert float(jnp.linalg.norm(coordinates().move(y))) == pytest.approx(float(SCALE[frequency, 1]), rel=1e-4)
