"""What a vehicle is told and what it tells: values with frames and units in their names.

The border between `mission` and `sim_bridge`: everything here is local ENU metres relative to the *mission's*
origin, and seconds of the vehicle's own time.
"""

from __future__ import annotations

import dataclasses
import enum
import math

Vector = tuple[float, float, float]
GRAVITY_MPS2 = 9.80665
LARGEST_ON_THE_WIRE = (2.0 - 2.0**-23) * 2.0**127
"""MAVLink's numbers have four bytes: a larger one becomes infinite in them."""


@dataclasses.dataclass(frozen=True)
class GeodeticPoint:
    """A WGS84 position.

    Attributes:
        latitude_deg: Latitude, degrees north.
        longitude_deg: Longitude, degrees east.
        altitude_amsl_m: Height above mean sea level, metres.
    """

    latitude_deg: float
    longitude_deg: float
    altitude_amsl_m: float


def finite_on_the_wire(*numbers: float) -> bool:
    """Whether numbers are still finite in the four bytes that MAVLink has for each."""
    return all(abs(number) <= LARGEST_ON_THE_WIRE for number in numbers)


@dataclasses.dataclass(frozen=True)
class Setpoint:
    """One point of the curve to fly, as streamed to a vehicle.

    Attributes:
        position_enu_m: Position, metres.
        velocity_enu_mps: Velocity feed-forward, metres per second.
        acceleration_enu_mps2: Acceleration feed-forward, metres per second squared.
        yaw_enu_rad: Heading, counter-clockwise from east, radians.

    Raises:
        ValueError: If any number is not finite on the wire: such a setpoint must never reach a vehicle.
    """

    position_enu_m: Vector
    velocity_enu_mps: Vector
    acceleration_enu_mps2: Vector
    yaw_enu_rad: float

    def __post_init__(self) -> None:
        numbers = (
            *self.position_enu_m,
            *self.velocity_enu_mps,
            *self.acceleration_enu_mps2,
            self.yaw_enu_rad,
        )
        if not finite_on_the_wire(*numbers):
            raise ValueError(f"a setpoint needs finite numbers, got {self}: plan again or hold the last one")

    @classmethod
    def hold(cls, position_enu_m: Vector, yaw_enu_rad: float) -> Setpoint:
        """The setpoint that stays at a place: zero velocity and acceleration."""
        return cls(position_enu_m, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), yaw_enu_rad)


class FlightMode(enum.Enum):
    """What a vehicle is doing, in words both autopilots share (numbers: `sim_bridge.dialects`)."""

    EXTERNAL = "external"
    """Follows our setpoints: OFFBOARD on PX4, GUIDED on ArduPilot."""
    TAKEOFF = "takeoff"
    HOLD = "hold"
    MISSION = "mission"
    RETURN = "return"
    LAND = "land"
    PILOT = "pilot"
    """A mode that follows sticks: POSCTL, ALTCTL, STABILIZE, LOITER …"""
    OTHER = "other"


class LandedState(enum.Enum):
    """Where a vehicle believes to be (MAV_LANDED_STATE)."""

    UNKNOWN = 0
    ON_GROUND = 1
    IN_AIR = 2
    TAKING_OFF = 3
    LANDING = 4


@dataclasses.dataclass(frozen=True)
class VehicleState:
    """Everything a vehicle told about itself, at one moment.

    Attributes:
        time_s: The vehicle's own clock (time since boot).
        position_enu_m: Position relative to the mission's origin, metres.
        velocity_enu_mps: Velocity, metres per second.
        yaw_enu_rad: Heading, counter-clockwise from east, radians.
        armed: Whether the motors are armed.
        mode: What it is doing.
        mode_name: The autopilot's own name of that mode.
        landed: Where it believes to be.
        battery_fraction: Charge left of its emptiest battery, 0 … 1; None: not told.
        waiting_for: What keeps it from being ready to arm, in words; empty: ready.
        failsafe: Whether the vehicle acts on a failsafe of its own.
        home_enu_m: Where it would return to; None: not told yet.
        tilt_enu_mps2: The acceleration east and north that its tilt makes while its rotors carry its weight, metres
            per second squared; None: not told.
        position_age_s: How old the position is, where positions fail to come.
        battery_age_s: How old the charge is, or that of the battery that was not told of for longest.
    """

    time_s: float
    position_enu_m: Vector
    velocity_enu_mps: Vector
    yaw_enu_rad: float
    armed: bool
    mode: FlightMode
    mode_name: str
    landed: LandedState
    battery_fraction: float | None
    waiting_for: tuple[str, ...]
    failsafe: bool
    home_enu_m: Vector | None
    tilt_enu_mps2: tuple[float, float] | None = None
    position_age_s: float = 0.0
    battery_age_s: float = 0.0

    @property
    def ready(self) -> bool:
        """Whether arming will be accepted, as far as the vehicle tells."""
        return not self.waiting_for

    @property
    def aloft(self) -> bool:
        """Whether it is flying."""
        return self.armed and self.landed in (LandedState.IN_AIR, LandedState.TAKING_OFF, LandedState.LANDING)

    @property
    def speed_mps(self) -> float:
        """Norm of the velocity."""
        return math.hypot(*self.velocity_enu_mps)


@dataclasses.dataclass(frozen=True)
class Waiting:
    """The vehicle is heard, but not enough is known of it yet for a state.

    Attributes:
        waiting_for: What is missing, in words.
    """

    waiting_for: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class StatusText:
    """A line of text from a vehicle.

    Attributes:
        severity: 0 emergency … 7 debug (MAV_SEVERITY).
        text: The words, reassembled from their chunks.
    """

    severity: int
    text: str


@dataclasses.dataclass(frozen=True)
class MissionProgress:
    """How far a vehicle is in its uploaded mission.

    Attributes:
        reached: Index of the last item it reached; None: none yet.
        current: Index of the item it flies to.
    """

    reached: int | None
    current: int


class Command(enum.Enum):
    """What a vehicle can be told to do."""

    ARM = "arm"
    TAKE_OFF = "take off"
    FOLLOW_SETPOINTS = "follow setpoints"
    HOLD = "hold"
    RETURN = "return"
    LAND = "land"
    START_MISSION = "start the mission"
    DISARM = "disarm"


@dataclasses.dataclass(frozen=True)
class CommandDone:
    """How a command ended.

    Attributes:
        command: What was asked for.
        accepted: Whether the vehicle took it.
        reason: Why not, with the vehicle's own words where it said any; empty where it was accepted.
        answered: Whether the vehicle said anything to it; without an answer it may have been taken all the same.
    """

    command: Command
    accepted: bool
    reason: str = ""
    answered: bool = True
