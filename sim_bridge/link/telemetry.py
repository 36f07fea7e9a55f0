"""From MAVLink messages to one `VehicleState`: remembers the last of each, knows no sockets and no clock."""

from __future__ import annotations

import math
import os

os.environ.setdefault("MAVLINK20", "1")
from pymavlink.dialects.v20 import common as mavlink

from sim_bridge.dialects import Autopilot, flight_mode
from sim_bridge.frames import VehicleFrame, enu_from_ned, geodetic_from_local_ned, yaw_ned_from_enu
from sim_bridge.link.charge import Charge
from sim_bridge.link.status_texts import StatusTexts
from sim_bridge.state import (
    GRAVITY_MPS2,
    FlightMode,
    GeodeticPoint,
    LandedState,
    MissionProgress,
    StatusText,
    Vector,
    VehicleState,
    Waiting,
)

READY_BIT = mavlink.MAV_SYS_STATUS_PREARM_CHECK
_FAILSAFE_STATUS = (mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY)
# A clock that falls back by more than this was restarted; by less, a message came late.
_REBOOT_S = 5.0
_STALE_S = 0.5
# Positions that go on without heartbeats; what a lost link took of both does not count.
_NO_HEARTBEAT_S = 4.0
_LONGEST_STEP_S = 1.0
# Cosine of the tilt: beyond 80° nothing flies steadily.
_LEAST_UPRIGHT = 0.17
# Heartbeats come once a second.
_BEATS_WITHOUT_POSITION = 5
_CLOCKS = (
    mavlink.MAVLink_local_position_ned_message,
    mavlink.MAVLink_attitude_message,
    mavlink.MAVLink_global_position_int_message,
)
_SENSORS = {
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO: "gyroscope",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL: "accelerometer",
    mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG: "compass",
    mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE: "barometer",
    mavlink.MAV_SYS_STATUS_SENSOR_GPS: "GPS",
    mavlink.MAV_SYS_STATUS_AHRS: "attitude estimate",
    mavlink.MAV_SYS_STATUS_SENSOR_BATTERY: "battery",
}

Heard = VehicleState | Waiting | StatusText | MissionProgress


