"""Seeds: the patterns against their geometry, the paths against the vehicle, the free space and the gate."""

import dataclasses
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.free_space import FreeSpace
from planner.gate import ViolationKind, inspect
from planner.obstacles import ObstacleField
from planner.polygon import KeepIn
from planner.polyline import cut_at, densified, length_of
from planner.problem import Problem
from planner.seeds import LAST_RESORT, Pattern, pacing, seed_paths, sizing, spline_from_path
from planner.seeds.altitudes import Altitudes
from planner.seeds.drawing import Drawing
from planner.seeds.informed import greedy_ridge, peak_m, spread_m, stops, tour
from planner.seeds.pacing import lead_in, led_to_the_end, paced, reach_m
from planner.seeds.patterns import Region, expanding_square, lawnmower, layered_rows, sectors, spiral
from planner.trajectory import Motion, Trajectory
from tests.planner.worlds import LIMITS, mixed, open_box, trees, two_peaks

SEGMENTS = 192
FENCE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [60.0, 80.0], [60.0, 50.0], [0.0, 50.0]])


def curve_of(points: np.ndarray, problem: Problem, segments: int = SEGMENTS) -> Trajectory:
    return Trajectory(spline_from_path(points, problem, segments), problem.duration_s / segments)


@pytest.fixture(scope="module")
def square() -> Region:
    from planner.information import uniform
    from planner.workspace import Workspace

    workspace = Workspace(np.zeros(3), np.ones(3))
    centre = Motion.at_rest(np.full(3, 0.5))
    return Region(open_box(uniform(workspace), workspace=workspace, start=centre, end_position_m=None))


@pytest.mark.parametrize(("rows", "length"), [(4, 3.75), (5, 4.8), (6, 5.8333), (8, 7.875)])
def test_a_lawnmower_keeps_half_a_spacing_from_the_border(square: Region, rows: int, length: float) -> None:
    path = lawnmower(square, 0.0, rows)
    assert length_of(path) == pytest.approx(length, abs=1e-4)
    assert path.min() == pytest.approx(0.5 / rows)
    assert path.max() == pytest.approx(1.0 - 0.5 / rows)
    np.testing.assert_allclose(np.unique(path[:, 1].round(9)), (np.arange(rows) + 0.5) / rows)
    assert length_of(lawnmower(square, 0.5 * np.pi, rows)) == pytest.approx(length, abs=1e-4)


def test_layers_lie_across_each_other_and_share_the_rows(square: Region) -> None:
    path = layered_rows(square, 0.0, 5, [0.25, 0.75])
    low, high = path[path[:, 2] == 0.25], path[path[:, 2] == 0.75]
    assert len(low) == 6
    assert len(high) == 4
    assert len(np.unique(low[:, 1].round(9))) == 3
    assert len(np.unique(high[:, 0].round(9))) == 2


def test_rows_end_at_the_fence() -> None:
    region = Region(open_box(fence_polygon_m=FENCE))
    path = lawnmower(region, 0.0, 8)
    # Half a row's spacing of slack: rows are as long as the area beside them.
    assert (KeepIn.of(FENCE).distance(path) > -5.5).all()
    high = path[path[:, 1] > 55.0]
    assert high[:, 0].min() > 55.0


def test_the_long_axis_of_a_slanted_fence_is_a_heading() -> None:
    slanted = np.array([[5.0, 5.0], [15.0, 0.0], [90.0, 60.0], [80.0, 70.0]])
    region = Region(open_box(fence_polygon_m=slanted))
    assert region.headings_rad[0] == pytest.approx(np.arctan2(60.0, 75.0), abs=0.05)


def test_a_spiral_grows_evenly_to_half_a_spacing_from_the_border(square: Region) -> None:
    path = spiral(square, 3.0, steps_a_turn=200)
    radius = np.linalg.norm(path - 0.5, axis=1)
    assert (np.diff(radius) > 0.0).all()
    assert radius[-1] == pytest.approx(0.5 * 3.0 / 3.5)
    assert radius[400] - radius[200] == pytest.approx(radius[600] - radius[400])


