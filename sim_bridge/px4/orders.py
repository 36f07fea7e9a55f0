"""What PX4 does at a command, and how it answers."""

from __future__ import annotations

from collections.abc import Callable

from sim_bridge.codec import Message, mavlink
from sim_bridge.px4.commander import Commander
from sim_bridge.px4.modes import Mode, mode_from_numbers
from sim_bridge.px4.navigator import Navigator
from sim_bridge.state import GeodeticPoint
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.plan_storage import PlanStorage
from sim_bridge.vehicle.services import Order, Reply

_FORCE = 21196
_AUTOTUNE_S = 20.0
_ACCEPTED, _DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
_REJECTED, _UNSUPPORTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_UNSUPPORTED


class Orders:
    """The commands that the autopilot decides about.

    Args:
        body: The vehicle.
        commander: Arms it and changes its modes.
        navigator: Flies it where a command says.
        storage: Its plans.
        reboot: Starts the autopilot anew, on the ground.
    """

    def __init__(
        self,
        body: Body,
        commander: Commander,
        navigator: Navigator,
        storage: PlanStorage,
        reboot: Callable[[], None],
    ) -> None:
        self._body = body
        self._commander = commander
        self._navigator = navigator
        self._storage = storage
        self._reboot = reboot
        self._autotune_s: float | None = None

    def answer(self, order: Order, now_s: float) -> list[Message]:
        """Do what a command for this vehicle says; the acknowledgement, and what is said besides.

        Args:
            order: The command.
            now_s: Since boot.
        """
        if order.command == mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE:
            return [self._autotune(order, now_s)]
        result, more = self._carry_out(order)
        return [order.ack(result), *more]

    def _carry_out(self, order: Order) -> Reply:
        commander = self._commander
        match order.command:
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                match order.whole(1):
                    case 1:
                        return commander.arm()
                    case 0:
                        return commander.disarm(force=order.whole(2) == _FORCE)
                    case _:
                        return _UNSUPPORTED, commander.critical(f"Unsupported ARM_DISARM param: {order.params[0]:.3f}")
            case mavlink.MAV_CMD_DO_SET_MODE:
                custom = order.whole(1) & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
                mode = mode_from_numbers(order.whole(2), max(0, order.whole(3))) if custom else None
                return commander.change_mode(mode) if mode is not None else (_REJECTED, [])
            case mavlink.MAV_CMD_NAV_TAKEOFF:
                return self._take_off(order)
            case mavlink.MAV_CMD_NAV_LAND:
                return commander.change_mode(Mode.LAND, "Landing at current position")
            case mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                return commander.change_mode(Mode.RETURN, "Returning to launch")
            case mavlink.MAV_CMD_MISSION_START:
                return self._start_mission(order)
            case mavlink.MAV_CMD_DO_REPOSITION:
                return self._reposition(order)
            case mavlink.MAV_CMD_DO_CHANGE_SPEED:
                speed = order.given(2)
                self._navigator.cruise_mps = speed if speed is not None and speed > 0.0 else None
                return _ACCEPTED, []
            case mavlink.MAV_CMD_DO_SET_HOME:
                return self._set_home(order)
            case mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                if self._body.armed:
                    return _DENIED, []
                self._reboot()
                return _ACCEPTED, []
            case _:
                return _UNSUPPORTED, []

    def _take_off(self, order: Order) -> Reply:
        """Altitudes of take-offs are above sea level."""
        result, texts = self._commander.change_mode(Mode.TAKEOFF)
        amsl_m = order.given(7)
        if result == _ACCEPTED and amsl_m is not None:
            self._navigator.takeoff_down_m = self._body.origin.altitude_amsl_m - amsl_m
        return result, texts

    def _start_mission(self, order: Order) -> Reply:
        if not self._storage.mission:
            return _DENIED, self._commander.critical("Mission start denied! No valid mission")
        if not -1 <= order.whole(1) < len(self._storage.mission):
            return _DENIED, []
        result, texts = self._commander.change_mode(Mode.MISSION)
        if result == _ACCEPTED and not self._body.armed:
            result, more = self._commander.arm()
            texts += more
        return result, texts

    def _reposition(self, order: Order) -> Reply:
        if order.whole(2) != 1:
            return _UNSUPPORTED, []
        result, texts = self._commander.change_mode(Mode.HOLD)
        if result == _ACCEPTED:
            self._commander.fly(Mode.HOLD)
            here = self._body.geodetic()
            latitude, longitude, amsl_m = (order.given(number) for number in (5, 6, 7))
            if latitude is None or longitude is None:
                latitude, longitude = here.latitude_deg, here.longitude_deg
            place = GeodeticPoint(latitude, longitude, here.altitude_amsl_m if amsl_m is None else amsl_m)
            self._navigator.hold_at(place, order.given(4))
        return result, texts

    def _set_home(self, order: Order) -> Reply:
        """Here, or at a place above sea level, however far away."""
        latitude, longitude, amsl_m = (order.given(number) for number in (5, 6, 7))
        if order.whole(1) == 1:
            self._body.home_ned_m = self._body.position_ned_m
        elif latitude is None or longitude is None or amsl_m is None:
            return _DENIED, []
        else:
            self._body.home_ned_m = self._body.local_ned(GeodeticPoint(latitude, longitude, amsl_m))
        return _ACCEPTED, []

    def _autotune(self, order: Order, now_s: float) -> Message:
        """A command that takes its time: IN_PROGRESS with a share, asked again and again until it is done."""
        if self._autotune_s is None:
            self._autotune_s = now_s
        share = (now_s - self._autotune_s) / _AUTOTUNE_S
        if share < 1.0:
            return order.ack(mavlink.MAV_RESULT_IN_PROGRESS, int(100.0 * share))
        self._autotune_s = None
        return order.ack(_ACCEPTED, 100)
