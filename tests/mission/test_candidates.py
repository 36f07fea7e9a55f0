"""The candidates of a plan side by side."""

import dataclasses
import json
import math

import numpy as np
import pytest
from matplotlib.image import imread

from mission.candidates import candidates_as_json, ranked_candidates
from mission.pictures.candidates_picture import draw_candidates
from mission.plan_output import summary_of, write_outputs
from planner.plan import Status


@pytest.fixture(scope="module")
def rows(planned):
    return ranked_candidates(planned)


def test_what_passed_the_gate_ranks_before_what_did_not_however_low_its_cost(rows):
    assert [(row.rank, row.index, row.candidate.feasible) for row in rows] == [(1, 1, True), (2, 0, False)]


def test_the_distance_to_the_selected_path_is_a_mean_over_time_in_metres(rows, planned):
    moments = np.linspace(0.0, 600.0, 20_001)
    first, second = (candidate.trajectory.sample(moments).position_m for candidate in planned.plan.candidates)
    assert rows[0].distance_to_selected_m == 0.0
    assert rows[1].distance_to_selected_m == pytest.approx(np.linalg.norm(first - second, axis=1).mean(), rel=1e-3)


def test_each_candidate_is_compared_with_a_lawnmower_of_its_own_length(rows):
    assert rows[0].lawnmower_ergodic_metric != rows[1].lawnmower_ergodic_metric
    for row in rows:
        expected = row.candidate.ergodic_metric / row.lawnmower_ergodic_metric
        assert row.over_lawnmower == pytest.approx(expected)


def test_only_the_best_of_hundreds_are_compared_with_lawnmowers(planned, monkeypatch):
    monkeypatch.setattr("mission.candidates.MOST_COMPARED", 1)
    first, second = ranked_candidates(planned)
    assert math.isfinite(first.over_lawnmower)
    assert math.isnan(second.over_lawnmower)
    assert candidates_as_json([first, second])[0]["lawnmower_ergodic_metric"] is None


def test_the_verdict_names_what_is_broken_most(rows):
    assert rows[0].verdict == "passed"
    assert rows[1].verdict in [violation.text for violation in rows[1].candidate.report.violations]
    assert "clearance" in rows[1].verdict


def test_the_json_rows_keep_the_order_of_the_set(planned, rows):
    found = summary_of(planned, [], rows)["candidates"]
    assert [row["rank"] for row in found] == [2, 1]
    assert found[1]["mean_distance_to_selected_m"] == 0.0
    assert "rank" not in summary_of(planned, [])["candidates"][0]
    json.dumps(found, allow_nan=False)


def test_with_nothing_selected_there_is_no_distance_and_the_picture_is_drawn_all_the_same(planned, tmp_path):
    refused = dataclasses.replace(planned.plan, status=Status.INFEASIBLE, selected=None)
    without = dataclasses.replace(planned, plan=refused)
    rows = ranked_candidates(without)
    assert all(math.isnan(row.distance_to_selected_m) for row in rows)
    assert candidates_as_json(rows)[0]["mean_distance_to_selected_m"] is None
    files = write_outputs(without, tmp_path, rows)
    assert [file.name for file in files] == ["plan.png", "candidates.png"]


def test_every_candidate_has_a_map_with_its_path(planned, rows, tmp_path):
    draw_candidates(planned, rows, tmp_path / "candidates.png")
    draw_candidates(planned, rows[:1], tmp_path / "one.png")
    both, one = imread(tmp_path / "candidates.png"), imread(tmp_path / "one.png")
    assert both.shape[1] > 1.5 * one.shape[1]
    red, green, blue = (both[:, :, channel] for channel in range(3))
    # The selected path is orange and the refused one red; ground, obstacles and text are not.
    half = both.shape[1] // 2
    warm = (red > 0.7) & (green < 0.4) & (blue < 0.3)
    assert warm[:, :half].sum() > 500
    assert warm[:, half:].sum() > 500