def test_an_expanding_square_turns_at_right_angles_and_widens(square: Region) -> None:
    path = expanding_square(square, np.array([0.5, 0.5]), 9)
    legs = np.diff(path, axis=0)
    assert (np.abs(legs).min(axis=1) < 1e-12).all()
    np.testing.assert_allclose(np.sum(legs[1:7] * legs[:6], axis=1), 0.0, atol=1e-12)
    lengths = np.linalg.norm(legs, axis=1)
    assert lengths[0] == pytest.approx(lengths[1])
    assert lengths[2] == pytest.approx(2.0 * lengths[0])
    assert path.min() >= 0.0
    assert path.max() <= 1.0


def test_each_diameter_of_a_sector_search_crosses_the_datum() -> None:
    datum = np.array([3.0, -2.0])
    path = sectors(datum, 5.0, 4, 0.3)
    assert path.shape == (8, 2)
    np.testing.assert_array_equal(path[0], datum)
    np.testing.assert_allclose(np.linalg.norm(path[1:] - datum, axis=1), 5.0)
    legs = np.diff(path, axis=0)
    through = np.linalg.norm(legs, axis=1) > 9.9
    assert through.sum() == 3
    # The ways between diameters are short chords.
    chords = np.linalg.norm(legs[1:][~through[1:]], axis=1)
    np.testing.assert_allclose(chords, 2.0 * 5.0 * np.sin(np.pi / 8.0))


def test_a_tour_is_nearly_the_shortest_of_all() -> None:
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(12):
        start, end, places = rng.uniform(size=3), rng.uniform(size=3), rng.uniform(size=(6, 3))
        found = length_of(tour(start, places, end, 1.0))
        orders = itertools.permutations(range(6))
        best = min(length_of(np.concatenate([start[None], places[list(order)], end[None]])) for order in orders)
        ratios.append(found / best)
    assert max(ratios) < 1.2
    assert np.mean(ratios) < 1.03


def test_a_tour_without_an_end_visits_every_stop_once() -> None:
    rng = np.random.default_rng(1)
    places = rng.uniform(size=(40, 3))
    path = tour(np.zeros(3), places, None, 2.0)
    assert len(path) == 41
    assert {tuple(p) for p in path[1:]} == {tuple(p) for p in places}


def test_stops_stand_for_equal_shares_of_the_information() -> None:
    problem = open_box()
    problem = dataclasses.replace(problem, information=two_peaks(problem))
    places = stops(problem, 60, np.random.default_rng(0))
    near_second = np.linalg.norm(places[:, :2] - [75.0, 20.0], axis=1) < 40.0
    assert near_second.mean() == pytest.approx(2.0 / 3.0, abs=0.05)
    assert np.abs(places[near_second, 2] - 15.0).mean() < 2.0


def test_the_ridge_takes_the_greatest_information_first() -> None:
    problem = open_box()
    problem = dataclasses.replace(problem, information=two_peaks(problem))
    path = greedy_ridge(problem, problem.start.position_m, 150.0, 1.0)
    near = np.minimum(
        np.linalg.norm(path - [25.0, 60.0], axis=1) / 16.0, np.linalg.norm(path - [75.0, 20.0], axis=1) / 20.0
    )
    assert (near[1:] < 1.5).mean() > 0.9
    assert len({tuple(p) for p in path}) == len(path)


def test_peak_and_spread_describe_a_normal_density() -> None:
    from planner.information import gaussians

    problem = open_box()
    grid = gaussians(
        problem.workspace,
        np.array([[60.0, 40.0, 10.0]]),
        np.array([[5.0, 5.0, 50.0]]),
        np.ones(1),
        (100, 80, 2),
    )
    problem = dataclasses.replace(problem, information=grid)
    np.testing.assert_allclose(peak_m(problem), [60.0, 40.0], atol=0.51)
    # Nine tenths of a flat normal density lie within 2.146 standard deviations.
    assert spread_m(problem, np.array([60.0, 40.0])) == pytest.approx(2.146 * 5.0, rel=0.05)


