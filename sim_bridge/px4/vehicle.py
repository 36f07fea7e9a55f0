"""The built-in vehicle as PX4 1.15 behaves: what it hears, what it is told to do, what it tells."""

from __future__ import annotations

import math

from sim_bridge.codec import Message, mavlink
from sim_bridge.dialects import Autopilot
from sim_bridge.px4.addressing import addressed_to_us
from sim_bridge.px4.commander import Commander
from sim_bridge.px4.defaults import CAPABILITIES, DEAD_RECKONING_S, PARAMETERS, RATES_HZ, READY_AFTER_S, RELEASE
from sim_bridge.px4.modes import Mode, mode_from_numbers
from sim_bridge.px4.navigator import Navigator
from sim_bridge.px4.offboard import SETPOINTS, Refused, Stream
from sim_bridge.px4.orders import Orders
from sim_bridge.px4.plan_transfer import PlanTransfer
from sim_bridge.state import FlightMode
from sim_bridge.vehicle.autopilot import switched_to
from sim_bridge.vehicle.body import Body, VehicleConfig
from sim_bridge.vehicle.boot_clock import BootClock
from sim_bridge.vehicle.kinematics import SpeedLimits
from sim_bridge.vehicle.parameters import Encoding, Parameters
from sim_bridge.vehicle.services import Order, Services, version
from sim_bridge.vehicle.telemetry import Standing, Streams, body_message

_REACHED_REPEATS = 10
_REBOOT_S = 3.0
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
        self._storage = PlanTransfer()
        self.services = Services(self._parameters, self._storage, Streams(RATES_HZ), RATES_HZ)
        self._clock = BootClock()
        self.refusal = ""
        self._start(0.0)

    def _start(self, boot_s: float) -> None:
        """What every boot begins with."""
        wanted_s = self.body.config.ready_after_s
        self._clock.boot(boot_s)
        self._stream = Stream()
        self._navigator = Navigator(self.body, self._parameters, self._storage)
        self._commander = Commander(
            self.body,
            self.services,
            self._stream,
            self._navigator,
            READY_AFTER_S if wanted_s is None else wanted_s,
        )
        self._reached: tuple[int, int] | None = None
        self._reached_told_s = self._complained_s = -math.inf
        self._orders = Orders(self.body, self._commander, self._navigator, self._storage, self._reboot_on_ground)
        self._apply_parameters()

    def receive(self, message: Message, now_s: float) -> list[Message]:
        """Take one message in and answer it."""
        if not self._at(now_s):
            return []
        ours = addressed_to_us(message, self.body.config.system)
        order = Order.from_message(message)
        if order is not None:
            return self._ordered(order) if ours else [order.ack(mavlink.MAV_RESULT_FAILED)]
        if not ours:
            return []
        match message:
            case mavlink.MAVLink_heartbeat_message():
                if message.type == mavlink.MAV_TYPE_GCS:
                    self._commander.ground_station_s = self._clock.now_s
                return []
            case _ if isinstance(message, SETPOINTS):
                return self._setpoint(message)
            case mavlink.MAVLink_set_mode_message():
                mode = mode_from_numbers(message.custom_mode >> 16 & 0xFF, message.custom_mode >> 24 & 0xFF)
                return self._commander.change_mode(mode)[1] if mode is not None else []
            case mavlink.MAVLink_mission_set_current_message():
                return self._set_current(message.seq)
            case _:
                replies = self.services.receive(message, self._clock.now_s)
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
        self.body.start_anew()
        self._storage.forget_transfer()
        self.services.streams = Streams(RATES_HZ)
        self._start(now_s + outage_s)
        if flying and recovers_in_air:
            self._commander.recover_in_air()

    def _reboot_on_ground(self) -> None:
        self.reboot(self._clock.world_s, _REBOOT_S, recovers_in_air=False)

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

    def _ordered(self, order: Order) -> list[Message]:
        served = self.services.carry_out(order, self._clock.now_s, self._message)
        return self._orders.answer(order, self._clock.now_s) if served is None else [order.ack(served[0]), *served[1]]

    def _setpoint(self, message: Message) -> list[Message]:
        refused = self._stream.receive(message, self.body, self._clock.now_s)
        if isinstance(refused, Refused) and self._clock.now_s - self._complained_s >= 1.0:
            self._complained_s = self._clock.now_s
            return self._commander.critical(refused.reason)
        return []

    def _set_current(self, seq: int) -> list[Message]:
        if self._storage.busy:
            return self._commander.critical("WPM: IGN WP CURR CMD: Busy")
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
                    message_id, self.body, Standing(self._clock.now_s, ready, False, self._landed_state(), target)
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
