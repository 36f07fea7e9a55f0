import dataclasses
import itertools
import json

import numpy as np
import pytest

from mission.findings import InputError
from mission.plan_file import read_plan_file, write_plan_file
from mission.plan_output import plan_file_of, summary_of, write_outputs
from planner import gate
from planner.plan import Status


@pytest.fixture
def written(plan_file, tmp_path):
    path = tmp_path / "plan.json"
    write_plan_file(plan_file, path)
    return path


def changed(path, change):
    """The file with something changed in it."""
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return path


def test_a_baseline_that_is_not_known_is_null(planned, tmp_path):
    unknown = dataclasses.replace(planned.plan, lawnmower_ergodic_metric=float("nan"))
    write_plan_file(plan_file_of(dataclasses.replace(planned, plan=unknown)), tmp_path / "plan.json")
    assert read_plan_file(tmp_path / "plan.json").metric.lawnmower_ergodic_metric is None


def test_a_plan_read_back_is_the_plan_that_was_written(plan_file, written):
    assert read_plan_file(written) == plan_file


def test_the_curve_read_back_passes_the_gate_with_exactly_the_same_figures(planned, written):
    curve = read_plan_file(written).curve()
    best = planned.plan.best
    np.testing.assert_array_equal(curve.control_points_m, best.trajectory.control_points_m)
    assert gate.inspect(curve, planned.problem) == best.report


def test_the_trajectory_is_sampled_at_the_streaming_rate_from_the_first_to_the_last_moment(planned, plan_file):
    flown = plan_file.trajectory
    curve = planned.plan.best.trajectory
    assert (flown.time_s[0], flown.time_s[-1]) == (curve.start_s, curve.end_s)
    assert np.diff(flown.time_s).max() <= 1.0 / planned.mission.flight.stream_rate_hz + 1e-9
    samples = curve.sample(np.array(flown.time_s))
    np.testing.assert_array_equal(flown.position_enu_m, samples.position_m)
    np.testing.assert_array_equal(flown.velocity_enu_mps, samples.velocity_mps)
    np.testing.assert_array_equal(flown.acceleration_enu_mps2, samples.acceleration_mps2)


def test_the_heading_turns_no_faster_than_the_vehicle(plan_file):
    rate = np.abs(np.diff(plan_file.trajectory.yaw_enu_rad)) / np.diff(plan_file.trajectory.time_s)
    assert rate.max() <= plan_file.limits.max_yaw_rate_radps * (1.0 + 1e-9)


def test_the_legs_between_waypoints_keep_the_margin_too(planned, plan_file):
    corners = np.array([waypoint.position_enu_m for waypoint in plan_file.waypoints])
    along = np.concatenate([np.linspace(a, b, 100) for a, b in itertools.pairwise(corners)])
    clearance = planned.problem.obstacles.distance(along) - planned.problem.vehicle_radius_m
    assert clearance.min() >= planned.problem.clearance_margin_m
    assert len(corners) < 200


def test_the_file_has_the_entries_that_others_rely_on(written):
    document = json.loads(written.read_text())
    assert set(document["origin"]) == {"latitude_deg", "longitude_deg", "altitude_amsl_m"}
    assert {"time_s", "position_enu_m", "velocity_enu_mps", "acceleration_enu_mps2", "yaw_enu_rad"} <= set(
        document["trajectory"]
    )
    assert {"position_enu_m", "cost", "ergodic_metric", "feasible", "violations"} <= set(document["candidates"][0])
    assert {"waypoints", "limits", "metric", "spline", "version"} <= set(document)
    assert {"mission", "seed", "versions"} <= set(document["problem"])


def test_a_refused_candidate_says_in_the_file_what_it_breaks(plan_file):
    refused, selected = plan_file.candidates
    assert not refused.feasible
    assert "clearance" in refused.violations[0]
    assert selected.feasible
    assert selected.violations == []


