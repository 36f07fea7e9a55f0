"""What a flight needs done beside its loop: checks before arming, proven ways, and taking in what is pushed."""

from __future__ import annotations

import dataclasses
import functools
import threading
import time
from collections.abc import Callable

import numpy as np

from mission.executive.course import vector
from mission.executive.energy import Energy
from mission.executive.events import Assignment, Checked, FindWay, FlightMethod, Goal, MissionPlace
from mission.executive.uploaded import is_blocked
from mission.flying import preflight, return_settings, vehicle_settings
from mission.flying.belief import Belief
from mission.flying.pushes import Pushes, TakenIn
from mission.flying.ways import find_way
from mission.mission_file import Mission
from mission.site.fence import autopilot_fence, planned_fence
from planner import gate
from planner.gate import ProvenTrajectory
from planner.polygon import KeepIn
from planner.trajectory import Motion, Trajectory
from planner.workspace import Workspace
from sim_bridge.link.client import Link, LinkError
from sim_bridge.state import Vector, VehicleState

_WARM_UP_HOST_S = 90.0

Prepare = Callable[[bool], tuple[MissionPlace, ...]]
"""Does what else must be done before arming (uploads), told whether the vehicle flies already: where an uploaded
mission leads, if there is one; its refusal is a LinkError or a ValueError."""


