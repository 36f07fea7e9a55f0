"""The built-in vehicle as ArduPilot Copter 4.5 behaves: what it hears, what it is told to do, what it tells."""

from __future__ import annotations

import dataclasses

from sim_bridge.ardupilot.commander import Commander
from sim_bridge.ardupilot.defaults import (
    CAPABILITIES,
    DEAD_RECKONING_S,
    HEARTBEAT_HZ,
    PARAMETERS,
    READY_AFTER_S,
    RELEASE,
    STREAMS,
    TELEMETRY,
)
from sim_bridge.ardupilot.guided import AutopilotCrash, Submode
from sim_bridge.ardupilot.modes import Mode
from sim_bridge.ardupilot.orders import Orders
from sim_bridge.ardupilot.plan_transfer import PlanTransfer
from sim_bridge.codec import Message, mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.state import FlightMode
from sim_bridge.vehicle.autopilot import switched_to
from sim_bridge.vehicle.body import Body, VehicleConfig
from sim_bridge.vehicle.boot_clock import BootClock
from sim_bridge.vehicle.kinematics import SpeedLimits
from sim_bridge.vehicle.parameters import Encoding, Parameters
from sim_bridge.vehicle.plan_items import Item
from sim_bridge.vehicle.services import Order, Reply, Services, version
from sim_bridge.vehicle.telemetry import Standing, Streams, body_message

