"""Where ArduPilot's modes take the vehicle: a target for the controller at every moment."""

from __future__ import annotations

import math
from collections.abc import Callable

from sim_bridge.ardupilot.guided import Guided
from sim_bridge.ardupilot.modes import Mode
from sim_bridge.codec import mavlink
from sim_bridge.state import Vector
from sim_bridge.vehicle import guidance
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.guidance import Landing, Leg, Return
from sim_bridge.vehicle.kinematics import Target
from sim_bridge.vehicle.mission_execution import Course, MissionRun
from sim_bridge.vehicle.parameters import Parameters
from sim_bridge.vehicle.plan_items import Item
from sim_bridge.vehicle.plan_storage import PlanStorage

_CENTI = 0.01
_SPOOL_UP_S = 1.0
_LOWEST_RETURN_M = 2.0
_REACHED_HEIGHT_M = 1.0
FIRST_ITEM = 1
"""Item 0 of a mission is home."""


class Navigator:
    """Targets of the modes; knows what each was told when it began.

    Args:
        body: Of the vehicle.
        parameters: Of its autopilot.
        storage: Its plans.
        allowed: Whether a place lies inside the fence.
    """

    def __init__(
        self, body: Body, parameters: Parameters, storage: PlanStorage, allowed: Callable[[Vector], bool]
    ) -> None:
        self._body = body
        self._parameters = parameters
        self._storage = storage
        self._allowed = allowed
        self.guided = Guided(body, allowed)
        self.mission = MissionRun(FIRST_ITEM)
        self.sticks = False
        """Whether a pilot's sticks are there; without them the throttle is at zero."""
        self.may_start = False
        """Whether AUTO may leave the ground: a raised throttle, or MISSION_START."""
        self.speed_mps: float | None = None
        self._held = body.position_ned_m
        self._held_yaw_rad = body.rotor.yaw_rad
        self._return: Return | None = None
        self._armed_s = -math.inf

    def enter(self, mode: Mode) -> None:
        """A mode begins."""
        self._hold_here()
        self._return = self._new_return() if mode is Mode.RTL else None
        self.mission.pause()
        if mode is Mode.GUIDED:
            self.guided.enter()
        if mode is Mode.AUTO:
            self.speed_mps = None

    def armed(self) -> None:
        """The motors start to turn."""
        self._armed_s = self._body.time_s
        self.may_start = False

    @property
    def landing(self) -> bool:
        """Whether the vehicle comes down to land in RTL or AUTO."""
        returning = self._return is not None and self._return.leg is Leg.DESCEND
        ends_with = self.mission.ends_with
        return returning or (ends_with is not None and ends_with.command == mavlink.MAV_CMD_NAV_LAND)

    def target(self, mode: Mode, items: list[Item]) -> Target | None:
        """What to do now; None: stand with the motors idling."""
        body, parameters = self._body, self._parameters
        if body.time_s - self._armed_s < _SPOOL_UP_S:
            return None
        match mode:
            case Mode.GUIDED:
                return self.guided.target(_CENTI * parameters["WPNAV_SPEED_UP"], parameters["GUID_TIMEOUT"])
            case Mode.AUTO:
                return self._mission(items)
            case Mode.RTL:
                return None if body.on_ground or self._return is None else self._return.target(body)
            case Mode.LAND:
                return self._land()
            case Mode.BRAKE:
                return None if body.on_ground else guidance.hold(self._held, self._held_yaw_rad)
            case Mode.STABILIZE:
                return guidance.hold(self._held, self._held_yaw_rad) if self.sticks and not body.on_ground else None
            case Mode.ALT_HOLD | Mode.LOITER | Mode.POSHOLD:
                return self._by_sticks()

    def _by_sticks(self) -> Target | None:
        """A pilot's centred sticks hold; without a pilot the throttle is at zero, and down it goes."""
        if self._body.on_ground:
            return None
        if self.sticks:
            return guidance.hold(self._held, self._held_yaw_rad)
        sinking = _CENTI * (self._parameters["PILOT_SPEED_DN"] or self._parameters["PILOT_SPEED_UP"])
        return guidance.descend(self._held, sinking, self._held_yaw_rad)

    def _mission(self, items: list[Item]) -> Target | None:
        body, parameters = self._body, self._parameters
        if body.on_ground and not self.may_start:
            return None
        course = Course(
            cruise_mps=self.speed_mps or _CENTI * parameters["WPNAV_SPEED"],
            radius_m=_CENTI * parameters["WPNAV_RADIUS"],
            height_m=_REACHED_HEIGHT_M,
            takeoff_mps=_CENTI * parameters["WPNAV_SPEED_UP"],
        )
        target = self.mission.target(items, body, course)
        if target is not None:
            self._hold_here()
            return target
        ends_with = self.mission.ends_with
        if ends_with is not None and ends_with.command == mavlink.MAV_CMD_NAV_LAND:
            return self._land()
        if ends_with is not None:
            if self._return is None:
                self._return = self._new_return()
            return None if body.on_ground else self._return.target(body)
        return None if body.on_ground else guidance.hold(self._held, self._held_yaw_rad)

    def _land(self) -> Target | None:
        body = self._body
        if body.on_ground:
            return None
        if not body.position_valid:
            return Target(velocity_ned_mps=(0.0, 0.0, _CENTI * self._parameters["LAND_SPEED"]))
        return self._landing().target(body, self._held, self._held_yaw_rad)

    def _landing(self) -> Landing:
        fast = self._parameters["LAND_SPEED_HIGH"] or self._parameters["WPNAV_SPEED_DN"]
        return Landing(
            _CENTI * fast, _CENTI * self._parameters["LAND_SPEED"], _CENTI * self._parameters["LAND_ALT_LOW"]
        )

    def _hold_here(self) -> None:
        self._held = self._body.stopping_place_ned_m(guidance.braking_mps2(self._body))
        self._held_yaw_rad = self._body.rotor.yaw_rad

    def _new_return(self) -> Return:
        """To RTL_ALT or the rally point's height, within RTL_CONE_SLOPE's cone over it, but never down first."""
        body, parameters = self._body, self._parameters
        destination = self._destination()
        height = max(_CENTI * parameters["RTL_ALT"], body.home_ned_m[2] - destination[2])
        if parameters["RTL_CONE_SLOPE"] > 0.0:
            cone = max(parameters["RTL_CONE_SLOPE"] * body.distance_m(destination), _LOWEST_RETURN_M)
            height = min(height, cone)
        down = min(body.home_ned_m[2] - height, body.position_ned_m[2])
        speed = _CENTI * (parameters["RTL_SPEED"] or parameters["WPNAV_SPEED"])
        return Return(
            body,
            destination,
            down,
            body.rotor.limits.climb_mps,
            speed,
            self._landing(),
            1e-3 * parameters["RTL_LOIT_TIME"],
            _CENTI * parameters["RTL_ALT_FINAL"],
        )

    def _destination(self) -> Vector:
        """Home, or the nearest rally point inside the fence, if it is nearer and within RALLY_LIMIT_KM."""
        body, limit_m = self._body, 1e3 * self._parameters["RALLY_LIMIT_KM"]
        home = body.home_ned_m
        places = [body.local_ned(item.place(body.home_amsl_m)) for item in self._storage.rally]
        nearest = min((place for place in places if self._allowed(place)), key=body.distance_m, default=home)
        if 0.0 < limit_m < body.distance_m(nearest):
            return home
        nearer = not self._parameters["RALLY_INCL_HOME"] or body.distance_m(nearest) < body.distance_home_m()
        return nearest if nearer else home
