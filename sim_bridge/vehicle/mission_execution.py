"""Flying an uploaded mission, item after item; nothing in it was checked for sense, as on the real vehicles."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from sim_bridge.codec import mavlink
from sim_bridge.state import Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.guidance import climb, follow_line, hold, is_at
from sim_bridge.vehicle.kinematics import Target
from sim_bridge.vehicle.plan_items import Item

_MOST_STEPS = 1000


@dataclasses.dataclass(frozen=True)
class Course:
    """How an autopilot flies missions.

    Attributes:
        cruise_mps: Speed where no item sets one.
        radius_m: A waypoint is reached within this, where it names no radius itself.
        height_m: And within this height.
        takeoff_mps: Rate of climb of a take-off item.
    """

    cruise_mps: float
    radius_m: float
    height_m: float
    takeoff_mps: float


class MissionRun:
    """Where a mission stands.

    Args:
        first: Index of the first item to fly (ArduPilot's item 0 is home).
    """

    def __init__(self, first: int = 0) -> None:
        self._first = first
        self._jumps: dict[int, int] = {}
        self.restart()

    def restart(self, at: int | None = None) -> None:
        """Begin again, or go on from an item."""
        self.current = self._first if at is None else at
        self.reached: int | None = None
        self.ends_with: Item | None = None
        """A LAND or RETURN item that was come to."""
        self._jumps.clear()
        self._speed_mps: float | None = None
        self._begin_leg()

    def pause(self) -> None:
        """Another mode took over: the leg is flown from wherever the vehicle is when it comes back."""
        self._begin_leg()

    def target(self, items: Sequence[Item], body: Body, course: Course) -> Target | None:
        """What to do now; None: the mission is over, or ends with `ends_with`."""
        for _ in range(_MOST_STEPS):
            if self.ends_with is not None or self.current >= len(items):
                return None
            target = self._item_target(items, body, course)
            if target is not None:
                return target
        # Jumps in a circle, with nothing to fly between them.
        return None

    def _begin_leg(self) -> None:
        self._from: Vector | None = None
        self._arrived_s: float | None = None

    def _next(self, index: int | None = None) -> None:
        self.current = self.current + 1 if index is None else index
        self._begin_leg()

    def _item_target(self, items: Sequence[Item], body: Body, course: Course) -> Target | None:
        """What the current item asks for; None: nothing any more, another one is current."""
        item = items[self.current]
        p1, p2 = item.params[:2]
        match item.command:
            case (
                mavlink.MAV_CMD_NAV_WAYPOINT
                | mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT
                | mavlink.MAV_CMD_NAV_LOITER_TIME
                | mavlink.MAV_CMD_NAV_LOITER_UNLIM
            ):
                place = self._place(item, body)
                named = item.command == mavlink.MAV_CMD_NAV_WAYPOINT and p2 > 0.0
                arrived = is_at(body, place, p2 if named else course.radius_m, course.height_m)
                wait_s = math.inf if item.command == mavlink.MAV_CMD_NAV_LOITER_UNLIM else max(0.0, p1)
                return self._fly(item, body, course, place) if self._goes_on(arrived, wait_s, body) else None
            case mavlink.MAV_CMD_NAV_TAKEOFF:
                x, y, _ = self._leg_start(body)
                place = (x, y, self._place(item, body)[2])
                arrived = is_at(body, place, math.inf, course.height_m)
                goes_on = self._goes_on(arrived, 0.0, body)
                return climb(body, place, course.takeoff_mps, body.rotor.yaw_rad) if goes_on else None
            case mavlink.MAV_CMD_NAV_LAND:
                return self._approach_landing(item, body, course)
            case mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                self.ends_with = item
            case mavlink.MAV_CMD_NAV_DELAY | mavlink.MAV_CMD_CONDITION_DELAY:
                goes_on = self._goes_on(True, max(0.0, p1), body)
                return hold(self._leg_start(body), body.rotor.yaw_rad) if goes_on else None
            case mavlink.MAV_CMD_DO_CHANGE_SPEED:
                self._speed_mps = p2 if p2 > 0.0 else self._speed_mps
                self._next()
            case mavlink.MAV_CMD_DO_JUMP:
                self._jump(p1, p2, len(items))
            case _:
                self._next()
        return None

    def _fly(self, item: Item, body: Body, course: Course, place: Vector) -> Target:
        if body.on_ground:
            x, y, _ = self._leg_start(body)
            return climb(body, (x, y, place[2]), course.takeoff_mps, body.rotor.yaw_rad)
        target = follow_line(body, self._leg_start(body), place, self._speed_mps or course.cruise_mps)
        heading_deg = item.params[3]
        if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and math.isfinite(heading_deg) and heading_deg != 0.0:
            return dataclasses.replace(target, yaw_rad=math.radians(heading_deg))
        return target

    def _approach_landing(self, item: Item, body: Body, course: Course) -> Target | None:
        """To above the place to land at, in the height the vehicle has; then the mission ends with landing."""
        _, _, down = self._leg_start(body)
        here = item.latitude_e7 == 0 and item.longitude_e7 == 0
        x, y, _ = self._leg_start(body) if here else self._place(item, body)
        if here or is_at(body, (x, y, down), 1.0, math.inf):
            self.reached, self.ends_with = self.current, item
            return None
        return follow_line(body, self._leg_start(body), (x, y, down), self._speed_mps or course.cruise_mps)

    def _jump(self, index: float, times: float, count: int) -> None:
        """To another item, so many times; one that is not in the mission ends it, as neither autopilot goes on."""
        done = self._jumps.get(self.current, 0)
        if not self._first <= index < count:
            self._next(count)
        elif times < 0.0 or done < times:
            self._jumps[self.current] = done + 1
            self._next(int(index))
        else:
            self._next()

    def _goes_on(self, arrived: bool, wait_s: float, body: Body) -> bool:
        """Whether this item goes on; else the next is current."""
        if arrived and self._arrived_s is None:
            self._arrived_s = body.time_s
            self.reached = self.current
        if self._arrived_s is not None and not body.time_s - self._arrived_s < wait_s:
            self._next()
            return False
        return True

    def _leg_start(self, body: Body) -> Vector:
        if self._from is None:
            self._from = body.position_ned_m
        return self._from

    @staticmethod
    def _place(item: Item, body: Body) -> Vector:
        return body.local_ned(item.place(body.home_amsl_m))
