"""What really happened: stands at the vehicle, sees where it truly is, and hears all that it hears and says.

A flight only knows what comes through its line, and its vehicle only what its estimate tells; neither can vouch for
itself.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from sim_bridge.codec import Codec, frames_in, mavlink
from sim_bridge.dialects import flight_mode
from sim_bridge.frames import VehicleFrame
from sim_bridge.state import FlightMode, GeodeticPoint
from sim_bridge.station import Station
from sim_bridge.vehicle.autopilot import VehicleAutopilot

STALE_S = 0.75
"""A setpoint that moves is old when it is heard again so long after the first time, bad lines included."""
LATE_S = 0.75
"""Setpoints under way when the stream ends arrive within this."""
SAFE_MODES = (FlightMode.HOLD, FlightMode.RETURN, FlightMode.LAND)
_SETTLED_S = 30.0
_HOVERS_MPS = 1.0
_STEP_S = 0.01
_KEPT = 200
_CLOCK_BYTES, _VELOCITY_BEGINS = 4, 12
_VELOCITY = struct.Struct("<3f")


class Witness:
    """Watches one vehicle.

    Args:
        vehicle: It.
        origin: The mission's origin.
    """

    def __init__(self, vehicle: VehicleAutopilot, origin: GeodeticPoint) -> None:
        self._vehicle = vehicle
        self._frame = VehicleFrame(origin)
        self._codec = Codec(vehicle.body.config.system)
        self._first_heard_s: dict[bytes, float] = {}
        self.armed = False
        self.mode = FlightMode.OTHER
        self.setpoint_s = -math.inf
        """When the vehicle last heard a setpoint."""
        self.setpoints_heard = 0
        self.broken: dict[str, str] = {}

    def record(self, now_s: float, datagram: bytes) -> None:
        """Take what passes at the vehicle, both ways."""
        for message_id, payload in frames_in(datagram):
            match message_id:
                case mavlink.MAVLINK_MSG_ID_HEARTBEAT:
                    self._heartbeat(datagram)
                case mavlink.MAVLINK_MSG_ID_SET_POSITION_TARGET_LOCAL_NED:
                    self._setpoint(payload, datagram, now_s)
                case _:
                    pass

    def place_enu_m(self) -> Float[np.ndarray, "3"]:
        """Where the vehicle truly is, mission frame."""
        body = self._vehicle.body
        return np.array(self._frame.position_enu(body.autopilot, body.origin, body.rotor.position_ned_m))

    @property
    def flies(self) -> bool:
        """Whether it is truly in the air."""
        return not self._vehicle.body.on_ground

    @property
    def speed_mps(self) -> float:
        """How fast it truly is."""
        return math.hypot(*self._vehicle.body.rotor.velocity_ned_mps)

    @property
    def estimate_error_m(self) -> float:
        """How far it is from where it believes to be."""
        return math.dist(self._vehicle.body.estimator.offset_ned_m, (0.0, 0.0, 0.0))

    def left_alone(self, station: Station, now_s: float, longest_s: float) -> str:
        """Watch on after the flight has ended.

        Returns:
            Empty: it stands on the ground, disarmed, or settled in a safe mode of its own, or hovers where its
            setpoints ended, as Copter's GUIDED does after GUID_TIMEOUT; else what it does.
        """
        settled_s, until_s = now_s, now_s + longest_s
        mode = self.mode
        while now_s < until_s:
            if not self.armed and not self.flies:
                return ""
            if self.mode is not mode:
                mode, settled_s = self.mode, now_s
            hovers = self.mode is FlightMode.EXTERNAL and self.speed_mps < _HOVERS_MPS
            if not (hovers or self.mode in SAFE_MODES):
                settled_s = now_s
            if now_s - settled_s > _SETTLED_S:
                return ""
            now_s += _STEP_S
            station.advance(now_s)
        return f"left {'armed' if self.armed else 'disarmed in the air'} in {self.mode.value}"

    def _heartbeat(self, datagram: bytes) -> None:
        for message in self._codec.decode(datagram):
            if isinstance(message, mavlink.MAVLink_heartbeat_message) and (
                message.get_srcSystem() == self._vehicle.body.config.system
            ):
                self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
                self.mode = flight_mode(self._vehicle.body.autopilot, message.custom_mode)[0]

    def _setpoint(self, payload: bytes, datagram: bytes, now_s: float) -> None:
        self.setpoint_s = now_s
        self.setpoints_heard += 1
        content = payload[_CLOCK_BYTES:]
        first_s = self._first_heard_s.setdefault(content, now_s)
        if any(_VELOCITY.unpack_from(content, _VELOCITY_BEGINS)) and now_s - first_s > STALE_S:
            self.broken.setdefault("stale", f"a setpoint {now_s - first_s:.2f} s old at {now_s:.1f} s")
        if len(self._first_heard_s) > _KEPT:
            del self._first_heard_s[next(iter(self._first_heard_s))]
        for message in self._codec.decode(datagram):
            numbers: Sequence[float] = (
                message.x, message.y, message.z, message.vx, message.vy, message.vz,
                message.afx, message.afy, message.afz, message.yaw, message.yaw_rate,
            )  # fmt: skip
            if not all(map(math.isfinite, numbers)):
                self.broken.setdefault("non-finite", f"a setpoint of {numbers} at {now_s:.1f} s")
