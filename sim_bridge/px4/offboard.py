"""PX4's setpoint stream: which setpoints count, what they ask for, and whether the stream is alive."""

from __future__ import annotations

import dataclasses
import math

from sim_bridge.codec import Message, mavlink
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.kinematics import Target

SETPOINTS = (
    mavlink.MAVLink_set_position_target_local_ned_message,
    mavlink.MAVLink_set_position_target_global_int_message,
)
_X, _VX, _AX = 0, 3, 6
_ALL = 0b111
_FORCE, _YAW_IGNORED, _YAW_RATE_IGNORED = 1 << 9, 1 << 10, 1 << 11

Axes = tuple[float | None, float | None, float | None]


@dataclasses.dataclass(frozen=True)
class Refused:
    """A setpoint that does not count.

    Attributes:
        reason: What PX4 says about it.
    """

    reason: str


def target_of(message: Message, body: Body) -> Target | Refused:
    """What a setpoint asks for, as PX4 1.15 understands it.

    LOCAL_NED and the global frames count, BODY_NED for velocities. A mask that ignores everything does not count. NaN
    is not refused: what is not a number means "stop here".
    """
    mask = int(message.type_mask)
    name = message.get_type()
    position = _position_ned(message, body)
    if position is None:
        return Refused(f"{name} coordinate frame {message.coordinate_frame} unsupported")
    if mask & _FORCE and mask >> _AX & _ALL != _ALL:
        return Refused(f"{name} force not supported")
    places = _kept(position, mask, _X)
    velocity: Axes = _kept((message.vx, message.vy, message.vz), mask, _VX)
    acceleration: Axes = _kept((message.afx, message.afy, message.afz), mask, _AX)
    if message.coordinate_frame == mavlink.MAV_FRAME_BODY_NED:
        places = (None, None, None)
        velocity, acceleration = _turned(velocity, body), _turned(acceleration, body)
    if all(value is None for value in (*places, *velocity, *acceleration)):
        return Refused(f"{name} invalid")
    yaw = None if mask & _YAW_IGNORED else message.yaw
    yaw_rate = 0.0 if mask & _YAW_RATE_IGNORED else message.yaw_rate
    numbers = (*places, *velocity, *acceleration, yaw, yaw_rate)
    if not all(value is None or math.isfinite(value) for value in numbers):
        return Target(position_ned_m=body.position_ned_m)
    free = all(value is None for value in (*places, *velocity))
    return Target(places, None if free else _filled(velocity), _filled(acceleration), yaw, yaw_rate)


def _position_ned(message: Message, body: Body) -> Vector | None:
    frame = message.coordinate_frame
    if isinstance(message, mavlink.MAVLink_set_position_target_local_ned_message):
        known = frame in (mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_NED)
        return (message.x, message.y, message.z) if known else None
    if frame == mavlink.MAV_FRAME_GLOBAL_INT:
        amsl_m = message.alt
    elif frame == mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT:
        # PX4 1.15.2 has z = home − alt − origin, where z = origin − home − alt would be right.
        amsl_m = 2.0 * body.origin.altitude_amsl_m - body.home_amsl_m + message.alt
    else:
        return None
    return body.local_ned(GeodeticPoint(message.lat_int * 1e-7, message.lon_int * 1e-7, amsl_m))


class Stream:
    """The last setpoint that counted, and when it came."""

    def __init__(self) -> None:
        self.target: Target | None = None
        self.last_s = -math.inf

    def receive(self, message: Message, body: Body, now_s: float) -> Refused | None:
        """Take a setpoint in; what does not count is told and changes nothing."""
        target = target_of(message, body)
        if isinstance(target, Refused):
            return target
        self.target, self.last_s = target, now_s
        return None

    def alive(self, now_s: float, loss_s: float) -> bool:
        """Whether a setpoint that counts came within the last `loss_s` seconds."""
        return now_s - self.last_s < loss_s


def _kept(values: Vector, mask: int, first_bit: int) -> Axes:
    x, y, z = (None if mask >> (first_bit + axis) & 1 else value for axis, value in enumerate(values))
    return x, y, z


def _turned(values: Axes, body: Body) -> Axes:
    """From the body's heading to north; one axis that is ignored leaves the others without meaning."""
    forward, right, down = values
    if forward is None or right is None or down is None:
        return None, None, None
    cosine, sine = math.cos(body.rotor.yaw_rad), math.sin(body.rotor.yaw_rad)
    return cosine * forward - sine * right, sine * forward + cosine * right, down


def _filled(values: Axes) -> Vector:
    x, y, z = (0.0 if value is None else value for value in values)
    return x, y, z
