"""`mission plan` from the mission file to plan.json, confirmed by a checker that shares no code with the planner."""

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mission.cli import app
from tests.planner.independent_checker import check

EXAMPLES = Path(__file__).parents[2] / "examples"


def planned_example(name, tmp_path):
    arguments = ["plan", str(EXAMPLES / f"{name}.toml"), "--out", str(tmp_path), "--json", "--candidates"]
    # On a slow computer the default would make a worse plan.
    result = CliRunner().invoke(app, [*arguments, "--set", "planner.time_limit_s=240"])
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary["feasible"]
    plan = json.loads((tmp_path / "plan.json").read_text())
    confirmed = check(plan)
    assert confirmed.faults == ()
    assert summary["min_clearance_m"] <= confirmed.min_clearance_m + 1e-6
    assert summary["max_speed_mps"] >= confirmed.max_speed_mps * (1.0 - 1e-3)
    assert summary["ergodic_metric"] < summary["lawnmower_ergodic_metric"]
    return summary, plan


def test_the_room_is_planned_and_an_independent_checker_agrees(tmp_path):
    summary, plan = planned_example("room", tmp_path)
    assert len(summary["candidates"]) == 4
    assert summary["diversity"]["mean_pair_distance"] > 0.15
    assert {Path(file).name for file in summary["files"]} == {path.name for path in tmp_path.iterdir()}
    assert plan["problem"]["seed"] == 0
    assert (tmp_path / "candidates.png").stat().st_size > 10_000
    assert sorted(row["rank"] for row in summary["candidates"]) == [1, 2, 3, 4]
    assert summary["candidates"][summary["selected"]]["mean_distance_to_selected_m"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("name", ["forest", "search", "city", "hill"])
def test_an_example_is_planned_and_an_independent_checker_agrees(name, tmp_path):
    summary, _ = planned_example(name, tmp_path)
    share = 1.0 if name == "forest" else 0.5
    assert summary["ergodic_metric"] <= share * summary["lawnmower_ergodic_metric"]


def test_a_plan_that_cannot_be_is_refused_with_exit_code_1_and_the_reason(tmp_path):
    mission = tmp_path / "walled.toml"
    text = (EXAMPLES / "room.toml").read_text(encoding="utf-8")
    # The way around it takes longer than there is time.
    wall = '\n[[obstacle]]\nkind = "box"\nmin_enu_m = [1.4, -1.0, 0.0]\nmax_enu_m = [1.6, 2.5, 2.0]\n'
    mission.write_text(text.replace("start_enu_m = [0.3, 0.3", "start_enu_m = [1.0, 0.3") + wall, encoding="utf-8")
    arguments = [
        "plan",
        str(mission),
        "--out",
        str(tmp_path / "out"),
        "--json",
        "--set",
        "planner.time_limit_s=1",
        "--set",
    ]
    result = CliRunner().invoke(app, [*arguments, "planner.end_enu_m=[2.0, 0.3, 1.0]", "--set", "planner.duration_s=2"])
    assert result.exit_code == 1
    summary = json.loads(result.stdout)
    assert not summary["feasible"]
    assert all(candidate["violations"] for candidate in summary["candidates"])
    assert "nothing to fly" in result.stderr
    assert "Traceback" not in result.output


def test_a_plan_that_was_short_of_time_says_so(tmp_path):
    arguments = ["plan", str(EXAMPLES / "room.toml"), "--out", str(tmp_path), "--set", "planner.time_limit_s=0.01"]
    assert "ran short of time" in CliRunner().invoke(app, arguments).stderr
