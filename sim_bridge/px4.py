"""The built-in vehicle as PX4 1.15 behaves: modes, arming, Offboard and its loss, failsafes, missions, fences."""

from __future__ import annotations

import dataclasses
import enum
import math

from sim_bridge import guidance
from sim_bridge.body import Body, VehicleConfig
from sim_bridge.codec import Message, mavlink
from sim_bridge.fence_watch import FenceWatch
from sim_bridge.kinematics import Airframe, Target
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.mission_execution import MissionRun
from sim_bridge.offboard import SETPOINTS, Stream
from sim_bridge.parameters import Encoding, Parameters
from sim_bridge.plan_storage import Manners, PlanStorage
from sim_bridge.px4_defaults import PARAMETERS, RATES_HZ
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.telemetry import Streams, body_message, status_texts

FORCE_DISARM = 21196.0
PREFLIGHT_DISARM_S = 10.0
LANDED_DISARM_S = 2.0
FAST_DESCENT_ABOVE_M = 10.0
REACHED_REPEAT_S = 1.0
TAKEN_OFF_WITHIN_M = 0.3


class Mode(enum.Enum):
    """Flight modes, by main and sub mode of the heartbeat."""

    POSCTL = (3, 0)
    ALTCTL = (2, 0)
    OFFBOARD = (6, 0)
    TAKEOFF = (4, 2)
    HOLD = (4, 3)
    MISSION = (4, 4)
    RETURN = (4, 5)
    LAND = (4, 6)

    @property
    def custom_mode(self) -> int:
        """As the heartbeat carries it."""
        main, sub = self.value
        return sub << 24 | main << 16


_LOSS_MODES = {0: Mode.POSCTL, 1: Mode.ALTCTL, 3: Mode.RETURN, 4: Mode.LAND, 5: Mode.HOLD}
_FENCE_MODES = {2: Mode.HOLD, 3: Mode.RETURN, 5: Mode.LAND}
_NAMES = {Mode.POSCTL: "Position", Mode.ALTCTL: "Altitude", Mode.OFFBOARD: "Offboard", Mode.TAKEOFF: "Takeoff"}


