"""A vehicle that strays is slowed down before its course leads past something; one that keeps to it never is."""

import itertools
from collections.abc import Sequence

import numpy as np
import pytest

from mission.executive.phases import Phase
from mission.executive.straying import Straying
from planner.trajectory import Trajectory
from sim_bridge.vehicle.kinematics import Airframe
from tests.mission.moving_vehicle import PX4_SIH_DRAG, MovingVehicle
from tests.mission.proven import proven
from tests.mission.rehearsed_flight import Flight

MARGIN_M = 1.0
ROOM_M = 1.3 * MARGIN_M
"""From the course to the posts: a planner keeps the margin and a little."""
TURNS = 10
SWING_M, TURN_EVERY_M, UP_M = 9.0, 30.0, 10.0
STEP_S = 0.5


def between(turn: float) -> np.ndarray:
    """A place of the serpentine; whole numbers are the middles of its turns."""
    return np.array([TURN_EVERY_M * turn, SWING_M * np.cos(np.pi * turn), UP_M])


def serpentine() -> Trajectory:
    """A path that swings from side to side at 4.6 m/s, at rest at both ends."""
    turns = np.linspace(0.0, TURNS, 20001)
    places = np.array([between(turn) for turn in turns])
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    speeding = np.sin(np.linspace(0.0, 0.5 * np.pi, 8)) ** 2
    full = np.ones(int(length[-1] / (4.6 * STEP_S)) - len(speeding))
    flown = np.concatenate([[0.0] * 3, np.cumsum(np.concatenate([speeding, full, speeding[::-1]]))])
    flown = np.concatenate([flown, flown[-1:].repeat(2)]) * length[-1] / flown[-1]
    along = np.interp(flown, length, turns)
    return Trajectory(np.array([between(turn) for turn in along]), STEP_S, 0.0)


def posts(*turns: float) -> np.ndarray:
    """One on either side between two turns, where drag takes a vehicle farthest from the path."""
    found = []
    for turn in turns:
        forward = (between(turn + 0.01) - between(turn - 0.01))[:2]
        left = np.array([-forward[1], forward[0]]) / np.linalg.norm(forward)
        found += [between(turn)[:2] + side_m * left for side_m in (-ROOM_M, ROOM_M)]
    return np.array(found)


class BetweenPosts(Flight):
    """A flight along the serpentine, past posts that do not stand at its beginning."""

    def __init__(
        self, drag: float | None, leaned_against_per_s: float = 0.0, turns: Sequence[float] = (4.5, 6.5, 8.5)
    ) -> None:
        super().__init__(exploration=proven(serpentine()))
        self.leaned_against_per_s = leaned_against_per_s
        self.posts = posts(*turns)
        self.vehicle = MovingVehicle(Airframe() if drag is None else Airframe(drag=drag))

    def clearance_m(self, places: np.ndarray) -> np.ndarray:
        return np.linalg.norm(places[..., None, :2] - self.posts, axis=-1).min(axis=-1)

    def explore(self) -> float:
        """Fly to the end of the exploration, and tell how near to a post it came, metres."""
        nearest_m = np.inf

        def explored(_: Flight) -> bool:
            nonlocal nearest_m
            nearest_m = min(nearest_m, float(self.clearance_m(self.vehicle.position)))
            return self.executive.explored

        self.run(explored)
        return nearest_m


def test_a_vehicle_with_drag_keeps_clear_of_what_its_course_leads_past():
    flight = BetweenPosts(PX4_SIH_DRAG)
    nearest_m = flight.explore()
    # Slowed down step by step it would come to the first posts before the last step.
    assert sum("past what is near" in text for text in flight.said) == 1
    assert nearest_m > MARGIN_M / 2.0


def test_where_nothing_is_near_for_a_while_the_pace_is_taken_up_again_and_the_next_place_is_passed_slowly():
    flight = BetweenPosts(PX4_SIH_DRAG, turns=(2.5, 9.0))
    nearest_m = flight.explore()
    paces = ["again" in text for text in flight.said if "of the pace" in text]
    assert [pace for pace, _ in itertools.groupby(paces)] == [False, True, False, True]
    assert nearest_m > MARGIN_M / 2.0
    everywhere = BetweenPosts(PX4_SIH_DRAG)
    everywhere.explore()
    assert flight.now_s < everywhere.now_s - 20.0


def test_a_vehicle_that_leans_against_its_drag_keeps_to_its_course_at_full_pace():
    flight = BetweenPosts(PX4_SIH_DRAG, leaned_against_per_s=PX4_SIH_DRAG)
    assert flight.explore() > MARGIN_M
    assert not any("of the pace" in text for text in flight.said)


def test_a_vehicle_that_keeps_to_its_course_is_never_slowed_down():
    flight = BetweenPosts(None)
    assert flight.explore() > MARGIN_M / 2.0
    assert not any("of the pace" in text for text in flight.said)
    assert Phase.HOLDING not in flight.phases


def test_what_it_strayed_before_it_was_slowed_down_is_not_held_against_the_slower_pace():
    flight = Flight().exploring()
    flight.push = np.array([0.0, 0.0, -0.8])
    flight.run_for(3.0)
    flight.push = np.array([0.0, 4.0, 0.0])
    flight.run_for(0.2)
    flight.push = np.zeros(3)
    flight.run(lambda _: flight.phase is Phase.FOLLOWING)
    course = flight.executive.course
    assert course is not None
    flight.obstacle = course.motion_at(course.at(flight.now_s).curve_s + 6.0).position_m + np.array([0.0, 0.0, 1.2])
    flight.run_for(6.0)
    assert flight.executive.course is not None
    assert flight.executive.course.at(flight.now_s).rate == pytest.approx(0.7)


class TestStraying:
    """What is remembered."""

    def observed(self, *distances_m: float, straying: Straying | None = None, from_s: float = 0.0) -> float:
        straying = straying or Straying()
        return [straying.observe(m, from_s + 0.1 * index) for index, m in enumerate(distances_m)][-1]

    def test_what_was_kept_up_is_remembered_when_it_is_over(self):
        assert self.observed(*[0.2] * 10, *[1.1] * 10, *[0.2] * 50) == 1.1

    def test_a_jump_is_none(self):
        assert self.observed(*[0.2] * 10, *[3.0] * 3, *[0.2] * 50) == 0.2

    def test_it_is_forgotten_after_a_while(self):
        assert self.observed(*[1.1] * 10, *[0.2] * 250) == 0.2

    def test_distances_before_and_after_a_gap_are_not_taken_together(self):
        straying = Straying()
        straying.observe(1.1, 0.0)
        assert straying.observe(1.1, 5.0) == 0.0

    def test_another_pace_is_judged_anew_and_only_once_it_has_settled(self):
        straying = Straying()
        assert self.observed(*[1.1] * 20, straying=straying) == 1.1
        straying.begin(7.0)
        assert self.observed(*[1.1] * 20, straying=straying, from_s=4.9) == 0.0
        assert self.observed(*[0.3] * 20, straying=straying, from_s=7.0) == 0.3
