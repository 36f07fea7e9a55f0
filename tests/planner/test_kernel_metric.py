"""The kernel metric against its double loop, autodiff, quadrature and the parameters of the paper's own tutorial."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.special import i0e
from scipy.stats import multivariate_normal, norm

from planner.density_field import density_at, density_at_centers, grid_field, kernel_sum
from planner.information import DensityGrid, gaussians, uniform
from planner.judging import Judge
from planner.kernel_metric import Attraction, KernelMetric, kernel_metric, pose_metric, sampled
from planner.kernel_metric_of import metric_of_places
from planner.kernel_variance import select_variance, silverman_variance
from planner.obstacles import ObstacleField
from planner.problem import Covered, Limits, Metric, Options, Problem
from planner.scene import scene_of
from planner.spectral_metric import mean_basis
from planner.trajectory import Motion
from planner.workspace import Workspace
from tests.planner.compiled import value_and_slope_of, value_of
from tests.planner.finite_differences import numeric_gradient

WORKSPACE = Workspace(np.array([-10.0, 0.0, 5.0]), np.array([30.0, 20.0, 25.0]))
MEAN_UNIT, STD_UNIT = np.array([0.4, 0.6, 0.5]), np.array([0.1, 0.08, 0.12])
VARIANCE = np.array([4e-3, 6e-3, 5e-3])


@pytest.fixture(scope="module")
def peak() -> DensityGrid:
    """One normal density well inside the box: everything about it is known in closed form."""
    lengths = WORKSPACE.lengths_m
    mean_m = WORKSPACE.enu_from_unit(MEAN_UNIT)
    return gaussians(WORKSPACE, mean_m[None], (STD_UNIT * lengths)[None], np.ones(1), shape=(96, 96, 96))


def normal(points: np.ndarray, center: np.ndarray, variance: np.ndarray) -> np.ndarray:
    return np.asarray(multivariate_normal.pdf(points, center, np.diag(variance)))


def double_loop(
    points: np.ndarray, weight: np.ndarray, density: np.ndarray, constant: float, theta: np.ndarray
) -> float:
    """KES eq. (13) with two nested sums."""
    total = constant - 2.0 * float(weight @ density)
    for one, share in zip(points, weight, strict=True):
        total += share * float(weight @ normal(points, one, theta))
    return total


def path(count: int = 40, seed: int = 0) -> np.ndarray:
    return np.random.default_rng(seed).uniform(0.2, 0.8, size=(count, 3))


@pytest.mark.parametrize("attraction", list(Attraction))
def test_the_metric_is_the_papers_double_sum(peak: DensityGrid, attraction: Attraction) -> None:
    points, weight = path(), np.random.default_rng(1).dirichlet(np.ones(40))
    metric = kernel_metric(peak, attraction=attraction, variance_unit2=VARIANCE)
    blur = VARIANCE if attraction is Attraction.BLURRED else 0.0 * VARIANCE
    density = normal(points, MEAN_UNIT, STD_UNIT**2 + blur)
    constant = float(normal(MEAN_UNIT, MEAN_UNIT, 2.0 * STD_UNIT**2 + blur))
    found = float(value_of(metric, points, weight))
    scale = double_loop(points, weight, 0.0 * density, 0.0, VARIANCE)
    assert found == pytest.approx(double_loop(points, weight, density, constant, VARIANCE), abs=3e-3 * scale)


def test_the_gradient_equals_autodiff_of_the_double_sum(peak: DensityGrid) -> None:
    metric = kernel_metric(peak, variance_unit2=VARIANCE)
    points = jnp.asarray(path(200), jnp.float32)
    weight = jnp.asarray(np.random.default_rng(1).dirichlet(np.ones(200)), jnp.float32)
    spread = jnp.asarray(STD_UNIT**2 + VARIANCE, jnp.float32)

    def density(x: jax.Array, center: jax.Array, variance: jax.Array) -> jax.Array:
        return jnp.exp(-0.5 * jnp.sum((x - center) ** 2 / variance, -1)) / jnp.sqrt(jnp.prod(2.0 * jnp.pi * variance))

    def naive(x: jax.Array) -> jax.Array:
        mutual = density(x[:, None], x[None], jnp.asarray(VARIANCE, jnp.float32))
        return weight @ mutual @ weight - 2.0 * weight @ density(x, jnp.asarray(MEAN_UNIT, jnp.float32), spread)

    expected = np.asarray(jax.jit(jax.grad(naive))(points))
    found = np.asarray(value_and_slope_of(metric, points, weight)[1])
    np.testing.assert_allclose(found, expected, atol=4e-3 * np.abs(expected).max())


def test_samples_of_the_density_score_near_zero_and_others_do_not(peak: DensityGrid) -> None:
    metric = kernel_metric(peak, variance_unit2=VARIANCE)
    weight = jnp.full(3000, 1.0 / 3000.0)
    fair = jnp.asarray(sampled(peak, 3000, np.random.default_rng(0)), jnp.float32)
    elsewhere = jnp.asarray(path(3000), jnp.float32)
    assert 0.0 < float(value_of(metric, fair, weight)) < 0.02 * float(value_of(metric, elsewhere, weight))


def test_blurred_attraction_lets_a_uniform_path_rest_and_the_printed_one_drives_it_to_the_walls() -> None:
    place = (np.arange(30) + 0.5) / 30.0
    lattice = np.stack(np.meshgrid(place, place, [0.5], indexing="ij"), -1).reshape(-1, 3)
    points, weight = jnp.asarray(lattice, jnp.float32), jnp.full(900, 1.0 / 900.0)
    outward = np.sign(lattice - 0.5) * np.array([1.0, 1.0, 0.0])

    def pull_outward(attraction: Attraction) -> float:
        metric = kernel_metric(
            uniform(WORKSPACE, (60, 60, 1)),
            attraction=attraction,
            counts=(True, True, False),
            variance_unit2=np.full(3, 4e-3),
        )
        value, slope = value_and_slope_of(metric, points, weight)
        descent = -900.0 * np.asarray(slope)
        inside = np.abs(lattice[:, :2] - 0.5).max(axis=1) < 0.44
        return float(np.abs((descent * outward)[inside]).max()), float(value)

    blurred, value = pull_outward(Attraction.BLURRED)
    printed, _ = pull_outward(Attraction.AS_PRINTED)
    assert value == pytest.approx(0.0, abs=2e-3)
    assert blurred < 0.1 * printed


def test_an_axis_that_does_not_count_takes_no_part() -> None:
    information = gaussians(WORKSPACE, np.array([[0.0, 8.0, 10.0]]), np.array([[6.0, 3.0, 2.0]]), np.ones(1))
    metric = kernel_metric(information, counts=(True, True, False))
    points = path()
    raised = points + np.array([0.0, 0.0, 0.13])
    weight = jnp.full(40, 1.0 / 40.0)
    value, gradient = value_and_slope_of(metric, points, weight)
    assert float(value_of(metric, raised, weight)) == pytest.approx(float(value), rel=1e-5)
    np.testing.assert_array_equal(np.asarray(gradient)[:, 2], 0.0)


def test_memory_makes_the_whole_flight_one_measure(peak: DensityGrid) -> None:
    past, future = path(30, 1), path(20, 2)
    share = 0.6
    flown = Covered(np.zeros((2, 2, 2)), duration_s=60.0, places=past)
    remembered = kernel_metric(peak, variance_unit2=VARIANCE, covered=flown, duration_s=40.0)
    plain = kernel_metric(peak, variance_unit2=VARIANCE)
    whole = np.concatenate([past, future])
    weight = np.r_[np.full(30, share / 30), np.full(20, (1.0 - share) / 20)]
    horizon = jnp.full(20, 1.0 / 20.0)
    found, slope = value_and_slope_of(remembered, whole[30:], horizon)
    expected, whole_slope = value_and_slope_of(plain, whole, weight)
    assert float(found) == pytest.approx(float(expected), rel=1e-2)
    np.testing.assert_allclose(slope, whole_slope[30:], atol=1e-2 * np.abs(whole_slope).max())


@pytest.mark.parametrize("ahead", [(0.3, 0.3), (0.7, 0.6), (0.9, 0.1)], ids=["covered", "not covered", "elsewhere"])
def test_memory_is_as_sharp_as_the_kernel_however_few_modes_there_are(ahead: tuple[float, float]) -> None:
    cube = Workspace(np.zeros(3), np.ones(3))
    information = gaussians(cube, np.array([[0.3, 0.3, 0.5], [0.7, 0.6, 0.5]]), np.full((2, 3), 0.04), np.ones(2))
    generator, modes = np.random.default_rng(1), (8, 8, 1)
    past, future = (
        np.column_stack([np.array(middle) + 0.04 * generator.normal(size=(count, 2)), np.full(count, 0.5)])
        for middle, count in (((0.3, 0.3), 300), (ahead, 200))
    )
    flat = (True, True, False)
    plain = kernel_metric(information, counts=flat)
    theta = np.asarray(plain.variance, dtype=float)[:2]
    assert np.sqrt(theta).max() < 0.03
    flown = Covered(mean_basis(past, np.full(300, 1.0 / 300.0), modes), 60.0, places=past)
    remembered = kernel_metric(information, counts=flat, covered=flown, duration_s=60.0)
    whole, weight = np.concatenate([past, future])[:, :2], np.r_[np.full(300, 1.0 / 600.0), np.full(200, 1.0 / 400.0)]
    density = np.asarray(density_at(plain.attraction, np.concatenate([past, future]))[0], dtype=float)
    exact = double_loop(whole, weight, density, float(plain.constant), theta)
    found = float(value_of(remembered, future, np.full(200, 1.0 / 200.0)))
    assert found == pytest.approx(exact, rel=0.01, abs=0.01)


def test_memory_of_poses_makes_the_whole_flight_one_measure() -> None:
    generator = np.random.default_rng(5)
    poses = np.concatenate(
        [generator.uniform(0.3, 0.7, size=(50, 3)), generator.uniform(-3.0, 3.0, size=(50, 1))], axis=1
    )
    theta, share = np.array([5e-3, 5e-3, 5e-3, 0.2]), 0.6
    plain = pose_metric(poses, np.ones(50), variance=theta)
    remembered = pose_metric(poses, np.ones(50), variance=theta, covered=poses[:30] + 0.1, covered_share=share)
    whole = np.concatenate([poses[:30] + 0.1, poses[30:]])
    weight = np.r_[np.full(30, share / 30), np.full(20, (1.0 - share) / 20)]
    expected, whole_slope = value_and_slope_of(plain, whole, weight)
    found, slope = value_and_slope_of(remembered, whole[30:], np.full(20, 0.05))
    assert float(found) == pytest.approx(float(expected), rel=1e-4)
    np.testing.assert_allclose(slope, whole_slope[30:], atol=1e-5 * np.abs(whole_slope).max())


def test_many_samples_are_summed_in_pieces_to_the_same_result(peak: DensityGrid) -> None:
    metric = kernel_metric(peak, variance_unit2=VARIANCE)
    points = path(40)
    repeated = jnp.asarray(np.tile(points, (25, 1)), jnp.float32)
    once = float(value_of(metric, points, np.full(40, 1.0 / 40.0)))
    compiled = jax.jit(jax.value_and_grad(metric.__call__)).lower(repeated, jnp.full(1000, 1e-3)).compile()
    assert float(compiled(repeated, jnp.full(1000, 1e-3))[0]) == pytest.approx(once, rel=1e-3)
    assert compiled.memory_analysis().temp_size_in_bytes < 1000 * 1000 * 4


def test_the_selected_variance_is_the_one_the_papers_tutorial_finds() -> None:
    # The authors' public tutorial: this mixture, 100 samples, log10 variances −2.46 and −2.59.
    means = np.array([[0.35, 0.38], [0.68, 0.25], [0.56, 0.64]])
    covariances = np.array(
        [[[0.01, 0.004], [0.004, 0.01]], [[0.005, -0.003], [-0.003, 0.005]], [[0.008, 0], [0, 0.004]]]
    )
    weights = np.array([0.5, 0.2, 0.3])
    found = []
    for seed in range(5):
        generator = np.random.default_rng(seed)
        samples = np.concatenate(
            [
                generator.multivariate_normal(mean, covariance, int(100 * weight))
                for mean, covariance, weight in zip(means, covariances, weights, strict=True)
            ]
        )
        slope = np.zeros_like(samples)
        for mean, covariance, weight in zip(means, covariances, weights, strict=True):
            density = multivariate_normal.pdf(samples, mean, covariance)
            slope -= weight * density[:, None] * ((samples - mean) @ np.linalg.inv(covariance))
        found.append(np.log10(select_variance(samples, slope, wraps=False)))
    np.testing.assert_allclose(np.median(found, axis=0), [-2.4577, -2.5869], atol=0.2)


def test_the_automatic_variance_follows_the_width_of_the_information() -> None:
    def chosen(std_m: float) -> float:
        information = gaussians(WORKSPACE, np.array([[10.0, 10.0, 15.0]]), np.full((1, 3), std_m), np.ones(1))
        return float(kernel_metric(information, counts=(True, True, False)).variance[0])

    assert chosen(1.0) < 0.5 * chosen(3.0)
    flat = np.asarray(kernel_metric(uniform(WORKSPACE)).variance)
    assert (flat > 1e-3).all()
    assert (flat < 1.1e-2).all()


def test_metrics_of_informations_of_different_width_serve_one_compilation() -> None:
    def metric(std_m: float) -> KernelMetric:
        return kernel_metric(gaussians(WORKSPACE, np.array([[10.0, 10.0, 15.0]]), np.full((1, 3), std_m), np.ones(1)))

    narrow, wide = metric(2.4), metric(3.0)
    assert float(wide.variance[0]) > 1.2 * float(narrow.variance[0])
    assert jax.tree.structure(narrow) == jax.tree.structure(wide)
    assert jax.tree.map(jnp.shape, narrow) == jax.tree.map(jnp.shape, wide)


def test_a_blurred_grid_is_the_convolution(peak: DensityGrid) -> None:
    field = grid_field(peak.mass, VARIANCE)
    points = path(50)
    value, slope = density_at(field, points)
    expected = normal(points, MEAN_UNIT, STD_UNIT**2 + VARIANCE)
    np.testing.assert_allclose(value, expected, atol=2e-3 * expected.max())
    numeric = -expected[:, None] * (points - MEAN_UNIT) / (STD_UNIT**2 + VARIANCE)
    np.testing.assert_allclose(slope, numeric, atol=5e-3 * np.abs(numeric).max())
    centers = density_at_centers(peak.mass, VARIANCE)
    assert float(centers.max()) == pytest.approx(float(normal(MEAN_UNIT, MEAN_UNIT, STD_UNIT**2 + VARIANCE)), rel=1e-2)


def test_the_gradient_of_a_grid_is_continuous_across_its_nodes(peak: DensityGrid) -> None:
    field = grid_field(peak.mass)
    node = np.asarray(field.low + 40 * field.spacing)
    _, slope = density_at(field, np.stack([node - 1e-5, node + 1e-5]))
    np.testing.assert_allclose(slope[0], slope[1], rtol=2e-2, atol=1e-2)


def test_the_kernel_is_a_density_on_places_and_headings() -> None:
    variance = jnp.asarray([2e-3, 3e-3, 2e-3, 0.3])
    center = jnp.asarray([[0.5, 0.5, 0.5, 3.0]])
    axis = np.linspace(0.2, 0.8, 31)
    heading = np.linspace(-np.pi, np.pi, 41)[:-1]
    grid = np.stack(np.meshgrid(axis, axis, axis, heading, indexing="ij"), -1).reshape(-1, 4)
    density, _ = jax.jit(lambda x: kernel_sum(x, center, jnp.ones(1), variance, True))(jnp.asarray(grid, jnp.float32))
    cell = (axis[1] - axis[0]) ** 3 * (heading[1] - heading[0])
    assert float(np.asarray(density, float).sum() * cell) == pytest.approx(1.0, rel=2e-3)


def test_the_heading_wraps_like_the_circle_does() -> None:
    variance = 0.25
    angle = np.linspace(-7.0, 7.0, 57)
    points = jnp.asarray(np.stack([np.full(57, 0.5)] * 3 + [angle], axis=-1), jnp.float32)
    center = jnp.asarray([[0.5, 0.5, 0.5, 0.3]])
    theta = jnp.asarray([1.0 / (2.0 * np.pi)] * 3 + [variance])
    density, slope = jax.jit(kernel_sum, static_argnums=4)(points, center, jnp.ones(1), theta, True)
    images = (angle - 0.3)[:, None] + 2.0 * np.pi * np.arange(-6, 7)
    np.testing.assert_allclose(density, norm.pdf(images, scale=0.5).sum(axis=1), rtol=1e-4, atol=1e-6)
    expected = (-images / variance * norm.pdf(images, scale=0.5)).sum(axis=1)
    np.testing.assert_allclose(slope[:, 3], expected, atol=1e-4)
    # The wrapped normal and von Mises agree where both are narrow.
    mises = np.exp((np.cos(angle - 0.3) - 1.0) / variance) / (2.0 * np.pi * i0e(1.0 / variance))
    np.testing.assert_allclose(density, mises, atol=0.03)


def test_poses_draw_a_path_to_their_place_and_their_heading() -> None:
    generator = np.random.default_rng(0)
    poses = np.concatenate(
        [generator.normal(0.5, 0.08, size=(300, 3)), generator.normal(3.0, 0.3, size=(300, 1))], axis=1
    )
    metric = pose_metric(poses, np.ones(300))
    weight = np.full(300, 1.0 / 300.0)
    facing_away = poses + np.array([0.0, 0.0, 0.0, np.pi])
    a_turn_on = poses + np.array([0.0, 0.0, 0.0, 2.0 * np.pi])
    fair = float(value_of(metric, poses, weight))
    assert float(value_of(metric, a_turn_on, weight)) == pytest.approx(fair, rel=1e-2)
    assert float(value_of(metric, facing_away, weight)) > 5.0 * fair
    assert (np.asarray(metric.variance) > 0.0).all()


def test_the_gradient_of_poses_equals_finite_differences() -> None:
    with jax.enable_x64(True):
        generator = np.random.default_rng(3)
        poses = np.concatenate(
            [generator.uniform(0.3, 0.7, size=(20, 3)), generator.uniform(-3.0, 3.0, size=(20, 1))], 1
        )
        built = pose_metric(poses, generator.uniform(size=20), covered=poses[:5] + 0.1, covered_share=0.3)
        metric: KernelMetric = jax.tree.map(lambda leaf: leaf.astype(jnp.float64), built)
        points, weight = jnp.asarray(poses[:6] + 0.05), jnp.asarray(generator.dirichlet(np.ones(6)))
        gradient = np.asarray(value_and_slope_of(metric, points, weight)[1]).ravel()
        numeric = numeric_gradient(lambda x: metric(x, weight), points)
        np.testing.assert_allclose(gradient, numeric, rtol=1e-5, atol=1e-6 * np.abs(gradient).max())


def test_silvermans_rule_has_its_known_value_and_knows_the_circle() -> None:
    generator = np.random.default_rng(0)
    samples = np.concatenate([generator.normal(0.5, 0.1, (4000, 1)), generator.normal(np.pi, 0.2, (4000, 1))], axis=1)
    samples[:, 1] = np.mod(samples[:, 1] + np.pi, 2.0 * np.pi) - np.pi
    factor = (4.0 / (4.0 * 4000.0)) ** (2.0 / 6.0)
    found = silverman_variance(samples, np.full(4000, 1.0 / 4000.0), wraps=True)
    np.testing.assert_allclose(found, [factor * 0.01, factor * 0.04], rtol=0.06)


def test_the_solver_and_its_judge_measure_alike_and_leave_out_the_same_axes() -> None:
    information = gaussians(WORKSPACE, np.array([[0.0, 8.0, 15.0]]), np.array([[6.0, 3.0, 4.0]]), np.ones(1))
    flown = Covered(np.zeros((8, 8, 1)), 50.0, places=path(30, 1))
    problem = Problem(
        workspace=WORKSPACE,
        information=information,
        obstacles=ObstacleField.of([]),
        limits=Limits(5.0, 3.0, 3.0, 5.0),
        start=Motion.at_rest(np.array([0.0, 10.0, 15.0])),
        end_position_m=None,
        duration_s=40.0,
        vehicle_radius_m=0.0,
        clearance_margin_m=0.0,
        covered=flown,
    )
    options = Options(modes=(8, 8, 1), metric=Metric.KERNEL)
    scene = scene_of(problem, options, 16, 2)
    assert isinstance(scene.metric, KernelMetric)
    points = path(60, 4)
    judged = Judge(problem, options).ergodic_metric(WORKSPACE.enu_from_unit(points))
    assert float(eqx.filter_jit(scene.ergodic_metric)(points)) == pytest.approx(judged, rel=1e-4)
    np.testing.assert_array_equal(scene.metric.counts, [1.0, 1.0, 0.0])


def test_what_makes_no_metric_is_refused(peak: DensityGrid) -> None:
    with pytest.raises(ValueError, match="an axis that counts"):
        kernel_metric(peak, counts=(False, False, False))
    with pytest.raises(ValueError, match="share of the past"):
        pose_metric(np.zeros((3, 4)), np.ones(3), covered_share=0.5)
    with pytest.raises(ValueError, match="no memory"):
        kernel_metric(peak, attraction=Attraction.AS_PRINTED, covered=Covered(np.zeros((2, 2, 2)), 1.0))
    with pytest.raises(ValueError, match=r"give Covered\.places"):
        kernel_metric(peak, covered=Covered(np.zeros((2, 2, 2)), 1.0))
    with pytest.raises(ValueError, match="not all zero"):
        pose_metric(np.zeros((3, 4)), np.zeros(3))


def test_neighbours_closer_than_the_kernel_can_tell_are_taken_together_at_little_loss(peak: DensityGrid) -> None:
    metric = kernel_metric(peak, variance_unit2=VARIANCE)
    # 400 samples along a closed curve: four of them span a fifth of the kernel's width.
    turn = 2.0 * np.pi * np.arange(400)[:, None] / 400
    points = jnp.asarray(0.5 + 0.2 * np.sin(turn * np.array([1.0, 2.0, 3.0])), jnp.float32)
    weight = jnp.full(400, 1.0 / 400.0)
    together = dataclasses.replace(metric, together=4)
    expected, slope = value_and_slope_of(metric, points, weight)
    found, pooled_slope = value_and_slope_of(together, points, weight)
    assert float(found) == pytest.approx(float(expected), rel=5e-3)
    of_each_four = jnp.repeat(slope.reshape(100, 4, 3).mean(axis=1), 4, axis=0)
    np.testing.assert_allclose(pooled_slope, of_each_four, atol=0.1 * float(jnp.abs(slope).max()))


def test_only_long_missions_take_neighbours_together() -> None:
    def together(duration_s: float, samples: int) -> int:
        problem = Problem(
            workspace=WORKSPACE,
            information=uniform(WORKSPACE, (16, 16, 16)),
            obstacles=ObstacleField.of(()),
            limits=Limits(2.0, 2.0, 2.0, 2.0),
            start=Motion.at_rest(WORKSPACE.enu_from_unit(np.full(3, 0.5))),
            end_position_m=None,
            duration_s=duration_s,
            vehicle_radius_m=0.0,
            clearance_margin_m=0.0,
        )
        return metric_of_places(problem, Options(modes=(4, 4, 4)), samples).together

    assert together(200.0, 200) == 1
    assert together(200.0, 3200) == 4 * together(200.0, 800) > 1
    # Seven samples cannot be halved.
    assert together(1.0, 7) == 1
