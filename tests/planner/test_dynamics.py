"""Vehicles against an ODE solver, closed forms and their own limits."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from planner.dynamics import (
    Aircraft,
    DoubleIntegrator,
    DubinsCar,
    Dynamics,
    Multirotor,
    SingleIntegrator,
    position_of,
    rollout,
)
from tests.planner.finite_differences import numeric_gradient

AIRCRAFT = Aircraft(8.0, 15.0, 0.4, 0.3, 0.5)
MULTIROTOR = Multirotor(6.0, 2.0, 1.0, 3.0, 0.8)
CASES: list[tuple[Dynamics, np.ndarray]] = [
    (SingleIntegrator(5.0, 2.0, 1.0), np.array([1.0, 2.0, 3.0])),
    (DoubleIntegrator(3.0), np.array([1.0, 2.0, 3.0, 0.5, -0.2, 0.1])),
    (DubinsCar(10.0, 20.0), np.array([1.0, 2.0, 3.0, 0.7])),
    (AIRCRAFT, np.array([1.0, 2.0, 3.0, 0.1, 0.7])),
    (MULTIROTOR, np.array([1.0, 2.0, 3.0, 0.5, -0.2, 0.1, 0.3])),
]
names = [type(case[0]).__name__ for case in CASES]


def rate(dynamics: Dynamics, state: np.ndarray, control: np.ndarray) -> np.ndarray:
    """The equations of motion, without limits."""
    match dynamics:
        case SingleIntegrator():
            return control
        case DoubleIntegrator():
            return np.r_[state[3:], control]
        case DubinsCar():
            return np.r_[10.0 * np.cos(state[3]), 10.0 * np.sin(state[3]), 0.0, control]
        case Aircraft():
            path, heading = state[3:]
            forward = [np.cos(heading) * np.cos(path), np.sin(heading) * np.cos(path), np.sin(path)]
            return np.r_[control[0] * np.array(forward), control[1:]]
        case Multirotor():
            return np.r_[state[3:6], control]


@pytest.mark.parametrize(("dynamics", "state"), CASES, ids=names)
def test_steps_solve_the_equations_of_motion(dynamics: Dynamics, state: np.ndarray) -> None:
    low, high = dynamics.control_low, dynamics.control_high
    control = 0.5 * (low + high) + 0.2 * (high - low) * np.array([1.0, -0.5, 0.7, 0.9])[: len(low)]
    duration = 0.1
    truth = solve_ivp(lambda _, x: rate(dynamics, x, control), (0.0, duration), state, rtol=1e-10, atol=1e-12).y[:, -1]
    found = dynamics.step(jnp.asarray(state), jnp.asarray(control), duration)
    np.testing.assert_allclose(found, truth, atol=2e-4 if dynamics is AIRCRAFT else 2e-6)


def test_the_aircraft_is_second_order_in_its_step() -> None:
    with jax.enable_x64(True):
        state, control = np.array([0.0, 0.0, 0.0, 0.1, 0.7]), np.array([10.0, 0.2, 0.45])
        truth = solve_ivp(lambda _, x: rate(AIRCRAFT, x, control), (0.0, 0.8), state, rtol=1e-12, atol=1e-13).y[:, -1]
        errors = []
        for steps in (2, 4, 8):
            controls = jnp.tile(jnp.asarray(control), (steps, 1))
            end = rollout(AIRCRAFT, jnp.asarray(state), controls, 0.8 / steps)[-1]
            errors.append(float(np.linalg.norm(np.asarray(end) - truth)))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.05)


def test_a_full_turn_of_the_dubins_car_closes_its_circle() -> None:
    car = DubinsCar(10.0, 20.0)
    steps = 36
    duration = 2.0 * np.pi * 20.0 / 10.0 / steps
    states = np.asarray(rollout(car, jnp.asarray([5.0, 5.0, 30.0, 0.0]), jnp.full((steps, 1), 99.0), duration))
    np.testing.assert_allclose(states[-1, :3], [5.0, 5.0, 30.0], atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(states[:, :2] - [5.0, 25.0], axis=1), 20.0, atol=1e-3)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_a_multirotor_asked_for_anything_keeps_every_limit(seed: int) -> None:
    generator = np.random.default_rng(seed)
    controls = jnp.asarray(generator.normal(scale=10.0, size=(60, 4)), jnp.float32)
    start = jnp.asarray([0.0, 0.0, 0.0, 1.0, 0.5, -0.5, 0.0])
    duration = 0.2
    states = np.asarray(_multirotor(start, controls, duration), float)
    velocity, yaw = states[:, 3:6], states[:, 6]
    assert np.linalg.norm(velocity, axis=1).max() <= 6.0 * (1.0 + 1e-5)
    assert velocity[:, 2].max() <= 2.0 + 1e-5
    assert velocity[:, 2].min() >= -1.0 - 1e-5
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() / duration <= 3.0 * (1.0 + 1e-4)
    assert np.abs(np.diff(yaw)).max() / duration <= 0.8 * (1.0 + 1e-4)


_multirotor = jax.jit(lambda start, controls, duration: rollout(MULTIROTOR, start, controls, duration))


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10_000))
def test_an_aircraft_asked_for_anything_keeps_every_limit(seed: int) -> None:
    generator = np.random.default_rng(seed)
    controls = jnp.asarray(generator.normal(scale=20.0, size=(50, 3)), jnp.float32)
    states = np.asarray(_aircraft(jnp.zeros(5), controls), float)
    speed = np.linalg.norm(np.diff(states[:, :3], axis=0), axis=1) / 0.1
    assert speed.max() <= 15.0 * (1.0 + 1e-4)
    assert speed.min() >= 8.0 * (1.0 - 1e-4)
    assert np.abs(states[:, 3]).max() <= 0.4 + 1e-6
    assert np.abs(np.diff(states[:, 4])).max() <= 0.1 * 0.5 * (1.0 + 1e-4)


_aircraft = jax.jit(lambda start, controls: rollout(AIRCRAFT, start, controls, 0.1))


@pytest.mark.parametrize(
    "wanted", [[9.0, 1.0, 0.5], [9.0, 0.0, 9.0], [0.2, 0.1, 3.0], [1.0, 1.0, 0.3], [2.0, 1.0, -9.0]]
)
def test_the_velocity_flown_is_the_nearest_one_allowed(wanted: list[float]) -> None:
    vehicle = SingleIntegrator(5.0, 2.0, 1.0)
    found = np.asarray(vehicle.step(jnp.zeros(3), jnp.asarray(wanted), 1.0))
    truth = minimize(
        lambda v: float(np.sum((v - wanted) ** 2)),
        np.array([0.1, 0.1, 0.1]),
        jac=lambda v: 2.0 * (v - wanted),
        bounds=[(-9.0, 9.0), (-9.0, 9.0), (-1.0, 2.0)],
        constraints=[{"type": "ineq", "fun": lambda v: 25.0 - v @ v, "jac": lambda v: -2.0 * v}],
        method="SLSQP",
        options={"ftol": 1e-12},
    ).x
    np.testing.assert_allclose(found, truth, atol=1e-4)


@pytest.mark.parametrize(("dynamics", "state"), CASES, ids=names)
def test_gradients_are_finite_at_rest_and_far_beyond_every_limit(dynamics: Dynamics, state: np.ndarray) -> None:
    size = len(dynamics.control_low)
    for controls in (jnp.zeros((10, size)), jnp.full((10, size), 1e3)):
        at_rest = jnp.asarray(np.where(np.arange(len(state)) < 3, state, 0.0), jnp.float32)
        gradient = jax.grad(lambda u, start: jnp.sum(position_of(rollout(dynamics, start, u, 0.1)) ** 2))
        assert np.isfinite(gradient(controls, at_rest)).all()


def test_the_gradient_through_a_rollout_equals_finite_differences() -> None:
    with jax.enable_x64(True):
        controls = jnp.asarray(np.random.default_rng(0).normal(scale=2.0, size=(8, 4)))
        start = jnp.asarray(CASES[-1][1])

        def value(flat: jax.Array) -> jax.Array:
            return jnp.sum(jnp.sin(rollout(MULTIROTOR, start, flat.reshape(8, 4), 0.3)))

        flat = controls.ravel()
        np.testing.assert_allclose(jax.grad(value)(flat), numeric_gradient(value, flat), rtol=1e-6, atol=1e-7)


def test_limits_that_make_no_vehicle_are_refused() -> None:
    with pytest.raises(ValueError, match="max_climb_mps must be positive"):
        SingleIntegrator(5.0, 0.0, 1.0)
    with pytest.raises(ValueError, match="above max_speed_mps"):
        Aircraft(9.0, 8.0, 0.3, 0.3, 0.3)
