"""The built-in vehicle as PX4 1.15 behaves: what it hears, what it is told to do, what it tells."""

from __future__ import annotations

import math

from sim_bridge.autopilot import switched_to
from sim_bridge.body import Body, VehicleConfig
from sim_bridge.boot_clock import BootClock
from sim_bridge.codec import Message, mavlink
from sim_bridge.kinematics import SpeedLimits
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.parameters import Encoding, Parameters
from sim_bridge.plan_storage import PlanStorage
from sim_bridge.px4_commander import Commander
from sim_bridge.px4_defaults import CAPABILITIES, DEAD_RECKONING_S, PARAMETERS, RATES_HZ, READY_AFTER_S, RELEASE
from sim_bridge.px4_modes import Mode, mode_from_numbers
from sim_bridge.px4_navigator import Navigator
from sim_bridge.px4_offboard import SETPOINTS, Refused, Stream
from sim_bridge.px4_plans import PX4_MANNERS
from sim_bridge.services import Order, Reply, Services, version
from sim_bridge.state import FlightMode, GeodeticPoint
from sim_bridge.telemetry import Standing, Streams, body_message

_FORCE = 21196
_REACHED_REPEATS = 10
_AUTOTUNE_S = 20.0
_REBOOT_S = 3.0
_ACCEPTED, _DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
_REJECTED, _UNSUPPORTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED, mavlink.MAV_RESULT_UNSUPPORTED
_BROADCAST = (mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES)
_PILOT_MODES = {
    FlightMode.PILOT: Mode.POSCTL,
    FlightMode.HOLD: Mode.HOLD,
    FlightMode.RETURN: Mode.RETURN,
    FlightMode.LAND: Mode.LAND,
    FlightMode.MISSION: Mode.MISSION,
}


