"""What is allowed and probably not meant is said; where there is no way at all, it is refused."""

import dataclasses
import json

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cautions import cautions_about_plan, slowest_under_way
from mission.cli import app
from mission.findings import InputError
from mission.loading import load
from mission.plan_output import summary_of
from planner.trajectory import Trajectory
from tests.mission.proven import proven


def checked(sound, override):
    result = CliRunner().invoke(app, ["check", str(sound), "--set", override, "--json"])
    assert result.exit_code == 0, result.stderr
    warnings = json.loads(result.stdout)["warnings"]
    assert all(f"! {warning}" in result.stderr for warning in warnings)
    return warnings


def test_a_raster_that_covers_a_quarter_of_the_box_and_is_cut_is_said(sound, tmp_path):
    np.save(tmp_path / "map.npy", np.ones((50, 50)))
    raster = f"information={{kind='raster', raster='{tmp_path / 'map.npy'}', cell_m=10"
    covers, cut = checked(sound, raster + "}")
    assert "map.npy covers 25 % of the box" in covers
    assert "75 % of the weight in map.npy lies outside the box" in cut
    assert checked(sound, raster + ", center_enu_m=[250, 250]}") == []


@pytest.mark.parametrize(
    ("section", "kind", "shape"),
    [
        ("obstacle", "sphere", "center_enu_m=[{east}, 250, 50], radius_m=20"),
        ("obstacle", "cylinder", "center_enu_m=[{east}, 250], radius_m=5, floor_m=0, ceiling_m=60"),
        ("obstacle", "box", "min_enu_m=[{east}, 0, 0], max_enu_m=[10000, 10, 9]"),
        ("no_fly", "prism", "polygon_enu_m=[[{east}, 0], [10000, 0], [10000, 30]], floor_m=0, ceiling_m=60"),
    ],
)
def test_an_obstacle_in_numbers_that_lies_elsewhere_is_said_and_one_nearby_is_not(section, kind, shape, sound):
    (said,) = checked(sound, f"{section}=[{{kind='{kind}', {shape.format(east=9000)}}}]")
    assert said.startswith(f"{section}.0 ({kind}) lies 8 km from the mission")
    assert checked(sound, f"{section}=[{{kind='{kind}', {shape.format(east=900)}}}]") == []


def test_a_plan_that_loses_to_the_lawnmower_or_stands_still_is_said(planned):
    assert cautions_about_plan(planned) == []
    worse = dataclasses.replace(planned, plan=dataclasses.replace(planned.plan, lawnmower_ergodic_metric=0.001))
    (said,) = summary_of(worse, [])["warnings"]
    assert "a lawnmower of the same length explores better (ergodic metric 0.001, this path 0.02)" in said
    # A search is compared by what it finds.
    best = dataclasses.replace(planned.plan.best, probability_found=0.3)
    finding = dataclasses.replace(worse.plan, candidates=(best,), selected=0, lawnmower_probability_found=0.2)
    assert cautions_about_plan(dataclasses.replace(worse, plan=finding)) == []
    less = dataclasses.replace(finding, lawnmower_probability_found=0.4)
    (said,) = cautions_about_plan(dataclasses.replace(worse, plan=less))
    assert "(probability of finding nothing 0.6, this path 0.7)" in said
    along = np.concatenate([np.zeros(3), np.linspace(0.0, 0.5, 10), np.full(3, 0.5)])
    places = np.column_stack([10.0 + along, np.full(len(along), 10.0), np.full(len(along), 30.0)])
    curve = Trajectory(places, 600.0 / (len(along) - 3))
    still = dataclasses.replace(planned.plan.best, trajectory=proven(curve))
    standing = dataclasses.replace(planned.plan, candidates=(planned.plan.candidates[0], still))
    (said,) = cautions_about_plan(dataclasses.replace(planned, plan=standing))
    assert "hardly moves (0.5 m in 600 s)" in said


