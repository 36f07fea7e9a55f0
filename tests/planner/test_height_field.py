"""Ground as distances: never above the truth, as steep as a metre a metre, and a band of heights that plans keep."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from planner.gate import ViolationKind, inspect
from planner.height_field import STEEP, HeightField, band, ground, steepest_slope
from planner.information import uniform
from planner.obstacles import ObstacleField
from planner.problem import Limits, Options, Problem
from planner.solver import solve
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace

REGION = Workspace(np.array([0.0, 0.0, -10.0]), np.array([60.0, 50.0, 60.0]))
POST_M = np.array([5.0, 5.0])


def rough(seed: int, scale_m: float) -> HeightField:
    heights = np.random.default_rng(seed).uniform(0.0, scale_m, (13, 11))
    return ground(heights, np.zeros(2), POST_M, REGION, 1.0, 6.0)


def surface_points(field: HeightField, spacing_m: float) -> np.ndarray:
    east, north = np.meshgrid(np.arange(-20.0, 80.0, spacing_m), np.arange(-20.0, 70.0, spacing_m), indexing="ij")
    places = np.stack([east, north], axis=-1).reshape(-1, 2)
    return np.column_stack([places, field.height_at(places)])


@pytest.mark.parametrize("scale_m", [3.0, 25.0])
def test_it_is_never_farther_than_the_surface_is(scale_m: float) -> None:
    field = rough(1, scale_m)
    assert (field.near is not None) == (steepest_slope(field.heights_m, POST_M) > STEEP)
    points = np.random.default_rng(2).uniform(REGION.box_min_m - 10.0, REGION.box_max_m + 10.0, (2500, 3))
    above = points[points[:, 2] > field.height_at(points[:, :2])]
    truth, _ = KDTree(surface_points(field, 0.25)).query(above)
    bound, smooth = field.lower_bound(above), field.distance(above)
    assert (bound <= truth + 1e-9).all()
    assert (smooth <= bound + 1e-9).all()
    # What the slope's bound gives away is a share, what the grid gives away as far as it reaches is about its cells.
    sampling_m = 0.25
    assert (bound >= float(field.slant) * truth - sampling_m).all()
    close = (truth < 6.0) & ((above >= REGION.box_min_m) & (above <= REGION.box_max_m)).all(axis=1)
    assert field.near is None or (truth - bound)[close].max() < 2.5
    below = points[points[:, 2] < field.height_at(points[:, :2]) - 1e-6]
    assert (field.lower_bound(below) <= 0.0).all()


def beside_a_cliff(foot_m: float, reach_m: float) -> HeightField:
    posts = np.arange(-20.0, 101.0, 2.0)
    heights = np.zeros((len(posts), len(posts)))
    heights[posts >= REGION.box_max_m[0] + foot_m + 2.0] = 100.0
    return ground(heights, np.full(2, -20.0), np.full(2, 2.0), REGION, 1.0, reach_m)


@pytest.mark.parametrize("foot_m", [-1.0, 0.0, 1.0, 2.0, 5.0])
@pytest.mark.parametrize("reach_m", [0.0, 3.0, 15.0])
def test_a_cliff_just_outside_the_region_is_no_farther_than_it_is(foot_m: float, reach_m: float) -> None:
    field = beside_a_cliff(foot_m, reach_m)
    assert field.near is not None
    points = np.random.default_rng(7).uniform([40.0, 20.0, 0.1], [63.0, 30.0, 60.0], (1500, 3))
    above = points[points[:, 2] > field.height_at(points[:, :2])]
    # The cliff runs north, so that its profile is all there is to it.
    east = np.linspace(30.0, 80.0, 50_001)
    profile = np.column_stack([east, field.height_at(np.column_stack([east, np.full_like(east, 25.0)]))])
    truth, _ = KDTree(profile).query(above[:, [0, 2]])
    assert (field.lower_bound(above) <= truth + 1e-9).all()
    assert (field.distance(above) <= field.lower_bound(above) + 1e-9).all()


def test_the_gate_refuses_a_path_along_a_cliff_that_stands_just_outside_the_box() -> None:
    box = Workspace(np.array([0.0, 0.0, 0.0]), np.array([60.0, 50.0, 60.0]))
    north = np.r_[[5.0] * 3, np.linspace(6.0, 34.0, 20), [35.0] * 3]
    curve = Trajectory(np.stack([np.full_like(north, 59.9), north, np.full_like(north, 10.0)], axis=1), 2.0)
    for margin_m, kept in ((1.0, True), (5.0, False)):
        problem = Problem(
            workspace=box,
            information=uniform(box, (8, 8, 8)),
            obstacles=ObstacleField.of([beside_a_cliff(2.0, 15.0)]),
            limits=Limits(6.0, 3.0, 2.0, 4.0),
            start=curve.motion_at(0.0),
            end_position_m=None,
            duration_s=curve.duration_s,
            vehicle_radius_m=0.4,
            clearance_margin_m=margin_m,
        )
        assert (ViolationKind.CLEARANCE not in {found.kind for found in inspect(curve, problem).violations}) == kept


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_it_changes_by_at_most_a_metre_a_metre(seed: int) -> None:
    rng = np.random.default_rng(seed)
    field = dataclasses.replace(rough(seed % 100, rng.uniform(1.0, 30.0)), near=None)
    first = rng.uniform(-20.0, 80.0, (500, 3))
    second = first + rng.normal(0.0, rng.uniform(0.1, 10.0), (500, 3))
    change = np.abs(field.lower_bound(first) - field.lower_bound(second))
    assert (change <= np.linalg.norm(first - second, axis=1) + 1e-9).all()


def test_heights_are_met_at_posts_and_go_on_beyond_the_outermost() -> None:
    heights = np.arange(12.0).reshape(4, 3)
    field = ground(heights, np.array([10.0, 20.0]), np.array([5.0, 4.0]), REGION, 1.0, 6.0)
    east, north = np.meshgrid(10.0 + 5.0 * np.arange(4), 20.0 + 4.0 * np.arange(3), indexing="ij")
    np.testing.assert_allclose(field.height_at(np.stack([east, north], axis=-1)), heights)
    np.testing.assert_allclose(field.height_at(np.array([[1000.0, 1000.0], [-1000.0, 22.0]])), [11.0, 0.5])


def test_the_optimiser_measures_what_the_proof_measures() -> None:
    field = rough(3, 25.0)
    single = jax.tree.map(lambda leaf: jnp.asarray(leaf, jnp.float32), field)
    points = np.random.default_rng(4).uniform(REGION.box_min_m, REGION.box_max_m, (400, 3))
    found, slope = jax.jit(jax.vmap(jax.value_and_grad(single.distance)))(points)
    np.testing.assert_allclose(found, field.distance(points), atol=1e-3)
    assert np.isfinite(slope).all()


def test_a_band_keeps_between_two_heights_above_the_ground() -> None:
    field, away_m = rough(5, 3.0), 2.0
    kept = ObstacleField.of([field, *band(field, 8.0, 20.0, away_m)])
    places = np.random.default_rng(6).uniform(0.0, 50.0, (300, 2))
    for height, allowed in ((7.99, False), (8.01, True), (19.99, True), (20.01, False)):
        points = np.column_stack([places, field.height_at(places) + height])
        assert ((kept.lower_bound(points) >= away_m) == allowed).all()
    low, high = kept.span_m(places, away_m)
    np.testing.assert_allclose(low, field.height_at(places) + 8.0)
    np.testing.assert_allclose(high, field.height_at(places) + 20.0)
    assert kept.standing.is_empty
    assert len(kept.below_lids.surfaces) == 2


def test_plans_follow_the_ground_in_the_band() -> None:
    box = Workspace(np.array([0.0, 0.0, 0.0]), np.array([200.0, 160.0, 90.0]))
    posts = np.stack(np.meshgrid(np.arange(-10.0, 221.0, 10.0), np.arange(-10.0, 181.0, 10.0), indexing="ij"), axis=-1)
    heights = 45.0 * np.exp(-0.5 * (((posts - [110.0, 80.0]) / 40.0) ** 2).sum(axis=-1))
    field = ground(heights, np.full(2, -10.0), np.full(2, 10.0), box, 1.0, 9.0)
    start = np.array([10.0, 10.0, 25.0])
    problem = Problem(
        workspace=box,
        information=uniform(box, (32, 32, 8)),
        obstacles=ObstacleField.of([field, *band(field, 15.0, 35.0, 3.0)]),
        limits=Limits(6.0, 3.0, 2.0, 4.0),
        start=Motion.at_rest(start),
        end_position_m=start,
        duration_s=150.0,
        vehicle_radius_m=0.5,
        clearance_margin_m=2.5,
    )
    plan = solve(problem, Options(candidates=2, modes=(8, 8, 1)))
    curve = plan.best.trajectory
    along = curve.sample(np.linspace(0.0, curve.end_s, 20_000)).position_m
    above = along[:, 2] - field.height_at(along[:, :2])
    assert above.min() >= 15.0
    assert above.max() <= 35.0
    # It went over the hill, and up with it.
    assert along[:, 2].max() > 45.0


@pytest.mark.parametrize("heights", [np.zeros((1, 5)), np.array([[0.0, np.nan], [0.0, 0.0]]), np.zeros(4)])
def test_heights_that_are_no_ground_are_refused(heights: np.ndarray) -> None:
    with pytest.raises(ValueError, match="terrain needs finite heights"):
        ground(heights, np.zeros(2), POST_M, REGION, 1.0, 6.0)
