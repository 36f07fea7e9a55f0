"""ArduPilot's GUIDED mode: take-off, and setpoints as Copter 4.5 understands them."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable

from sim_bridge.codec import Message, mavlink
from sim_bridge.state import GeodeticPoint, Vector
from sim_bridge.vehicle import guidance
from sim_bridge.vehicle.body import Body
from sim_bridge.vehicle.kinematics import STILL, Target

_POSITION, _VELOCITY, _ACCELERATION = 0b111, 0b111 << 3, 0b111 << 6
_FORCE, _YAW_IGNORED, _YAW_RATE_IGNORED = 1 << 9, 1 << 10, 1 << 11
_LOCAL_FRAMES = (
    mavlink.MAV_FRAME_LOCAL_NED,
    mavlink.MAV_FRAME_LOCAL_OFFSET_NED,
    mavlink.MAV_FRAME_BODY_NED,
    mavlink.MAV_FRAME_BODY_OFFSET_NED,
)
_OFFSET_FRAMES = (mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED)
_BODY_FRAMES = (mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED)
_RELATIVE_FRAMES = (mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT)
_ABSOLUTE_FRAMES = (mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT)
_TAKEN_OFF_WITHIN_M = 0.3


class AutopilotCrash(RuntimeError):
    """The firmware itself dies, as Copter 4.5 does of a setpoint that is not a number."""


class Submode(enum.Enum):
    """What GUIDED does at the moment."""

    TAKE_OFF = "take off"
    POSITION = "position"
    POSITION_VELOCITY = "position and velocity"
    VELOCITY = "velocity"
    ACCELERATION = "acceleration"


class Guided:
    """State of GUIDED.

    Args:
        body: Of the vehicle.
        allowed: Whether a place lies inside the fence.
    """

    def __init__(self, body: Body, allowed: Callable[[Vector], bool]) -> None:
        self._body = body
        self._allowed = allowed
        self.enter()

    def enter(self) -> None:
        """GUIDED begins, or stops: hold here."""
        self.submode = Submode.VELOCITY
        self._target = Target()
        self._held: Vector | None = None
        self._updated_s = -math.inf
        self._takeoff: Vector = self._body.position_ned_m
        self._yaw_rad = self._body.rotor.yaw_rad

    def take_off(self, down_m: float) -> None:
        """Climb to a height, straight up."""
        x, y, _ = self._body.position_ned_m
        self._takeoff = (x, y, down_m)
        self._yaw_rad = self._body.rotor.yaw_rad
        self.submode = Submode.TAKE_OFF

    def go_to(self, place_ned_m: Vector) -> bool:
        """Fly to a place and stay there; whether the fence allows it."""
        if not self._allowed(place_ned_m):
            return False
        self._take(Submode.POSITION, Target(position_ned_m=place_ned_m))
        return True

    def receive(self, message: Message) -> None:
        """Take a setpoint; also one during a take-off, which ends that.

        A group counts only whole: one ignored axis ignores all three, and where nothing is left the vehicle stops.

        Raises:
            AutopilotCrash: A number that counts is not one.
        """
        mask = int(message.type_mask)
        force = mask & _FORCE and not mask & _ACCELERATION
        if force:
            return
        if isinstance(message, mavlink.MAVLink_set_position_target_local_ned_message):
            position = self._local_position(message)
        else:
            position = self._global_position(message)
        if position is None:
            self._stop()
            return
        velocity, acceleration = (message.vx, message.vy, message.vz), (message.afx, message.afy, message.afz)
        if message.coordinate_frame in _BODY_FRAMES:
            velocity, acceleration = self._turned(velocity), self._turned(acceleration)
        yaw = None if mask & _YAW_IGNORED else message.yaw
        yaw_rate = 0.0 if mask & _YAW_RATE_IGNORED else message.yaw_rate
        has_position, has_velocity, has_acceleration = (
            not mask & group for group in (_POSITION, _VELOCITY, _ACCELERATION)
        )
        used = (
            *(position if has_position else ()),
            *(velocity if has_velocity else ()),
            *(acceleration if has_acceleration else ()),
            *(() if yaw is None else (yaw,)),
            yaw_rate,
        )
        if not all(math.isfinite(value) for value in used):
            raise AutopilotCrash("a setpoint held a number that is none")
        pushed = acceleration if has_acceleration else STILL
        if has_position and not self._allowed(position):
            return
        if has_position and has_velocity:
            self._take(Submode.POSITION_VELOCITY, Target(position, velocity, pushed, yaw, yaw_rate))
        elif has_velocity:
            self._take(Submode.VELOCITY, Target((None, None, None), velocity, pushed, yaw, yaw_rate))
        elif has_position:
            self._take(Submode.POSITION, Target(position, STILL, STILL, yaw, yaw_rate))
        elif has_acceleration:
            self._take(Submode.ACCELERATION, Target((None, None, None), None, pushed, yaw, yaw_rate))
        else:
            self._stop()

    def target(self, climb_mps: float, timeout_s: float) -> Target | None:
        """What to do now; None: stand, which only a take-off ends.

        A place is held for ever; a velocity or acceleration that is not renewed becomes nought after GUID_TIMEOUT.
        """
        body = self._body
        if self.submode is Submode.TAKE_OFF:
            if abs(body.position_ned_m[2] - self._takeoff[2]) >= _TAKEN_OFF_WITHIN_M or body.on_ground:
                return guidance.climb(body, self._takeoff, climb_mps, self._yaw_rad)
            self._take(Submode.POSITION, Target(position_ned_m=self._takeoff, yaw_rad=self._yaw_rad))
        if body.on_ground:
            return None
        target, stale = self._target, body.time_s - self._updated_s > timeout_s
        if self.submode is Submode.POSITION:
            return target
        if self.submode is Submode.POSITION_VELOCITY:
            return Target(target.position_ned_m, yaw_rad=target.yaw_rad) if stale else target
        if not stale and (target.velocity_ned_mps is None or any(target.velocity_ned_mps)):
            self._held = None
            return target
        if self._held is None:
            self._held = body.stopping_place_ned_m(guidance.braking_mps2(body))
        return Target(position_ned_m=self._held, yaw_rad=None if stale else target.yaw_rad)

    @property
    def asked(self) -> Target:
        """The last thing that was asked for."""
        return self._target

    def _stop(self) -> None:
        """Hold here; asked for again and again, the place stays the same."""
        holds = self.submode is Submode.VELOCITY and self._updated_s == -math.inf
        if not holds:
            self.enter()

    def _take(self, submode: Submode, target: Target) -> None:
        self.submode, self._target, self._updated_s = submode, target, self._body.time_s
        self._held = None

    def _local_position(self, message: Message) -> Vector | None:
        if message.coordinate_frame not in _LOCAL_FRAMES:
            return None
        position = (message.x, message.y, message.z)
        if message.coordinate_frame in _BODY_FRAMES:
            position = self._turned(position)
        if message.coordinate_frame in _OFFSET_FRAMES:
            x, y, z = self._body.position_ned_m
            return position[0] + x, position[1] + y, position[2] + z
        return position

    def _global_position(self, message: Message) -> Vector | None:
        if message.coordinate_frame in _ABSOLUTE_FRAMES:
            amsl_m = message.alt
        elif message.coordinate_frame in _RELATIVE_FRAMES:
            amsl_m = self._body.home_amsl_m + message.alt
        else:
            return None
        return self._body.local_ned(GeodeticPoint(message.lat_int * 1e-7, message.lon_int * 1e-7, amsl_m))

    def _turned(self, vector: Vector) -> Vector:
        """From the body's heading to north."""
        forward, right, down = vector
        cosine, sine = math.cos(self._body.rotor.yaw_rad), math.sin(self._body.rotor.yaw_rad)
        return cosine * forward - sine * right, sine * forward + cosine * right, down
