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
_NOTHING: Axes = (None, None, None)


@dataclasses.dataclass(frozen=True)
class Refused:
    """A setpoint that does not count.

    Attributes:
        reason: What PX4 says about it.
    """

    reason: str


def target_of(message: Message, body: Body) -> Target | Refused:
    """What a setpoint asks for, as PX4 1.15 understands it.

    LOCAL_NED and the global frames count, BODY_NED for velocities. A mask that ignores everything does not count, and
    what is sent as NaN is ignored as if the mask said so. Of what is left every axis needs something, and x and y come
    in pairs; else the setpoint counts and means "stop here".
    """
    mask = int(message.type_mask)
    name = message.get_type()
    position = _position_ned(message, mask, body)
    if position is None:
        return Refused(f"{name} coordinate frame {message.coordinate_frame} unsupported")
    velocity = _kept((message.vx, message.vy, message.vz), mask, _VX)
    acceleration = _kept((message.afx, message.afy, message.afz), mask, _AX)
    if message.coordinate_frame == mavlink.MAV_FRAME_BODY_NED:
        velocity, acceleration = _turned(velocity, body), _turned(acceleration, body)
    if mask & _FORCE and not _nothing(acceleration):
        return Refused(f"{name} force not supported")
    if _nothing(position) and _nothing(velocity) and _nothing(acceleration):
        return Refused(f"{name} invalid")
    position, velocity, acceleration = _finite(position), _finite(velocity), _finite(acceleration)
    if not _complete(position, velocity, acceleration):
        return Target()
    yaw, yaw_rate, _ = _finite((message.yaw, message.yaw_rate, None))
    return Target(
        position_ned_m=position,
        velocity_ned_mps=None if _nothing(position) and _nothing(velocity) else _filled(velocity),
        acceleration_ned_mps2=_filled(acceleration),
        yaw_rad=None if mask & _YAW_IGNORED else yaw,
        yaw_rate_radps=0.0 if mask & _YAW_RATE_IGNORED or yaw_rate is None else yaw_rate,
    )


def _position_ned(message: Message, mask: int, body: Body) -> Axes | None:
    """The position that is asked for; None: in a frame that is not understood."""
    frame = message.coordinate_frame
    if isinstance(message, mavlink.MAVLink_set_position_target_local_ned_message):
        if frame == mavlink.MAV_FRAME_BODY_NED:
            return _NOTHING
        known = frame == mavlink.MAV_FRAME_LOCAL_NED
        return _kept((message.x, message.y, message.z), mask, _X) if known else None
    if mask & _ALL:
        # A place on the globe counts whole.
        return _NOTHING
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


def _nothing(values: Axes) -> bool:
    return all(value is None or math.isnan(value) for value in values)


def _finite(values: Axes) -> Axes:
    x, y, z = (value if value is not None and math.isfinite(value) else None for value in values)
    return x, y, z


def _complete(*groups: Axes) -> bool:
    """Whether every axis has something, and x and y come in pairs."""
    served = all(any(group[axis] is not None for group in groups) for axis in range(3))
    return served and all((x is None) == (y is None) for x, y, _ in groups)


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