class Px4:
    """A PX4 quadrotor.

    Args:
        config: How it is set up.

    Raises:
        ValueError: A parameter that it does not have.
    """

    def __init__(self, config: VehicleConfig) -> None:
        self.body = Body(config, Autopilot.PX4, DEAD_RECKONING_S)
        self._parameters = Parameters(PARAMETERS, Encoding.BYTEWISE)
        self._parameters.change({"MAV_SYS_ID": config.system, **dict(config.parameters)})
        self._storage = PlanStorage(PX4_MANNERS)
        self.services = Services(self._parameters, self._storage, Streams(RATES_HZ), RATES_HZ)
        self._clock = BootClock()
        self.refusal = ""
        self._start(0.0)

    def _start(self, boot_s: float) -> None:
        """What every boot begins with."""
        wanted_s = self.body.config.ready_after_s
        self._clock.boot(boot_s)
        self._stream = Stream()
        self._navigator = Navigator(self.body, self._parameters)
        self._commander = Commander(
            self.body,
            self.services,
            self._stream,
            self._navigator,
            READY_AFTER_S if wanted_s is None else wanted_s,
        )
        self._reached: tuple[int, int] | None = None
        self._reached_told_s = self._complained_s = -math.inf
        self._autotune_s: float | None = None
        self._apply_parameters()

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it."""
        if not self._at(now_s):
            return []
        own, target = self.body.config.system, getattr(message, "target_system", None)
        order = Order.from_message(message)
        if order is not None:
            return self._ordered(order)
        match message:
            case mavlink.MAVLink_heartbeat_message():
                if message.type == mavlink.MAV_TYPE_GCS:
                    self._commander.ground_station_s = self._clock.now_s
                return []
            case _ if isinstance(message, SETPOINTS):
                return self._setpoint(message) if target in (0, own) else []
            case mavlink.MAVLink_set_mode_message():
                mode = mode_from_numbers(message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF)
                return self._commander.change_mode(mode)[1] if target == own and mode is not None else []
            case mavlink.MAVLink_mission_set_current_message():
                return self._set_current(message.seq) if target == own else []
            case _:
                replies = self.services.receive(message, self._clock.now_s, own)
                if self._parameters.changes != self._applied:
                    self._apply_parameters()
                return replies + self._plans_changed()

    def tick(self, now_s: float) -> list[Message]:
        """Move until now, and tell what is due."""
        if not self._at(now_s):
            self.body.advance(now_s, None)
            return []
        told = self._commander.watch() if self.body.armed else []
        target = None
        if self.body.armed:
            target = self._navigator.target(self._commander.flown, self._storage.mission, self._stream.target)
        self.body.advance(now_s, target)
        told += self._commander.settle() + self._storage.tick(self._clock.now_s) + self._reached_item()
        for message_id in self.services.streams.due(self._clock.now_s):
            message = self._message(message_id)
            if message is not None:
                told.append(message)
        return told

    def follows_setpoints(self) -> bool:
        """Whether the vehicle is flown by setpoints."""
        return self.body.armed and self._commander.flown is Mode.OFFBOARD

    def reboot(self, now_s: float, outage_s: float, *, recovers_in_air: bool) -> None:
        """Start anew: parameters and plans stay, everything else is forgotten."""
        flying = self.body.armed and not self.body.on_ground
        self.body.armed = False
        self._storage.forget_transfer()
        self.services.streams = Streams(RATES_HZ)
        self._start(now_s + outage_s)
        if flying and recovers_in_air:
            self._commander.recover_in_air()

    def pilot_switches(self, mode: FlightMode) -> list[Message]:
        """A pilot takes the transmitter, sticks centred, and chooses a mode."""
        self._navigator.sticks = True
        return self._commander.change_mode(switched_to(_PILOT_MODES, mode, "PX4"))[1]

    def _at(self, now_s: float) -> bool:
        """Set the clock; whether the autopilot runs."""
        runs = self._clock.set(now_s)
        self._commander.now_s = self._clock.now_s
        self._commander.refusal = self.refusal
        return runs

    # Orders.

    def _ordered(self, order: Order) -> list[Message]:
        system, component = order.target
        anyone = order.command in _BROADCAST and system == 0
        if not anyone and (system != self.body.config.system or component not in (0, mavlink.MAV_COMP_ID_AUTOPILOT1)):
            return [order.ack(mavlink.MAV_RESULT_FAILED)]
        if order.command == mavlink.MAV_CMD_DO_AUTOTUNE_ENABLE:
            return [self._autotune(order)]
        result, more = self.services.carry_out(order, self._clock.now_s, self._message) or self._carry_out(order)
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
                if self.body.armed:
                    return _DENIED, []
                self.reboot(self._clock.world_s, _REBOOT_S, recovers_in_air=False)
                return _ACCEPTED, []
            case _:
                return _UNSUPPORTED, []

    def _take_off(self, order: Order) -> Reply:
        """Altitudes of take-offs are above sea level."""
        result, texts = self._commander.change_mode(Mode.TAKEOFF)
        amsl_m = order.given(7)
        if result == _ACCEPTED and amsl_m is not None:
            self._navigator.takeoff_down_m = self.body.origin.altitude_amsl_m - amsl_m
        return result, texts

    def _start_mission(self, order: Order) -> Reply:
        if not self._storage.mission:
            return _DENIED, self._commander.critical("Mission start denied! No valid mission")
        if not -1 <= order.whole(1) < len(self._storage.mission):
            return _DENIED, []
        result, texts = self._commander.change_mode(Mode.MISSION)
        if result == _ACCEPTED and not self.body.armed:
            result, more = self._commander.arm()
            texts += more
        return result, texts

    def _reposition(self, order: Order) -> Reply:
        if order.whole(2) != 1:
            return _UNSUPPORTED, []
        result, texts = self._commander.change_mode(Mode.HOLD)
        if result == _ACCEPTED:
            self._commander.fly(Mode.HOLD)
            here = self.body.geodetic()
            latitude, longitude, amsl_m = (order.given(number) for number in (5, 6, 7))
            if latitude is None or longitude is None:
                latitude, longitude = here.latitude_deg, here.longitude_deg
            place = GeodeticPoint(latitude, longitude, here.altitude_amsl_m if amsl_m is None else amsl_m)
            self._navigator.hold_at(place, order.given(4))
        return result, texts

    def _set_home(self, order: Order) -> Reply:
        home = order.home(self.body)
        if home is None:
            return _DENIED, []
        self.body.home_ned_m = home
        return _ACCEPTED, []

    def _autotune(self, order: Order) -> Message:
        """A command that takes its time: IN_PROGRESS with a share, asked again and again until it is done."""
        if self._autotune_s is None:
            self._autotune_s = self._clock.now_s
        share = (self._clock.now_s - self._autotune_s) / _AUTOTUNE_S
        if share < 1.0:
            return order.ack(mavlink.MAV_RESULT_IN_PROGRESS, int(100.0 * share))
        self._autotune_s = None
        return order.ack(_ACCEPTED, 100)

    def _setpoint(self, message: Message) -> list[Message]:
        refused = self._stream.receive(message, self.body, self._clock.now_s)
        if isinstance(refused, Refused) and self._clock.now_s - self._complained_s >= 1.0:
            self._complained_s = self._clock.now_s
            return self._commander.critical(refused.reason)
        return []

    def _set_current(self, seq: int) -> list[Message]:
        if seq >= len(self._storage.mission):
            return self._commander.critical("WPM: WP CURR CMD: Not in list")
        self._navigator.mission.restart(at=seq)
        self._reached = None
        return []

    # Telling.

    def _reached_item(self) -> list[Message]:
        """MISSION_ITEM_REACHED, at once and then each second ten times more."""
        reached = self._navigator.mission.reached
        if reached is None:
            return []
        if self._reached is None or self._reached[0] != reached:
            self._reached = (reached, 0)
        elif self._reached[1] >= _REACHED_REPEATS or self._clock.now_s - self._reached_told_s < 1.0:
            return []
        else:
            self._reached = (reached, self._reached[1] + 1)
        self._reached_told_s = self._clock.now_s
        return [mavlink.MAVLink_mission_item_reached_message(reached)]

    def _plans_changed(self) -> list[Message]:
        told = []
        for kind in self._storage.changed():
            if kind == mavlink.MAV_MISSION_TYPE_MISSION:
                # Also in flight: the new one begins at once.
                self._navigator.mission.restart()
                self._reached = None
            elif kind == mavlink.MAV_MISSION_TYPE_FENCE:
                told += self._commander.load_fence()
        return told

    def _landed_state(self) -> int:
        flown = self._commander.flown
        if self.body.on_ground:
            return mavlink.MAV_LANDED_STATE_ON_GROUND
        if flown is Mode.TAKEOFF:
            return mavlink.MAV_LANDED_STATE_TAKEOFF
        down = flown in (Mode.LAND, Mode.DESCEND)
        down = down or (flown in (Mode.RETURN, Mode.MISSION) and self._navigator.landing)
        return mavlink.MAV_LANDED_STATE_LANDING if down else mavlink.MAV_LANDED_STATE_IN_AIR

    def _message(self, message_id: int) -> Message | None:
        match message_id:
            case mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                return self._heartbeat()
            case mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                return version(CAPABILITIES, RELEASE, self.body.config.system)
            case mavlink.MAVLINK_MSG_ID_MISSION_CURRENT:
                total = len(self._storage.mission)
                return mavlink.MAVLink_mission_current_message(self._navigator.mission.current, total)
            case _:
                target = self._stream.target if self.follows_setpoints() else None
                ready = self._commander.fault() is None
                return body_message(
                    message_id, self.body, Standing(self._clock.now_s, ready, self._landed_state(), target)
                )

    def _heartbeat(self) -> Message:
        flown = self._commander.flown
        if self.body.armed:
            status = mavlink.MAV_STATE_CRITICAL if self._commander.in_failsafe else mavlink.MAV_STATE_ACTIVE
        else:
            status = mavlink.MAV_STATE_STANDBY if self._commander.fault() is None else mavlink.MAV_STATE_UNINIT
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
        if flown.follows_sticks:
            base |= mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        else:
            base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED | mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
        if self.body.armed:
            base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_PX4, base, flown.custom_mode, status, 3
        )

    def _apply_parameters(self) -> None:
        """The limits as the parameters say now."""
        self._applied = self._parameters.changes
        self.body.rotor.limits = SpeedLimits(
            horizontal_mps=max(0.1, self._parameters["MPC_XY_VEL_MAX"]),
            climb_mps=max(0.1, self._parameters["MPC_Z_VEL_MAX_UP"]),
            descent_mps=max(0.1, self._parameters["MPC_Z_VEL_MAX_DN"]),
        )