class Ground:
    """The parts of a flight that take longer than a tick, for one mission and one vehicle.

    Args:
        mission: What was asked.
        belief: What is known.
        link: The vehicle.
        energy: What flying costs.
        pushes: Takes in what is pushed.
        assignment: What this flight is to do.
        prepare: What else must be done before arming.
        warm: Whether replans are quick already: the ground is the place to wait for a compiler.
        from_s: Curve time at which the exploration begins, where a part of it was flown before.
    """

    def __init__(
        self,
        mission: Mission,
        belief: Belief,
        link: Link,
        energy: Energy,
        pushes: Pushes,
        assignment: Assignment,
        prepare: Prepare,
        warm: Callable[[], bool],
        from_s: float | None = None,
    ) -> None:
        self._from_s = from_s
        self._warm = warm
        self.mission = mission
        self._belief = belief
        self._link = link
        self._energy = energy
        self._pushes = pushes
        self._assignment = assignment
        self._prepare = prepare
        self._ended = threading.Event()

    def check(self, state: VehicleState) -> Checked:
        """Check the vehicle before arming."""
        if self._assignment.only_home:
            # A vehicle on the ground is left there by this, and one in the air is flown home.
            return Checked(("everything is explored: there is nothing to fly but the way home",))
        planned, altitude_m = self._belief.problem, self._assignment.takeoff_altitude_m
        misplaced = []
        if not state.aloft:
            misplaced = preflight.place_problems(state, self.mission.home_enu_m, planned, altitude_m)
        misplaced = misplaced or preflight.fence_problems(state, autopilot_fence(self.mission.site))
        if misplaced:
            # Nothing that is reckoned from there would mean anything.
            return Checked(tuple(misplaced))
        home = state.home_enu_m or state.position_enu_m
        reach = preflight.reach_of(planned, planned_fence(self.mission.site), home)
        # Each is asked for once: one that the vehicle does not have is answered by silence.
        parameter = functools.cache(self._link.parameter)
        settings = vehicle_settings.settings_of(self._link.autopilot, parameter, planned.limits, reach)
        exploration, problems = self._assignment.exploration, list(settings.problems)
        try:
            exploration, slower = vehicle_settings.slowed_down(exploration, planned, settings.limits)
            if slower is not planned:
                self._belief.change(limits=slower.limits, duration_s=slower.duration_s, start=slower.start)
        except gate.GateRefused as refused:
            problems.append(f"flown as slowly as the vehicle can, {refused}")
        energy = self._energy.within(settings.limits).told(
            return_settings.own_return_of(self._link.autopilot, parameter)
        )
        if not problems:
            problems += self._way_problems(state, home, exploration, energy)
        notes, places = list(settings.notes), ()
        if below := preflight.landing_problems(exploration, self._assignment.end, home, planned):
            if self._assignment.method is FlightMethod.MISSION:
                problems.append(f"{below}: give planner.end_enu_m where it can land")
            else:
                notes.append(f"{below}: it will fly home and land there")
        if not problems:
            try:
                places = self._prepare(state.aloft)
            except (LinkError, ValueError) as error:
                problems.append(str(error))
            if places and is_blocked(places, None, self._belief.problem):
                problems.append(
                    "a straight leg of the uploaded mission leads too near to an obstacle, the one from the climb to "
                    "the start included: set flight.takeoff_altitude_m or planner.start_enu_m above it"
                )
        until_s = time.monotonic() + _WARM_UP_HOST_S
        while not problems and not state.aloft and not self._warm() and time.monotonic() < until_s:
            if self._ended.wait(0.05):
                break
        return Checked(tuple(problems), tuple(notes), exploration, settings.limits, energy, places)

    def _way_problems(self, state: VehicleState, home: Vector, exploration: Trajectory, energy: Energy) -> list[str]:
        """Whether there are ways to the exploration and home, and charge for them."""
        altitude_m = self._assignment.takeoff_altitude_m
        from_s = exploration.start_s if self._from_s is None else self._from_s
        begin = vector(exploration.motion_at(from_s).position_m)
        end = vector(exploration.motion_at(exploration.end_s).position_m)
        try:
            here = state.position_enu_m if state.aloft else _above(state.position_enu_m, altitude_m)
            there = self.find_way(FindWay(Goal.EXPLORATION, here, begin))
            back = self.find_way(FindWay(Goal.HOME, end, _above(home, altitude_m)))
        except ValueError as error:
            return [str(error)]
        out_s = there.duration_s + altitude_m / energy.climb_mps
        home_s = back.duration_s + energy.way_home_s(_above(home, altitude_m), home, altitude_m)
        problems = preflight.energy_problems(state, energy, out_s, exploration.end_s - from_s, home_s)
        if not problems and state.battery_fraction is not None:
            problems = preflight.own_return_problems(state.battery_fraction, energy, out_s, exploration, from_s, home)
        return problems

    def find_way(self, wanted: FindWay) -> ProvenTrajectory:
        """A proven way at rest from one place to another.

        Raises:
            ValueError: There is none.
        """
        problem, site = self._belief.problem, self.mission.site
        start, end = np.asarray(wanted.start_m), np.asarray(wanted.end_m)
        fence = np.array(planned_fence(site))
        inside = KeepIn.of(fence).distance(np.stack([start[:2], end[:2]])) >= 0.0
        if not inside.all():
            # Home may lie beside the area that is explored, but never outside the vehicle's own fence.
            fence = np.array(autopilot_fence(site))
        low = np.array([*fence.min(axis=0), min(start[2], end[2])])
        high = np.array([*fence.max(axis=0), max(start[2], end[2], problem.workspace.box_max_m[2])])
        room = Workspace(np.minimum(low, np.minimum(start, end)), np.maximum(high, low + 1e-3))

        def prove(trajectory: Trajectory) -> ProvenTrajectory:
            return gate.prove(
                trajectory,
                dataclasses.replace(
                    problem,
                    workspace=room,
                    start=Motion.at_rest(start),
                    end_position_m=end,
                    duration_s=trajectory.duration_s,
                    fence_polygon_m=fence,
                    covered=None,
                    max_length_m=np.inf,
                ),
            )

        return find_way(
            start,
            end,
            problem.limits,
            problem.obstacles.distance,
            problem.keep_out_m,
            room.box_min_m,
            room.box_max_m,
            prove,
        )

    def take_in(self) -> list[TakenIn]:
        """Take in what was pushed since the last call."""
        return self._pushes.take_in()

    def close(self) -> None:
        """The flight has ended: wait for nothing more."""
        self._ended.set()


def _above(place: Vector, height_m: float) -> Vector:
    return place[0], place[1], place[2] + height_m