def test_the_least_speed_of_a_wing_is_said_and_the_ends_at_rest_are_not_it(planned):
    speeds = np.concatenate(
        [np.linspace(0.0, 20.0, 10), [20.0] * 10, [6.0] * 10, [20.0] * 10, np.linspace(20.0, 0.0, 10), [0.0] * 2]
    )
    control = np.column_stack([np.cumsum(speeds), np.zeros_like(speeds), np.full_like(speeds, 50.0)])
    curve = Trajectory(control, 1.0)
    slowest_mps, at_s = slowest_under_way(curve)
    assert slowest_mps == pytest.approx(6.0, abs=0.01)
    assert 18.0 < at_s < 30.0
    wing = planned.mission.model_copy(
        update={"vehicle": planned.mission.vehicle.model_copy(update={"preset": "fixed-wing"})}
    )
    best = dataclasses.replace(planned.plan.best, trajectory=proven(curve))
    plan = dataclasses.replace(planned.plan, candidates=(planned.plan.candidates[0], best))
    (said,) = cautions_about_plan(dataclasses.replace(planned, mission=wing, plan=plan))
    assert "its speed falls to 6.0 m/s" in said


WALL = "{kind='box', min_enu_m=[200, -9, 0], max_enu_m=[230, %s, 90]}"
CAGE = "{kind='box', min_enu_m=[%s, %s, 0], max_enu_m=[%s, %s, 90]}"
SIDES = [(10, 100, 230, 130), (10, 470, 230, 500), (-10, 100, 20, 500), (220, 100, 250, 500)]


def refused(sound, obstacles, *overrides):
    with pytest.raises(InputError) as caught:
        load(sound, [f"obstacle=[{', '.join(obstacles)}]", *overrides])
    return {finding.path: finding.advice for finding in caught.value.findings}


def test_an_end_behind_a_wall_without_a_gap_is_refused_and_one_with_a_gap_is_not(sound):
    end = "planner.end_enu_m=[400, 20, 30]"
    assert "no way there from the start" in refused(sound, [WALL % 510], end)["planner.end_enu_m"]
    load(sound, [f"obstacle=[{WALL % 480}]", end])


def test_information_that_is_walled_in_is_refused(sound):
    component = "information={kind='gaussians', component=[{mean_enu_m=[120, 300, 40], std_m=[15, 15, 15]}]}"
    cage = [CAGE % side for side in SIDES]
    assert "no way from the start to it" in refused(sound, cage, component)["information.component"]
    load(sound, [f"obstacle=[{', '.join(cage[1:])}]", component])


def test_the_time_of_the_solver_is_told_without_that_of_compiling(planned, capsys):
    from mission.verbs.plan import _report

    slow = dataclasses.replace(planned, solve_s=6.1, compile_s=12.0, total_s=18.6)
    _report(slow, [])
    assert "solved in 6.1 s, and 12 s of compiling" in capsys.readouterr().err
    summary = summary_of(slow, [])
    assert (summary["solve_s"], summary["compile_s"], summary["total_s"]) == (6.1, 12.0, 18.6)


def test_what_a_plan_should_not_be_is_said_before_it_is_flown(sound, planned, tmp_path, monkeypatch):
    impatient = planned.mission.link.model_copy(update={"ready_timeout_s": 1.0})
    worse = dataclasses.replace(
        planned,
        mission=planned.mission.model_copy(update={"link": impatient}),
        plan=dataclasses.replace(planned.plan, lawnmower_ergodic_metric=0.001),
    )
    monkeypatch.setattr("mission.planning.plan", lambda *_, **__: worse)
    nobody = ["--link", "udp://127.0.0.1:1", "--out", str(tmp_path / "flight")]
    result = CliRunner().invoke(app, ["fly", str(sound), *nobody])
    assert result.exit_code == 1
    assert "! a lawnmower of the same length explores better" in result.stderr
