"""How far an uploaded mission is flown: by the moment of what was reached, not by how many items that is."""

import dataclasses

from mission.executive.events import Checked, FlightMethod, MissionPlace
from mission.executive.phases import Phase
from mission.mission_items import Command, item_times_s, mission_items
from sim_bridge.state import MissionProgress
from tests.mission.proven import proven
from tests.mission.rehearsed_flight import Flight


def test_an_uploaded_mission_is_explored_up_to_the_moment_of_the_last_waypoint_that_was_reached():
    flight = Flight(method=FlightMethod.MISSION, item_times_s=(0.0, 0.0, 4.0, 4.0, 15.0))
    # Counted from one, as Copter does: take-off 1, speed 2, waypoints 3 and 5, speed 4.
    flight.places = (MissionPlace(3, (10.0, 0.0, 10.0)), MissionPlace(5, (20.0, 0.0, 10.0)))
    flight.run_to(Phase.AUTO_MISSION)
    assert flight.executive.explored_s(flight.now_s) == 0.0
    for reached, passed_s in ((1, 0.0), (3, 4.0), (4, 4.0)):
        flight.tell(MissionProgress(reached, reached + 1))
        assert flight.executive.explored_s(flight.now_s) == passed_s
    flight.tell(MissionProgress(5, 6))
    assert flight.executive.explored_s(flight.now_s) == flight.executive.exploration.end_s


def test_a_mission_that_is_flown_more_slowly_is_explored_up_to_a_later_moment():
    flight = Flight(method=FlightMethod.MISSION, item_times_s=(0.0, 4.0, 15.0))
    flight.places = places = (MissionPlace(1, (10.0, 0.0, 10.0)), MissionPlace(2, (20.0, 0.0, 10.0)))
    flight.run_to(Phase.CHECKING)
    slowed = proven(flight.executive.exploration.slowed(2.0))
    flight.answers = [dataclasses.replace(Checked((), places=places), exploration=slowed)]
    flight.run_to(Phase.AUTO_MISSION)
    flight.tell(MissionProgress(1, 2))
    assert flight.executive.explored_s(flight.now_s) == 8.0


def test_the_moment_of_an_item_is_that_of_the_last_waypoint_up_to_it(plan_file):
    times_s, items = item_times_s(plan_file), mission_items(plan_file)
    assert [times_s[number] for number, item in enumerate(items) if item.command is Command.WAYPOINT] == [
        waypoint.time_s for waypoint in plan_file.waypoints
    ]
    assert list(times_s) == sorted(times_s)
    assert items[len(times_s) - 1].command is Command.WAYPOINT
    assert len([item for item in items[len(times_s) :] if item.command is Command.WAYPOINT]) == 0
