"""Who is in command of an ArduPilot vehicle: arming, modes, failsafes."""

from __future__ import annotations

from sim_bridge.ardupilot.modes import Mode
from sim_bridge.ardupilot.navigator import FIRST_ITEM, Navigator
from sim_bridge.codec import Message, mavlink
from sim_bridge.state import Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.fence_watch import FenceWatch
from sim_bridge.vehicle.services import Reply, Services
from sim_bridge.vehicle.telemetry import CELLS, cell_volts

_ACCEPTED, _FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
FORCE_ARM, FORCE_DISARM = 2989, 21196
# A mode set so soon after boot is undone, when the mode switch is first read.
_SWITCH_READ_S = 2.0
_PREARM_TEXT_EVERY_S = 30.0
_LANDED_DISARM_S = 1.0
_ALTITUDE_FENCE, _CIRCLE_FENCE, _POLYGON_FENCE = 1, 2, 4


class Commander:
    """Arming, modes, failsafes.

    Args:
        body: Of the vehicle.
        services: Its parameters, plans and texts.
        ready_after_s: From boot until it can be armed.
    """

    def __init__(self, body: Body, services: Services, ready_after_s: float) -> None:
        self._body = body
        self._services = services
        self._parameters = services.parameters
        self._ready_after_s = ready_after_s
        self._fence = FenceWatch()
        self._load_fence()
        self.navigator = Navigator(body, services.parameters, services.storage, self._inside_fence)
        self.now_s = 0.0
        """Since boot; set before anything else is asked."""
        self.refusal = ""
        self.mode = Mode.STABILIZE
        self.ground_station_s: float | None = None
        """When the one that is watched was last heard."""
        self._ground_station_lost = False
        self._switch_read = False
        self._prearm_told_s = 0.0
        self._armed_s = 0.0
        self._flew = False
        self._landed_s: float | None = None
        self._battery_level = 0
        self._position_lost = False
        self._outside = False

    @property
    def in_failsafe(self) -> bool:
        """Whether any failsafe was triggered and has not been cleared."""
        return self._battery_level > 0 or self._position_lost or self._ground_station_lost

    # Arming and modes.

    def fault(self) -> str | None:
        """Why arming is refused; None: it is not."""
        if self.now_s < self._ready_after_s:
            return "Need Position Estimate"
        if self.refusal:
            return self.refusal
        if not self._body.estimator.has_gps:
            return "GPS 1: Bad fix"
        if not self._body.position_valid:
            return "Need Position Estimate"
        if self._parameters["FENCE_ENABLE"] and self._breaches(self._body.position_ned_m):
            return "vehicle outside fence"
        return None

    def arm(self, *, force: bool) -> Reply:
        """Start the motors, if nothing is against it."""
        if self._body.armed:
            return _ACCEPTED, []
        fault = None if force else self.fault()
        if fault is None and not self.mode.armable:
            fault = f"{self.mode.name} mode not armable"
        if fault is not None:
            return _FAILED, self.critical(f"Arm: {fault}")
        self._body.armed = True
        self._body.set_home()
        self._armed_s, self._flew, self._landed_s = self.now_s, False, None
        self.navigator.armed()
        return _ACCEPTED, self.inform("Arming motors")

    def disarm(self, *, force: bool) -> Reply:
        """Stop the motors; in the air only by force."""
        if not self._body.armed:
            return _ACCEPTED, []
        if not self._body.on_ground and not force:
            return _FAILED, []
        return _ACCEPTED, self._stop_motors()

    def change_mode(self, number: int) -> Reply:
        """A mode is asked for: always allowed while disarmed, else only where it can be flown."""
        if number not in list(Mode):
            return _FAILED, self.critical(f"No such mode {number}")
        mode = Mode(number)
        reason, texts = self._why_not(mode)
        if reason:
            return _FAILED, texts + self.critical(f"Mode change to {mode.name} failed: {reason}")
        self.fly(mode)
        return _ACCEPTED, []

    def _why_not(self, mode: Mode) -> tuple[str, list[Message]]:
        """Why a mode cannot be changed to, in a word and in texts; empty: it can."""
        if self._body.armed and mode.needs_position and not self._body.position_valid:
            return "requires position", []
        if mode is not Mode.AUTO or self.mode is Mode.AUTO:
            return "", []
        mission = self._services.storage.mission
        if len(mission) <= FIRST_ITEM:
            return "init failed", []
        standing = self._body.armed and self._body.on_ground
        if standing and mission[FIRST_ITEM].command != mavlink.MAV_CMD_NAV_TAKEOFF:
            return "init failed", self.critical("Auto: Missing Takeoff Cmd")
        return "", []

    def fly(self, mode: Mode) -> None:
        """Make a mode the one that is flown."""
        if mode is not self.mode:
            self.mode = mode
            self.navigator.enter(mode)

    def recover_in_air(self) -> None:
        """After a restart in flight: motors on, and down."""
        self._body.armed = self._flew = self._switch_read = True
        self.fly(Mode.LAND)

    def _stop_motors(self) -> list[Message]:
        self._body.armed = False
        return self.inform("Disarming motors")

    # Watching.

    def watch(self) -> list[Message]:
        """Whatever happens by itself."""
        if not self._switch_read and self.now_s >= _SWITCH_READ_S:
            self._switch_read = True
            if not self._body.armed:
                self.fly(Mode.STABILIZE)
        if not self._body.armed:
            return self._complain()
        told = self._watch_position() + self._watch_fence() + self._watch_battery() + self._watch_ground_station()
        return told + self._landed_or_idle()

    def plan_changed(self, kind: int) -> list[Message]:
        """A plan was replaced."""
        if kind == mavlink.MAV_MISSION_TYPE_FENCE:
            self._load_fence()
            return []
        if kind != mavlink.MAV_MISSION_TYPE_MISSION:
            return []
        if self.mode is not Mode.AUTO:
            self.navigator.mission.restart()
        return self.inform("Flight plan received") if self._services.storage.mission else []

    def critical(self, text: str) -> list[Message]:
        """Say what matters."""
        return self._services.say(mavlink.MAV_SEVERITY_CRITICAL, text)

    def inform(self, text: str) -> list[Message]:
        """Say what is good to know."""
        return self._services.say(mavlink.MAV_SEVERITY_INFO, text)

    def _complain(self) -> list[Message]:
        """Every half minute: why it could not be armed."""
        fault = self.fault()
        if fault is None or self.now_s - self._prearm_told_s < _PREARM_TEXT_EVERY_S:
            return []
        self._prearm_told_s = self.now_s
        return self.critical(f"PreArm: {fault}")

    def _watch_position(self) -> list[Message]:
        lost, before = not self._body.position_valid, self._position_lost
        self._position_lost = lost
        if not lost or before:
            return [] if lost == before else self.critical("EKF Failsafe Cleared")
        told = self.critical("EKF variance")
        if self.mode.needs_position and self._parameters["FS_EKF_ACTION"]:
            self.fly(Mode.LAND)
            told += self.critical("EKF Failsafe: changed to LAND Mode")
        return told

    def _watch_fence(self) -> list[Message]:
        if not self._parameters["FENCE_ENABLE"] or self._body.on_ground:
            self._outside = False
            return []
        before, self._outside = self._outside, self._breaches(self._body.position_ned_m)
        if before or not self._outside:
            return []
        match int(self._parameters["FENCE_ACTION"]):
            case 0:
                pass
            case 2:
                self.fly(Mode.LAND)
            case 4:
                self.fly(Mode.BRAKE)
            case _:
                self.fly(Mode.RTL if self._body.position_valid else Mode.LAND)
        return self._services.say(mavlink.MAV_SEVERITY_NOTICE, "Fence breached")

    def _watch_battery(self) -> list[Message]:
        parameters, charge = self._parameters, self._body.rotor.battery
        left_mah, volts = charge * parameters["BATT_CAPACITY"], CELLS * cell_volts(charge)
        level = sum(
            left_mah < parameters[f"BATT_{name}_MAH"] or volts < parameters[f"BATT_{name}_VOLT"]
            for name in ("LOW", "CRT")
        )
        if level <= self._battery_level:
            return []
        self._battery_level = level
        name, word = ("LOW", "low") if level == 1 else ("CRT", "critical")
        used = parameters["BATT_CAPACITY"] - left_mah
        told = self._services.say(mavlink.MAV_SEVERITY_WARNING, f"Battery 1 is {word} {volts:.2f}V used {used:.0f} mAh")
        match int(parameters[f"BATT_FS_{name}_ACT"]):
            case 1:
                self.fly(Mode.LAND)
            case 2 | 3 | 4:
                self.fly(Mode.RTL)
            case 5:
                return told + self._stop_motors()
            case _:
                return told
        return told + self.critical("Battery Failsafe")

    def _watch_ground_station(self) -> list[Message]:
        """Only SYSID_MYGCS counts, and only once it was heard."""
        action = int(self._parameters["FS_GCS_ENABLE"])
        lost = (
            action != 0
            and self.ground_station_s is not None
            and self.now_s - self.ground_station_s > self._parameters["FS_GCS_TIMEOUT"]
        )
        before, self._ground_station_lost = self._ground_station_lost, lost
        if lost == before:
            return []
        if not lost:
            return self.critical("GCS Failsafe Cleared")
        told = self.critical("GCS Failsafe")
        if self._body.on_ground:
            return told + self._stop_motors()
        if not (action == 2 and self.mode is Mode.AUTO):
            self.fly(Mode.LAND if action == 5 else Mode.BRAKE if action == 7 else Mode.RTL)
        return told

    def _landed_or_idle(self) -> list[Message]:
        """Motors stop by themselves when landed in a mode that lands, else DISARM_DELAY after nothing flies."""
        if not self._body.on_ground:
            self._flew, self._landed_s = True, None
            return []
        since_s = self._armed_s
        if self._flew:
            since_s = self._landed_s = self.now_s if self._landed_s is None else self._landed_s
        lands = self.mode in (Mode.LAND, Mode.RTL) or (self.mode is Mode.AUTO and self.navigator.landing)
        wait_s = _LANDED_DISARM_S if lands and self._flew else self._parameters["DISARM_DELAY"]
        return self._stop_motors() if 0.0 < wait_s <= self.now_s - since_s else []

    # The fence.

    def _load_fence(self) -> None:
        self._fence.load(self._services.storage.fence, self._body, must_contain=[])

    def _inside_fence(self, place_ned_m: Vector) -> bool:
        return not (self._parameters["FENCE_ENABLE"] and self._breaches(place_ned_m))

    def _breaches(self, place_ned_m: Vector) -> bool:
        parameters, home = self._parameters, self._body.home_ned_m
        kinds = int(parameters["FENCE_TYPE"])
        too_high = home[2] - place_ned_m[2] > parameters["FENCE_ALT_MAX"]
        away = ((place_ned_m[0] - home[0]) ** 2 + (place_ned_m[1] - home[1]) ** 2) ** 0.5
        return bool(
            (kinds & _ALTITUDE_FENCE and too_high)
            or (kinds & _CIRCLE_FENCE and away > parameters["FENCE_RADIUS"])
            or (kinds & _POLYGON_FENCE and self._fence.breached(place_ned_m))
        )
