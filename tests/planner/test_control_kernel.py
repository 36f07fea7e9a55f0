"""Receding-horizon control under the kernel metric: the same memory, in the splines of its density."""

import dataclasses
import functools

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from planner import control
from planner.control import ControlInfo, ControlState, ControlTask
from planner.dynamics import Multirotor
from planner.information import DensityGrid, gaussians
from planner.kernel_metric import KernelMetric, kernel_metric, pose_metric
from planner.obstacles import ObstacleField, Sphere
from planner.priors import GaussianPrior
from planner.problem import Covered, MetricWeights
from planner.spectral_metric import SpectralMetric
from planner.workspace import Workspace
from tests.planner.compiled import value_and_slope_of, value_of
from tests.planner.finite_differences import numeric_gradient

WORKSPACE = Workspace(np.array([0.0, 0.0, 0.0]), np.array([100.0, 100.0, 40.0]))
PLACES = np.array([[25.0, 50.0, 20.0], [75.0, 50.0, 20.0]])
STD_M = np.array([8.0, 12.0, 6.0])
VARIANCE = np.array([3e-3, 4e-3, 8e-3])
CENTER, RADIUS, KEEP_OUT = np.array([50.0, 50.0, 20.0]), 12.0, 1.5
START = (10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0)
PERIOD, CANDIDATES, HORIZON, STEPS = 0.5, 8, 20, 100


def places(*middles: np.ndarray, std_m: np.ndarray = STD_M) -> DensityGrid:
    return gaussians(
        WORKSPACE, np.array(middles), np.tile(std_m, (len(middles), 1)), np.ones(len(middles)), (64, 64, 48)
    )


@functools.cache
def metric() -> KernelMetric:
    return kernel_metric(places(*PLACES), variance_unit2=VARIANCE)


def task_of(wanted: KernelMetric) -> ControlTask:
    return ControlTask.of(
        WORKSPACE,
        wanted,
        Multirotor(8.0, 3.0, 2.0, 4.0, 0.8),
        GaussianPrior(1.0),
        obstacles=ObstacleField.of([Sphere(CENTER, RADIUS)]),
        keep_out_m=KEEP_OUT,
        control_s=PERIOD,
        iterations=10,
    )


def normal(points: np.ndarray, center: np.ndarray, variance: np.ndarray) -> np.ndarray:
    return np.asarray(multivariate_normal.pdf(points, center, np.diag(variance)))


def double_loop(points: np.ndarray, middles: np.ndarray = PLACES, std_m: np.ndarray = STD_M) -> float:
    """E of equally long moments, unit cube, by two nested sums; normal densities blur each other in closed form."""
    count, spread = len(points), (std_m / WORKSPACE.lengths_m) ** 2
    means = middles / WORKSPACE.lengths_m
    total = 0.0
    for one in means:
        total += sum(float(normal(other, one, 2.0 * spread + VARIANCE)) for other in means) / len(means) ** 2
        total -= 2.0 * float(normal(points, one, spread + VARIANCE).mean()) / len(means)
    for one in points:
        for other in points:
            total += float(normal(one, other, VARIANCE)) / count**2
    return total


def own_share(points: np.ndarray) -> float:
    """What of E is the path's own repulsion: the measure of what rounding and splines may cost."""
    return float(np.mean([normal(points, one, VARIANCE).mean() for one in points]))


def wandering(count: int, seed: int) -> np.ndarray:
    """A smooth path through the middle of the cube."""
    phase = 2.0 * np.pi * np.random.default_rng(seed).uniform(size=3)
    return 0.5 + 0.35 * np.sin(np.linspace(0.0, 4.0, count)[:, None] * np.array([1.0, 1.7, 2.3]) + phase)


@eqx.filter_jit
def with_covered(wanted: KernelMetric, past: jax.Array, share: float) -> KernelMetric:
    return wanted.with_covered(jnp.mean(jax.vmap(wanted.basis)(past), axis=0), jnp.asarray(share))


def remembering(wanted: KernelMetric, past: np.ndarray, share: float) -> KernelMetric:
    return with_covered(wanted, past.astype(wanted.variance.dtype), share)


@functools.cache
def flight(remembers: bool = True) -> tuple[np.ndarray, list[ControlInfo], ControlState]:
    task, key = task_of(metric()), jax.random.key(0)
    state, vehicle = control.init(task, key, CANDIDATES, HORIZON), jnp.asarray(START)
    states, infos = [np.asarray(vehicle)], []
    move = jax.jit(lambda x, u: task.dynamics.step(x, u, PERIOD))
    for index in range(STEPS):
        state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
        if not remembers:
            state = dataclasses.replace(
                state, basis_sum=jnp.zeros_like(state.basis_sum), moments=jnp.ones((), jnp.int32)
            )
        vehicle = move(vehicle, info.control)
        states.append(np.asarray(vehicle))
        infos.append(info)
    return np.array(states), infos, state


def test_with_memory_the_metric_is_the_double_sum_over_the_whole_flight() -> None:
    past, ahead = wandering(60, 0), wandering(20, 1)
    whole = np.concatenate([past, ahead])
    remembered = remembering(metric(), past, 0.75)
    found = float(value_of(remembered, ahead, np.full(20, 1.0 / 20.0)))
    assert found == pytest.approx(double_loop(whole), abs=3e-3 * own_share(whole))
    assert abs(double_loop(whole) - double_loop(ahead)) > 0.1 * own_share(whole)


