"""`fly`: a plan in, a flown exploration out, with a folder that holds everything about it."""

from __future__ import annotations

import contextlib
import dataclasses
import datetime
import enum
import gc
import json
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import numpy as np

from mission import keys
from mission.belief import Belief
from mission.clock import FlightClock
from mission.events import Assignment, FlightEnd, FlightMethod
from mission.executive import Executive
from mission.fence import autopilot_fence
from mission.flight_folder import MISSION_NAME, draw_outputs, read_flight_folder
from mission.flight_log import read_flight_log
from mission.flight_loop import FlightLoop
from mission.flight_progress import Watcher
from mission.ground import Ground
from mission.intake import Intake
from mission.mission_file import Mission
from mission.monitors import Energy, Monitors
from mission.phases import Phase
from mission.plan_output import plan_file_of, write_outputs
from mission.planning import Planned
from mission.preflight import disk_problems
from mission.recorder import SUMMARY_NAME, Recorder, write_durably
from mission.replan_cycle import ReplanCycle, Schedule
from mission.replanning import Replanner
from mission.streamer import Streamer
from mission.summary import summarize
from mission.uploads import upload_plan, upload_safety
from planner.polygon import KeepIn
from planner.problem import Problem
from sim_bridge.frames import geodetic_from_enu
from sim_bridge.link import Link
from sim_bridge.link_autopilot import Autopilot
from sim_bridge.link_commands import OWN_SYSTEM

_SIM = "sim"
_FENCE_TOLERANCE_M = 1.0
_LEAST_CLEARANCE_SHARE = 0.3
_TRACK_ERROR_S = 1.0
_LEAST_TRACK_ERROR_M = 0.5
_MOST_TRACK_ERROR_M = 5.0
_REPLAN_LIMIT_HOST_S = 5.0
_HEARD_WITHIN_S = 30.0
_CENTI = 100.0
_GROUND_STATION_TIMEOUT_S = 5.0


class Outcome(enum.Enum):
    """How a flight ended."""

    DONE = "explored and landed"
    EARLY = "landed before the exploration was done"
    HANDED_OVER = "explored and handed over"
    ABORTED = "aborted"


@dataclasses.dataclass(frozen=True)
class Flown:
    """A flight that has ended.

    Attributes:
        outcome: How.
        interrupted: Whether the operator interrupted it.
        summary: What it came to, as `summary.json` has it.
        folder: Everything about it.
        files: What was written for people and other programs.
    """

    outcome: Outcome
    interrupted: bool
    summary: dict[str, Any]
    folder: Path
    files: tuple[str, ...]


@dataclasses.dataclass(frozen=True)
class FlightSettings:
    """How a plan is flown.

    Attributes:
        link: "sim", or the vehicle's address.
        method: Setpoints, or an uploaded mission.
        speed: How fast the built-in vehicle's time runs.
        folder: Where everything about the flight goes.
        from_s: Curve time at which the exploration begins, in a flight that is resumed.
        flown_m: What was explored before, in a flight that is resumed; None: nothing.
    """

    link: str
    method: FlightMethod
    speed: float
    folder: Path
    from_s: float | None = None
    flown_m: np.ndarray | None = None

    @property
    def resumed(self) -> bool:
        """Whether it goes on with an earlier flight."""
        return self.flown_m is not None


def fly(planned: Planned, *, folder: Path | None = None, speed: float = 1.0, watcher: Watcher | None = None) -> Flown:
    """Fly a plan as its mission says.

    Args:
        planned: The mission and its plan, with something to fly.
        folder: Where everything about the flight goes; None: a new folder below `flights`.
        speed: How fast the built-in vehicle's time runs.
        watcher: Told what happens; None: nobody is.

    Returns:
        How it ended.

    Raises:
        ValueError: There is nothing to fly.
        LinkError: The vehicle cannot be reached.
        OSError: The folder cannot be written.
    """
    settings = settings_of(planned.mission, folder=folder or default_folder(planned.mission), speed=speed)
    return fly_planned(planned, settings, watcher or Watcher())


