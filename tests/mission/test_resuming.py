"""What lies on the disk is flown on only after it has passed the gate again."""

import json
import math

import numpy as np
import pytest

from mission.flying import resuming
from mission.flying.flight_folder import MISSION_NAME, read_flight_folder
from mission.flying.recorder import LOG_NAME, Recorder
from mission.flying.resuming import resumption
from planner.gate import ProvenTrajectory
from planner.plan import Status
from tests.mission.flying_vehicle import STATE
from tests.mission.hand_made import CORNERS, MISSION, plan_by_hand

COURSE = "course-000.json"


@pytest.fixture
def interrupted(tmp_path):
    """The folder of a flight that was killed after some seconds of its exploration."""
    planned = plan_by_hand(MISSION, CORNERS, tmp_path)
    curve, folder = planned.plan.best.proven, tmp_path / "flight"
    recorder = Recorder(folder, {"name": "killed", "link": "sim"})
    (folder / MISSION_NAME).write_text(json.dumps(planned.mission.model_dump(mode="json", exclude_none=True)))
    recorder.course(0.0, recorder.keep(curve).result(), "plan")
    for now_s in np.arange(0.0, 6.0, 0.1):
        place = tuple(curve.motion_at(now_s).position_m.tolist())
        recorder.telemetry(now_s, STATE, "exploring", place)
    recorder.write("progress", 6.0, explored_s=6.0)
    recorder.close()
    return folder


def test_the_rest_of_a_curve_passes_the_gate_again_and_says_that_nothing_was_solved(interrupted):
    left = resumption(read_flight_folder(interrupted))
    assert left is not None
    plan = left.planned.plan
    assert isinstance(plan.best.proven, ProvenTrajectory)
    assert plan.status is Status.KEPT
    assert math.isnan(plan.lawnmower_ergodic_metric)
    assert left.from_s == 6.0


@pytest.mark.parametrize(
    "change",
    [
        lambda curve: [[x + 45.0 * (20 < index < len(curve) - 6), y, z] for index, (x, y, z) in enumerate(curve)],
        lambda curve: [[x, y, z - 5.0 * (index > 20)] for index, (x, y, z) in enumerate(curve)],
    ],
    ids=["a stretch is moved", "it is lowered out of the box"],
)
def test_a_curve_that_was_changed_on_the_disk_is_not_flown(interrupted, change, monkeypatch):
    file = interrupted / COURSE
    course = json.loads(file.read_text())
    course["control_points_enu_m"] = change(course["control_points_enu_m"])
    file.write_text(json.dumps(course))
    asked = []
    monkeypatch.setattr(resuming, "_planned_anew", lambda flight, left: asked.append(left))
    left = resumption(read_flight_folder(interrupted))
    assert asked
    assert left is not None
    assert left.planned is None, "the curve on the disk was taken as it lies there"


def test_a_vehicle_that_is_only_to_be_brought_home_is_not_held_up_by_what_is_in_the_way_of_its_exploration(interrupted):
    file = interrupted / COURSE
    course = json.loads(file.read_text())
    # Into the pillar, where the gate would refuse it.
    course["control_points_enu_m"][-3:] = [[50.0, 40.0, 14.0]] * 3
    file.write_text(json.dumps(course))
    end_s = read_flight_folder(interrupted).log.courses[0][1].end_s
    with (interrupted / LOG_NAME).open("a") as log:
        log.write(json.dumps({"kind": "progress", "t": 70.0, "explored_s": end_s}) + "\n")
        log.write(json.dumps({"kind": "phase", "t": 71.0, "phase": "returning", "why": ""}) + "\n")
    left = resumption(read_flight_folder(interrupted))
    assert left is not None
    assert left.left.only_home
    stands = left.planned.plan.best.proven
    assert stands.end_s == pytest.approx(end_s)
    assert np.ptp(stands.control_points_m, axis=0).max() == 0.0
    # What is known counts for the way home.
    assert not left.planned.problem.obstacles.is_empty


def test_a_curve_of_numbers_that_mean_nothing_is_not_flown_on(interrupted):
    file = interrupted / COURSE
    course = json.loads(file.read_text())
    course["control_points_enu_m"][9][0] = float("nan")
    file.write_text(json.dumps(course))
    flight = read_flight_folder(interrupted)
    assert flight.log.courses == ()
    with pytest.raises(ValueError, match="no course"):
        resumption(flight)