def test_the_gradient_with_memory_equals_finite_differences() -> None:
    with jax.enable_x64(True):
        built: KernelMetric = jax.tree.map(lambda leaf: leaf.astype(jnp.float64), metric())
        remembered = remembering(built, wandering(60, 0), 0.75)
        ahead, weight = jnp.asarray(wandering(8, 1)), jnp.full(8, 1.0 / 8.0)
        gradient = np.asarray(value_and_slope_of(remembered, ahead, weight)[1]).ravel()
        numeric = numeric_gradient(lambda x: remembered(x, weight), ahead)
        np.testing.assert_allclose(gradient, numeric, rtol=1e-5, atol=1e-6 * np.abs(gradient).max())


def test_a_flight_in_two_halves_is_the_flight_in_one() -> None:
    first, second = wandering(40, 2), wandering(40, 3)
    whole = np.concatenate([first, second])
    at_once, slope = value_and_slope_of(metric(), whole, np.full(80, 1.0 / 80.0))
    remembered = remembering(metric(), first, 0.5)
    halves, second_slope = value_and_slope_of(remembered, whole[40:], np.full(40, 1.0 / 40.0))
    scale = own_share(whole)
    assert float(halves) == pytest.approx(float(at_once), abs=2e-3 * scale)
    np.testing.assert_allclose(second_slope, slope[40:], atol=5e-3 * float(jnp.abs(slope).max()))


def test_an_axis_that_does_not_count_is_not_remembered() -> None:
    flat = kernel_metric(places(*PLACES), counts=(True, True, False), variance_unit2=VARIANCE)
    past, ahead, weight = wandering(60, 0), wandering(20, 1), np.full(20, 1.0 / 20.0)
    low, high = (remembering(flat, past * [1.0, 1.0, 0.0] + [0.0, 0.0, height], 0.75) for height in (0.1, 0.9))
    lower = float(value_of(low, ahead, weight))
    assert lower == pytest.approx(float(value_of(high, ahead, weight)), rel=1e-5)
    expected = float(value_of(flat, np.concatenate([past, ahead]), np.full(80, 1.0 / 80.0)))
    assert lower == pytest.approx(expected, rel=1e-2)


def test_a_flight_visits_both_places_around_the_sphere_without_a_violation() -> None:
    states, _, _ = flight()
    positions = states[:, :3]
    assert np.linalg.norm(positions - CENTER, axis=1).min() >= RADIUS + KEEP_OUT - 1e-3
    assert (positions >= -1e-3).all()
    assert (positions <= WORKSPACE.lengths_m + 1e-3).all()
    near = np.linalg.norm(positions[:, None] - PLACES, axis=-1) < 15.0
    assert (near.mean(axis=0) > 0.1).all()


def test_what_a_flight_is_told_of_itself_is_the_double_sum() -> None:
    states, infos, last = flight()
    assert int(last.moments) == STEPS
    ahead = np.asarray(infos[-1].candidates.positions_m[0])[1:]
    whole = WORKSPACE.unit_from_enu(np.concatenate([states[:-1, :3], ahead]).astype(float))
    found = float(infos[-1].candidates.ergodic_metric[0])
    assert found == pytest.approx(double_loop(whole), abs=3e-3 * own_share(whole))


def test_without_memory_a_flight_covers_worse() -> None:
    with_memory, without = (WORKSPACE.unit_from_enu(flight(kept)[0][:, :3].astype(float)) for kept in (True, False))
    assert double_loop(with_memory) < 0.7 * double_loop(without)


def test_new_information_turns_a_flight_without_a_new_compilation(caplog: pytest.LogCaptureFixture) -> None:
    states, _, state = flight()
    new, std_m = np.array([50.0, 22.0, 20.0]), np.array([8.0, 7.0, 6.0])
    task = task_of(kernel_metric(places(new, std_m=std_m), variance_unit2=VARIANCE))
    vehicle, key, flown = jnp.asarray(states[-1]), jax.random.key(5), list(states[:-1, :3])
    move = jax.jit(lambda x, u: task.dynamics.step(x, u, PERIOD))
    with jax.log_compiles():
        for index in range(40):
            state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
            flown.append(np.asarray(vehicle)[:3])
            vehicle = move(vehicle, info.control)
        assert "Compiling jit(step)" not in caplog.text
    near = np.linalg.norm(np.array(flown) - new, axis=1) < 15.0
    assert near[:STEPS].mean() < 0.15
    assert near[STEPS:].mean() > 0.3
    # What was flown under the old information is measured against the new one; cells widen its peak a little.
    whole = WORKSPACE.unit_from_enu(np.concatenate([flown, info.candidates.positions_m[0][1:]]).astype(float))
    found = float(info.candidates.ergodic_metric[0])
    assert found == pytest.approx(double_loop(whole, new[None], std_m), rel=0.01)


def test_a_metric_with_another_basis_is_refused_in_flight() -> None:
    _, _, state = flight()
    finer = task_of(kernel_metric(places(*PLACES), variance_unit2=0.25 * VARIANCE))
    with pytest.raises(ValueError, match="the variance of a kernel metric"):
        control.step(finer, state, jnp.asarray(START), jax.random.key(0))


def test_metrics_that_remember_already_or_cannot_are_refused() -> None:
    flown = Covered(np.zeros((4, 4, 2)), 10.0, places=wandering(20, 0))
    with pytest.raises(ValueError, match="remembers by itself"):
        task_of(kernel_metric(places(*PLACES), variance_unit2=VARIANCE, covered=flown, duration_s=10.0))
    with pytest.raises(ValueError, match="remembers by itself"):
        task_of(SpectralMetric.of(places(*PLACES).coefficients((4, 4, 2)), MetricWeights.LINEAR, flown, 10.0))
    poses = np.column_stack([wandering(20, 0), np.linspace(-3.0, 3.0, 20)])
    with pytest.raises(ValueError, match="only a metric of places"):
        task_of(pose_metric(poses, np.ones(20)))