def settings_of(mission: Mission, *, folder: Path, speed: float = 1.0) -> FlightSettings:
    """How a mission asks to be flown."""
    return FlightSettings(mission.link.address, FlightMethod(mission.flight.mode), speed, folder)


def default_folder(mission: Mission) -> Path:
    """`flights/NAME-TIME` in the working directory."""
    name = "".join(letter if letter.isalnum() else "-" for letter in mission.name.lower())
    return Path("flights") / f"{name}-{datetime.datetime.now():%Y%m%d-%H%M%S}"


def fly_planned(planned: Planned, settings: FlightSettings, watcher: Watcher) -> Flown:
    """Fly a plan, to the landed vehicle or its own safe mode.

    Args:
        planned: The mission and its plan, with something to fly.
        settings: How.
        watcher: Told what happens.

    Returns:
        How it ended.

    Raises:
        ValueError: There is nothing to fly.
        LinkError: The vehicle cannot be reached.
        OSError: The folder cannot be written.
    """
    mission, problem = planned.mission, planned.problem
    exploration = planned.plan.best.trajectory
    recorder = Recorder(settings.folder, _header(planned, settings))
    files: list[Path] = []
    if not settings.resumed:
        write_durably(settings.folder / MISSION_NAME, json.dumps(mission.model_dump(mode="json", exclude_none=True)))
        files = write_outputs(planned, settings.folder)
    recorder.course(0.0, exploration, "resumed" if settings.resumed else "plan")
    replanner = Replanner() if mission.replanning.enabled and settings.method is FlightMethod.OFFBOARD else None
    rate = settings.speed if settings.link == _SIM else 1.0
    clock = FlightClock(time.monotonic(), rate)
    belief = Belief(problem, settings.flown_m)
    assignment = assignment_of(planned, settings.method)
    energy = energy_of(mission, problem)
    executive = Executive(assignment, monitors_of(mission, belief, energy), from_s=settings.from_s, patience=rate)
    loop: FlightLoop | None = None
    try:
        with _vehicle(mission, settings, watcher, clock) as link:
            streamer = Streamer(clock, mission.flight.stream_rate_hz, link.stream, link.close_stream, recorder.setpoint)
            cycle = None
            if replanner is not None:
                cycle = ReplanCycle(replanner, belief, planned.options, _schedule(mission), planned.plan)
            ground = Ground(
                mission,
                belief,
                link,
                energy,
                Intake(settings.folder, mission),
                assignment,
                lambda: _prepare(link, planned, settings),
                lambda: cycle is None or cycle.warm,
                settings.from_s,
            )
            loop = FlightLoop(executive, link, clock, streamer, recorder, belief, cycle, ground, watcher)
            try:
                with _interrupting(loop), _without_long_pauses(), keys.listening(loop.tell) as at_terminal:
                    if at_terminal:
                        watcher.say(keys.HELP, warning=False)
                    loop.run()
            finally:
                streamer.close()
                gaps_s = np.array(link.setpoint_gaps_s())
                reboots, refused = link.reboots, link.refused_messages
    finally:
        if replanner is not None:
            replanner.close()
        recorder.close()
    summary = {
        "outcome": outcome_of(executive).value,
        "landed": executive.phase is Phase.LANDED,
        "explored": executive.explored,
        "link": settings.link,
        "mode": settings.method.value,
        **summarize(read_flight_log(settings.folder), belief.problem, planned.options, mission.vehicle.max_speed_mps),
        "offboard_lost": executive.offboard_lost,
        "setpoint_gap_p999_s": float(np.quantile(gaps_s, 0.999)) if len(gaps_s) else None,
        "setpoint_gap_max_s": float(gaps_s.max()) if len(gaps_s) else None,
        "vehicle_reboots": reboots,
        "messages_refused": refused,
        "why": executive.why,
    }
    try:
        write_durably(settings.folder / SUMMARY_NAME, json.dumps(summary, indent=1) + "\n")
        watcher.say("drawing", warning=False)
        files += draw_outputs(read_flight_folder(settings.folder))
    except OSError as error:
        # The flight is over and came out as it did, whether or not there is room to draw it.
        watcher.say(f"the summary or its pictures cannot be written: {error}", warning=True)
    watcher.close()
    return Flown(outcome_of(executive), loop.interrupted, summary, settings.folder, tuple(map(str, files)))


