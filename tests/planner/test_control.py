"""Receding-horizon control: its memory, its safety, and what it finds."""

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner import control, stein
from planner.control import ControlInfo, ControlState, ControlTask, Transport
from planner.dynamics import Aircraft, DoubleIntegrator, DubinsCar, Dynamics, Multirotor, SingleIntegrator
from planner.information import DensityGrid, gaussians
from planner.obstacles import ObstacleField, Sphere
from planner.priors import GaussianPrior, OffsetPrior, Prior
from planner.problem import Kernel, MetricWeights
from planner.spectral_metric import SpectralMetric, mean_basis, mode_weights
from planner.workspace import Workspace

WORKSPACE = Workspace(np.array([0.0, 0.0, 0.0]), np.array([100.0, 100.0, 40.0]))
MODES = (6, 6, 3)
CENTER, RADIUS, KEEP_OUT = np.array([50.0, 50.0, 20.0]), 12.0, 1.5
MULTIROTOR = Multirotor(8.0, 3.0, 2.0, 4.0, 0.8)
PERIOD = 0.5


def two_places() -> DensityGrid:
    mean = np.array([[25.0, 50.0, 20.0], [75.0, 50.0, 20.0]])
    return gaussians(WORKSPACE, mean, np.array([[8.0, 12.0, 6.0]] * 2), np.ones(2), shape=(48, 48, 16))


def metric_of(information: DensityGrid) -> SpectralMetric:
    return SpectralMetric.of(information.coefficients(MODES), MetricWeights.LINEAR)


def task_of(
    dynamics: Dynamics = MULTIROTOR,
    prior: Prior | None = None,
    information: DensityGrid | None = None,
    transport: Transport = Transport.OWN_SCORE,
) -> ControlTask:
    return ControlTask.of(
        WORKSPACE,
        metric_of(two_places() if information is None else information),
        dynamics,
        GaussianPrior(1.0) if prior is None else prior,
        obstacles=ObstacleField.of([Sphere(CENTER, RADIUS)]),
        keep_out_m=KEEP_OUT,
        control_s=PERIOD,
        iterations=10,
        transport=transport,
    )


def flight(
    task: ControlTask, start: list[float], steps: int, seed: int = 0
) -> tuple[np.ndarray, list[ControlInfo], ControlState]:
    """Fly, and return states, infos and the last control state."""
    key = jax.random.key(seed)
    state, vehicle = control.init(task, key, 8, 20), jnp.asarray(start, jnp.float32)
    states, infos = [np.asarray(vehicle)], []
    move = jax.jit(lambda x, u: task.dynamics.step(x, u, PERIOD))
    for index in range(steps):
        state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
        vehicle = move(vehicle, info.control)
        states.append(np.asarray(vehicle))
        infos.append(info)
    return np.array(states), infos, state


def metric_of_path(positions_m: np.ndarray, information: DensityGrid) -> float:
    unit = WORKSPACE.unit_from_enu(positions_m)
    mean = mean_basis(unit, np.full(len(unit), 1.0 / len(unit)), MODES)
    return float(np.sum(mode_weights(MODES, MetricWeights.LINEAR) * (mean - information.coefficients(MODES)) ** 2))


@functools.cache
def multirotor_flight() -> tuple[np.ndarray, list[ControlInfo], ControlState]:
    return flight(task_of(), [10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0], 100)


@functools.cache
def aircraft_flight() -> tuple[np.ndarray, list[ControlInfo], ControlState]:
    return flight(task_of(Aircraft(8.0, 12.0, 0.35, 0.3, 0.6)), [10.0, 10.0, 15.0, 0.0, 0.7], 100)


