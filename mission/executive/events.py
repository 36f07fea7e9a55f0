"""What the executive hears and what it answers with: plain values, no behaviour."""

from __future__ import annotations

import dataclasses
import enum

from mission.executive.course import Course
from mission.executive.energy import Energy
from mission.executive.phases import Phase
from planner.gate import ProvenTrajectory
from planner.problem import Limits
from sim_bridge.state import (
    Command,
    CommandDone,
    MissionProgress,
    StatusText,
    Vector,
    VehicleState,
    Waiting,
)


class FlightEnd(enum.Enum):
    """What happens when the exploration is done."""

    RETURN = "return"
    LAND = "land"
    HOLD = "hold"


class FlightMethod(enum.Enum):
    """How the curve is flown."""

    OFFBOARD = "offboard"
    MISSION = "mission"


class Operator(enum.Enum):
    """What the person at the keys wants."""

    PAUSE = "pause"
    RESUME = "resume"
    RETURN = "return"
    LAND = "land"
    LEAVE = "leave"


@dataclasses.dataclass(frozen=True)
class Assignment:
    """What this flight is to do.

    Attributes:
        exploration: The proven curve; its start is reached by a proven way after take-off.
        takeoff_altitude_m: Height of the end of the climb above where the vehicle stands.
        end: What happens after the exploration.
        method: How the curve is flown.
        max_acceleration_mps2: What braking may use.
        max_yaw_rate_radps: How fast the nose may turn.
        max_climb_mps: How fast it climbs, for the time limit of the take-off.
        ready_timeout_s: How long to wait until the vehicle is ready to arm.
        item_times_s: Curve time passed when an item of an uploaded mission is reached, up to the last waypoint.
        only_home: Whether the exploration was flown to its end before, and the vehicle is only to be brought home.
        resumed: Whether it goes on with an earlier flight, whose vehicle may be in the air.
        rally_m: Above where it may land instead of home, at whatever height.
    """

    exploration: ProvenTrajectory
    takeoff_altitude_m: float
    end: FlightEnd
    method: FlightMethod
    max_acceleration_mps2: float
    max_yaw_rate_radps: float
    max_climb_mps: float
    ready_timeout_s: float = 180.0
    item_times_s: tuple[float, ...] = ()
    only_home: bool = False
    resumed: bool = False
    rally_m: tuple[Vector, ...] = ()


class Goal(enum.Enum):
    """Where a way is wanted to."""

    EXPLORATION = "exploration"
    HOME = "home"


@dataclasses.dataclass(frozen=True)
class Connected:
    """A vehicle answered."""


@dataclasses.dataclass(frozen=True)
class MissionPlace:
    """A place that an uploaded mission leads to.

    Attributes:
        number: Of its item, in the vehicle's counting.
        position_m: Where it is.
    """

    number: int
    position_m: Vector


@dataclasses.dataclass(frozen=True)
class Checked:
    """How the checks before arming ended.

    Attributes:
        problems: What forbids the flight.
        notes: What is worth saying.
        exploration: The curve to fly, slowed down where the vehicle is slower; None: as it was.
        limits: The smaller of the mission's and the vehicle's limits; None: the mission's.
        energy: What flying costs this vehicle; None: as thought before.
        places: Of an uploaded mission, in order; empty: none was uploaded.
    """

    problems: tuple[str, ...]
    notes: tuple[str, ...] = ()
    exploration: ProvenTrajectory | None = None
    limits: Limits | None = None
    energy: Energy | None = None
    places: tuple[MissionPlace, ...] = ()


@dataclasses.dataclass(frozen=True)
class NewCourse:
    """A proven curve that continues the exploration from its own start on."""

    trajectory: ProvenTrajectory


@dataclasses.dataclass(frozen=True)
class NoWayRound:
    """Nobody finds a course round what blocks this one."""


@dataclasses.dataclass(frozen=True)
class Stalled:
    """The stream was not renewed in time and braked by itself.

    Attributes:
        course: What it streams since.
    """

    course: Course


@dataclasses.dataclass(frozen=True)
class StreamFailed:
    """Setpoints cannot be sent any more."""


@dataclasses.dataclass(frozen=True)
class StreamLate:
    """Setpoints came so late that the vehicle may have done what it does without them."""


@dataclasses.dataclass(frozen=True)
class FindWay:
    """Find a proven way at rest from one place to another; home: above where it lands.

    Attributes:
        goal: What the way is for.
        start_m: Where it begins.
        end_m: Where it ends.
        number: Counts what was asked: an answer to an earlier question is none to this.
    """

    goal: Goal
    start_m: Vector
    end_m: Vector
    number: int = 0


@dataclasses.dataclass(frozen=True)
class WayFound:
    """A proven way, or why there is none.

    Attributes:
        asked: The question.
        trajectory: The way; None: there is none.
        reason: Why.
    """

    asked: FindWay
    trajectory: ProvenTrajectory | None
    reason: str = ""


@dataclasses.dataclass(frozen=True)
class WayHome:
    """How long the proven way home takes, reckoned beside the flight; nobody waits for it."""

    from_m: Vector
    duration_s: float


Event = (
    VehicleState
    | Waiting
    | StatusText
    | CommandDone
    | MissionProgress
    | Connected
    | Checked
    | WayFound
    | WayHome
    | NewCourse
    | NoWayRound
    | Stalled
    | StreamFailed
    | StreamLate
    | Operator
)


@dataclasses.dataclass(frozen=True)
class RunChecks:
    """Check the vehicle, its parameters and the ways there and back."""


@dataclasses.dataclass(frozen=True)
class Order:
    """Give the vehicle a command."""

    command: Command
    altitude_m: float | None = None


@dataclasses.dataclass(frozen=True)
class Withdraw:
    """Give none of the commands that were ordered and have not been sent yet."""


@dataclasses.dataclass(frozen=True)
class Stream:
    """Follow a course with setpoints; None: not one setpoint more."""

    course: Course | None


@dataclasses.dataclass(frozen=True)
class Entered:
    """A new phase began."""

    phase: Phase
    why: str


VEHICLE_SAYS = "vehicle: "
"""How a line begins that repeats what the vehicle said."""


@dataclasses.dataclass(frozen=True)
class Say:
    """Tell the operator."""

    text: str
    warning: bool = False


Action = RunChecks | Order | Withdraw | Stream | FindWay | Entered | Say