def _prepare(link: Link, planned: Planned, settings: FlightSettings) -> int | None:
    """What must be done before arming, uploads above all; the number of the last waypoint of an uploaded mission.

    Raises:
        LinkError: The vehicle does not hold what was sent.
        ValueError: More items than the autopilot holds, or no room for the log.
    """
    if problems := disk_problems(settings.folder):
        raise ValueError("; ".join(problems))
    plan = plan_file_of(planned)
    upload_safety(link, plan)
    return upload_plan(link, plan) if settings.method is FlightMethod.MISSION else None


def outcome_of(executive: Executive) -> Outcome:
    """How a finished flight ended."""
    match executive.phase:
        case Phase.LANDED:
            return Outcome.DONE if executive.explored else Outcome.EARLY
        case Phase.HANDED_OVER:
            return Outcome.HANDED_OVER
        case _:
            return Outcome.ABORTED


def assignment_of(planned: Planned, method: FlightMethod) -> Assignment:
    """What the executive is given to do."""
    mission, limits = planned.mission, planned.problem.limits
    return Assignment(
        exploration=planned.plan.best.trajectory,
        takeoff_altitude_m=mission.takeoff_altitude_m,
        end=FlightEnd(mission.flight.end),
        method=method,
        max_acceleration_mps2=limits.max_acceleration_mps2,
        max_yaw_rate_radps=limits.max_yaw_rate_radps,
        max_climb_mps=limits.max_climb_mps,
        ready_timeout_s=mission.link.ready_timeout_s,
    )


def energy_of(mission: Mission, problem: Problem) -> Energy:
    """What flying costs."""
    limits = problem.limits
    return Energy(
        mission.vehicle.endurance_s,
        mission.flight.reserve_fraction,
        limits.max_speed_mps,
        limits.max_climb_mps,
        limits.max_descent_mps,
    )


def monitors_of(mission: Mission, belief: Belief, energy: Energy) -> Monitors:
    """What telemetry is held against: always what is known now, pushed obstacles too."""
    keep_in = KeepIn.of(np.array(autopilot_fence(mission.site)))
    ceiling_m = mission.site.box_m[1][2] + mission.site.fence_margin_m
    radius_m = mission.vehicle.radius_m

    def fence_distance_m(place: np.ndarray) -> float:
        return min(float(keep_in.distance(place[None, :2])[0]), ceiling_m - float(place[2]))

    return Monitors(
        clearance_m=lambda place: float(belief.problem.obstacles.distance(place[None])[0]) - radius_m,
        least_clearance_m=_LEAST_CLEARANCE_SHARE * mission.flight.clearance_margin_m,
        fence_distance_m=fence_distance_m,
        fence_tolerance_m=_FENCE_TOLERANCE_M,
        max_track_error_m=float(
            np.clip(_TRACK_ERROR_S * mission.vehicle.max_speed_mps, _LEAST_TRACK_ERROR_M, _MOST_TRACK_ERROR_M)
        ),
        energy=energy,
        cruise_height_m=mission.takeoff_altitude_m,
    )


def _schedule(mission: Mission) -> Schedule:
    return Schedule(mission.replanning.period_s, min(mission.planner.time_limit_s, _REPLAN_LIMIT_HOST_S))


