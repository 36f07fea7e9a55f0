"""`mission plan` from the mission file to plan.json, confirmed by a checker that shares no code with the planner."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from scipy.interpolate import BSpline
from typer.testing import CliRunner

from mission.cli import app

EXAMPLES = Path(__file__).parents[2] / "examples"


def flown(plan, times_finer):
    """Positions, velocities and accelerations between the samples of plan.json, from its own spline by scipy."""
    spline = plan["spline"]
    points, h = np.array(spline["control_points_enu_m"]), spline["knot_interval_s"]
    knots = spline["start_s"] + (np.arange(len(points) + 4) - 3.0) * h
    curve = BSpline(knots, points, 3)
    time = np.array(plan["trajectory"]["time_s"])
    fine = np.interp(np.linspace(0.0, len(time) - 1.0, times_finer * (len(time) - 1) + 1), np.arange(len(time)), time)
    fine = np.clip(fine, time[0], np.nextafter(time[-1], -np.inf))
    np.testing.assert_allclose(curve(fine[::times_finer]), plan["trajectory"]["position_enu_m"], atol=1e-6)
    return curve(fine), curve(fine, 1), curve(fine, 2)


def outside_upright(horizontal, points, floor, ceiling):
    vertical = np.maximum(floor - points[:, 2], points[:, 2] - ceiling)
    return np.hypot(np.maximum(horizontal, 0.0), np.maximum(vertical, 0.0))


def distance_to(obstacle, points, origin):
    """Distance from points outside an obstacle to it, zero inside."""
    match obstacle["kind"]:
        case "sphere":
            return np.maximum(np.linalg.norm(points - obstacle["center_enu_m"], axis=1) - obstacle["radius_m"], 0.0)
        case "cylinder":
            across = np.linalg.norm(points[:, :2] - obstacle["center_enu_m"], axis=1) - obstacle["radius_m"]
            return outside_upright(across, points, obstacle["floor_m"], obstacle["ceiling_m"])
        case "prism":
            base = shapely.Polygon(obstacle["polygon_enu_m"])
            across = shapely.distance(base, shapely.points(points[:, :2]))
            return outside_upright(across, points, obstacle["floor_m"], obstacle["ceiling_m"])
        case "geojson":
            return np.min([distance_to(building, points, origin) for building in prisms(obstacle, origin)], axis=0)
        case other:
            raise AssertionError(f"the checker does not know {other}")


def prisms(obstacle, origin):
    import pymap3d

    place = (origin["latitude_deg"], origin["longitude_deg"], origin["altitude_amsl_m"])
    for feature in json.loads(Path(obstacle["file"]).read_text())["features"]:
        longitude, latitude = np.array(feature["geometry"]["coordinates"][0]).T.copy()
        east, north, _ = pymap3d.geodetic2enu(latitude, longitude, place[2], *place)
        polygon = np.stack([east, north], axis=-1).tolist()
        ceiling = feature["properties"]["height_m"]
        yield {"kind": "prism", "polygon_enu_m": polygon, "floor_m": 0.0, "ceiling_m": ceiling}


def check(plan, times_finer=20):
    """Every limit that plan.json names, at twenty times the streaming rate."""
    limits, mission = plan["limits"], plan["problem"]["mission"]
    position, velocity, acceleration = flown(plan, times_finer)
    assert (position >= np.array(limits["box_min_enu_m"]) - 1e-6).all()
    assert (position <= np.array(limits["box_max_enu_m"]) + 1e-6).all()
    speed = np.linalg.norm(velocity, axis=1)
    assert speed.max() <= limits["max_speed_mps"] * (1.0 + 1e-6)
    assert velocity[:, 2].max() <= limits["max_climb_mps"] * (1.0 + 1e-6)
    assert -velocity[:, 2].min() <= limits["max_descent_mps"] * (1.0 + 1e-6)
    assert np.linalg.norm(acceleration, axis=1).max() <= limits["max_acceleration_mps2"] * (1.0 + 1e-6)
    obstacles = [*mission.get("obstacle", ()), *mission.get("no_fly", ())]
    clearance = np.min([distance_to(obstacle, position, plan["origin"]) for obstacle in obstacles], axis=0)
    assert clearance.min() - limits["vehicle_radius_m"] >= limits["clearance_margin_m"] - 1e-6
    return float(clearance.min() - limits["vehicle_radius_m"]), float(speed.max())


def planned_example(name, tmp_path):
    arguments = ["plan", str(EXAMPLES / f"{name}.toml"), "--out", str(tmp_path), "--json"]
    # Compiling counts against the limit, and here it may have to happen first.
    result = CliRunner().invoke(app, [*arguments, "--set", "planner.time_limit_s=240"])
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary["feasible"]
    plan = json.loads((tmp_path / "plan.json").read_text())
    least_m, fastest_mps = check(plan)
    assert summary["min_clearance_m"] <= least_m + 1e-6
    assert summary["max_speed_mps"] >= fastest_mps - 1e-6
    assert summary["ergodic_metric"] < summary["lawnmower_ergodic_metric"]
    return summary, plan


def test_the_room_is_planned_and_an_independent_checker_agrees(tmp_path):
    summary, plan = planned_example("room", tmp_path)
    assert len(summary["candidates"]) == 4
    assert summary["diversity"]["mean_pair_distance"] > 0.15
    assert {Path(file).name for file in summary["files"]} == {path.name for path in tmp_path.iterdir()}
    assert plan["problem"]["seed"] == 0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["forest", "search", "city"])
def test_an_example_is_planned_and_an_independent_checker_agrees(name, tmp_path):
    summary, _ = planned_example(name, tmp_path)
    share = 0.5 if name in ("search", "city") else 1.0
    assert summary["ergodic_metric"] <= share * summary["lawnmower_ergodic_metric"]


def test_a_plan_that_cannot_be_is_refused_with_exit_code_1_and_the_reason(tmp_path):
    mission = tmp_path / "walled.toml"
    text = (EXAMPLES / "room.toml").read_text(encoding="utf-8")
    wall = '\n[[obstacle]]\nkind = "box"\nmin_enu_m = [1.4, -1.0, 0.0]\nmax_enu_m = [1.6, 4.0, 2.0]\n'
    mission.write_text(text + wall, encoding="utf-8")
    arguments = ["plan", str(mission), "--out", str(tmp_path / "out"), "--json", "--set", "planner.time_limit_s=1"]
    result = CliRunner().invoke(app, [*arguments, "--set", "planner.end_enu_m=[2.7, 2.7, 1.0]"])
    assert result.exit_code == 1
    summary = json.loads(result.stdout)
    assert not summary["feasible"]
    assert all(candidate["violations"] for candidate in summary["candidates"])
    assert "nothing to fly" in result.stderr
    assert "Traceback" not in result.output