class Px4:
    """A PX4 quadrotor.

    Args:
        config: How it is set up.
    """

    def __init__(self, config: VehicleConfig) -> None:
        self.parameters = Parameters(PARAMETERS, Encoding.BYTEWISE)
        self.parameters.change(dict(config.parameters))
        self.body = Body(dataclasses.replace(config, airframe=self._airframe(config.airframe)), Autopilot.PX4)
        self.mode = Mode.POSCTL
        self.failsafe = False
        self.storage = PlanStorage(
            Manners(
                first_request_is_int=False,
                later_requests_are_int=True,
                retry_s=0.26,
                give_up_s=5.0,
                gives_up_with_ack=False,
                most_items=2000,
                check=lambda _kind, _item: mavlink.MAV_MISSION_ACCEPTED,
            )
        )
        self._streams = Streams(RATES_HZ)
        self._stream = Stream()
        self._mission = MissionRun()
        self._fence = FenceWatch()
        self._held: Vector = self.body.rotor.position_ned_m
        self._held_yaw_rad = 0.0
        self._takeoff_down_m = 0.0
        self._return_leg = 0
        self._armed_s = 0.0
        self._flew = False
        self._landed_s: float | None = None
        self._offboard_wanted = False
        self._battery_warned = 0
        self._reached_told_s = -math.inf
        self._text_id = 0
        self._now_s = 0.0

    # Hearing.

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it."""
        self._now_s = now_s
        own = self.body.config.system
        target = getattr(message, "target_system", None)
        match message:
            case mavlink.MAVLink_command_long_message() | mavlink.MAVLink_command_int_message():
                if target not in (0, own):
                    return [self._ack(message, mavlink.MAV_RESULT_FAILED)]
                return self._command(message)
            case mavlink.MAVLink_ping_message():
                if target not in (0, own):
                    return []
                peer = (message.get_srcSystem(), message.get_srcComponent())
                return [mavlink.MAVLink_ping_message(message.time_usec, message.seq, *peer)]
            case mavlink.MAVLink_timesync_message():
                if message.tc1 != 0:
                    return []
                return [mavlink.MAVLink_timesync_message(int(now_s * 1e9), message.ts1)]
            case _ if target not in (None, 0, own):
                return []
            case mavlink.MAVLink_file_transfer_protocol_message():
                return [_ftp_refusal(message)]
            case mavlink.MAVLink_set_mode_message():
                result, texts = self._set_mode(message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF)
                del result
                return texts
            case mavlink.MAVLink_mission_set_current_message():
                self._mission.restart(at=message.seq)
                return []
            case _ if isinstance(message, SETPOINTS):
                self._stream.receive(message, self.body, now_s)
                return []
            case _:
                replies = self.parameters.receive(message) + self.storage.receive(message, now_s)
                return replies + self._plan_changed()

    def _command(self, message: Message) -> list[Message]:
        result, more = self._carried_out(message)
        return [self._ack(message, result), *more]

    def _carried_out(self, message: Message) -> tuple[int, list[Message]]:
        accepted, denied = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
        match message.command:
            case mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
                return self._arm() if message.param1 > 0.5 else self._disarm(message.param2 == FORCE_DISARM)
            case mavlink.MAV_CMD_DO_SET_MODE:
                return self._set_mode(int(message.param2), int(message.param3))
            case mavlink.MAV_CMD_NAV_TAKEOFF:
                home = self.body.geodetic(self.body.home_ned_m).altitude_amsl_m
                altitude = getattr(message, "param7", getattr(message, "z", math.nan))
                amsl = altitude if math.isfinite(altitude) else home + self.parameters["MIS_TAKEOFF_ALT"]
                self._takeoff_down_m = self.body.origin.altitude_amsl_m - amsl
                return accepted, self._enter(Mode.TAKEOFF)
            case mavlink.MAV_CMD_NAV_LAND:
                return accepted, self._enter(Mode.LAND)
            case mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                return accepted, self._enter(Mode.RETURN)
            case mavlink.MAV_CMD_MISSION_START:
                return self._set_mode(*Mode.MISSION.value)
            case mavlink.MAV_CMD_DO_REPOSITION:
                texts = self._enter(Mode.HOLD)
                if isinstance(message, mavlink.MAVLink_command_int_message) and message.x != 0:
                    place = GeodeticPoint(message.x * 1e-7, message.y * 1e-7, message.z)
                    self._held = self.body.local_ned(place)
                return accepted, texts
            case mavlink.MAV_CMD_DO_CHANGE_SPEED | mavlink.MAV_CMD_DO_SET_HOME:
                return accepted, []
            case mavlink.MAV_CMD_SET_MESSAGE_INTERVAL:
                message_id = int(message.param1)
                self._streams.set_interval(message_id, message.param2, RATES_HZ.get(message_id, 1.0), self._now_s)
                return accepted, []
            case mavlink.MAV_CMD_GET_MESSAGE_INTERVAL:
                message_id = int(message.param1)
                interval = int(self._streams.interval_us(message_id))
                return accepted, [mavlink.MAVLink_message_interval_message(message_id, interval)]
            case mavlink.MAV_CMD_REQUEST_MESSAGE:
                asked = self._message(int(message.param1))
                return (accepted, [asked]) if asked is not None else (denied, [])
            case mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES:
                return accepted, [_version()]
            case mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN:
                if self.body.armed:
                    return denied, []
                self.reboot()
                return accepted, []
            case _:
                return mavlink.MAV_RESULT_UNSUPPORTED, []

    def reboot(self) -> None:
        """Forget everything but parameters, plans and where the vehicle is."""
        self.body.armed = False
        self.mode, self.failsafe = Mode.POSCTL, False
        self._stream.forget()
        self._offboard_wanted = False
        self._booted_s = self._now_s

    _booted_s = 0.0

    # Modes and arming.

    @property
    def ready(self) -> bool:
        """Whether the pre-arm checks pass."""
        return self._now_s - self._booted_s >= self.body.config.ready_after_s

    def _arm(self) -> tuple[int, list[Message]]:
        rejected = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        if self.body.armed:
            return mavlink.MAV_RESULT_ACCEPTED, []
        if not self.ready:
            text = "Arming denied: Resolve system health failures first: ekf2 missing data"
            return rejected, self._say(mavlink.MAV_SEVERITY_CRITICAL, text)
        if self.mode is Mode.OFFBOARD and not self._streaming():
            return rejected, self._say(mavlink.MAV_SEVERITY_CRITICAL, "Arming denied: no offboard signal")
        if self.body.rotor.battery < self.parameters["BAT_CRIT_THR"]:
            return rejected, self._say(mavlink.MAV_SEVERITY_CRITICAL, "Arming denied: battery critically low")
        self.body.armed = True
        self.body.home_ned_m = self.body.rotor.position_ned_m
        self._armed_s, self._flew, self._landed_s = self._now_s, False, None
        self._hold_here()
        fence = self._plan_changed() if self.storage.plans[mavlink.MAV_MISSION_TYPE_FENCE] else []
        return mavlink.MAV_RESULT_ACCEPTED, [*self._say(mavlink.MAV_SEVERITY_INFO, "Armed by external command"), *fence]

    def _disarm(self, force: bool) -> tuple[int, list[Message]]:
        if not self.body.armed:
            return mavlink.MAV_RESULT_ACCEPTED, []
        if not self.body.rotor.on_ground and not force:
            text = "Disarming denied: not landed"
            return mavlink.MAV_RESULT_TEMPORARILY_REJECTED, self._say(mavlink.MAV_SEVERITY_CRITICAL, text)
        return mavlink.MAV_RESULT_ACCEPTED, self._stop_motors("Disarmed by external command")

    def _stop_motors(self, text: str) -> list[Message]:
        self.body.armed, self.failsafe = False, False
        return self._say(mavlink.MAV_SEVERITY_INFO, text)

    def _set_mode(self, main: int, sub: int) -> tuple[int, list[Message]]:
        mode = next((mode for mode in Mode if mode.value == (main, sub)), None)
        if mode is None:
            return mavlink.MAV_RESULT_UNSUPPORTED, []
        rejected = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
        if mode is Mode.OFFBOARD and self.body.armed and not self._streaming():
            return rejected, self._say(
                mavlink.MAV_SEVERITY_CRITICAL, "Switching to Offboard is currently not available"
            )
        if mode is Mode.MISSION and not self.storage.plans[mavlink.MAV_MISSION_TYPE_MISSION]:
            return rejected, self._say(mavlink.MAV_SEVERITY_CRITICAL, "Switching to Mission is currently not available")
        return mavlink.MAV_RESULT_ACCEPTED, self._enter(mode)

    def pilot_switches(self, mode: Mode) -> list[Message]:
        """A pilot's own choice of mode, by transmitter."""
        return self._enter(mode)

    def _enter(self, mode: Mode) -> list[Message]:
        """Change mode because somebody asked for it: a loss is over, and so is Offboard's wish to come back."""
        self._offboard_wanted = mode is Mode.OFFBOARD
        self.failsafe = False
        return self._switch(mode)

    def _switch(self, mode: Mode) -> list[Message]:
        if mode is Mode.MISSION and self.mode is not Mode.MISSION:
            self._mission.restart(at=self._mission.current)
        self.mode = mode
        self._return_leg = 0
        self._hold_here()
        return []

    def _hold_here(self) -> None:
        """Where to stay: where the vehicle comes to a stand from the speed it has."""
        rotor = self.body.rotor
        x, y, z = rotor.position_ned_m
        vx, vy, vz = rotor.velocity_ned_mps
        stop_s = math.hypot(vx, vy) / (2.0 * guidance.BRAKING_SHARE * rotor.airframe.max_acceleration_mps2)
        self._held = (x + vx * stop_s, y + vy * stop_s, min(z + 0.3 * vz, rotor.ground_down_m))
        self._held_yaw_rad = rotor.yaw_rad

    def _streaming(self) -> bool:
        return self._stream.alive(self._now_s, self.parameters["COM_OF_LOSS_T"])

    # Moving and telling.

    def tick(self, now_s: float) -> list[Message]:
        """Move until now, and tell what is due."""
        self._now_s = now_s
        told = self._watch() if self.body.armed else []
        target = self._target() if self.body.armed else None
        self.body.advance(now_s, target)
        told += self._landed_or_idle() + self.storage.tick(now_s) + self._mission_progress()
        for message_id in self._streams.due(now_s):
            message = self._message(message_id)
            if message is not None:
                told.append(message)
        return told

    def streamed_to_s(self) -> float | None:
        """Vehicle time of the last new setpoint while they are being followed."""
        following = self.body.armed and self.mode is Mode.OFFBOARD
        return self._stream.last_new_s if following else None

    def _watch(self) -> list[Message]:
        """Failsafes: stream loss and its end, fence, battery."""
        told: list[Message] = []
        streaming = self._streaming()
        if self.mode is Mode.OFFBOARD and not streaming:
            self.failsafe = True
            action = _LOSS_MODES.get(int(self.parameters["COM_OBL_RC_ACT"]), Mode.HOLD)
            told += self._switch(action)
            told += self._say(mavlink.MAV_SEVERITY_CRITICAL, "Failsafe activated: no offboard signal")
        elif self._offboard_wanted and self.failsafe and streaming and self.mode is not Mode.OFFBOARD:
            # It comes back by itself as soon as setpoints do, unless somebody chose another mode.
            self.failsafe = False
            told += self._switch(Mode.OFFBOARD)
        fence_mode = _FENCE_MODES.get(int(self.parameters["GF_ACTION"]))
        outside = self._fence.enforced and self._fence.breached(self.body.rotor.position_ned_m)
        if outside and fence_mode is not None and self.mode not in (fence_mode, Mode.RETURN, Mode.LAND):
            self._offboard_wanted = False
            self.failsafe = True
            told += self._switch(fence_mode)
            told += self._say(mavlink.MAV_SEVERITY_CRITICAL, "Geofence violation: approaching or outside geofence")
        return told + self._watch_battery()

    def _watch_battery(self) -> list[Message]:
        levels = ("BAT_LOW_THR", "BAT_CRIT_THR", "BAT_EMERGEN_THR")
        level = sum(self.body.rotor.battery < self.parameters[name] for name in levels)
        if level <= self._battery_warned:
            return []
        self._battery_warned = level
        action = int(self.parameters["COM_LOW_BAT_ACT"])
        words = ("Low battery level", "Critical battery level", "Dangerously low battery")[level - 1]
        told = self._say(mavlink.MAV_SEVERITY_WARNING, words)
        mode = None
        if (level == 2 and action in (2, 3)) or (level == 3 and action == 3):
            mode = Mode.LAND if level == 3 or action == 2 else Mode.RETURN
        if mode is not None and self.mode is not mode:
            self._offboard_wanted, self.failsafe = False, True
            told += self._switch(mode)
        return told

    def _target(self) -> Target | None:
        body, rotor = self.body, self.body.rotor
        match self.mode:
            case Mode.OFFBOARD:
                return self._stream.target
            case Mode.HOLD:
                if rotor.on_ground:
                    return None
                return guidance.hold(self._held, self._held_yaw_rad)
            case Mode.POSCTL | Mode.ALTCTL:
                # Without a transmitter nobody holds the throttle: it sinks.
                return None if rotor.on_ground else guidance.descend(self._held, 0.5, self._held_yaw_rad)
            case Mode.TAKEOFF:
                if abs(rotor.position_ned_m[2] - self._takeoff_down_m) < TAKEN_OFF_WITHIN_M and not rotor.on_ground:
                    self._switch(Mode.HOLD)
                    self._held = (*self._held[:2], self._takeoff_down_m)
                speed = self.parameters["MPC_TKO_SPEED"]
                return guidance.climb(self._held, self._takeoff_down_m, speed, self._held_yaw_rad)
            case Mode.MISSION:
                return self._mission_target()
            case Mode.RETURN:
                return self._return_target()
            case Mode.LAND:
                fast = rotor.height_m > FAST_DESCENT_ABOVE_M
                speed = self.parameters["MPC_Z_V_AUTO_DN" if fast else "MPC_LAND_SPEED"]
                return None if rotor.on_ground else guidance.descend(self._held, speed, self._held_yaw_rad)
        raise AssertionError(f"no behaviour for {body} in {self.mode}")

    def _mission_target(self) -> Target | None:
        items = self.storage.plans[mavlink.MAV_MISSION_TYPE_MISSION]
        cruise, radius = self.parameters["MPC_XY_CRUISE"], self.parameters["NAV_ACC_RAD"]
        target = self._mission.target(items, self.body, self._now_s, cruise, radius)
        if target is not None:
            return target
        match self._mission.ends_with:
            case mavlink.MAV_CMD_NAV_LAND:
                self._enter(Mode.LAND)
            case mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
                self._enter(Mode.RETURN)
            case _:
                self._enter(Mode.HOLD)
        return self._target()

    def _return_target(self) -> Target | None:
        """Up to the return altitude, over to home, down."""
        body, rotor = self.body, self.body.rotor
        top = min(rotor.position_ned_m[2], body.home_ned_m[2] - self.parameters["RTL_RETURN_ALT"])
        near = body.distance_home_m() < 5.0
        if self._return_leg == 0:
            self._held = (*self._held[:2], self._held[2] if near else top)
            self._return_leg = 2 if near else 1
        if self._return_leg == 1:
            if abs(rotor.position_ned_m[2] - self._held[2]) > 1.0:
                return guidance.climb(self._held, self._held[2], rotor.airframe.max_climb_mps, self._held_yaw_rad)
            self._return_leg = 2
            self._held = (*body.home_ned_m[:2], self._held[2])
        if self._return_leg == 2:
            home = (*body.home_ned_m[:2], self._held[2])
            if not guidance.is_at(body, home, 1.0, math.inf):
                return guidance.go_to(body, home, self.parameters["MPC_XY_CRUISE"])
            self._return_leg = 3
            self._held, self._held_yaw_rad = home, rotor.yaw_rad
        fast = rotor.height_m > FAST_DESCENT_ABOVE_M
        speed = self.parameters["MPC_Z_V_AUTO_DN" if fast else "MPC_LAND_SPEED"]
        return None if rotor.on_ground else guidance.descend(self._held, speed, self._held_yaw_rad)

    def _landed_or_idle(self) -> list[Message]:
        """Motors stop by themselves some time after landing, or if nothing takes off."""
        if not self.body.armed:
            return []
        if not self.body.rotor.on_ground:
            self._flew, self._landed_s = True, None
            return []
        if not self._flew:
            idle = self._now_s - self._armed_s > PREFLIGHT_DISARM_S
            return self._stop_motors("Disarmed by auto preflight disarming") if idle else []
        if self._landed_s is None:
            self._landed_s = self._now_s
        if self._now_s - self._landed_s >= LANDED_DISARM_S:
            return self._stop_motors("Disarmed by landing")
        return []

    def _mission_progress(self) -> list[Message]:
        reached = self._mission.reached
        if self.mode is not Mode.MISSION or reached is None or self._now_s - self._reached_told_s < REACHED_REPEAT_S:
            return []
        self._reached_told_s = self._now_s
        return [mavlink.MAVLink_mission_item_reached_message(reached)]

    def _plan_changed(self) -> list[Message]:
        changed, self.storage.accepted = self.storage.accepted, None
        fence = self.storage.plans[mavlink.MAV_MISSION_TYPE_FENCE]
        if changed == mavlink.MAV_MISSION_TYPE_MISSION:
            self._mission.restart(at=0)
        if (changed == mavlink.MAV_MISSION_TYPE_FENCE or changed is None) and not self._fence.load(fence, self.body):
            return self._say(mavlink.MAV_SEVERITY_CRITICAL, "Geofence invalid: does not contain home, not enforced")
        return []

    def _landed_state(self) -> int:
        if self.body.rotor.on_ground:
            return mavlink.MAV_LANDED_STATE_ON_GROUND
        if self.mode is Mode.TAKEOFF:
            return mavlink.MAV_LANDED_STATE_TAKEOFF
        landing = self.mode is Mode.LAND or (self.mode is Mode.RETURN and self._return_leg == 3)
        return mavlink.MAV_LANDED_STATE_LANDING if landing else mavlink.MAV_LANDED_STATE_IN_AIR

    def _message(self, message_id: int) -> Message | None:
        match message_id:
            case mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                return self._heartbeat()
            case mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                return _version()
            case mavlink.MAVLINK_MSG_ID_MISSION_CURRENT:
                total = len(self.storage.plans[mavlink.MAV_MISSION_TYPE_MISSION])
                return mavlink.MAVLink_mission_current_message(self._mission.current, total)
            case mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED:
                target = self._stream.target if self.mode is Mode.OFFBOARD else None
                if target is None:
                    return None
                x, y, z = (0.0 if value is None else value for value in target.position_ned_m)
                return mavlink.MAVLink_position_target_local_ned_message(
                    int(self._now_s * 1e3), mavlink.MAV_FRAME_LOCAL_NED, 0, x, y, z, *target.velocity_ned_mps,
                    *target.acceleration_ned_mps2, target.yaw_rad or 0.0, 0.0,
                )  # fmt: skip
            case _:
                return body_message(message_id, self.body, self._now_s, self.ready, self._landed_state())

    def _heartbeat(self) -> Message:
        if self.failsafe:
            status = mavlink.MAV_STATE_CRITICAL
        elif self.body.armed:
            status = mavlink.MAV_STATE_ACTIVE
        else:
            status = mavlink.MAV_STATE_STANDBY if self.ready else mavlink.MAV_STATE_UNINIT
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        if self.body.armed:
            base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, base, self.mode.custom_mode, status, 3
        )

    def _say(self, severity: int, text: str) -> list[Message]:
        self._text_id = self._text_id % 65535 + 1
        return status_texts(severity, text, self._text_id)

    @staticmethod
    def _ack(message: Message, result: int) -> Message:
        peer = (message.get_srcSystem(), message.get_srcComponent())
        return mavlink.MAVLink_command_ack_message(message.command, result, 255, 0, *peer)

    def _airframe(self, airframe: Airframe) -> Airframe:
        """The airframe within what the autopilot's parameters allow."""
        return dataclasses.replace(
            airframe,
            max_speed_mps=min(airframe.max_speed_mps, self.parameters["MPC_XY_VEL_MAX"]),
            max_climb_mps=min(airframe.max_climb_mps, self.parameters["MPC_Z_VEL_MAX_UP"]),
            max_descent_mps=min(airframe.max_descent_mps, self.parameters["MPC_Z_VEL_MAX_DN"]),
        )


def _version() -> Message:
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
        | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
        | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    )
    release = 1 << 24 | 15 << 16 | 2 << 8 | 255
    return mavlink.MAVLink_autopilot_version_message(capabilities, release, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 1)


def _ftp_refusal(message: Message) -> Message:
    """NAK (128) with the opcode asked for and FileNotFound, as a vehicle without those files answers."""
    payload = bytes(message.payload)
    sequence = (int.from_bytes(payload[:2], "little") + 1) & 0xFFFF
    reply = sequence.to_bytes(2, "little") + bytes([payload[2], 128, 1, payload[3], 0, 0, 0, 0, 0, 0, 10])
    peer = (message.get_srcSystem(), message.get_srcComponent())
    return mavlink.MAVLink_file_transfer_protocol_message(0, *peer, reply.ljust(251, b"\0"))