def _header(planned: Planned, settings: FlightSettings) -> dict[str, Any]:
    origin = planned.mission.site.origin
    return {
        "name": planned.mission.name,
        "origin": origin.model_dump(),
        "link": settings.link,
        "mode": settings.method.value,
        "speed": settings.speed,
        "resumed": settings.resumed,
        "started": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
    }


@contextlib.contextmanager
def _vehicle(mission: Mission, settings: FlightSettings, watcher: Watcher, clock: FlightClock) -> Iterator[Link]:
    """The vehicle, connected; the built-in one is started and ended."""
    with contextlib.ExitStack() as stack:
        address = settings.link
        if address == _SIM:
            from sim_bridge.airframes import AirframeKind
            from sim_bridge.simulator import spawn

            small = mission.vehicle.preset == "crazyflie"
            simulator = spawn(
                geodetic_from_enu(mission.home_enu_m, mission.site.origin.point()),
                speed=settings.speed,
                parameters=_as_told(mission, settings.speed),
                endurance_s=mission.vehicle.endurance_s,
                autopilot=Autopilot[mission.vehicle.autopilot.upper()],
                kind=AirframeKind.CRAZYFLIE if small else AirframeKind.QUADROTOR,
                # Indoors a vehicle knows its place to centimetres, under GPS to the better part of a metre.
                wander_m=0.02 if small else 0.8,
            )
            stack.callback(simulator.stop)
            address = simulator.address
        watcher.say(f"connecting to {address}", warning=False)
        link = Link.connect(
            address,
            mission.site.origin.point(),
            vehicle_system=mission.link.system_id,
            key_file=mission.link.signing_key_file,
            timeout_s=min(_HEARD_WITHIN_S, mission.link.ready_timeout_s),
            on_state=clock.hear,
        )
        stack.callback(link.close)
        yield link


def _as_told(mission: Mission, speed: float) -> tuple[tuple[str, float], ...]:
    """The built-in vehicle's parameters, set as docs/flying.md tells a team to set a real one's."""
    vehicle = mission.vehicle
    match Autopilot[vehicle.autopilot.upper()]:
        case Autopilot.PX4:
            return (
                ("COM_OBL_RC_ACT", 5.0),
                ("COM_LOW_BAT_ACT", 3.0),
                ("MPC_XY_VEL_MAX", vehicle.max_speed_mps),
                ("MPC_Z_VEL_MAX_UP", vehicle.max_climb_mps),
                ("MPC_Z_VEL_MAX_DN", vehicle.max_descent_mps),
            )
        case Autopilot.ARDUPILOT:
            return (
                ("FENCE_ENABLE", 1.0),
                ("FENCE_TYPE", 4.0),
                ("FS_GCS_ENABLE", 1.0),
                ("SYSID_MYGCS", float(OWN_SYSTEM)),
                # Heartbeats come once a second of this machine's time, however fast the vehicle's runs.
                ("FS_GCS_TIMEOUT", _GROUND_STATION_TIMEOUT_S * max(1.0, speed)),
                ("BATT_FS_LOW_ACT", 2.0),
                ("WPNAV_SPEED", _CENTI * vehicle.max_speed_mps),
                ("WPNAV_SPEED_UP", _CENTI * vehicle.max_climb_mps),
                ("WPNAV_SPEED_DN", _CENTI * vehicle.max_descent_mps),
            )


@contextlib.contextmanager
def _without_long_pauses() -> Iterator[None]:
    """Keep the garbage collector from looking at everything that was made before the flight.

    With the planner's libraries loaded a full collection stops every thread for a third of a second; what the flight
    itself makes is little.
    """
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


@contextlib.contextmanager
def _interrupting(loop: FlightLoop) -> Iterator[None]:
    """Ctrl-C and a polite kill tell the flight to come back, instead of ending the process in the air."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        loop.interrupt()

    before: dict[signal.Signals, Any] = {
        number: signal.signal(number, interrupt) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
