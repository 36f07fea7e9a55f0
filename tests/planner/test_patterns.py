"""The search patterns, against their geometry."""

import numpy as np
import pytest

from planner.polygon import KeepIn
from planner.polyline import length_of
from planner.seeds.patterns import Region, expanding_square, lawnmower, layered_rows, sectors, spiral
from planner.trajectory import Motion
from tests.planner.worlds import open_box

FENCE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [60.0, 80.0], [60.0, 50.0], [0.0, 50.0]])


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