class Telemetry:
    """Takes messages in, gives states out.

    Args:
        frame: Between the mission's frame and the vehicle's.
    """

    def __init__(self, frame: VehicleFrame) -> None:
        self._frame = frame
        self.autopilot: Autopilot | None = None
        self.origin: GeodeticPoint | None = None
        self.home: GeodeticPoint | None = None
        self.time_s = 0.0
        self.reboots = 0
        self._heartbeat: mavlink.MAVLink_heartbeat_message | None = None
        self._status: mavlink.MAVLink_sys_status_message | None = None
        self._position: tuple[float, Vector, Vector] | None = None
        self._beats = 0
        self._unbeaten_s = 0.0
        self._yaw_enu_rad: float | None = None
        self._tilt_enu_mps2: tuple[float, float] | None = None
        self._home_m: Vector | None = None
        self._landed = LandedState.UNKNOWN
        self._charge = Charge()
        self._texts = StatusTexts()
        self._progress = MissionProgress(None, 0)

    def receive(self, message: mavlink.MAVLink_message) -> list[Heard]:
        """Take one message in.

        Returns:
            What became known by it: a state with each position (or with a heartbeat while positions fail to come),
            finished lines of text, progress in a mission.
        """
        restarted = self._tell_time(message)
        return [*restarted, *self._taken_in(message)]

    def _taken_in(self, message: mavlink.MAVLink_message) -> list[Heard]:
        match message:
            case mavlink.MAVLink_heartbeat_message():
                return [*self._texts.heartbeat(), *self._heartbeat_heard(message)]
            case mavlink.MAVLink_local_position_ned_message():
                return self._position_heard(message)
            case mavlink.MAVLink_attitude_message():
                if math.isfinite(message.yaw):
                    self._yaw_enu_rad = yaw_ned_from_enu(message.yaw)
                self._tilt_enu_mps2 = _tilt(message)
            case mavlink.MAVLink_sys_status_message():
                self._status = message
                self._charge.status(message, self.time_s)
            case mavlink.MAVLink_battery_status_message():
                self._charge.battery(message, self.time_s)
            case mavlink.MAVLink_extended_sys_state_message():
                self._landed = LandedState(message.landed_state) if message.landed_state <= 4 else LandedState.UNKNOWN
            case mavlink.MAVLink_gps_global_origin_message():
                self.origin = _geodetic(message.latitude, message.longitude, message.altitude)
            case mavlink.MAVLink_home_position_message():
                self.home = _geodetic(message.latitude, message.longitude, message.altitude)
                self._home_m = self._frame.geodetic_enu(self.home)
            case mavlink.MAVLink_statustext_message():
                return list(self._texts.chunk(message))
            case mavlink.MAVLink_mission_current_message():
                return self._progressed(self._progress.reached, int(message.seq))
            case mavlink.MAVLink_mission_item_reached_message():
                return self._progressed(int(message.seq), self._progress.current)
            case _:
                pass
        return []

    @property
    def altitude_amsl_m(self) -> float | None:
        """How high the vehicle is by its own estimate; None: it has not told."""
        if self.origin is None or self.autopilot is None or self._position is None:
            return None
        return geodetic_from_local_ned(self.autopilot, self._position[1], self.origin).altitude_amsl_m

    def waiting_for(self) -> tuple[str, ...]:
        """What is not known yet, or keeps the vehicle from arming, in words."""
        missing = []
        if self._heartbeat is None:
            missing.append("its heartbeat")
        if self._position is None or self._beats > _BEATS_WITHOUT_POSITION:
            missing.append("its local position estimate")
        if self.origin is None:
            missing.append("the origin of its local frame")
        if self._home_m is None:
            missing.append("its home position")
        if self._yaw_enu_rad is None:
            missing.append("its attitude")
        if self._landed is LandedState.UNKNOWN:
            missing.append("whether it stands or flies")
        status = self._status
        if status is None:
            missing.append("its system status")
        elif not (status.onboard_control_sensors_health & READY_BIT or self._stands_in_offboard()):
            # PX4 never says that it has such checks, only that they are passed (SYS_STATUS.hpp of 1.15).
            unhealthy = status.onboard_control_sensors_enabled & ~status.onboard_control_sensors_health
            reasons = [name for bit, name in _SENSORS.items() if unhealthy & bit]
            if self.autopilot is Autopilot.PX4 and self.mode is FlightMode.PILOT:
                reasons.append("in a mode that needs a transmitter")
            missing.append("its pre-arm checks" + (f" ({', '.join(reasons)})" if reasons else ""))
        return tuple(missing)

    def _stands_in_offboard(self) -> bool:
        """PX4's checks are those of its mode, and Offboard fails them without a stream: it is armed from Hold."""
        return self.autopilot is Autopilot.PX4 and self.mode is FlightMode.EXTERNAL

    @property
    def mode(self) -> FlightMode | None:
        """The mode of the last heartbeat; None: none was heard."""
        if self._heartbeat is None or self.autopilot is None:
            return None
        return flight_mode(self.autopilot, self._heartbeat.custom_mode)[0]

    @property
    def complete(self) -> bool:
        """Whether a state can be told."""
        return None not in (self._heartbeat, self._position, self.origin, self._yaw_enu_rad)

    def restart_mission_progress(self) -> None:
        """Forget which items were reached: another mission begins."""
        self._progress = MissionProgress(None, 0)

    def _progressed(self, reached: int | None, current: int) -> list[Heard]:
        """Progress, told once: both messages are repeated each second."""
        progress = MissionProgress(reached, current)
        if progress == self._progress:
            return []
        self._progress = progress
        return [progress]

    def _tell_time(self, message: mavlink.MAVLink_message) -> list[Heard]:
        if not isinstance(message, _CLOCKS):
            return []
        time_s = message.time_boot_ms * 1e-3
        restarted = time_s < self.time_s - _REBOOT_S
        if restarted:
            self.reboots += 1
            self.time_s = time_s
            self._position, self.origin = None, None
            self._charge.restart(time_s)
        self.time_s = max(self.time_s, time_s)
        return [StatusText(mavlink.MAV_SEVERITY_CRITICAL, "the autopilot was restarted")] if restarted else []

    def _heartbeat_heard(self, message: mavlink.MAVLink_heartbeat_message) -> list[Heard]:
        if message.autopilot not in (Autopilot.PX4.value, Autopilot.ARDUPILOT.value):
            return []
        self._heartbeat = message
        self.autopilot = Autopilot(message.autopilot)
        self._beats += 1
        self._unbeaten_s = 0.0
        if self._position is None or not self.complete or self._beats > _BEATS_WITHOUT_POSITION:
            return [Waiting(self.waiting_for())]
        stale = self.time_s - self._position[0] > _STALE_S
        return [self._state(*self._position)] if stale else []

    def _position_heard(self, message: mavlink.MAVLink_local_position_ned_message) -> list[Heard]:
        time_s = message.time_boot_ms * 1e-3
        numbers = (message.x, message.y, message.z, message.vx, message.vy, message.vz)
        if (self._position is not None and time_s <= self._position[0]) or not all(map(math.isfinite, numbers)):
            return []
        self._beats = 0
        since_s = 0.0 if self._position is None else min(time_s - self._position[0], _LONGEST_STEP_S)
        silent = self._unbeaten_s < _NO_HEARTBEAT_S <= self._unbeaten_s + since_s
        self._unbeaten_s += since_s
        self._position = (time_s, numbers[:3], numbers[3:])
        if not self.complete:
            return []
        unknown = f"no heartbeat for {_NO_HEARTBEAT_S:.0f} s: which mode it is in is not known"
        warning: list[Heard] = [StatusText(mavlink.MAV_SEVERITY_ERROR, unknown)] if silent else []
        return [*warning, self._state(*self._position)]

    def _state(self, time_s: float, position_ned_m: Vector, velocity_ned_mps: Vector) -> VehicleState:
        heartbeat, origin, autopilot, yaw = self._heartbeat, self.origin, self.autopilot, self._yaw_enu_rad
        assert heartbeat is not None, "a state is only told once it is complete"
        assert origin is not None, "likewise"
        assert autopilot is not None, "likewise"
        assert yaw is not None, "likewise"
        mode, name = flight_mode(autopilot, heartbeat.custom_mode)
        return VehicleState(
            time_s=self.time_s,
            position_enu_m=self._frame.position_enu(autopilot, origin, position_ned_m),
            velocity_enu_mps=enu_from_ned(velocity_ned_mps),
            yaw_enu_rad=yaw,
            armed=bool(heartbeat.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED),
            mode=mode,
            mode_name=name,
            landed=self._landed,
            battery_fraction=self._charge.fraction,
            waiting_for=self.waiting_for(),
            failsafe=heartbeat.system_status in _FAILSAFE_STATUS,
            home_enu_m=self._home_m,
            tilt_enu_mps2=self._tilt_enu_mps2,
            position_age_s=self.time_s - time_s,
            battery_age_s=self._charge.age_s(self.time_s),
        )


def _tilt(message: mavlink.MAVLink_attitude_message) -> tuple[float, float] | None:
    """What rotors that carry the weight push east and north; None where they cannot carry it."""
    roll, pitch, yaw = message.roll, message.pitch, message.yaw
    if not all(map(math.isfinite, (roll, pitch, yaw))):
        return None
    upright = math.cos(roll) * math.cos(pitch)
    if upright < _LEAST_UPRIGHT:
        return None
    forward, right = -math.cos(roll) * math.sin(pitch), math.sin(roll)
    north = forward * math.cos(yaw) - right * math.sin(yaw)
    east = forward * math.sin(yaw) + right * math.cos(yaw)
    return GRAVITY_MPS2 * east / upright, GRAVITY_MPS2 * north / upright


def _geodetic(latitude_e7: int, longitude_e7: int, altitude_mm: int) -> GeodeticPoint:
    return GeodeticPoint(latitude_e7 * 1e-7, longitude_e7 * 1e-7, altitude_mm * 1e-3)
