"""The vehicle's own parameters before arming: the built-in vehicles' defaults, and what a team may have changed."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from mission.executive.events import Checked
from mission.executive.phases import Phase
from mission.flying.connecting import as_told
from mission.flying.return_settings import own_return_of
from mission.flying.vehicle_settings import Reach, settings_of, slowed_down, slowing_factor
from mission.flying.ways import along
from mission.loading import load
from planner import gate
from planner.gate import ProvenTrajectory, inspect
from planner.information import uniform
from planner.obstacles import ObstacleField, Sphere
from planner.problem import Limits, Problem
from planner.workspace import Workspace
from sim_bridge.ardupilot import defaults as ardupilot_defaults
from sim_bridge.dialects import Autopilot
from sim_bridge.px4 import defaults as px4_defaults
from tests.mission.rehearsed_flight import Flight

WANTED = Limits(8.0, 3.0, 1.5, 3.0)
NEAR = Reach(across_m=80.0, up_m=40.0, clear_up_m=0.0)
SAFE_PX4 = px4_defaults.PARAMETERS | {"COM_OBL_RC_ACT": 5, "COM_LOW_BAT_ACT": 3}
SAFE_COPTER = ardupilot_defaults.PARAMETERS | {
    "FENCE_ENABLE": 1,
    "FS_GCS_ENABLE": 1,
    "SYSID_MYGCS": 245,
    "BATT_FS_LOW_ACT": 2,
}


def px4(reach=NEAR, **changes):
    return settings_of(Autopilot.PX4, (SAFE_PX4 | changes).get, WANTED, reach)


def copter(reach=NEAR, **changes):
    return settings_of(Autopilot.ARDUPILOT, (SAFE_COPTER | changes).get, WANTED, reach)


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"COM_OBL_RC_ACT": 0}, ("COM_OBL_RC_ACT is 0", "descends", "set it to 5")),
        ({"COM_OBL_RC_ACT": 2}, ("falls",)),
        ({"COM_OBL_RC_ACT": 6}, ("stops the motors",)),
        ({"COM_OBL_RC_ACT": 8}, ("not known", "set it to 5")),
        ({"COM_OF_LOSS_T": 30.0}, ("COM_OF_LOSS_T is 30", "too late", "set it to 1")),
        ({"COM_OF_LOSS_T": 0.1}, ("a short gap",)),
        ({"GF_ACTION": 0}, ("GF_ACTION is 0", "no consequence", "set it to 2")),
        ({"GF_ACTION": 1}, ("GF_ACTION is 1", "only told", "5 (land)")),
        ({"GF_ACTION": 4}, ("GF_ACTION is 4", "stops the motors")),
        ({"NAV_DLL_ACT": 5}, ("NAV_DLL_ACT is 5", "stops the motors", "set it to 2")),
        ({"NAV_DLL_ACT": 6}, ("NAV_DLL_ACT is 6", "stops the motors")),
        ({"NAV_DLL_ACT": None}, ("NAV_DLL_ACT was not told",)),
        ({"GF_MAX_HOR_DIST": 50.0}, ("GF_MAX_HOR_DIST is 50 m", "reaches 80 m", "set it to 80, or 0")),
        ({"GF_MAX_VER_DIST": 30.0}, ("GF_MAX_VER_DIST is 30 m", "reaches 40 m")),
        ({"COM_OBL_RC_ACT": None}, ("COM_OBL_RC_ACT was not told",)),
        ({"GF_ACTION": float("nan")}, ("GF_ACTION was not told",)),
    ],
)
def test_px4_settings_that_are_not_safe_are_refused_with_the_parameter_to_change(parameters, words):
    (problem,) = px4(**parameters).problems
    for word in words:
        assert word in problem


@pytest.mark.parametrize(
    "choice",
    [{"COM_OBL_RC_ACT": one} for one in (3, 4, 5)]
    + [{"GF_ACTION": one} for one in (2, 3, 5)]
    + [{"NAV_DLL_ACT": one} for one in (0, 1, 2, 3)]
    + [{"COM_LOW_BAT_ACT": one} for one in (2, 3)],
)
def test_safe_px4_settings_pass_without_a_word(choice):
    found = px4(**choice)
    assert found.problems == found.notes == ()


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"FENCE_ENABLE": 0}, ("FENCE_ENABLE is 0", "set it to 1")),
        ({"FENCE_ACTION": 0}, ("FENCE_ACTION is 0", "no consequence", "set it to 1")),
        ({"FENCE_TYPE": 3}, ("FENCE_TYPE is 3", "polygon", "set it to 7")),
        ({"FENCE_RADIUS": 60.0}, ("FENCE_RADIUS is 60 m", "set it to 80, or FENCE_TYPE to 5")),
        ({"FENCE_ALT_MAX": 30.0}, ("FENCE_ALT_MAX is 30 m", "set it to 40, or FENCE_TYPE to 6")),
        ({"FS_GCS_ENABLE": 0}, ("FS_GCS_ENABLE is 0", "stays where it is", "set it to 1")),
        ({"SYSID_MYGCS": 255}, ("SYSID_MYGCS is 255", "this program is 245")),
        ({"FS_GCS_ENABLE": 2}, ("FS_GCS_ENABLE is 2", "mission on", "set it to 1")),
        ({"FS_GCS_ENABLE": 8}, ("not known",)),
        ({"FENCE_ACTION": 6}, ("FENCE_ACTION is 6", "not known")),
        ({"BATT_FS_LOW_ACT": 5}, ("BATT_FS_LOW_ACT is 5", "stops the motors", "set it to 2")),
        ({"BATT_FS_CRT_ACT": 5}, ("BATT_FS_CRT_ACT is 5", "stops the motors", "set it to 1")),
        ({"FS_GCS_ENABLE": None}, ("FS_GCS_ENABLE was not told",)),
    ],
)
def test_copter_settings_that_are_not_safe_are_refused_with_the_parameter_to_change(parameters, words):
    (problem,) = copter(**parameters).problems
    for word in words:
        assert word in problem


@pytest.mark.parametrize(
    "choice",
    [{"FS_GCS_ENABLE": one} for one in (1, 3, 4, 5, 6, 7)]
    + [{"FENCE_ACTION": one} for one in (1, 2, 3, 4, 5)]
    + [{"BATT_FS_LOW_ACT": one} for one in (1, 2, 3, 4, 6, 7)],
)
def test_safe_copter_settings_pass_without_a_word(choice):
    found = copter(WPNAV_ACCEL=300.0, WPNAV_SPEED_UP=300.0, **choice)
    assert found.problems == found.notes == ()


def test_a_circle_that_is_not_watched_may_be_as_small_as_it_likes():
    assert copter(FENCE_RADIUS=10.0, FENCE_TYPE=5).problems == ()


def test_a_vehicle_as_it_comes_is_refused_on_both():
    defaults = {Autopilot.PX4: px4_defaults.PARAMETERS, Autopilot.ARDUPILOT: ardupilot_defaults.PARAMETERS}
    refused = {one: settings_of(one, defaults[one].get, WANTED, NEAR).problems for one in Autopilot}
    assert [problem.split()[0] for problem in refused[Autopilot.PX4]] == ["COM_OBL_RC_ACT"]
    assert {problem.split()[0] for problem in refused[Autopilot.ARDUPILOT]} == {
        "FENCE_ENABLE",
        "FS_GCS_ENABLE",
        "SYSID_MYGCS",
    }


def test_a_low_battery_that_the_vehicle_ignores_and_a_return_below_the_roofs_are_said():
    high = Reach(80.0, 40.0, clear_up_m=72.5)
    notes = px4(high, COM_LOW_BAT_ACT=0).notes
    assert "COM_LOW_BAT_ACT is 0" in notes[0]
    assert "RTL_RETURN_ALT" in notes[1]
    assert "set it to 73" in notes[1]
    notes = copter(high, BATT_FS_LOW_ACT=0).notes
    assert "BATT_FS_LOW_ACT is 0" in notes[0]
    assert "at 15 m above home" in notes[1]
    assert "set it to 7300" in notes[1]


@pytest.mark.parametrize("autopilot", ["px4", "ardupilot"])
def test_the_built_in_vehicle_is_set_as_a_real_one_is_told_to_be(sound, autopilot):
    mission = load(sound, [f"vehicle.autopilot={autopilot}"])
    vehicle, reach = mission.vehicle, Reach(700.0, 80.0, clear_up_m=72.0)
    limits = Limits(vehicle.max_speed_mps, vehicle.max_climb_mps, vehicle.max_descent_mps, 2.5)
    defaults = {"px4": px4_defaults.PARAMETERS, "ardupilot": ardupilot_defaults.PARAMETERS}[autopilot]
    parameters = defaults | dict(as_told(mission, reach, 1.0))
    found = settings_of(Autopilot[autopilot.upper()], parameters.get, limits, reach)
    assert found.problems == found.notes == ()


def test_limits_are_the_smaller_of_the_two_and_it_is_said():
    found = px4(MPC_XY_VEL_MAX=5.0, MPC_Z_VEL_MAX_UP=9.0, MPC_Z_VEL_MAX_DN=1.0)
    assert found.limits == Limits(5.0, 3.0, 1.0, 3.0)
    assert len(found.notes) == 2


def test_copters_centimetres_are_metres():
    found = copter(WPNAV_SPEED=500.0, WPNAV_SPEED_UP=200.0, WPNAV_SPEED_DN=100.0, WPNAV_ACCEL=250.0)
    assert found.limits == Limits(5.0, 2.0, 1.0, 2.5)


def test_a_curve_is_slowed_down_until_every_limit_holds(planned):
    problem = planned.problem
    allowed = Limits(4.0, 3.0, 1.0, 1.5)
    curve = along(
        np.array([[10.0, 10.0, 30.0], [200.0, 10.0, 30.0], [200.0, 10.0, 60.0], [200.0, 150.0, 30.0]]), WANTED
    )
    factor = slowing_factor(inspect(curve, problem), allowed)
    assert 1.5 < factor <= 2.0
    slowed = inspect(curve.slowed(factor), problem)
    assert slowed.max_speed_mps <= allowed.max_speed_mps * (1.0 + 1e-9)
    assert slowed.max_climb_mps <= allowed.max_climb_mps * (1.0 + 1e-9)
    assert slowed.max_descent_mps <= allowed.max_descent_mps * (1.0 + 1e-9)
    assert slowed.max_acceleration_mps2 <= allowed.max_acceleration_mps2 * (1.0 + 1e-9)
    # What is slow enough already, as after an interruption, is flown as it is.
    assert slowing_factor(slowed, allowed) == 1.0


def test_a_curve_that_is_slowed_down_is_proven_anew_with_what_is_known_by_then():
    curve = along(np.array([[0.0, 0.0, 10.0], [60.0, 0.0, 10.0], [60.0, 30.0, 15.0]]), WANTED)
    box = Workspace(np.array([-5.0, -5.0, 5.0]), np.array([65.0, 35.0, 20.0]))
    # As in a flight that is resumed, it begins in motion.
    rest = curve.from_knot(12)
    known = Problem(
        workspace=box,
        information=uniform(box),
        obstacles=ObstacleField.of([]),
        limits=WANTED,
        start=rest.motion_at(rest.start_s),
        end_position_m=None,
        duration_s=rest.duration_s,
        vehicle_radius_m=0.5,
        clearance_margin_m=1.0,
    )
    proven = gate.prove(rest, known)
    assert np.linalg.norm(known.start.velocity_mps) > 1.0
    assert slowed_down(proven, known, WANTED) == (proven, known)
    allowed = Limits(4.0, 3.0, 1.0, 1.5)
    slower, problem = slowed_down(proven, known, allowed)
    assert isinstance(slower, ProvenTrajectory)
    assert 1.5 * rest.duration_s < slower.duration_s == problem.duration_s
    assert slower.report.max_acceleration_mps2 <= allowed.max_acceleration_mps2 * (1.0 + 1e-9)
    assert gate.inspect(slower, problem).passed
    learned = dataclasses.replace(
        known, obstacles=ObstacleField.of([Sphere(rest.motion_at(rest.end_s).position_m, 2.0)])
    )
    with pytest.raises(gate.GateRefused, match="clearance"):
        slowed_down(proven, learned, allowed)


def test_a_slower_vehicle_brakes_more_gently_and_is_called_home_earlier():
    flight, slow = Flight(), Limits(2.0, 1.0, 0.5, 1.0)
    flight.run_to(Phase.CHECKING)
    place, home = (200.0, 0.0, 10.0), (0.0, 0.0, 0.0)
    before_s = flight.executive.monitors.energy.way_home_s(place, home, 10.0)
    flight.tell(Checked((), limits=slow, energy=flight.executive.monitors.energy.within(slow)))
    assert flight.executive.monitors.energy.way_home_s(place, home, 10.0) > 2.0 * before_s
    flight.run_to(Phase.TRANSIT)
    assert flight.executive.course is not None
    assert flight.executive.course.max_acceleration_mps2 == 1.0


def test_the_page_on_flying_gives_every_parameter_that_is_looked_at():
    looked_at: set[str] = set()

    def parameter(name):
        looked_at.add(name)
        return 0.0

    for autopilot in Autopilot:
        settings_of(autopilot, parameter, WANTED, NEAR)
        own_return_of(autopilot, parameter)
    page = (Path(__file__).parents[2] / "docs" / "flying.md").read_text(encoding="utf-8")
    # Of a greatest and a usual acceleration the greatest counts; the other is read where there is none.
    assert {name for name in looked_at - {"MPC_ACC_HOR"} if f"`{name}`" not in page} == set()