@pytest.mark.parametrize("flown", [multirotor_flight, aircraft_flight], ids=["multirotor", "aircraft"])
def test_both_places_around_the_sphere_are_visited_without_a_violation(flown) -> None:
    states, _, _ = flown()
    positions = states[:, :3]
    assert np.linalg.norm(positions - CENTER, axis=1).min() >= RADIUS + KEEP_OUT - 1e-3
    assert (positions >= -1e-3).all()
    assert (positions <= WORKSPACE.lengths_m + 1e-3).all()
    for east in (25.0, 75.0):
        near = np.linalg.norm(positions - np.array([east, 50.0, 20.0]), axis=1) < 15.0
        assert near.mean() > 0.05


def test_the_flight_covers_far_better_than_the_prior() -> None:
    states, _, _ = multirotor_flight()
    task, generator = task_of(), np.random.default_rng(0)
    drifting = [
        control.rollout(task.dynamics, jnp.asarray(states[0]), jnp.asarray(generator.normal(size=(100, 4))), PERIOD)
        for _ in range(5)
    ]
    aimless = [metric_of_path(np.asarray(path)[:, :3], two_places()) for path in drifting]
    assert metric_of_path(states[:, :3], two_places()) < 0.2 * np.median(aimless)


def test_memory_is_the_sum_of_the_basis_over_what_was_flown() -> None:
    states, infos, last = multirotor_flight()
    flown = states[:-1, :3]
    expected = mean_basis(WORKSPACE.unit_from_enu(flown), np.ones(len(flown)), MODES)
    assert int(last.moments) == len(flown)
    np.testing.assert_allclose(last.basis_sum, expected, atol=2e-3)
    whole = np.concatenate([flown, np.asarray(infos[-1].candidates.positions_m[0])[1:]])
    found = float(infos[-1].candidates.ergodic_metric[0])
    assert found == pytest.approx(metric_of_path(whole, two_places()), rel=1e-2)


def test_without_memory_the_same_ground_is_covered_again() -> None:
    task, key = task_of(), jax.random.key(0)
    start = jnp.asarray([10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0])
    state, vehicle, forgetful = control.init(task, key, 8, 20), start, [np.asarray(start)]
    for index in range(100):
        state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
        state = dataclasses.replace(state, basis_sum=jnp.zeros_like(state.basis_sum), moments=jnp.ones((), jnp.int32))
        vehicle = task.dynamics.step(vehicle, info.control, PERIOD)
        forgetful.append(np.asarray(vehicle))
    remembered, _, _ = multirotor_flight()
    without = metric_of_path(np.array(forgetful)[:, :3], two_places())
    assert metric_of_path(remembered[:, :3], two_places()) < 0.7 * without


def test_new_information_turns_the_vehicle_without_a_new_compilation(caplog: pytest.LogCaptureFixture) -> None:
    states, _, state = multirotor_flight()
    corner = gaussians(WORKSPACE, np.array([[85.0, 15.0, 30.0]]), np.full((1, 3), 5.0), np.ones(1), shape=(48, 48, 16))
    task = task_of(information=corner)
    vehicle, key = jnp.asarray(states[-1]), jax.random.key(5)
    with jax.log_compiles():
        for index in range(40):
            state, info = control.step(task, state, vehicle, jax.random.fold_in(key, index))
            vehicle = task.dynamics.step(vehicle, info.control, PERIOD)
        assert "Compiling jit(step)" not in caplog.text
        smaller = dataclasses.replace(state, particles=state.particles[:, :10])
        control.step(task, smaller, vehicle, key)
        assert "Compiling jit(step)" in caplog.text
    assert np.linalg.norm(np.asarray(vehicle)[:3] - np.array([85.0, 15.0, 30.0])) < 15.0


def test_shifting_repeats_the_last_control() -> None:
    particles = jnp.arange(12.0).reshape(1, 4, 3)
    np.testing.assert_array_equal(control.shifted(particles)[0, :, 0], [3.0, 6.0, 9.0, 9.0])


