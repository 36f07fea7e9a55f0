"""The setpoint stream: which setpoints count, what they ask for, and whether the stream is alive."""

from __future__ import annotations

import math

from sim_bridge.body import Body
from sim_bridge.codec import Message, mavlink
from sim_bridge.kinematics import Target
from sim_bridge.state import GeodeticPoint, Vector

_X, _VX, _AX = 0, 3, 6
_YAW_IGNORED, _YAW_RATE_IGNORED = 1 << 10, 1 << 11
_ALL_AXES_IGNORED = 0x1FF
_GLOBAL_AMSL = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
_GLOBAL_RELATIVE = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
SETPOINTS = (
    mavlink.MAVLink_set_position_target_local_ned_message,
    mavlink.MAVLink_set_position_target_global_int_message,
)


def target_of(message: Message, body: Body) -> Target | None:
    """What a setpoint asks for, as PX4 understands it; None: it does not count.

    Only LOCAL_NED and the global frames count, and a mask that ignores everything does not. NaN is not refused: what is
    not a number means "stop here".
    """
    mask = int(message.type_mask)
    if mask & _ALL_AXES_IGNORED == _ALL_AXES_IGNORED:
        return None
    position: Vector
    match message:
        case mavlink.MAVLink_set_position_target_local_ned_message():
            if message.coordinate_frame != mavlink.MAV_FRAME_LOCAL_NED:
                return None
            position = (message.x, message.y, message.z)
        case _ if message.coordinate_frame in _GLOBAL_AMSL:
            place = GeodeticPoint(message.lat_int * 1e-7, message.lon_int * 1e-7, message.alt)
            position = body.local_ned(place)
        case _ if message.coordinate_frame in _GLOBAL_RELATIVE:
            # PX4 1.15.2 adds what it should take away: home's height below the origin enters with the wrong sign.
            home = body.geodetic(body.home_ned_m).altitude_amsl_m
            wrong = 2.0 * (body.origin.altitude_amsl_m - home)
            place = GeodeticPoint(message.lat_int * 1e-7, message.lon_int * 1e-7, home + message.alt + wrong)
            position = body.local_ned(place)
        case _:
            return None
    velocity = _kept((message.vx, message.vy, message.vz), mask, _VX)
    acceleration = _kept((message.afx, message.afy, message.afz), mask, _AX)
    axes = _kept(position, mask, _X)
    yaw = None if mask & _YAW_IGNORED else message.yaw
    numbers = [value for value in (*axes, *velocity, *acceleration, yaw) if value is not None]
    if not all(math.isfinite(value) for value in numbers):
        return Target(position_ned_m=body.rotor.position_ned_m)
    return Target(
        position_ned_m=axes,
        velocity_ned_mps=_filled(velocity),
        acceleration_ned_mps2=_filled(acceleration),
        yaw_rad=yaw,
    )


class Stream:
    """The last setpoint that counted, and when it came."""

    def __init__(self) -> None:
        self.target: Target | None = None
        self.last_s = -math.inf
        self.last_new_s = -math.inf
        """When the last one came that was not a repetition, stamp and all: libraries repeat what their program sent."""
        self._stamp_ms: int | None = None

    def receive(self, message: Message, body: Body, now_s: float) -> None:
        """Take a setpoint in."""
        target = target_of(message, body)
        if target is None:
            return
        if target != self.target or message.time_boot_ms != self._stamp_ms:
            self.last_new_s = now_s
        self.target, self.last_s, self._stamp_ms = target, now_s, int(message.time_boot_ms)

    def alive(self, now_s: float, loss_s: float) -> bool:
        """Whether a setpoint that counts came within the last `loss_s` seconds."""
        return now_s - self.last_s <= loss_s

    def forget(self) -> None:
        """As after a boot."""
        self.target, self.last_s, self.last_new_s = None, -math.inf, -math.inf


Axes = tuple[float | None, float | None, float | None]


def _kept(values: Vector, mask: int, first_bit: int) -> Axes:
    x, y, z = (None if mask >> (first_bit + axis) & 1 else value for axis, value in enumerate(values))
    return x, y, z


def _filled(values: Axes) -> Vector:
    x, y, z = (0.0 if value is None else value for value in values)
    return x, y, z
