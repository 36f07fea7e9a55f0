"""The flight as one table: in which phase, on what trigger, to which phase, and why.

`executive` turns what is heard into triggers, `phase_machine` takes the rows. A trigger without a row
for the phase it comes in changes nothing. `docs/safety.md` says which hazard each of them answers.
"""

from __future__ import annotations

import dataclasses
import enum

from sim_bridge.state import Command, FlightMode


class Phase(enum.Enum):
    """What the flight is doing."""

    CONNECTING = "connecting"
    WAITING_READY = "waiting until ready"
    CHECKING = "checking the vehicle"
    CHECKING_ALOFT = "checking the flying vehicle"
    ARMING = "arming"
    DISARMING = "disarming"
    TAKING_OFF = "taking off"
    ENTERING = "taking over"
    TAKING_BACK = "taking over to return"
    TRANSIT = "flying to the start"
    FOLLOWING = "exploring"
    HOLDING = "holding"
    BLIND = "link lost"
    TURNING_BACK = "turning back"
    RETURNING = "returning"
    VEHICLE_RETURN = "vehicle returns by itself"
    LANDING = "landing"
    RETURN_PAUSED = "return or landing paused"
    AUTO_MISSION = "vehicle flies the uploaded mission"
    AUTO_HOLD = "vehicle holds"
    HANDING_OVER = "handing over"
    OVERRIDDEN = "pilot or failsafe in control"
    LANDED = "landed"
    HANDED_OVER = "handed over"
    ABORTED = "aborted"


class Trigger(enum.Enum):
    """What can happen."""

    CONNECTED = "a vehicle was heard"
    READY = "the vehicle is ready to arm"
    READY_ALOFT = "the vehicle flies already, and its flight is resumed"
    FLIES_ALREADY = "the vehicle flies already, and not for this flight"
    CHECKS_PASSED = "every check passed"
    CHECKS_FAILED = "a check failed"
    ARMED = "the motors are armed"
    DISARMED = "the motors are disarmed"
    AT_ALTITUDE = "take-off altitude reached"
    AT_ALTITUDE_MISSION = "take-off altitude reached, with an uploaded mission"
    UNDER_CONTROL = "the vehicle follows setpoints and the way is proven"
    NO_WAY = "no proven way exists"
    ARRIVED = "the end of the way is reached"
    EXPLORED = "the end of the exploration is reached"
    EXPLORED_LAND = "the end of the exploration is reached, to land there"
    EXPLORED_HOLD = "the end of the exploration is reached, to hold there"
    MODE_TAKEN = "the vehicle is in the mode asked for"
    PAUSE = "the operator pauses"
    RESUME = "the operator resumes"
    RETURN = "the operator calls it back"
    LAND = "the operator lets it land"
    LEAVE = "the operator leaves"
    PILOT = "the pilot changed the mode"
    FAILSAFE = "a failsafe of the vehicle acts"
    LINK_LOST = "nothing was heard for too long"
    LINK_GONE = "nothing was heard for very long"
    LINK_BACK = "the vehicle is heard again, still following"
    LINK_BACK_HOLDING = "the vehicle is heard again, held by its failsafe"
    LINK_BACK_HOMEWARD = "the vehicle is heard again, held by its failsafe on the way home"
    LINK_BACK_RETURNING = "the vehicle is heard again, on its way back"
    BATTERY_LOW = "the charge is what the way home needs"
    OUTSIDE = "outside the fence"
    TOO_CLOSE = "closer to an obstacle than allowed"
    OFF_TRACK = "too far from the course"
    STALLED = "nobody watched the flight for too long"
    STREAM_FAILED = "setpoints cannot be sent any more"
    RECOVERED = "on the course again, at a safe distance"
    GIVEN_UP = "too many recoveries"
    BLOCKED = "new information blocks the course"
    UNBLOCKED = "a new course is proven"
    NO_LANDING = "no place to land is clear"
    TIMED_OUT = "the phase took too long"


STREAMING = (
    Phase.ENTERING,
    Phase.TAKING_BACK,
    Phase.TRANSIT,
    Phase.FOLLOWING,
    Phase.HOLDING,
    Phase.TURNING_BACK,
    Phase.RETURNING,
)
"""Phases in which our setpoints fly the vehicle."""

ON_COURSE = (Phase.TRANSIT, Phase.FOLLOWING, Phase.RETURNING)
"""Phases that move along a proven curve; holding returns to the one it interrupted."""

