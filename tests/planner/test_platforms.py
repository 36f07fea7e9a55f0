"""A GPU is not at hand for tests: that everything is lowered for one, and that what is written for it says the same."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from planner import polish, stein, sves
from planner.obstacles import ObstacleField
from planner.problem import Kernel, Metric, MetricWeights, Options
from planner.scene import Scene, scene_of
from planner.spectral_metric import SpectralMetric, mean_basis
from tests.planner.worlds import LIMITS, mixed, open_box

SEGMENTS = 16
PARTICLES = np.full((3, SEGMENTS - 2, 3), 0.5, np.float32)
OBSTACLES = ObstacleField.of(mixed(np.random.default_rng(0), 9))


@pytest.fixture
def gpu(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is traced is what a GPU would be given, and runs here."""
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")


def scene_by(metric: Metric) -> Scene:
    fence_m = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [0.0, 80.0]])
    turning = dataclasses.replace(LIMITS, max_turn_rate_radps=1.0)
    problem = open_box(obstacles=OBSTACLES, limits=turning, fence_polygon_m=fence_m)
    return scene_of(problem, Options(metric=metric, modes=(8, 8, 3)), SEGMENTS, 2)


def lowered(compiled, *arguments: object) -> str:
    """The program for CUDA; an operation without one raises."""
    return compiled.trace(*arguments).lower(lowering_platforms=("cuda",)).as_text()


def assert_exact_and_the_gpus_own(program: str) -> None:
    """No operation is made for a processor, and only weights between candidates meet factors that are rounded."""
    assert "custom_call" not in program
    products = [line for line in program.splitlines() if "stablehlo.dot_general" in line]
    assert products
    between = f"tensor<{len(PARTICLES)}x{len(PARTICLES)}xf32>"
    assert all("precision = [HIGHEST, HIGHEST]" in line or between in line for line in products)


@pytest.mark.parametrize("kernel", Kernel)
@pytest.mark.usefixtures("gpu")
def test_stein_steps_are_lowered_for_a_gpu(kernel: Kernel) -> None:
    scene = scene_by(Metric.SPECTRAL)
    state = stein.init(PARTICLES)
    smooth = stein.smoother(PARTICLES.shape[1])
    program = lowered(polish._explore, scene, state, state.particles, smooth, kernel, None, np.int32(8))
    assert "stablehlo.while" in program
    assert_exact_and_the_gpus_own(program)


@pytest.mark.parametrize("metric", Metric)
@pytest.mark.usefixtures("gpu")
def test_the_polish_is_lowered_for_a_gpu(metric: Metric) -> None:
    scene = scene_by(metric)
    states = jax.eval_shape(polish._begin, scene, PARTICLES)
    for program in (
        lowered(polish._begin, scene, PARTICLES),
        lowered(polish._round, scene, states, np.float32(1.0), np.int32(3)),
    ):
        assert_exact_and_the_gpus_own(program)


@pytest.mark.parametrize("metric", Metric)
def test_what_runs_on_all_cores_at_once_calls_no_library_that_waits_for_the_same_threads(metric: Metric) -> None:
    scene = scene_by(metric)
    states = jax.eval_shape(polish._begin, scene, PARTICLES)
    for traced in (
        polish._begin.trace(scene, PARTICLES),
        polish._round.trace(scene, states, np.float32(1.0), np.int32(3)),
    ):
        assert "custom_call" not in traced.lower().as_text()


@pytest.mark.usefixtures("gpu")
def test_the_papers_steps_are_lowered_for_a_gpu() -> None:
    scene = scene_by(Metric.SPECTRAL)
    program = lowered(sves._descended, scene, PARTICLES, Kernel.RBF, PARTICLES, None, np.int32(8))
    assert "stablehlo.while" in program
    assert_exact_and_the_gpus_own(program)


@pytest.mark.usefixtures("gpu")
@pytest.mark.parametrize("modes", [(8, 8, 1), (11, 6, 4), (2, 3, 2)])
def test_the_metric_of_a_gpu_is_the_metric(modes: tuple[int, int, int]) -> None:
    rng = np.random.default_rng(1)
    target = rng.normal(size=modes)
    metric = SpectralMetric.of(target, MetricWeights.LINEAR)
    # Beyond the box too, where a path may be on its way.
    path = rng.uniform(-0.1, 1.1, (41, 3))
    share = np.full(41, 1.0 / 41)

    def value(at: jax.Array) -> jax.Array:
        return metric(at, jnp.asarray(share, jnp.float32))

    assert "optimization_barrier" not in str(jax.make_jaxpr(jax.grad(value))(path.astype(np.float32)))
    found, slope = jax.jit(jax.value_and_grad(value))(path.astype(np.float32))

    def exact(at: np.ndarray) -> float:
        return float((np.asarray(metric.weights, dtype=float) * (mean_basis(at, share, modes) - target) ** 2).sum())

    assert found == pytest.approx(exact(path), rel=1e-5)
    along = rng.normal(size=path.shape)
    by_differences = (exact(path + 1e-6 * along) - exact(path - 1e-6 * along)) / 2e-6
    assert float(np.sum(np.asarray(slope) * along)) == pytest.approx(by_differences, rel=1e-4, abs=1e-6)


@pytest.mark.usefixtures("gpu")
def test_distances_of_a_gpu_are_the_distances() -> None:
    points = np.random.default_rng(2).uniform(0.0, [100.0, 80.0, 20.0], (43, 3))
    found = jax.jit(OBSTACLES.distance)(points.astype(np.float32))
    np.testing.assert_allclose(found, OBSTACLES.distance(points), atol=1e-4)


def test_a_processor_is_told_what_not_to_fuse() -> None:
    path = jnp.zeros((5, 3), jnp.float32)
    metric = SpectralMetric.of(np.zeros((4, 4, 1)), MetricWeights.LINEAR)
    assert "optimization_barrier" in str(jax.make_jaxpr(lambda at: metric(at, jnp.full(5, 0.2)))(path))
