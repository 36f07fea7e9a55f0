"""What must hold before arming: place, fence, charge, disk; and how far a mission reaches."""

import collections
import dataclasses
import math

import numpy as np
import pytest

from mission.executive.events import FlightEnd, FlightMethod, MissionPlace
from mission.flying import flight, preflight
from mission.flying.ways import along
from mission.loading import load
from mission.site.fence import autopilot_fence, planned_fence
from mission.site.problem import problem_from_mission
from planner.problem import Limits
from sim_bridge.frames import enu_from_geodetic
from sim_bridge.state import GeodeticPoint
from tests.mission.flying_vehicle import ENERGY, STATE

SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 100.0))


class Field:
    """A wall at east 10."""

    keep_out_m = 2.0

    def __init__(self):
        self.obstacles = self.standing = self

    def distance(self, points):
        return np.abs(points[:, 0] - 10.0)


def standing_at(*place):
    return dataclasses.replace(STATE, position_enu_m=place)


def test_a_vehicle_at_another_place_is_refused():
    (problem,) = preflight.place_problems(standing_at(3000.0, 0.0, 0.0), (0.0, 0.0, 0.0), Field(), 20.0)
    assert "3000 m from the mission's home" in problem


@pytest.mark.parametrize(
    "vehicle",
    [
        GeodeticPoint(-47.3977, -171.4544, 10.0),
        GeodeticPoint(0.0, 0.0, 0.0),
        GeodeticPoint(8.5456, 47.3977, 488.0),
        GeodeticPoint(90.0, 0.0, 0.0),
    ],
    ids=["the other end of the world", "nowhere: a receiver without a fix", "latitude and longitude exchanged", "pole"],
)
def test_a_mission_planned_for_another_part_of_the_world_is_refused(vehicle):
    place = enu_from_geodetic(vehicle, GeodeticPoint(47.3977, 8.5456, 488.0))
    assert all(map(math.isfinite, place))
    problems = preflight.place_problems(standing_at(*place), (0.0, 0.0, 0.0), Field(), 20.0)
    assert "set site.origin" in problems[0]


def test_a_mission_planned_with_another_height_of_the_ground_is_refused():
    (problem,) = preflight.place_problems(standing_at(0.0, 0.0, 488.0), (0.0, 0.0, 0.0), Field(), 20.0)
    assert "+488 m" in problem
    assert "site.origin.altitude_amsl_m" in problem


def test_a_climb_beside_an_obstacle_is_refused():
    (problem,) = preflight.place_problems(standing_at(9.0, 0.0, 0.0), (9.0, 0.0, 0.0), Field(), 20.0)
    assert "1.0 m from an obstacle" in problem
    assert preflight.place_problems(standing_at(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), Field(), 20.0) == []


def test_a_landing_beside_an_obstacle_is_found():
    path = along(np.array([[0.0, 0.0, 20.0], [9.0, 0.0, 20.0]]), Limits(5.0, 2.0, 1.5, 3.0))
    assert "1.0 m from an obstacle" in preflight.landing_problems(path, FlightEnd.LAND, (0.0, 0.0, 0.0), Field())
    assert preflight.landing_problems(path, FlightEnd.RETURN, (0.0, 0.0, 0.0), Field()) == ""


def test_a_vehicle_outside_the_fence_it_is_given_is_refused():
    (problem,) = preflight.fence_problems(standing_at(112.0, 50.0, 0.0), SQUARE)
    assert "12 m outside the fence" in problem
    assert "site.fence_margin_m" in problem
    assert preflight.fence_problems(standing_at(99.0, 50.0, 0.0), SQUARE) == []


def test_a_charge_that_does_not_last_is_refused_with_the_reckoning():
    state = dataclasses.replace(STATE, battery_fraction=0.5)
    (problem,) = preflight.energy_problems(state, ENERGY, 60.0, 400.0, 90.0)
    needed = math.ceil(100.0 * (550.0 / 1200.0 + 0.15))
    assert f"the flight needs {needed}%" in problem
    assert preflight.energy_problems(state, ENERGY, 60.0, 200.0, 90.0) == []


@pytest.mark.parametrize(
    ("told", "words"),
    [({"battery_fraction": None}, "does not tell"), ({"battery_age_s": 30.0}, "told its charge 30 s ago")],
)
def test_a_charge_that_is_not_known_is_refused_with_what_to_set(told, words):
    (problem,) = preflight.energy_problems(dataclasses.replace(STATE, **told), ENERGY, 6.0, 40.0, 9.0)
    assert words in problem
    assert "BAT1_SOURCE" in problem
    assert "BATT_MONITOR" in problem


def test_a_disk_that_is_nearly_full_is_refused(tmp_path, monkeypatch):
    assert preflight.disk_problems(tmp_path) == []
    usage = collections.namedtuple("usage", "total used free")
    monkeypatch.setattr("shutil.disk_usage", lambda _: usage(10**9, 10**9 - 5_000_000, 5_000_000))
    (problem,) = preflight.disk_problems(tmp_path)
    assert "5 MB free" in problem


def test_a_mission_reaches_to_its_farthest_corner_and_its_highest_roof(sound):
    mission = load(sound, [])
    reach = preflight.reach_of(problem_from_mission(mission), planned_fence(mission.site), mission.home_enu_m)
    # Home below the start at (10, 10), a box of 500 m up to 80 m, a sphere up to 70 m and 1.4 m to keep away.
    assert reach.across_m == pytest.approx(math.hypot(490.0, 490.0))
    assert reach.up_m == 80.0
    assert 68.0 <= reach.clear_up_m <= 74.0
    assert len(autopilot_fence(mission.site)) == 4


@pytest.mark.parametrize("aloft", [False, True])
def test_no_mission_is_uploaded_to_a_vehicle_that_flies(planned, tmp_path, monkeypatch, aloft):
    uploaded, places = [], (MissionPlace(7, (10.0, 10.0, 30.0)),)
    monkeypatch.setattr(flight, "upload_safety", lambda *_: uploaded.append("fence"))
    monkeypatch.setattr(flight, "upload_plan", lambda *_: uploaded.append("mission") or places)
    settings = flight.FlightSettings("sim", FlightMethod.MISSION, 1.0, tmp_path)
    assert flight._prepare(None, planned, settings, aloft) == (() if aloft else places)  # pyright: ignore[reportArgumentType]
    assert uploaded == (["fence"] if aloft else ["fence", "mission"])
