"""What was learned lies on the way ahead: never flown into, whatever the flight did when it was learned."""

import dataclasses

import numpy as np
import pytest

from mission.executive.events import NewCourse, NoWayRound, Operator, WayFound
from mission.executive.lookout import Lookout, blocks
from mission.executive.phases import Phase
from mission.flying.ways import along
from planner.obstacles import ObstacleField, Sphere
from planner.trajectory import Trajectory
from sim_bridge.state import FlightMode
from tests.mission.proven import proven
from tests.mission.rehearsed_flight import KNOWN, LIMITS, Flight, largest_jump_mps

RADIUS_M = 2.0
KEPT_M = RADIUS_M + KNOWN.keep_out_m


def ahead(flight: Flight, seconds: float) -> np.ndarray:
    """Where the course will be."""
    course = flight.executive.course
    assert course is not None
    return course.motion_at(course.at(flight.now_s).curve_s + seconds).position_m


def learn(flight: Flight, place: np.ndarray) -> list[float]:
    """Something is known at a place from now on; the list fills with the distances to it."""
    flight.learn(Sphere(place, RADIUS_M))
    apart = []
    step = flight.step

    def stepped():
        step()
        apart.append(float(np.linalg.norm(flight.vehicle.position - place)))

    flight.step = stepped
    return apart


def test_a_blocked_course_is_flown_up_to_the_block_and_no_further():
    flight = Flight().exploring()
    apart = learn(flight, ahead(flight, 8.0))
    flight.run_for(1.0)
    assert flight.phase is Phase.FOLLOWING
    assert any("blocked ahead" in text for text in flight.said)
    flight.run_for(20.0)
    assert flight.phase is Phase.HOLDING
    flight.tell(Operator.RESUME)
    assert flight.phase is Phase.HOLDING
    stop = flight.executive.course.stop_position()
    flight.learn()
    # Proven from another place: it would be a jump to there.
    elsewhere = along(np.array([np.add(stop, [3.0, 0.0, 0.0]), [20.0, 20.0, 10.0]]), LIMITS)
    flight.tell(NewCourse(proven(elsewhere)))
    assert flight.phase is Phase.HOLDING
    flight.tell(NewCourse(proven(along(np.array([stop, [20.0, 20.0, 10.0]]), LIMITS))))
    assert flight.phase is Phase.FOLLOWING
    assert flight.run().phase is Phase.LANDED
    assert min(apart) >= KEPT_M


def test_what_was_learned_while_paused_stops_it_when_it_goes_on():
    flight = Flight().exploring()
    place = ahead(flight, 8.0)
    flight.tell(Operator.PAUSE)
    flight.run_for(5.0)
    apart = learn(flight, place)
    flight.run_for(5.0)
    flight.tell(Operator.RESUME)
    flight.run_for(30.0)
    assert flight.executive.held_by_block
    assert min(apart) >= KEPT_M


def test_what_was_learned_while_the_link_was_lost_stops_it_when_it_is_back():
    flight = Flight().exploring()
    place = ahead(flight, 12.0)
    flight.vehicle.silent = True
    flight.run_to(Phase.BLIND)
    apart = learn(flight, place)
    flight.vehicle.silent = False
    flight.run_for(30.0)
    assert flight.executive.held_by_block
    assert min(apart) >= KEPT_M


@pytest.mark.parametrize("phase", [Phase.TAKING_OFF, Phase.ENTERING, Phase.TRANSIT])
def test_what_was_learned_before_the_exploration_stops_it_there(phase):
    flight = Flight().run_to(phase)
    apart = learn(flight, flight.executive.exploration.motion_at(8.0).position_m)
    flight.run_to(Phase.HOLDING)
    assert flight.executive.held_by_block
    flight.run_for(10.0)
    assert min(apart) >= KEPT_M


def test_a_way_that_was_sought_before_something_was_learned_is_not_flown():
    flight = Flight().run_to(Phase.ENTERING).run_for(0.5)
    assert flight.executive._keeper.way is not None
    apart = learn(flight, np.array([10.0, 0.0, 10.0]))
    flight.run(lambda flown: flown.phases.count(Phase.ENTERING) >= 2)
    assert min(apart) >= KEPT_M


def test_a_way_home_that_is_blocked_is_sought_again_before_it_is_reached():
    flight = Flight().exploring()
    flight.tell(Operator.RETURN)
    flight.run_to(Phase.RETURNING)
    apart = learn(flight, ahead(flight, 6.0))
    flight.run_to(Phase.TURNING_BACK)
    assert min(apart, default=np.inf) >= KEPT_M


def test_a_replan_that_begins_behind_the_block_does_not_make_it_forgotten():
    flight = Flight().exploring()
    old, course = flight.executive.exploration, flight.executive.course
    assert course is not None
    here_s = course.at(flight.now_s).curve_s
    apart = learn(flight, ahead(flight, 6.0))
    knot = int(np.ceil((here_s + 9.0 - old.start_s) / old.knot_interval_s))
    flight.tell(NewCourse(proven(old.from_knot(knot))))
    assert flight.executive.exploration is old
    flight.run_to(Phase.HOLDING).run_for(10.0)
    assert flight.executive.held_by_block
    assert min(apart) >= KEPT_M


