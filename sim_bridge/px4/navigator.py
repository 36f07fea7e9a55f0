"""Where PX4's modes take the vehicle: a target for the controller at every moment."""

from __future__ import annotations

import math

from sim_bridge.codec import mavlink
from sim_bridge.px4.modes import Mode
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle import guidance
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.guidance import Landing, Leg, Return
from sim_bridge.vehicle.kinematics import STILL, Target
from sim_bridge.vehicle.mission_execution import Course, MissionRun
from sim_bridge.vehicle.parameters import Parameters
from sim_bridge.vehicle.plan_items import Item
from sim_bridge.vehicle.plan_storage import PlanStorage

TAKEN_OFF_WITHIN_M = 0.3
SINKING_MPS = 0.5
_SPOOL_UP_S = 1.0
_REACHED_HEIGHT_M = 0.8
_CLIMBS_ABOVE_M = 0.1
# A rally point counts if it lies so far from home, and is so much nearer than anything else.
_RALLY_BEYOND_M, _RALLY_NEARER_BY_M = 10.0, 2.0


class Navigator:
    """Targets of the modes; knows what each was told when it began.

    Args:
        body: Of the vehicle.
        parameters: Of its autopilot.
        storage: Its plans.
    """

    def __init__(self, body: Body, parameters: Parameters, storage: PlanStorage) -> None:
        self._body = body
        self._parameters = parameters
        self._storage = storage
        self.mission = MissionRun()
        self.sticks = False
        """Whether a pilot's sticks are there; without them a mode that follows sticks sinks."""
        self.cruise_mps: float | None = None
        self.takeoff_down_m: float | None = None
        self._held = body.position_ned_m
        self._held_yaw_rad = body.rotor.yaw_rad
        self._return: Return | None = None
        self._armed_s = -math.inf

    def enter(self, mode: Mode) -> None:
        """A mode begins."""
        body = self._body
        self._held = body.stopping_place_ned_m(guidance.braking_mps2(body))
        self._held_yaw_rad = body.rotor.yaw_rad
        self._return = None
        self.mission.pause()
        if mode is Mode.RETURN:
            self._return = self._new_return()

    def armed(self) -> None:
        """The motors start to turn."""
        self._armed_s = self._body.time_s

    def hold_at(self, point: GeodeticPoint, yaw_rad: float | None) -> None:
        """Go to a place and stay there (MAV_CMD_DO_REPOSITION)."""
        self._held = self._body.local_ned(point)
        self._held_yaw_rad = self._held_yaw_rad if yaw_rad is None else yaw_rad

    @property
    def landing(self) -> bool:
        """Whether the vehicle comes down to land in RETURN or MISSION."""
        returning = self._return is not None and self._return.leg is Leg.DESCEND
        ends_with = self.mission.ends_with
        return returning or (ends_with is not None and ends_with.command == mavlink.MAV_CMD_NAV_LAND)

    def target(self, mode: Mode, items: list[Item], setpoint: Target | None) -> Target | None:
        """What to do now; None: stand with the motors idling."""
        body = self._body
        if body.time_s - self._armed_s < _SPOOL_UP_S:
            return None
        match mode:
            case Mode.OFFBOARD:
                return self._from_ground(setpoint) if setpoint is not None else self._hold()
            case Mode.HOLD:
                return self._from_ground(self._hold())
            case Mode.POSCTL | Mode.ALTCTL | Mode.STABILIZED:
                if self.sticks:
                    return self._from_ground(self._hold())
                return None if body.on_ground else guidance.descend(self._held, SINKING_MPS, self._held_yaw_rad)
            case Mode.TAKEOFF:
                return self._take_off()
            case Mode.MISSION:
                return self._mission(items)
            case Mode.RETURN:
                return None if body.on_ground or self._return is None else self._return.target(body)
            case Mode.LAND:
                return None if body.on_ground else self._landing().target(body, self._held, self._held_yaw_rad)
            case Mode.DESCEND:
                sinking = Target(velocity_ned_mps=(0.0, 0.0, self._parameters["MPC_LAND_SPEED"]))
                return None if body.on_ground else sinking

    def takeoff_done(self) -> bool:
        """Whether the height to take off to is reached."""
        down = self.takeoff_down_m
        return (
            down is not None
            and not self._body.on_ground
            and abs(self._body.position_ned_m[2] - down) < TAKEN_OFF_WITHIN_M
        )

    def _hold(self) -> Target:
        if math.dist(self._held, self._body.position_ned_m) > guidance.TURN_TOWARDS_BEYOND_M:
            return guidance.follow_line(self._body, self._body.position_ned_m, self._held, self._cruise())
        return guidance.hold(self._held, self._held_yaw_rad)

    def _from_ground(self, target: Target) -> Target | None:
        """A vehicle that stands only moves when it is asked to climb."""
        if not self._body.on_ground:
            return target
        down, speed = target.position_ned_m[2], (target.velocity_ned_mps or STILL)[2]
        rises = speed < 0.0 if down is None else down < self._body.position_ned_m[2] - _CLIMBS_ABOVE_M
        return target if rises else None

    def _take_off(self) -> Target:
        body = self._body
        if self.takeoff_down_m is None:
            self.takeoff_down_m = body.position_ned_m[2] - self._parameters["MIS_TAKEOFF_ALT"]
        self.takeoff_down_m = min(self.takeoff_down_m, body.position_ned_m[2] if body.on_ground else math.inf)
        place: Vector = (self._held[0], self._held[1], self.takeoff_down_m)
        return guidance.climb(body, place, self._parameters["MPC_TKO_SPEED"], self._held_yaw_rad)

    def _mission(self, items: list[Item]) -> Target | None:
        body = self._body
        course = Course(
            self._cruise(), self._parameters["NAV_ACC_RAD"], _REACHED_HEIGHT_M, self._parameters["MPC_TKO_SPEED"]
        )
        before = self.mission.ends_with
        target = self.mission.target(items, body, course)
        if target is not None:
            self._held, self._held_yaw_rad = body.position_ned_m, body.rotor.yaw_rad
            return target
        ends_with = self.mission.ends_with
        if ends_with is not before:
            self._held = body.stopping_place_ned_m(guidance.braking_mps2(body))
        if ends_with is not None and ends_with.command == mavlink.MAV_CMD_NAV_LAND:
            return None if body.on_ground else self._landing().target(body, self._held, self._held_yaw_rad)
        return self._from_ground(self._hold())

    def _landing(self) -> Landing:
        parameters = self._parameters
        return Landing(parameters["MPC_Z_V_AUTO_DN"], parameters["MPC_LAND_SPEED"], parameters["MPC_LAND_ALT1"])

    def _cruise(self) -> float:
        return self.cruise_mps or self._parameters["MPC_XY_CRUISE"]

    def _new_return(self) -> Return:
        destination = self._destination()
        delay_s = self._parameters["RTL_LAND_DELAY"]
        return Return(
            self._body,
            destination,
            self._return_down_m(destination),
            min(self._parameters["MPC_Z_V_AUTO_UP"], self._body.rotor.limits.climb_mps),
            self._cruise(),
            self._landing(),
            delay_s if delay_s >= 0.0 else math.inf,
        )

    def _destination(self) -> Vector:
        """Home, or the rally point that is nearer; those right at home do not count."""
        body = self._body
        nearest, nearest_m = body.home_ned_m, body.distance_home_m()
        for item in self._storage.rally:
            place = body.local_ned(item.place(body.home_amsl_m))
            beside_home = math.dist(place[:2], body.home_ned_m[:2]) <= _RALLY_BEYOND_M
            if not beside_home and body.distance_m(place) + _RALLY_NEARER_BY_M < nearest_m:
                nearest, nearest_m = place, body.distance_m(place)
        return nearest

    def _return_down_m(self, destination_ned_m: Vector) -> float:
        """NED z to return at: RTL_RETURN_ALT, but within a cone over the destination where RTL_CONE_ANG asks for it."""
        body, parameters = self._body, self._parameters
        distance, radius = body.distance_m(destination_ned_m), parameters["NAV_ACC_RAD"]
        height = parameters["RTL_RETURN_ALT"]
        if 0.0 < parameters["RTL_CONE_ANG"] < 90.0:
            if distance <= radius:
                height = 2.0 * distance
            else:
                if distance <= parameters["RTL_MIN_DIST"]:
                    height = min(height, distance / math.tan(math.radians(parameters["RTL_CONE_ANG"])))
                height = max(height, 2.0 * radius)
        return min(destination_ned_m[2] - height, body.position_ned_m[2])
