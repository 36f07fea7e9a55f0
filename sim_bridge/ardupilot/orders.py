"""What ArduPilot Copter does at a command, and how it answers."""

from __future__ import annotations

from collections.abc import Callable

from sim_bridge.ardupilot.commander import FORCE_ARM, FORCE_DISARM, Commander
from sim_bridge.ardupilot.modes import Mode
from sim_bridge.codec import mavlink
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.parameters import Parameters
from sim_bridge.vehicle.plan_items import PLACE_FRAMES, Item
from sim_bridge.vehicle.services import Order, Reply

_ACCEPTED, _FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
_UNSUPPORTED, _DENIED = mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED
# What fits a height of Copter's, and how far home may lie above or below the origin.
_HIGHEST_M, _HOME_FROM_ORIGIN_M = 83_000.0, 50_000.0


class Orders:
    """The commands that the autopilot decides about.

    Args:
        body: The vehicle.
        parameters: Its parameters.
        commander: Arms it and changes its modes.
        set_current: Goes on from an item of the mission.
        reboot: Starts the autopilot anew, on the ground.
    """

    def __init__(
        self,
        body: Body,
        parameters: Parameters,
        commander: Commander,
        set_current: Callable[[int], Reply],
        reboot: Callable[[], None],
    ) -> None:
        self._body = body
        self._parameters = parameters
        self._commander = commander
        self._navigator = commander.navigator
        self._set_current = set_current
        self._reboot = reboot

    def carry_out(self, order: Order) -> Reply:
        """Do what a command for this vehicle says; the result, and what is said besides."""
        commander, navigator = self._commander, self._navigator
        match order.command:
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                match order.whole(1):
                    case 1:
                        return commander.arm(force=order.whole(2) == FORCE_ARM)
                    case 0:
                        return commander.disarm(force=order.whole(2) == FORCE_DISARM)
                    case _:
                        return _UNSUPPORTED, []
            case mavlink.MAV_CMD_DO_SET_MODE:
                custom = order.whole(1) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                return commander.change_mode(order.whole(2)) if custom else (_FAILED, [])
            case mavlink.MAV_CMD_NAV_TAKEOFF:
                return self._take_off(order)
            case mavlink.MAV_CMD_NAV_LAND:
                return commander.change_mode(Mode.LAND)
            case mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                return commander.change_mode(Mode.RTL)
            case mavlink.MAV_CMD_NAV_LOITER_UNLIM:
                return commander.change_mode(Mode.LOITER)
            case mavlink.MAV_CMD_MISSION_START:
                result, texts = commander.change_mode(Mode.AUTO)
                navigator.may_start = navigator.may_start or result == _ACCEPTED
                return result, texts
            case mavlink.MAV_CMD_DO_SET_MISSION_CURRENT:
                return self._set_current(order.whole(1))
            case mavlink.MAV_CMD_DO_REPOSITION:
                return self._reposition(order)
            case mavlink.MAV_CMD_DO_CHANGE_SPEED:
                speed = order.given(2)
                if speed is None or speed <= 0.0 or order.whole(1) not in (0, 1):
                    return _FAILED, []
                navigator.speed_mps = speed
                return _ACCEPTED, []
            case mavlink.MAV_CMD_DO_SET_HOME:
                return self._set_home(order)
            case mavlink.MAV_CMD_DO_FENCE_ENABLE:
                if order.whole(1) not in (0, 1):
                    return _FAILED, []
                self._parameters.change({"FENCE_ENABLE": order.whole(1)})
                return _ACCEPTED, []
            case mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                if self._body.armed:
                    return _FAILED, []
                self._reboot()
                return _ACCEPTED, []
            case _:
                return _UNSUPPORTED, []

    def _take_off(self, order: Order) -> Reply:
        """Altitudes of take-offs are above home; only GUIDED, armed, and from the ground."""
        if order.frame != mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT:
            return _DENIED, []
        height = order.given(7)
        may = self._body.armed and self._commander.mode is Mode.GUIDED and self._body.on_ground
        if not may or height is None:
            return _FAILED, []
        down = self._body.home_ned_m[2] - height
        if down >= self._body.position_ned_m[2]:
            return _FAILED, []
        self._navigator.guided.take_off(down)
        return _ACCEPTED, []

    def _reposition(self, order: Order) -> Reply:
        latitude, longitude, height = (order.given(number) for number in (5, 6, 7))
        if latitude is None or longitude is None or height is None:
            return _DENIED, []
        if self._commander.mode is not Mode.GUIDED:
            if order.whole(2) != 1:
                return _DENIED, []
            result, texts = self._commander.change_mode(Mode.GUIDED)
            if result != _ACCEPTED:
                return result, texts
        item = Item(0, order.frame, (0.0, 0.0, 0.0, 0.0), round(latitude * 1e7), round(longitude * 1e7), height)
        inside = self._navigator.guided.go_to(self._body.local_ned(item.place(self._body.home_amsl_m)))
        return (_ACCEPTED if inside else _FAILED), []

    def _set_home(self, order: Order) -> Reply:
        """Here, also where no place is given; else where the map of the earth and Copter's heights allow it."""
        latitude, longitude, height = (0.0 if value is None else value for value in map(order.given, (5, 6, 7)))
        if order.given(1) == 1.0 or (latitude == 0.0 and longitude == 0.0):
            self._body.home_ned_m = self._body.position_ned_m
            return _ACCEPTED, []
        if order.given(1) != 0.0:
            return _FAILED, []
        if order.given(7) is None or abs(height) > _HIGHEST_M or order.frame not in PLACE_FRAMES:
            return _DENIED, []
        if abs(latitude) > 90.0 or abs(longitude) > 180.0:
            return _FAILED, []
        item = Item(0, order.frame, (0.0, 0.0, 0.0, 0.0), round(latitude * 1e7), round(longitude * 1e7), height)
        home = item.place(self._body.home_amsl_m)
        if abs(home.altitude_amsl_m - self._body.origin.altitude_amsl_m) > _HOME_FROM_ORIGIN_M:
            return _FAILED, []
        self._body.home_ned_m = self._body.local_ned(home)
        return _ACCEPTED, []