def test_altitudes_are_those_of_the_information() -> None:
    problem = open_box()
    flat = Altitudes(problem)
    assert flat.layered
    np.testing.assert_allclose(flat.levels(2), [5.0, 15.0])
    np.testing.assert_allclose(flat.lifted(np.array([[10.0, 10.0], [90.0, 70.0]]), 0.25)[:, 2], 5.0, atol=1e-6)
    peaked = Altitudes(dataclasses.replace(problem, information=two_peaks(problem)))
    heights = peaked.lifted(np.array([[25.0, 60.0], [75.0, 20.0]]), 0.5)[:, 2]
    np.testing.assert_allclose(heights, [5.0, 15.0], atol=0.7)


def test_the_reach_is_that_of_the_vehicle() -> None:
    at_rest = open_box()
    cruise, change = 0.92 * 5.0, 0.5 * 3.0
    assert reach_m(at_rest) == pytest.approx(cruise * 200.0 - cruise**2 / change, rel=1e-3)
    moving = dataclasses.replace(at_rest, start=Motion(np.full(3, 9.0), np.array([cruise, 0, 0]), np.zeros(3)))
    assert reach_m(moving) == pytest.approx(cruise * 200.0 - cruise**2 / (2.0 * change), rel=1e-3)
    # In two seconds there is no cruise: up and down again.
    assert reach_m(at_rest, 2.0) == pytest.approx(change, rel=1e-3)


@pytest.mark.parametrize("length", [0.0, 1e-6, 0.5, 20.0, 60.0])
def test_a_path_shorter_than_the_reach_takes_all_of_the_time(length: float) -> None:
    problem = open_box(duration_s=60.0)
    begin = problem.start.position_m
    end = begin + np.array([length, 0.0, 0.0])
    positions, excess = paced(np.stack([begin, end]), problem, FreeSpace(problem), 601)
    assert excess < 1.0
    # Up to a cruise and down again with half of 3 m/s²: L = vT − v²/a.
    change = 0.5 * 3.0
    cruise = 0.5 * (60.0 * change - np.sqrt((60.0 * change) ** 2 - 4.0 * change * length))
    assert length_of(positions[250:351]) == pytest.approx(10.0 * cruise, rel=5e-3, abs=1e-9)
    np.testing.assert_allclose(positions[-1], end, atol=1e-9)


@settings(deadline=None)
@given(
    factor=st.floats(0.1, 20.0),
    power=st.floats(0.3, 2.0),
    most=st.integers(1, 300),
    begin=st.integers(1, 300),
    reaches=st.lists(st.floats(0.05, 2000.0), min_size=1, max_size=4),
)
def test_of_all_sizes_one_is_drawn_that_nearly_fills_the_reach(factor, power, most, begin, reaches) -> None:
    drawn: list[int] = []

    def make(size: int) -> np.ndarray:
        drawn.append(size)
        return np.array([[float(size), 0.0, 0.0]])

    def length_m(way: np.ndarray) -> float:
        return factor * float(way[0, 0]) ** power

    within = sizing.fitted(make, length_m, most, begin)
    for reach in reaches:
        size = int(within(reach)[0, 0])
        too_long = [one for one in range(1, most + 1) if factor * one**power > reach]
        if 1 in too_long:
            assert size == 1
        else:
            assert factor * size**power <= reach
            assert size == most or size + 1 in too_long or factor * size**power >= sizing.WELL_FITTED * reach
    assert len(drawn) == len(set(drawn))
    assert drawn[0] == min(begin, most)
    # A length that is a power of the size is found at once, but for what rounding makes of small sizes.
    assert len(drawn) <= 5 + 4 * len(reaches)