AIRBORNE = (
    Phase.TAKING_OFF,
    *STREAMING,
    Phase.BLIND,
    Phase.VEHICLE_RETURN,
    Phase.LANDING,
    Phase.RETURN_PAUSED,
    Phase.AUTO_MISSION,
    Phase.AUTO_HOLD,
    Phase.HANDING_OVER,
)
"""Phases in which the vehicle flies under our control."""

HOMEWARD = (Phase.TAKING_BACK, Phase.TURNING_BACK, Phase.RETURNING)
"""Phases that lead home."""

OUTWARD = (Phase.TRANSIT, Phase.FOLLOWING, Phase.HOLDING)
"""Phases of the exploration, from which it is called home."""

FINAL = (Phase.LANDED, Phase.HANDED_OVER, Phase.ABORTED)
"""Phases that end the flight."""

_BEFORE_ARMING = (Phase.CONNECTING, Phase.WAITING_READY, Phase.CHECKING)
_OURS = tuple(phase for phase in AIRBORNE if phase is not Phase.BLIND)
_HEARD_AGAIN = (Phase.BLIND, *STREAMING)
_AUTO = (Phase.AUTO_MISSION, Phase.AUTO_HOLD)


@dataclasses.dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes:
        phases: Where the row holds.
        trigger: What happens.
        goto: What the flight does then; None: what was interrupted.
        why: The reason, as it is told to the operator.
    """

    phases: tuple[Phase, ...]
    trigger: Trigger
    goto: Phase | None
    why: str


_P, _T = Phase, Trigger

TABLE: tuple[Row, ...] = (
    # To the air.
    Row((_P.CONNECTING,), _T.CONNECTED, _P.WAITING_READY, "the vehicle answers"),
    Row((_P.WAITING_READY,), _T.READY, _P.CHECKING, "the vehicle says it is ready"),
    Row((_P.CHECKING,), _T.CHECKS_PASSED, _P.ARMING, "every check passed"),
    Row((_P.CHECKING,), _T.CHECKS_FAILED, _P.ABORTED, "a check failed: nothing was armed"),
    Row((_P.ARMING,), _T.ARMED, _P.TAKING_OFF, "armed"),
    Row(_BEFORE_ARMING, _T.TIMED_OUT, _P.ABORTED, "it took too long: nothing took off"),
    Row(_BEFORE_ARMING, _T.RETURN, _P.ABORTED, "the operator stopped it before take-off"),
    Row(_BEFORE_ARMING, _T.LAND, _P.ABORTED, "the operator stopped it before take-off"),
    Row(_BEFORE_ARMING, _T.LEAVE, _P.ABORTED, "the operator stopped it before take-off"),
    # The order to arm may be on its way, or taken and not shown yet.
    Row((_P.ARMING,), _T.TIMED_OUT, _P.DISARMING, "arming took too long"),
    Row((_P.ARMING,), _T.RETURN, _P.DISARMING, "the operator stopped it before take-off"),
    Row((_P.ARMING,), _T.LAND, _P.DISARMING, "the operator stopped it before take-off"),
    Row((_P.ARMING,), _T.LEAVE, _P.DISARMING, "the operator stopped it before take-off"),
    Row((_P.DISARMING,), _T.DISARMED, _P.ABORTED, "disarmed before it left the ground"),
    Row((_P.DISARMING,), _T.TIMED_OUT, _P.ABORTED, "it did not say that it disarmed: mind the motors"),
    Row((_P.DISARMING,), _T.LEAVE, _P.ABORTED, "the operator left before it said that it disarmed: mind the motors"),
    Row(
        (*_BEFORE_ARMING, _P.ARMING, _P.DISARMING),
        _T.FLIES_ALREADY,
        _P.ABORTED,
        "it flies already: only `mission resume` takes over in the air",
    ),
    Row((_P.TAKING_OFF,), _T.AT_ALTITUDE, _P.ENTERING, "take-off altitude reached"),
    Row((_P.TAKING_OFF,), _T.AT_ALTITUDE_MISSION, _P.AUTO_MISSION, "take-off altitude reached"),
    Row((_P.TAKING_OFF,), _T.TIMED_OUT, _P.LANDING, "the take-off took too long"),
    Row((_P.TAKING_OFF,), _T.DISARMED, _P.ABORTED, "the vehicle disarmed before it left the ground"),
    Row((_P.TAKING_OFF,), _T.OUTSIDE, _P.LANDING, "the climb drifted out of the fence"),
    Row((_P.ARMING,), _T.BLOCKED, _P.DISARMING, "new information blocks the climb"),
    Row((_P.TAKING_OFF,), _T.BLOCKED, _P.LANDING, "new information blocks the climb"),
    # A flight that is resumed in the air; who steers the vehicle keeps it (`phase_machine`).
    Row((_P.WAITING_READY,), _T.READY_ALOFT, _P.CHECKING_ALOFT, "it flies already"),
    Row((_P.CHECKING_ALOFT,), _T.CHECKS_PASSED, _P.ENTERING, "every check passed, and nobody steers it"),
    Row((_P.CHECKING_ALOFT,), _T.CHECKS_FAILED, _P.TAKING_BACK, "a check failed: it is flown home"),
    Row((_P.CHECKING_ALOFT,), _T.TIMED_OUT, _P.TAKING_BACK, "the checks took too long: it is flown home"),
    Row((_P.CHECKING_ALOFT,), _T.RETURN, _P.TAKING_BACK, "called back by the operator"),
    Row((_P.CHECKING_ALOFT,), _T.LAND, _P.LANDING, "the operator lets it land here"),
    Row((_P.CHECKING_ALOFT,), _T.PILOT, _P.OVERRIDDEN, "somebody else flies it: taken over when the operator resumes"),
    # Exploring.
    Row((_P.ENTERING,), _T.UNDER_CONTROL, _P.TRANSIT, "the vehicle follows our setpoints"),
    Row((_P.ENTERING,), _T.NO_WAY, _P.TAKING_BACK, "no proven way leads to the exploration"),
    Row((_P.ENTERING,), _T.TIMED_OUT, _P.LANDING, "the vehicle did not take our setpoints"),
    Row((_P.TRANSIT,), _T.ARRIVED, _P.FOLLOWING, "at the start of the exploration"),
    Row((_P.FOLLOWING,), _T.EXPLORED, _P.TURNING_BACK, "the exploration is done"),
    Row((_P.FOLLOWING,), _T.EXPLORED_LAND, _P.LANDING, "the exploration is done"),
    Row((_P.FOLLOWING,), _T.EXPLORED_HOLD, _P.HANDING_OVER, "the exploration is done"),
    # Holding, and going on.
    Row(ON_COURSE, _T.PAUSE, _P.HOLDING, "paused by the operator"),
    Row((_P.VEHICLE_RETURN, _P.LANDING), _T.PAUSE, _P.RETURN_PAUSED, "paused by the operator"),
    Row((_P.RETURN_PAUSED,), _T.RESUME, None, "resumed by the operator"),
    Row((_P.RETURN_PAUSED,), _T.TIMED_OUT, None, "paused for too long"),
    Row((_P.RETURN_PAUSED,), _T.RETURN, _P.VEHICLE_RETURN, "called back by the operator"),
    Row(ON_COURSE, _T.TOO_CLOSE, _P.HOLDING, "closer to an obstacle than allowed"),
    Row(ON_COURSE, _T.OFF_TRACK, _P.HOLDING, "too far from the course"),
    Row(ON_COURSE, _T.STALLED, _P.HOLDING, "the flight was not watched: the stream braked by itself"),
    Row((_P.TRANSIT,), _T.BLOCKED, _P.ENTERING, "new information blocks the way"),
    Row((_P.FOLLOWING,), _T.BLOCKED, _P.HOLDING, "new information blocks the course"),
    Row((_P.RETURNING,), _T.BLOCKED, _P.TURNING_BACK, "new information blocks the way home"),
    Row((_P.HOLDING,), _T.RESUME, None, "resumed by the operator"),
    Row((_P.HOLDING,), _T.RECOVERED, None, "on the course again"),
    Row((_P.HOLDING,), _T.UNBLOCKED, _P.FOLLOWING, "a new course is proven"),
    Row((_P.HOLDING,), _T.NO_WAY, _P.TURNING_BACK, "no way round what blocks the course"),
    Row((_P.HOLDING,), _T.GIVEN_UP, _P.TURNING_BACK, "it keeps happening"),
    Row((_P.HOLDING,), _T.TIMED_OUT, _P.TURNING_BACK, "held for too long"),
    # Home.
    Row(OUTWARD, _T.BATTERY_LOW, _P.TURNING_BACK, "the charge left is what the way home needs"),
    Row(OUTWARD, _T.OUTSIDE, _P.TURNING_BACK, "outside the fence"),
    Row(OUTWARD, _T.RETURN, _P.TURNING_BACK, "called back by the operator"),
    Row((_P.FOLLOWING, _P.TRANSIT), _T.TIMED_OUT, _P.TURNING_BACK, "it took far longer than planned"),
    # Where our setpoints do not fly it yet, they must first be taken.
    Row((_P.ENTERING,), _T.BATTERY_LOW, _P.TAKING_BACK, "the charge left is what the way home needs"),
    Row((_P.ENTERING,), _T.OUTSIDE, _P.TAKING_BACK, "outside the fence"),
    Row((_P.ENTERING,), _T.RETURN, _P.TAKING_BACK, "called back by the operator"),
    Row((_P.TAKING_BACK,), _T.UNDER_CONTROL, _P.RETURNING, "the way home is proven"),
    Row((_P.TAKING_BACK,), _T.NO_WAY, _P.VEHICLE_RETURN, "no proven way leads home"),
    Row((_P.TAKING_BACK,), _T.TIMED_OUT, _P.LANDING, "the vehicle did not take our setpoints"),
    Row((_P.TURNING_BACK,), _T.UNDER_CONTROL, _P.RETURNING, "the way home is proven"),
    Row((_P.TURNING_BACK,), _T.NO_WAY, _P.VEHICLE_RETURN, "no proven way leads home"),
    Row((_P.TURNING_BACK, _P.RETURNING), _T.TIMED_OUT, _P.VEHICLE_RETURN, "the way home took too long"),
    Row((_P.RETURNING,), _T.ARRIVED, _P.LANDING, "above home"),
    Row((_P.RETURNING,), _T.NO_LANDING, _P.HOLDING, "no place to land is clear: it stands above home"),
    Row((_P.LANDING,), _T.BLOCKED, _P.TAKING_BACK, "new information blocks the way down"),
    Row(STREAMING, _T.STREAM_FAILED, _P.VEHICLE_RETURN, "setpoints cannot be sent any more"),
    Row((_P.TAKING_OFF,), _T.RETURN, _P.LANDING, "called back during take-off"),
    Row(
        (_P.TAKING_OFF, *STREAMING, _P.BLIND, _P.VEHICLE_RETURN, _P.RETURN_PAUSED, *_AUTO, _P.HANDING_OVER),
        _T.LAND,
        _P.LANDING,
        "the operator lets it land here",
    ),
    Row((_P.VEHICLE_RETURN,), _T.TIMED_OUT, _P.LANDING, "the vehicle did not return"),
    Row((_P.VEHICLE_RETURN, _P.LANDING, _P.RETURN_PAUSED), _T.DISARMED, _P.LANDED, "on the ground, disarmed"),
    Row((_P.HANDING_OVER,), _T.MODE_TAKEN, _P.HANDED_OVER, "the vehicle holds by itself"),
    Row((_P.HANDING_OVER,), _T.TIMED_OUT, _P.LANDING, "the vehicle did not take the hold mode"),
    # The link.
    Row(STREAMING, _T.LINK_LOST, _P.BLIND, "nothing heard: standing on the course"),
    Row((_P.BLIND,), _T.LINK_BACK, None, "heard again: going on"),
    Row(_HEARD_AGAIN, _T.LINK_BACK_HOLDING, _P.ENTERING, "heard again, held or off its course: rejoining"),
    Row(_HEARD_AGAIN, _T.LINK_BACK_HOMEWARD, _P.TAKING_BACK, "heard again, held or off its way home: rejoining"),
    Row(_HEARD_AGAIN, _T.LINK_BACK_RETURNING, _P.VEHICLE_RETURN, "heard again, on its way back"),
    Row((_P.BLIND,), _T.RETURN, _P.VEHICLE_RETURN, "called back by the operator"),
    Row((_P.BLIND,), _T.DISARMED, _P.ABORTED, "heard again, disarmed"),
    Row((_P.BLIND,), _T.TIMED_OUT, _P.ABORTED, "the vehicle was never heard again"),
    Row(
        (
            _P.CHECKING_ALOFT,
            _P.TAKING_OFF,
            *_AUTO,
            _P.VEHICLE_RETURN,
            _P.LANDING,
            _P.RETURN_PAUSED,
            _P.HANDING_OVER,
            _P.OVERRIDDEN,
        ),
        _T.LINK_GONE,
        _P.ABORTED,
        "the vehicle was never heard again",
    ),
    # The uploaded mission.
    Row((_P.AUTO_MISSION,), _T.PAUSE, _P.AUTO_HOLD, "paused by the operator"),
    Row((_P.AUTO_HOLD,), _T.RESUME, _P.AUTO_MISSION, "resumed by the operator"),
    Row((_P.AUTO_MISSION,), _T.EXPLORED, _P.VEHICLE_RETURN, "the mission is done"),
    Row((_P.AUTO_MISSION,), _T.EXPLORED_LAND, _P.LANDING, "the mission is done"),
    Row((_P.AUTO_MISSION,), _T.EXPLORED_HOLD, _P.HANDING_OVER, "the mission is done"),
    Row((_P.AUTO_MISSION,), _T.DISARMED, _P.LANDED, "on the ground, disarmed"),
    Row((_P.AUTO_MISSION,), _T.TOO_CLOSE, _P.VEHICLE_RETURN, "closer to an obstacle than allowed"),
    Row((_P.AUTO_MISSION,), _T.TIMED_OUT, _P.VEHICLE_RETURN, "it took far longer than planned"),
    Row((_P.AUTO_MISSION,), _T.BLOCKED, _P.AUTO_HOLD, "new information blocks the mission"),
    Row((_P.AUTO_HOLD,), _T.MODE_TAKEN, _P.TAKING_BACK, "it stands before what blocks the mission"),
    Row(_AUTO, _T.BATTERY_LOW, _P.VEHICLE_RETURN, "the charge left is what the way home needs"),
    Row(_AUTO, _T.OUTSIDE, _P.VEHICLE_RETURN, "outside the fence"),
    Row(_AUTO, _T.RETURN, _P.VEHICLE_RETURN, "called back by the operator"),
    # Who is in control.
    Row(_OURS, _T.PILOT, _P.OVERRIDDEN, "the pilot changed the mode: we stop streaming and only watch"),
    Row(_OURS, _T.FAILSAFE, _P.OVERRIDDEN, "a failsafe of the vehicle acts: we stop streaming and only watch"),
    Row((_P.BLIND,), _T.PILOT, _P.OVERRIDDEN, "the pilot changed the mode: we only watch"),
    Row((_P.OVERRIDDEN,), _T.RESUME, _P.ENTERING, "the operator takes over again"),
    Row((_P.OVERRIDDEN,), _T.LAND, _P.LANDING, "the operator lets it land"),
    Row((_P.CHECKING_ALOFT, _P.OVERRIDDEN), _T.LEAVE, _P.ABORTED, "whoever is in control stays so"),
    Row((_P.CHECKING_ALOFT, _P.OVERRIDDEN), _T.DISARMED, _P.LANDED, "on the ground, disarmed"),
    Row(
        (*STREAMING, _P.HANDING_OVER),
        _T.DISARMED,
        _P.ABORTED,
        "the motors were disarmed in the air",
    ),
    Row((_P.LANDING, _P.VEHICLE_RETURN), _T.LEAVE, _P.ABORTED, "the operator leaves: the vehicle lands alone"),
)


def next_phase(phase: Phase, trigger: Trigger) -> Row | None:
    """The row that holds for a phase and a trigger; None: nothing changes."""
    return _ROWS.get((phase, trigger))


_ROWS = {(phase, row.trigger): row for row in TABLE for phase in row.phases}


def expected_modes(phase: Phase) -> frozenset[FlightMode]:
    """The modes a vehicle is in when nobody else took over; empty: any.

    What it was in when the phase began is tolerated besides, until the phase's own order is taken and shown.
    """
    match phase:
        case Phase.TAKING_OFF:
            return frozenset({FlightMode.TAKEOFF, FlightMode.EXTERNAL})
        case (
            Phase.ENTERING
            | Phase.TAKING_BACK
            | Phase.TRANSIT
            | Phase.FOLLOWING
            | Phase.HOLDING
            | Phase.TURNING_BACK
            | Phase.RETURNING
        ):
            return frozenset({FlightMode.EXTERNAL})
        case Phase.VEHICLE_RETURN:
            return frozenset({FlightMode.RETURN, FlightMode.LAND})
        case Phase.LANDING:
            return frozenset({FlightMode.LAND})
        case Phase.AUTO_MISSION:
            return frozenset({FlightMode.MISSION, FlightMode.RETURN, FlightMode.LAND})
        case Phase.AUTO_HOLD | Phase.RETURN_PAUSED | Phase.HANDING_OVER:
            return frozenset({FlightMode.HOLD})
        case _:
            return frozenset()


def order_of(phase: Phase) -> Command | None:
    """The command that belongs to a phase and is given until the vehicle takes it."""
    match phase:
        case Phase.ARMING:
            return Command.ARM
        case Phase.DISARMING:
            return Command.DISARM
        case Phase.TAKING_OFF:
            return Command.TAKE_OFF
        case Phase.ENTERING | Phase.TAKING_BACK:
            return Command.FOLLOW_SETPOINTS
        case Phase.VEHICLE_RETURN:
            return Command.RETURN
        case Phase.LANDING:
            return Command.LAND
        case Phase.AUTO_MISSION:
            return Command.START_MISSION
        case Phase.AUTO_HOLD | Phase.RETURN_PAUSED | Phase.HANDING_OVER:
            return Command.HOLD
        case _:
            return None