FAULTS = {
    "another version": (lambda d: d.update(version=2), "file", "plan again with this version"),
    "no plan at all": (lambda d: d.pop("format"), "file", "is not a plan file"),
    "a part missing": (lambda d: d.pop("spline"), "spline", "plan again"),
    "a part of a part missing": (lambda d: d["limits"].pop("max_speed_mps"), "limits.max_speed_mps", "plan again"),
    "a text for a number": (lambda d: d["trajectory"]["time_s"].__setitem__(3, "x"), "trajectory.time_s.3", "number"),
    "a list cut short": (lambda d: d["trajectory"]["yaw_enu_rad"].pop(), "trajectory.yaw_enu_rad", "changed or cut"),
    "times that go back": (lambda d: d["trajectory"]["time_s"].reverse(), "trajectory.time_s", "must increase"),
    "a candidate that is not there": (lambda d: d.update(selected=7), "selected", "only 2 candidates"),
    "a position moved by hand": (
        lambda d: d["trajectory"]["position_enu_m"][50].__setitem__(0, 400.0),
        "spline",
        "differs from the sampled trajectory",
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_plan_file_that_was_tampered_with_is_refused(fault, written):
    change, path, words = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        read_plan_file(changed(written, change))
    said = {finding.path: finding.advice for finding in caught.value.findings}
    assert words in said[path]


@pytest.mark.parametrize(
    ("text", "words"),
    [("{", "line 1, column 2"), ('{"format": NaN}', "NaN"), ("[]", "is not a plan file"), ("\udcff", "is not a plan")],
)
def test_a_file_that_is_not_a_plan_is_refused(text, words, tmp_path):
    path = tmp_path / "plan.json"
    path.write_bytes(text.encode("utf-8", "surrogateescape"))
    with pytest.raises(InputError, match=words):
        read_plan_file(path)


def test_planning_leaves_every_file_and_a_summary_that_names_them(planned, tmp_path):
    files = write_outputs(planned, tmp_path / "out")
    assert {file.name for file in files} == {
        "plan.json",
        "plan.plan",
        "plan.waypoints",
        "plan.csv",
        "plan.geojson",
        "plan.kml",
        "plan.png",
    }
    assert all(file.stat().st_size > 500 for file in files)
    assert files[-1].read_bytes().startswith(b"\x89PNG")
    summary = json.loads(json.dumps(summary_of(planned, files), allow_nan=False))
    assert summary["feasible"]
    assert summary["selected"] == 1
    assert summary["min_clearance_m"] >= planned.problem.clearance_margin_m
    assert [row["feasible"] for row in summary["candidates"]] == [False, True]
    assert len(summary["files"]) == 7


def test_a_plan_is_written_before_its_picture_which_a_name_with_dollars_does_not_spoil(planned, tmp_path, monkeypatch):
    costly = dataclasses.replace(planned, mission=planned.mission.model_copy(update={"name": "cost $5_ and $6^"}))
    assert len(write_outputs(costly, tmp_path / "drawn")) == 7

    def broken(*_):
        raise RuntimeError("no picture")

    monkeypatch.setattr("mission.pictures.picture.draw_plan", broken)
    with pytest.raises(RuntimeError):
        write_outputs(planned, tmp_path / "not drawn")
    assert (tmp_path / "not drawn" / "plan.json").exists()


def test_a_plan_with_nothing_to_fly_leaves_its_picture_and_no_plan_not_even_an_earlier_one(planned, tmp_path):
    write_outputs(planned, tmp_path)
    (tmp_path / "notes.txt").touch()
    nothing = dataclasses.replace(
        planned.plan, status=Status.INFEASIBLE, selected=None, candidates=planned.plan.candidates[:1]
    )
    refused = dataclasses.replace(planned, plan=nothing)
    files = write_outputs(refused, tmp_path)
    assert [file.name for file in files] == ["plan.png"]
    assert {file.name for file in tmp_path.iterdir()} == {"plan.png", "notes.txt"}
    summary = summary_of(refused, files)
    assert not summary["feasible"]
    assert summary["ergodic_metric"] is None
    assert "clearance" in summary["candidates"][0]["violations"][0]


def test_a_format_that_cannot_hold_the_plan_is_left_out_and_said(planned, tmp_path, monkeypatch, capsys):
    def too_long(plan):
        raise ValueError("the plan needs 700 mission items and ArduPilot holds 650")

    monkeypatch.setattr("mission.exports.wpl.waypoint_list", too_long)
    written = {file.name for file in write_outputs(planned, tmp_path)}
    assert "plan.waypoints" not in written
    assert {"plan.json", "plan.plan", "plan.csv", "plan.geojson", "plan.kml", "plan.png"} <= written
    assert not (tmp_path / "plan.waypoints").exists()
    assert "700 mission items" in capsys.readouterr().err