def test_sizes_whose_lengths_are_in_no_order_are_searched_to_an_end() -> None:
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(0.5, 1.5, 161) * np.arange(161) for _ in range(50)]
    # However large, nearly or exactly as long, or with no length at all.
    alike = [np.full(161, 70.0), 70.0 + 1e-12 * np.arange(161), 70.0 - 1e-12 * np.arange(161), np.zeros(161)]
    for lengths in drawn + alike:
        begin = int(rng.integers(1, 161))
        within = sizing.fitted(
            lambda size: np.full((1, 3), float(size)), lambda way, of=lengths: of[int(way[0, 0])], 160, begin
        )
        for reach in (20.0, 90.0, 60.0, 400.0):
            assert lengths[int(within(reach)[0, 0])] <= max(reach, lengths[1])


@pytest.mark.parametrize("share", [0.3, 0.5, 0.88])
def test_patterns_whose_size_is_chosen_come_close_to_the_reach(share: float) -> None:
    problem = open_box(two_peaks(open_box()), end_position_m=None)
    drawing = Drawing(problem, FreeSpace(problem), lead_in(problem))
    reach = share * reach_m(problem)
    for pattern in (Pattern.TOUR, Pattern.SQUARE, Pattern.RANDOM):
        way = drawing.ways(pattern, 0, np.random.default_rng(1))(reach)
        length = length_of(np.concatenate([problem.start.position_m[None], way]))
        assert 0.85 * reach <= length <= reach, pattern


def test_every_pattern_is_drawn_and_begins_and_ends_where_it_should() -> None:
    problem = open_box()
    seeds = seed_paths(problem, 14, np.random.default_rng(0))
    assert [seed.pattern for seed in seeds[:3]] == ["lawnmower", "information tour", "greedy ridge"]
    assert {seed.pattern for seed in seeds} == {pattern.value for pattern in Pattern if pattern not in LAST_RESORT}
    for seed in seeds:
        np.testing.assert_allclose(seed.points_m[0], problem.start.position_m)
        np.testing.assert_allclose(seed.points_m[-1], problem.end_position_m)
        assert all(problem.workspace.contains(point) for point in seed.points_m)
    lengths = np.array([length_of(seed.points_m) for seed in seeds])
    # The time is used: climbs and corners take the rest.
    assert (lengths > 0.5 * reach_m(problem)).all()
    assert (lengths < 1.05 * reach_m(problem)).all()
    unit = np.stack([problem.workspace.unit_from_enu(seed.points_m) for seed in seeds])
    apart = np.linalg.norm(unit[:, None] - unit[None], axis=-1).mean(axis=-1)
    assert apart[~np.eye(len(seeds), dtype=bool)].min() > 0.1


def test_the_same_generator_gives_the_same_paths_and_another_gives_others() -> None:
    problem = open_box(obstacles=ObstacleField.of(trees(np.random.default_rng(0), 8)))
    first, again, other = (seed_paths(problem, 5, np.random.default_rng(n)) for n in (7, 7, 8))
    for one, two in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.points_m, two.points_m)
    assert not np.array_equal(first[1].points_m, other[1].points_m)


def test_in_the_open_every_seed_can_be_flown_as_it_is() -> None:
    problem = open_box()
    for seed in seed_paths(problem, 12, np.random.default_rng(1)):
        report = inspect(curve_of(seed.points_m, problem), problem)
        # The spline rounds what is sharper than its knots; a few hundredths over are the optimiser's to mend.
        allowed = {ViolationKind.ACCELERATION, ViolationKind.CLIMB, ViolationKind.DESCENT}
        assert {violation.kind for violation in report.violations} <= allowed, seed.pattern
        assert all(violation.measured < 1.15 * violation.limit for violation in report.violations), seed.pattern


@pytest.mark.parametrize("kind", [trees, mixed])
def test_between_obstacles_seeds_are_almost_free(kind) -> None:
    problem = open_box(obstacles=ObstacleField.of(kind(np.random.default_rng(3), 16)))
    for seed in seed_paths(problem, 8, np.random.default_rng(0)):
        clearance = problem.obstacles.distance(seed.points_m) - problem.keep_out_m
        assert (clearance < -0.3).mean() < 0.02, seed.pattern