def test_candidates_that_coincide_are_parted() -> None:
    task = task_of()
    state = control.init(task, jax.random.key(0), 8, 20)
    same = dataclasses.replace(state, particles=jnp.repeat(state.particles[:1], 8, axis=0))
    after, _ = control.step(task, same, jnp.asarray([10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0]), jax.random.key(1))
    flat = np.asarray(after.particles).reshape(8, -1)
    gaps = np.linalg.norm(flat[:, None] - flat[None], axis=-1)[np.triu_indices(8, k=1)]
    assert gaps.min() > 1e-2


def test_the_same_key_gives_the_same_flight() -> None:
    again, _, _ = flight(task_of(), [10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0], 20)
    np.testing.assert_array_equal(again, multirotor_flight()[0][:21])


@pytest.mark.parametrize(
    ("dynamics", "start"),
    [
        (SingleIntegrator(8.0, 3.0, 2.0), [10.0, 10.0, 10.0]),
        (DoubleIntegrator(4.0), [10.0, 10.0, 10.0, 0.0, 0.0, 0.0]),
        (DubinsCar(8.0, 6.0), [10.0, 10.0, 20.0, 0.0]),
    ],
    ids=["single integrator", "double integrator", "Dubins car"],
)
def test_every_vehicle_finds_its_way_to_the_information(dynamics: Dynamics, start: list[float]) -> None:
    states, _, _ = flight(task_of(dynamics, OffsetPrior(0.7, 0.7)), start, 40)
    assert np.linalg.norm(states[:, :3] - CENTER, axis=1).min() >= RADIUS + KEEP_OUT - 1e-3
    first = np.linalg.norm(states[:, :3] - np.array([25.0, 50.0, 20.0]), axis=1).min()
    second = np.linalg.norm(states[:, :3] - np.array([75.0, 50.0, 20.0]), axis=1).min()
    assert min(first, second) < 16.0


def test_a_step_never_shortens_the_time_a_candidate_stays_clear() -> None:
    task = task_of()
    state = control.init(task, jax.random.key(3), 8, 20)
    heading_for_it = jnp.asarray([33.0, 50.0, 20.0, 5.0, 0.0, 0.0, 0.0])
    here = task.metric.basis((heading_for_it[:3] - task.origin_m) / task.lengths_m)
    metric = control.with_memory(task.metric, state.basis_sum + here, state.moments + 1, 20)
    assess = jax.jit(lambda cube: control._assess(task, metric, heading_for_it, jnp.ones(()), cube))
    before = [assess(cube) for cube in state.particles]
    _, info = control.step(task, state, heading_for_it, jax.random.key(4))
    for old, new in zip(before, info.candidates.clear_moments, strict=True):
        assert int(new) >= int(old.clear_moments)
    chosen = int(info.candidates.clear_moments[info.selected])
    assert chosen == int(info.candidates.clear_moments.max())


def test_the_papers_own_step_is_at_hand() -> None:
    task = task_of(transport=Transport.STEIN)
    state = control.init(task, jax.random.key(0), 8, 20)
    after, info = control.step(task, state, jnp.asarray([10.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0]), jax.random.key(1))
    assert np.isfinite(np.asarray(after.particles)).all()
    assert float(info.candidates.cost.min()) < 10.0


def test_a_step_on_own_scores_moves_alone_candidates_up_their_score() -> None:
    state = stein.init(jnp.full((1, 20, 2), 0.5))
    smooth = jnp.asarray(stein.smoother(20))
    score = jnp.ones((1, 20, 2)) * jnp.asarray([1.0, 0.0])
    after = control.own_score_step(state, score, Kernel.RBF, smooth, 10)
    np.testing.assert_allclose(after.particles[0, :, 0], 0.5 + control.LONGEST_STEP, rtol=1e-3)
    np.testing.assert_allclose(after.particles[0, :, 1], 0.5, atol=1e-6)


def test_a_task_without_time_is_refused() -> None:
    with pytest.raises(ValueError, match="control_s must be positive"):
        ControlTask.of(
            WORKSPACE,
            metric_of(two_places()),
            MULTIROTOR,
            GaussianPrior(1.0),
            obstacles=ObstacleField.of([]),
            control_s=0.0,
        )
