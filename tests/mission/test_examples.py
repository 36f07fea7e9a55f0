from pathlib import Path

import numpy as np
import pytest

from mission.loading import load
from mission.site.endurance import endurance_budget
from mission.site.footprints import footprints_of
from mission.site.problem import options_from_mission, problem_from_mission

EXAMPLES = Path(__file__).parents[2] / "examples"
NAMES = sorted(path.stem for path in EXAMPLES.glob("*.toml"))


def test_the_examples_are_there():
    assert {"room", "forest", "search", "city", "hill"} <= set(NAMES)


@pytest.mark.parametrize("name", NAMES)
def test_an_example_is_sound_and_its_battery_lasts(name):
    mission = load(EXAMPLES / f"{name}.toml")
    problem, options = problem_from_mission(mission), options_from_mission(mission)
    assert endurance_budget(mission).spare_s > 0.0
    assert problem.workspace.contains(problem.start.position_m)
    assert problem.obstacles.distance(problem.start.position_m[None]).min() >= problem.keep_out_m
    assert options.candidates == mission.planner.candidates
    np.testing.assert_allclose(problem.information.mass.sum(), 1.0)


def test_the_room_is_the_one_of_the_paper():
    mission = load(EXAMPLES / "room.toml")
    assert mission.site.box_m == ((0.0, 0.0, 0.5), (3.0, 3.0, 1.5))
    assert len(mission.obstacle) == 3
    assert mission.time_step_s == pytest.approx(0.1)
    assert (mission.planner.candidates, mission.planner.modes) == (4, (8, 8, 8))


def test_no_information_lies_in_an_obstacle_or_beside_it():
    problem = problem_from_mission(load(EXAMPLES / "room.toml"))
    informed = problem.information.centers_m()[problem.information.mass > 0.0]
    assert problem.obstacles.distance(informed).min() >= problem.keep_out_m


def test_the_search_is_centred_on_the_likeliest_place_of_any_raster(tmp_path):
    random = np.random.default_rng(5)
    rows = random.uniform(size=(140, 151))
    rows[40, 77] = 9.0
    np.savez(tmp_path / "other.npz", probability=rows)
    mission = load(EXAMPLES / "search.toml", [f"information.raster={tmp_path / 'other.npz'}"])
    grid = problem_from_mission(mission).information
    peak = grid.centers_m().reshape(-1, 3)[np.argmax(grid.mass)]
    assert np.abs(peak[:2]).max() <= 30.0


def test_a_raster_lies_with_its_first_row_in_the_north_and_its_first_column_in_the_west(tmp_path):
    rows = np.zeros((50, 50))
    rows[2, 5] = 1.0
    np.save(tmp_path / "corner.npy", rows)
    raster = f"information={{kind='raster', raster='{tmp_path / 'corner.npy'}', cell_m=30, center_enu_m=[0, 0]}}"
    problem = problem_from_mission(load(EXAMPLES / "search.toml", [raster]))
    peak = problem.information.centers_m().reshape(-1, 3)[np.argmax(problem.information.mass)]
    np.testing.assert_allclose(peak[:2], [-750 + 5.5 * 30, 750 - 2.5 * 30], atol=15.0)
    upside_down = raster.replace("cell_m", "rows='south-to-north', cell_m")
    problem = problem_from_mission(load(EXAMPLES / "search.toml", [upside_down]))
    peak = problem.information.centers_m().reshape(-1, 3)[np.argmax(problem.information.mass)]
    np.testing.assert_allclose(peak[:2], [-750 + 5.5 * 30, -750 + 2.5 * 30], atol=15.0)


def test_the_city_has_buildings_to_fly_around_and_buildings_to_fly_over():
    mission = load(EXAMPLES / "city.toml")
    floor, ceiling = mission.site.box_m[0][2], mission.site.box_m[1][2]
    heights = [footprint.ceiling_m for footprint in footprints_of(mission) if not footprint.no_fly]
    assert 25 <= len(heights) <= 40
    assert sum(height + mission.keep_out_m > ceiling - 10.0 for height in heights) >= 1
    assert sum(floor < height < ceiling - mission.keep_out_m for height in heights) >= 10


def test_the_data_of_the_examples_are_what_their_scripts_make(tmp_path):
    import importlib.util
    import json

    def script(name):
        spec = importlib.util.spec_from_file_location(name, EXAMPLES / f"{name}.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        return module

    shipped = np.load(EXAMPLES / "search_probability.npz")["probability"]
    np.testing.assert_allclose(script("make_search_raster").probability(), shipped, rtol=1e-4, atol=1e-9)
    town = json.loads((EXAMPLES / "city_buildings.geojson").read_text(encoding="utf-8"))
    assert script("make_city_buildings").feature_collection() == town