def test_seeds_stay_inside_the_fence() -> None:
    problem = open_box(fence_polygon_m=FENCE)
    for seed in seed_paths(problem, 8, np.random.default_rng(0)):
        inside = KeepIn.of(FENCE).distance(seed.points_m[:, :2])
        assert (inside < -0.2).mean() < 0.02, seed.pattern


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_any_replan_gets_finite_paths_from_where_it_is(seed: int) -> None:
    rng = np.random.default_rng(seed)
    velocity = rng.normal(size=3)
    velocity *= rng.uniform(0.0, 4.5) / np.linalg.norm(velocity) * np.array([1.0, 1.0, 0.3])
    start = Motion(rng.uniform([1, 1, 1], [99, 79, 19]), velocity, rng.normal(size=3))
    end = None if rng.random() < 0.4 else rng.uniform([1, 1, 1], [99, 79, 19])
    problem = open_box(
        obstacles=ObstacleField.of(mixed(rng, int(rng.integers(0, 8)))),
        start=start,
        end_position_m=end,
        duration_s=float(10.0 ** rng.uniform(0.0, 2.5)),
        fence_polygon_m=FENCE if rng.random() < 0.3 else None,
    )
    for path in seed_paths(problem, 7, rng):
        assert path.points_m.shape == (1025, 3)
        assert np.isfinite(path.points_m).all()
        np.testing.assert_allclose(path.points_m[0], start.position_m, atol=1e-9)
        if end is not None:
            np.testing.assert_allclose(path.points_m[-1], end, atol=1e-9)
        curve = curve_of(path.points_m, problem, 32)
        report = inspect(curve, problem)
        assert not {ViolationKind.START, ViolationKind.END, ViolationKind.DURATION} & {
            violation.kind for violation in report.violations
        }


def test_a_vehicle_in_motion_is_carried_on_before_it_turns() -> None:
    start = Motion(np.array([50.0, 40.0, 10.0]), np.array([4.0, 0.0, 0.0]), np.zeros(3))
    carried = lead_in(open_box(start=start))
    np.testing.assert_allclose(carried[0], start.position_m)
    # Braking from 4 m/s with half of 3 m/s² takes 5.3 m.
    assert 5.0 < carried[1, 0] - 50.0 < 6.5
    assert len(lead_in(open_box())) == 1


def test_a_spline_follows_its_path_from_the_start_as_it_is_to_rest() -> None:
    start = Motion(np.array([10.0, 10.0, 5.0]), np.array([3.0, 1.0, 0.2]), np.array([0.0, 0.5, 0.0]))
    problem = open_box(start=start, end_position_m=None, duration_s=60.0)
    time = np.linspace(0.0, 60.0, 1025)
    angle = time * np.pi / 60.0
    # Leaves with the start's velocity, ends at rest.
    points = np.column_stack(
        [
            10.0 + 57.0 * np.sin(angle / 2.0) ** 2 + 3.0 * 60.0 / np.pi * np.sin(angle) / 2.0,
            10.0 + 20 * angle,
            5 + angle,
        ]
    )
    curve = curve_of(points, problem, 120)
    first, last = curve.motion_at(0.0), curve.motion_at(curve.end_s)
    np.testing.assert_allclose(first.position_m, start.position_m, atol=1e-9)
    np.testing.assert_allclose(first.velocity_mps, start.velocity_mps, atol=1e-9)
    np.testing.assert_allclose(first.acceleration_mps2, start.acceleration_mps2, atol=1e-9)
    np.testing.assert_allclose(last.position_m, points[-1], atol=1e-9)
    np.testing.assert_allclose(last.velocity_mps, 0.0, atol=1e-9)
    middle = (time > 3.0) & (time < 57.0)
    np.testing.assert_allclose(curve.sample(time[middle]).position_m, points[middle], atol=1e-3)


def test_a_spline_of_a_path_along_the_wall_stays_in_the_box() -> None:
    problem = open_box(end_position_m=None)
    rng = np.random.default_rng(0)
    points = np.clip(np.cumsum(rng.normal(size=(300, 3)) * 6.0, axis=0) + 5.0, [0, 0, 0], [100, 80, 20])
    points[0] = problem.start.position_m
    report = inspect(curve_of(points, problem), problem)
    assert ViolationKind.BOX not in {violation.kind for violation in report.violations}