def test_a_new_course_that_leads_into_what_is_known_is_flown_up_to_it():
    flight = Flight().exploring()
    apart = learn(flight, np.array([20.0, 20.0, 10.0]))
    course = flight.executive.course
    assert course is not None
    switch_s = course.at(flight.now_s).curve_s + 2.0
    old = flight.executive.exploration
    first = int((switch_s - old.start_s) / old.knot_interval_s)
    leg, end = np.linspace([60.0, 5.0, 10.0], [20.0, 20.0, 10.0], 60), np.tile([20.0, 20.0, 10.0], (2, 1))
    turning = np.vstack([old.control_points_m[first : first + 3], leg, end])
    new = proven(Trajectory(turning, old.knot_interval_s, old.start_s + first * old.knot_interval_s))
    flight.tell(NewCourse(new))
    assert flight.executive.exploration is new
    flight.run_to(Phase.HOLDING).run_for(10.0)
    assert flight.executive.held_by_block
    assert min(apart) >= KEPT_M


def test_where_nobody_finds_a_way_round_it_goes_home():
    flight = Flight().exploring()
    learn(flight, ahead(flight, 8.0))
    flight.run_to(Phase.HOLDING)
    flight.learn()
    flight.tell(NoWayRound())
    assert flight.phase is Phase.TURNING_BACK
    assert flight.run().phase is Phase.LANDED


def test_it_does_not_recover_onto_a_course_that_is_blocked():
    flight = Flight().exploring()
    place = ahead(flight, 3.0)
    apart = learn(flight, place)
    flight.obstacle = place
    flight.run_for(30.0)
    assert flight.phase is Phase.HOLDING
    assert min(apart[40:]) == pytest.approx(apart[-1], abs=0.3)


def test_an_answer_to_an_earlier_question_is_none_to_this():
    flight = Flight()
    answered, flight.answers = [], []
    flight.run_to(Phase.ENTERING)
    old = flight.executive._machine.wanted
    assert old is not None
    answered.append(WayFound(old, proven(along(np.array([old.start_m, old.end_m]), LIMITS))))
    flight.run_for(0.5)
    flight.vehicle.set_mode(FlightMode.PILOT, flight.now_s)
    flight.run_to(Phase.OVERRIDDEN)
    flight.vehicle.position = np.array([60.0, 80.0, 25.0])
    flight.run_for(1.0)
    flight.tell(Operator.RESUME)
    flight.answers = answered
    setpoints = len(flight.setpoints)
    flight.run_for(10.0)
    flight.setpoints = flight.setpoints[setpoints:]
    assert largest_jump_mps(flight) <= LIMITS.max_speed_mps * 1.01


def test_a_way_that_begins_elsewhere_is_not_flown():
    flight = Flight().exploring()
    flight.tell(Operator.RETURN)
    flight.answers = []
    wanted = flight.executive._machine.wanted
    assert wanted is not None
    flight.tell(WayFound(wanted, proven(along(np.array([[0.0, 30.0, 10.0], wanted.end_m]), LIMITS))))
    assert flight.phase is Phase.VEHICLE_RETURN
    assert "begins elsewhere" in flight.said[-1]


def test_the_blocks_of_a_way_are_found_wherever_they_are():
    random = np.random.default_rng(0)
    curve = along(np.array([[0.0, 0.0, 10.0], [200.0, 0.0, 10.0], [200.0, 100.0, 20.0]]), LIMITS)
    moments = np.arange(curve.start_s, curve.end_s, 0.01)
    places = curve.sample(moments).position_m
    for _ in range(30):
        spheres = [Sphere(random.uniform([0, -20, 0], [220, 120, 30]), random.uniform(0.5, 6.0)) for _ in range(4)]
        known = dataclasses.replace(KNOWN, obstacles=ObstacleField.of(spheres))
        near = moments[known.obstacles.distance(places) < known.keep_out_m]
        found = blocks((curve,), curve.start_s, curve.end_s, known)
        if not len(near):
            assert not found
        elif np.ptp(near) > 0.2:
            assert found[0].curve_s == pytest.approx(near[0], abs=0.11)
            assert found[-1].curve_s == pytest.approx(near[-1], abs=0.11)


def test_a_long_way_is_looked_along_a_stretch_at_a_time_and_what_is_not_yet_seen_is_not_clear():
    curve = along(np.array([[0.0, 0.0, 10.0], [900.0, 0.0, 10.0]]), LIMITS)
    known = dataclasses.replace(KNOWN, obstacles=ObstacleField.of([Sphere(np.array([600.0, 0.0, 10.0]), 3.0)]))
    lookout = Lookout(lambda: known)
    assert lookout.look((curve,), 0.0, 5.0) is None
    assert 5.0 < lookout.looked_s < curve.end_s
    seen = [lookout.look((curve,), 0.0, 5.0) for _ in range(20)][-1]
    assert seen is not None
    assert seen.place_m[0] == pytest.approx(600.0 - 3.0 - known.keep_out_m, abs=0.5)
    assert lookout.looked_s == np.inf
