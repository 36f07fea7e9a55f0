"""Who is in command of a PX4 vehicle: arming, the mode that was asked for, and what the failsafes make of it."""

from __future__ import annotations

from sim_bridge.codec import Message, mavlink
from sim_bridge.px4.failsafe import (
    MODES,
    Action,
    Cause,
    Failsafes,
    Response,
    on_battery,
    on_fence,
    on_ground_station_loss,
    on_stream_loss,
)
from sim_bridge.px4.modes import Mode
from sim_bridge.px4.navigator import Navigator
from sim_bridge.px4.offboard import Stream
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.fence_watch import FenceWatch
from sim_bridge.vehicle.parameters import Parameters
from sim_bridge.vehicle.services import Reply, Services

_ACCEPTED, _REJECTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
_BATTERY_LEVELS = (
    ("BAT_LOW_THR", "Low battery level"),
    ("BAT_CRIT_THR", "Critical battery level"),
    ("BAT_EMERGEN_THR", "Dangerously low battery"),
)


class Commander:
    """Arming, modes, failsafes.

    Args:
        body: Of the vehicle.
        services: Its parameters, plans and texts.
        stream: Its setpoints.
        navigator: Flies the modes.
        ready_after_s: From boot until it can be armed.
    """

    def __init__(
        self, body: Body, services: Services, stream: Stream, navigator: Navigator, ready_after_s: float
    ) -> None:
        self._body = body
        self._services = services
        self._parameters: Parameters = services.parameters
        self._stream = stream
        self._navigator = navigator
        self._ready_after_s = ready_after_s
        self._fence = FenceWatch()
        self._failsafes = Failsafes()
        self.now_s = 0.0
        """Since boot; set before anything else is asked."""
        self.refusal = ""
        self.intended = self.flown = self._after_disarming = Mode.POSCTL
        self.ground_station_s: float | None = None
        """When one was last heard."""
        self._mode_changed = False
        self._armed_s = 0.0
        self._flew = False
        self._landed_s: float | None = None
        self._battery_level = 0
        self._outside = False

    @property
    def in_failsafe(self) -> bool:
        """Whether the vehicle acts on a failsafe."""
        return self._failsafes.acts

    # Arming.

    def fault(self) -> str | None:
        """Why arming is denied; None: it is not."""
        if self.now_s < self._ready_after_s:
            return "Preflight Fail: ekf2 missing data"
        if self.refusal:
            return self.refusal
        if not self._body.position_valid:
            return "Preflight Fail: position estimate error"
        if self._body.rotor.battery < self._parameters["BAT_CRIT_THR"]:
            return "Preflight Fail: Battery unhealthy"
        if self._outside and on_fence(self._parameters["GF_ACTION"]).action is not Action.NONE:
            return "Geofence violation: approaching or outside geofence"
        if self.intended.prevents_arming:
            return "Preflight Fail: Mode not suitable for arming"
        if not self.can_fly(self.intended):
            missing = "offboard signal" if self.intended is Mode.OFFBOARD else "valid mission"
            return f"Preflight Fail: No {missing}"
        return None

    def arm(self) -> Reply:
        """Start the motors, if nothing is against it."""
        if self._body.armed:
            return _ACCEPTED, []
        fault = self.fault()
        if fault is not None:
            denied = "Arming denied: Resolve system health failures first"
            return _REJECTED, self.critical(fault) + self.critical(denied)
        self._body.armed = True
        self._body.set_home()
        self._failsafes.clear()
        self._armed_s, self._flew, self._landed_s = self.now_s, False, None
        self._navigator.armed()
        self.fly(self.intended)
        fence = self.load_fence() if self._services.storage.fence else []
        return _ACCEPTED, self.inform("Armed by external command") + fence

    def disarm(self, *, force: bool) -> Reply:
        """Stop the motors; in the air only by force."""
        if self._body.armed and not self._body.on_ground and not force:
            return _REJECTED, self.critical("Disarming denied: not landed")
        return _ACCEPTED, self._stop_motors("external command") if self._body.armed else []

    def recover_in_air(self) -> None:
        """After a restart in flight: motors on, and down."""
        self._body.armed = self._flew = True
        self.intended = Mode.LAND

    def _stop_motors(self, reason: str) -> list[Message]:
        self._body.armed = False
        self._failsafes.clear()
        self.intended = self._after_disarming
        self.fly(self.intended)
        return self.inform(f"Disarmed by {reason}")

    # Modes.

    def change_mode(self, mode: Mode, text: str = "") -> Reply:
        """A mode is asked for: always allowed while disarmed, else only where it can be flown."""
        if self._body.armed and not self.can_fly(mode):
            return _REJECTED, self.critical(f"Switching to {mode.words} is currently not available")
        if mode is Mode.TAKEOFF:
            self._navigator.takeoff_down_m = None
        self.intended = mode
        self._mode_changed = True
        if not mode.prevents_arming:
            self._after_disarming = mode
        if not self._body.armed:
            self.fly(mode)
        return _ACCEPTED, self.inform(text) if text else []

    def can_fly(self, mode: Mode) -> bool:
        """Whether what a mode needs is there."""
        if mode.needs_position and not self._body.position_valid:
            return False
        match mode:
            case Mode.OFFBOARD:
                return self._streaming()
            case Mode.MISSION:
                return bool(self._services.storage.mission)
            case _:
                return True

    def fly(self, mode: Mode) -> None:
        """Make a mode the one that is flown."""
        if mode is not self.flown:
            self.flown = mode
            self._navigator.enter(mode)

    def _streaming(self) -> bool:
        return self._stream.alive(self.now_s, self._parameters["COM_OF_LOSS_T"])

    # Watching.

    def watch(self) -> list[Message]:
        """While armed: what is wrong now, and what that does to the mode."""
        causes: dict[Cause, Response] = {}
        told = self._watch_fence(causes) + self._watch_battery(causes)
        fallback = self._fallback()
        if fallback is not Action.NONE:
            causes[Cause.MODE] = Response(fallback)
        heard_s = self.ground_station_s
        if heard_s is not None and self.now_s - heard_s > self._parameters["COM_DL_LOSS_T"]:
            causes[Cause.GROUND_STATION] = on_ground_station_loss(self._parameters["NAV_DLL_ACT"])
        texts = self._failsafes.update(
            causes,
            self.intended,
            mode_changed=self._mode_changed,
            can_fly=self.can_fly,
            delay_s=self._parameters["COM_FAIL_ACT_T"],
            now_s=self.now_s,
        )
        self._mode_changed = False
        told += [message for text in texts for message in self.critical(text)]
        action = self._failsafes.action
        if action in (Action.DISARM, Action.TERMINATE):
            return told + self._stop_motors("failsafe")
        self.fly(MODES.get(action, self.intended))
        return told

    def settle(self) -> list[Message]:
        """While armed: modes and flights that end by themselves."""
        if not self._body.armed:
            return []
        told: list[Message] = []
        if self.flown is Mode.TAKEOFF and self._navigator.takeoff_done():
            self.intended = self._after_disarming = Mode.HOLD
        ends_with = self._navigator.mission.ends_with
        ends_with_return = ends_with is not None and ends_with.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH
        if self.flown is Mode.MISSION and ends_with_return and self.intended is Mode.MISSION:
            self.intended = Mode.RETURN
            told += self.inform("Returning to launch")
        return told + self._landed_or_idle()

    def load_fence(self) -> list[Message]:
        """Take the stored fence.

        Areas that do not allow home, or in flight the vehicle's place, are not enforced; that is said afterwards.
        """
        body = self._body
        here = body.position_ned_m
        home = body.home_ned_m if body.armed else here
        broken = self._fence.load(
            self._services.storage.fence, body, must_contain=[home] if body.on_ground else [home, here]
        )
        told = []
        if home in broken:
            told += self.critical("Geofence invalid, doesn't contain Home position")
        if here in broken and not body.on_ground:
            told += self.critical("Geofence invalid, doesn't contain current vehicle position")
        return told

    def critical(self, text: str) -> list[Message]:
        """Say what matters."""
        return self._services.say(mavlink.MAV_SEVERITY_CRITICAL, text)

    def inform(self, text: str) -> list[Message]:
        """Say what is good to know."""
        return self._services.say(mavlink.MAV_SEVERITY_INFO, text)

    def _fallback(self) -> Action:
        """What to do where the wanted mode cannot be flown."""
        wanted, action = self.intended, Action.NONE
        if wanted is Mode.OFFBOARD and not self.can_fly(wanted):
            action = on_stream_loss(self._parameters["COM_OBL_RC_ACT"])
            if action not in MODES:
                return action
            wanted = MODES[action]
        if wanted is Mode.POSCTL and not self.can_fly(wanted):
            action, wanted = Action.ALTITUDE, Mode.ALTCTL
        return action if self.can_fly(wanted) else Action.RETURN

    def _watch_fence(self, causes: dict[Cause, Response]) -> list[Message]:
        body, parameters = self._body, self._parameters
        farthest, highest = parameters["GF_MAX_HOR_DIST"], parameters["GF_MAX_VER_DIST"]
        height = body.home_ned_m[2] - body.position_ned_m[2]
        outside = (
            (farthest > 0.0 and body.distance_home_m() > farthest)
            or (highest > 0.0 and height > highest)
            or self._fence.breached(body.position_ned_m)
        )
        fresh, self._outside = outside and not self._outside, outside
        if not outside:
            return []
        causes[Cause.FENCE] = on_fence(parameters["GF_ACTION"])
        warned = fresh and causes[Cause.FENCE].action is not Action.NONE
        return self.critical("Geofence violation: approaching or outside geofence") if warned else []

    def _watch_battery(self, causes: dict[Cause, Response]) -> list[Message]:
        charge = self._body.rotor.battery
        level = sum(charge < self._parameters[threshold] for threshold, _ in _BATTERY_LEVELS)
        if level:
            causes[Cause.BATTERY] = on_battery(self._parameters["COM_LOW_BAT_ACT"], level)
        fresh, self._battery_level = level > self._battery_level, max(self._battery_level, level)
        return self._services.say(mavlink.MAV_SEVERITY_EMERGENCY, _BATTERY_LEVELS[level - 1][1]) if fresh else []

    def _landed_or_idle(self) -> list[Message]:
        """Motors stop by themselves some time after landing, or if nothing takes off."""
        if not self._body.on_ground:
            took_off = not self._flew
            self._flew, self._landed_s = True, None
            if not took_off:
                return []
            self._body.set_home()
            return self.inform("Takeoff detected")
        wait_s = self._parameters["COM_DISARM_LAND" if self._flew else "COM_DISARM_PRFLT"]
        if not self._flew:
            idle = wait_s > 0.0 and self.now_s - self._armed_s > wait_s
            return self._stop_motors("auto preflight disarming") if idle else []
        if self._landed_s is None:
            self._landed_s = self.now_s
            return self.inform("Landing detected")
        if wait_s > 0.0 and self.now_s - self._landed_s >= wait_s:
            return self._stop_motors("landing")
        return []