def test_a_spline_of_too_few_pieces_is_refused() -> None:
    with pytest.raises(ValueError, match="four segments or more"):
        spline_from_path(np.zeros((5, 3)), open_box(), 3)


def test_the_limits_are_those_of_the_problem() -> None:
    slow = dataclasses.replace(LIMITS, max_speed_mps=1.0)
    problem = open_box(limits=slow)
    for seed in seed_paths(problem, 4, np.random.default_rng(0)):
        assert inspect(curve_of(seed.points_m, problem, 1000), problem).max_speed_mps < 1.03


def test_patterns_are_larger_where_there_is_more_time() -> None:
    short, long = open_box(duration_s=60.0), open_box(duration_s=400.0)
    for one, two in zip(
        seed_paths(short, 7, np.random.default_rng(0)), seed_paths(long, 7, np.random.default_rng(0)), strict=True
    ):
        assert length_of(two.points_m) > 2.0 * length_of(one.points_m), one.pattern


def test_the_free_space_of_seeds_keeps_more_than_the_gate_asks() -> None:
    problem = open_box(obstacles=ObstacleField.of(trees(np.random.default_rng(0), 4)))
    points = np.random.default_rng(1).uniform([0, 0, 0], [100, 80, 20], (500, 3))
    free = FreeSpace(problem).margin(points) >= 0.0
    assert (problem.obstacles.distance(points[free]) > problem.keep_out_m).all()


@pytest.mark.parametrize("end", [None, np.array([5.0, 6.0, 10.0])])
def test_of_a_pattern_far_larger_than_the_reach_only_what_is_within_reach_is_looked_at(monkeypatch, end) -> None:
    sizes = []

    def counted(points_m: np.ndarray, spacing_m: float) -> np.ndarray:
        dense = densified(points_m, spacing_m)
        sizes.append(len(dense))
        return dense

    monkeypatch.setattr(pacing, "densified", counted)
    problem = open_box(end_position_m=end)
    rows = np.array([[5.0, 5.0, 10.0], [95.0, 5.0, 10.0], [95.0, 75.0, 10.0], [5.0, 75.0, 10.0]])
    path = led_to_the_end(rows, problem, FreeSpace(problem), 2.5)
    assert max(sizes) < 1100
    assert length_of(path) <= 2.5 * 1.01
    assert np.linalg.norm(path[-1] - path[0]) == pytest.approx(2.5 if end is None else 1.0, rel=0.01)


def test_a_polyline_is_cut_at_a_length() -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 4.0]])
    legs = np.array([3.0, 4.0])
    np.testing.assert_allclose(cut_at(corners, legs, 5.0), [[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]])
    np.testing.assert_allclose(cut_at(corners, legs, 1.0), [[0.0, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(cut_at(corners, legs, 3.0), corners[:2])
    np.testing.assert_allclose(cut_at(corners, legs, 9.0), corners)


def test_without_time_to_draw_more_seeds_those_that_were_drawn_are_varied() -> None:
    problem = open_box()
    asked = itertools.count()
    seeds = seed_paths(problem, 7, np.random.default_rng(0), go_on=lambda: next(asked) < 1)
    drawn = seed_paths(problem, 4, np.random.default_rng(0))
    assert [seed.pattern for seed in seeds] == [drawn[index % 4].pattern for index in range(7)]
    for seed, own in zip(seeds, drawn, strict=False):
        np.testing.assert_array_equal(seed.points_m, own.points_m)
    for seed, source in zip(seeds[4:], itertools.cycle(drawn), strict=False):
        aside = np.linalg.norm(seed.points_m - source.points_m, axis=1)
        assert aside[[0, -1]].max() == 0.0
        assert 1.0 < aside.max() < 30.0
        assert (seed.points_m >= problem.workspace.box_min_m).all()
        assert (seed.points_m <= problem.workspace.box_max_m).all()