_ACCEPTED, _FAILED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_FAILED
_CENTI = 0.01
_REBOOT_S = 3.0
_POSITION_GAIN, _VELOCITY_GAIN, _INTEGRAL_GAIN = 1.0, 2.0, 1.0
_RATES_HZ = {**dict.fromkeys(TELEMETRY, 0.0), **HEARTBEAT_HZ}
_KNOWN = (*_RATES_HZ, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
_SETPOINTS = (
    mavlink.MAVLink_set_position_target_local_ned_message,
    mavlink.MAVLink_set_position_target_global_int_message,
)
_PILOT_MODES = {
    FlightMode.PILOT: Mode.LOITER,
    FlightMode.HOLD: Mode.BRAKE,
    FlightMode.RETURN: Mode.RTL,
    FlightMode.LAND: Mode.LAND,
    FlightMode.MISSION: Mode.AUTO,
}


class ArduCopter:
    """An ArduPilot quadrotor.

    Args:
        config: How it is set up.

    Raises:
        ValueError: A parameter that it does not have.
    """

    def __init__(self, config: VehicleConfig) -> None:
        airframe = dataclasses.replace(
            config.airframe,
            position_gain=_POSITION_GAIN,
            velocity_gain=_VELOCITY_GAIN,
            integral_gain=_INTEGRAL_GAIN,
        )
        self.body = Body(dataclasses.replace(config, airframe=airframe), Autopilot.ARDUPILOT, DEAD_RECKONING_S)
        self._parameters = Parameters(PARAMETERS, Encoding.CAST)
        self._parameters.change({"SYSID_THISMAV": config.system, **dict(config.parameters)})
        self._storage = PlanTransfer()
        self.services = Services(self._parameters, self._storage, Streams(HEARTBEAT_HZ), _RATES_HZ)
        self._clock = BootClock()
        self.refusal = ""
        self._crashed = False
        self._start(0.0)

    def _start(self, boot_s: float) -> None:
        """What every boot begins with."""
        wanted_s = self.body.config.ready_after_s
        self._clock.boot(boot_s)
        self._commander = Commander(self.body, self.services, READY_AFTER_S if wanted_s is None else wanted_s)
        self._navigator = self._commander.navigator
        self._orders = Orders(self.body, self._parameters, self._commander, self._set_current, self._reboot_on_ground)
        self._reached: int | None = None
        self._apply_parameters()

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it; a setpoint that is not a number is the last one ever taken."""
        if not self._at(now_s):
            return []
        if getattr(message, "target_system", 0) not in (0, self.body.config.system):
            # What is for another vehicle is passed on, not answered.
            return []
        order = Order.from_message(message)
        match message:
            case _ if order is not None:
                return self._ordered(order)
            case mavlink.MAVLink_heartbeat_message():
                if message.get_srcSystem() == int(self._parameters["SYSID_MYGCS"]):
                    self._commander.ground_station_s = self._clock.now_s
                return []
            case _ if isinstance(message, _SETPOINTS):
                return self._setpoint(message)
            case mavlink.MAVLink_set_mode_message():
                return self._set_mode_message(message)
            case mavlink.MAVLink_mission_set_current_message():
                return self._set_current(message.seq)[1]
            case mavlink.MAVLink_request_data_stream_message():
                self._set_streams(message)
                return []
            case _:
                if isinstance(message, mavlink.MAVLink_mission_request_list_message) and self._storage.mission:
                    self._storage.mission[0] = self._home_item()
                replies = self.services.receive(message, self._clock.now_s)
                if self._parameters.changes != self._applied:
                    self._apply_parameters()
                for kind in self._storage.changed():
                    replies += self._commander.plan_changed(kind)
                return replies

    def tick(self, now_s: float) -> list[Message]:
        """Move until now, and tell what is due."""
        if not self._at(now_s):
            self.body.advance(now_s, None)
            return []
        told = self._commander.watch()
        target = None
        if self.body.armed:
            target = self._navigator.target(self._commander.mode, self._storage.mission)
        self.body.advance(now_s, target)
        told += self._storage.tick(self._clock.now_s) + self._reached_item()
        for message_id in self.services.streams.due(self._clock.now_s):
            message = self._message(message_id)
            if message is not None:
                told.append(message)
        return told

    def follows_setpoints(self) -> bool:
        """Whether the vehicle is flown by setpoints."""
        guided = self._commander.mode is Mode.GUIDED and self._navigator.guided.submode is not Submode.TAKE_OFF
        return self.body.armed and guided and not self.body.on_ground

    def reboot(self, now_s: float, outage_s: float, *, recovers_in_air: bool) -> None:
        """Start anew: parameters and plans stay, everything else is forgotten."""
        flying = self.body.armed and not self.body.on_ground
        self.body.armed = self._crashed = False
        self.body.start_anew()
        self._storage.forget_transfer()
        self.services.streams = Streams(HEARTBEAT_HZ)
        self._start(now_s + outage_s)
        if flying and recovers_in_air:
            self._commander.recover_in_air()

    def _reboot_on_ground(self) -> None:
        self.reboot(self._clock.world_s, _REBOOT_S, recovers_in_air=False)

    def pilot_switches(self, mode: FlightMode) -> list[Message]:
        """A pilot takes the transmitter, sticks centred, and chooses a mode."""
        self._navigator.sticks = self._navigator.may_start = True
        return self._commander.change_mode(switched_to(_PILOT_MODES, mode, "ArduPilot"))[1]

    def _at(self, now_s: float) -> bool:
        """Set the clock; whether the autopilot runs."""
        runs = self._clock.set(now_s)
        self._commander.now_s = self._clock.now_s
        self._commander.refusal = self.refusal
        return runs and not self._crashed

    def _ordered(self, order: Order) -> list[Message]:
        wanted = order.whole(1)
        match order.command:
            case mavlink.MAV_CMD_REQUEST_MESSAGE if wanted in _KNOWN:
                asked = self._message(wanted)
                result, more = _ACCEPTED, [] if asked is None else [asked]
            case mavlink.MAV_CMD_REQUEST_MESSAGE:
                result, more = _FAILED, []
            case mavlink.MAV_CMD_SET_MESSAGE_INTERVAL if wanted not in _KNOWN:
                more = self._commander.inform(f"No ap_message for mavlink id ({wanted})")
                result = mavlink.MAV_RESULT_DENIED
            case _:
                served = self.services.carry_out(order, self._clock.now_s, self._message)
                result, more = self._orders.carry_out(order) if served is None else served
        return [order.ack(result), *more]

    def _set_current(self, seq: int) -> Reply:
        if not 0 <= seq < len(self._storage.mission):
            return _FAILED, []
        self._navigator.mission.restart(at=max(1, seq))
        self._reached = None
        return _ACCEPTED, [self._mission_current()]

    def _set_mode_message(self, message: Message) -> list[Message]:
        """SET_MODE, which ArduPilot acknowledges as if it were a command."""
        custom = message.base_mode & mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
        result, texts = self._commander.change_mode(message.custom_mode) if custom else (_FAILED, [])
        peer = (message.get_srcSystem(), message.get_srcComponent())
        return [mavlink.MAVLink_command_ack_message(mavlink.MAVLINK_MSG_ID_SET_MODE, result, 0, 0, *peer), *texts]

    def _set_streams(self, message: Message) -> None:
        interval_us = 1e6 / message.req_message_rate if message.start_stop and message.req_message_rate else -1.0
        groups = STREAMS.values() if message.req_stream_id == 0 else [STREAMS.get(message.req_stream_id, ())]
        for message_id in (each for group in groups for each in group):
            self.services.streams.set_interval(message_id, interval_us, 0.0, self._clock.now_s)

    def _setpoint(self, message: Message) -> list[Message]:
        if self._commander.mode is not Mode.GUIDED:
            return []
        try:
            self._navigator.guided.receive(message)
        except AutopilotCrash:
            # Nothing is flown and nothing is said any more.
            self._crashed = True
            self.body.armed = False
        return []

    # Telling.

    def _reached_item(self) -> list[Message]:
        reached = self._navigator.mission.reached
        if reached is None or reached == self._reached:
            return []
        self._reached = reached
        number = self._storage.mission[reached].command if reached < len(self._storage.mission) else 0
        told = self._commander.inform(f"Reached command #{reached}") if number else []
        return [mavlink.MAVLink_mission_item_reached_message(reached), *told]

    def _home_item(self) -> Item:
        """Item 0 of a mission comes back as home, whatever was sent."""
        home = self.body.geodetic(self.body.home_ned_m)
        return Item(
            mavlink.MAV_CMD_NAV_WAYPOINT,
            mavlink.MAV_FRAME_GLOBAL,
            (0.0, 0.0, 0.0, 0.0),
            round(1e7 * home.latitude_deg),
            round(1e7 * home.longitude_deg),
            home.altitude_amsl_m,
        )

    def _mission_current(self) -> Message:
        total = max(0, len(self._storage.mission) - 1)
        return mavlink.MAVLink_mission_current_message(self._navigator.mission.current, total)

    def _landed_state(self) -> int:
        mode = self._commander.mode
        if self.body.on_ground:
            return mavlink.MAV_LANDED_STATE_ON_GROUND
        if mode is Mode.GUIDED and self._navigator.guided.submode is Submode.TAKE_OFF:
            return mavlink.MAV_LANDED_STATE_TAKEOFF
        down = mode is Mode.LAND or (mode in (Mode.RTL, Mode.AUTO) and self._navigator.landing)
        return mavlink.MAV_LANDED_STATE_LANDING if down else mavlink.MAV_LANDED_STATE_IN_AIR

    def _message(self, message_id: int) -> Message | None:
        match message_id:
            case mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                return self._heartbeat()
            case mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION:
                return version(CAPABILITIES, RELEASE, self.body.config.system)
            case mavlink.MAVLINK_MSG_ID_MISSION_CURRENT:
                return self._mission_current()
            case _ if message_id in TELEMETRY:
                asked = self._navigator.guided.asked if self._commander.mode is Mode.GUIDED else None
                ready = self._commander.fault() is None
                return body_message(
                    message_id, self.body, Standing(self._clock.now_s, ready, True, self._landed_state(), asked)
                )
            case _:
                return None

    def _heartbeat(self) -> Message:
        mode = self._commander.mode
        if self._commander.in_failsafe:
            status = mavlink.MAV_STATE_CRITICAL
        elif self.body.on_ground:
            status = mavlink.MAV_STATE_STANDBY
        else:
            status = mavlink.MAV_STATE_ACTIVE
        base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
        base |= mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
        if not mode.follows_sticks:
            base |= mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
        if self.body.armed:
            base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
        return mavlink.MAVLink_heartbeat_message(
            mavlink.MAV_TYPE_QUADROTOR, mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, base, int(mode), status, 3
        )

    def _apply_parameters(self) -> None:
        """The limits as the parameters say now."""
        self._applied = self._parameters.changes
        self.body.rotor.limits = SpeedLimits(
            horizontal_mps=max(0.1, _CENTI * self._parameters["WPNAV_SPEED"]),
            climb_mps=max(0.1, _CENTI * self._parameters["WPNAV_SPEED_UP"]),
            descent_mps=max(0.1, _CENTI * self._parameters["WPNAV_SPEED_DN"]),
        )
