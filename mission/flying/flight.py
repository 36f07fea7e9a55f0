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
from mission.checks import findings_for_flying
from mission.executive.events import FlightMethod, MissionPlace
from mission.executive.executive import Executive
from mission.executive.phases import Phase
from mission.findings import Finding, InputError
from mission.flying.belief import Belief
from mission.flying.clock import FlightClock
from mission.flying.connecting import SIM, vehicle_of
from mission.flying.detached_watcher import DetachedWatcher
from mission.flying.flight_folder import MISSION_NAME, draw_outputs, read_flight_folder
from mission.flying.flight_log import read_flight_log
from mission.flying.flight_loop import FlightLoop
from mission.flying.flight_progress import Watcher
from mission.flying.flight_rules import assignment_of, energy_of, leaned_against_per_s, monitors_of
from mission.flying.folder_claim import claimed
from mission.flying.ground import Ground
from mission.flying.intake import Intake
from mission.flying.log_writer import write_durably
from mission.flying.preflight import disk_problems
from mission.flying.pushes import Pushes
from mission.flying.recorder import SUMMARY_NAME, Recorder
from mission.flying.replan_cycle import ReplanCycle, Schedule
from mission.flying.replanning import Replanner
from mission.flying.streamer import Streamer
from mission.flying.summary import summarize
from mission.flying.uploads import upload_plan, upload_safety
from mission.mission_file import Mission
from mission.plan_output import plan_file_of, write_outputs
from mission.planning import Planned
from sim_bridge.link.client import Link

_REPLAN_LIMIT_HOST_S = 5.0


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
        flown_yaw_rad: Headings there; None: not known.
        only_home: Whether everything was explored before, and a vehicle that flies is only to be brought home.
    """

    link: str
    method: FlightMethod
    speed: float
    folder: Path
    from_s: float | None = None
    flown_m: np.ndarray | None = None
    flown_yaw_rad: np.ndarray | None = None
    only_home: bool = False

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
        ValueError: There is nothing to fly, or the vehicle is one that can only be planned for.
        LinkError: The vehicle cannot be reached.
        InputError: The folder cannot be written.
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

    Nobody else flies into its folder meanwhile.

    Args:
        planned: The mission and its plan, with something to fly.
        settings: How.
        watcher: Told what happens.

    Returns:
        How it ended.

    Raises:
        ValueError: There is nothing to fly, or the vehicle is one that can only be planned for.
        LinkError: The vehicle cannot be reached.
        InputError: The folder cannot be written, or is another flight's.
    """
    if reasons := findings_for_flying(planned.mission):
        raise InputError(planned.mission.name, reasons)
    with claimed(settings.folder, make=True):
        return _flown(planned, settings, watcher)


def _flown(planned: Planned, settings: FlightSettings, watcher: Watcher) -> Flown:
    mission, problem = planned.mission, planned.problem
    recorder, files = _begun(planned, settings)
    watcher = DetachedWatcher(watcher)
    replans = mission.replanning.enabled and settings.method is FlightMethod.OFFBOARD and not settings.only_home
    replanner = Replanner() if replans else None
    rate = settings.speed if settings.link == SIM else 1.0
    clock = FlightClock(time.monotonic(), rate)
    belief = Belief(problem, settings.flown_m, settings.flown_yaw_rad)
    assignment = assignment_of(planned, settings.method, settings.resumed, only_home=settings.only_home)
    energy, leaned = energy_of(mission, problem), leaned_against_per_s(mission.vehicle)
    executive = Executive(
        assignment,
        monitors_of(mission, belief, energy),
        lambda: belief.problem,
        from_s=settings.from_s,
        patience=rate,
    )
    loop: FlightLoop | None = None
    try:
        with vehicle_of(planned, settings.link, settings.speed, watcher, clock) as link:
            streamer = Streamer(
                clock,
                mission.flight.stream_rate_hz,
                link.stream,
                link.open_stream,
                link.close_stream,
                recorder.setpoint,
                leaned or 0.0,
            )
            cycle = None
            if replanner is not None:
                cycle = ReplanCycle(replanner, belief, planned.options, _schedule(mission), planned.plan)
            ground = Ground(
                mission,
                belief,
                link,
                energy,
                Pushes(mission, belief, Intake(settings.folder, mission), executive.consequence),
                assignment,
                lambda aloft: _prepare(link, planned, settings, aloft),
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
                ground.close()
                streamer.close()
                gaps_s = np.array(link.setpoint_gaps_s())
                reboots, refused = link.reboots, link.refused_messages
    except BaseException:
        watcher.close()
        raise
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
        "drag_leaned_against_per_s": leaned if settings.method is FlightMethod.OFFBOARD else None,
        "offboard_lost": executive.offboard_lost,
        "setpoint_gap_p999_s": float(np.quantile(gaps_s, 0.999)) if len(gaps_s) else None,
        "setpoint_gap_max_s": float(gaps_s.max()) if len(gaps_s) else None,
        "vehicle_reboots": reboots,
        "messages_refused": refused,
        "log_lines_lost": recorder.lost_lines,
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


def _begun(planned: Planned, settings: FlightSettings) -> tuple[Recorder, list[Path]]:
    """The flight's folder with all that is known before it: the log, and the files that were written.

    Raises:
        InputError: The folder cannot be written.
    """
    mission, folder = planned.mission, settings.folder
    try:
        recorder = Recorder(folder, _header(planned, settings), goes_on=settings.resumed)
        files: list[Path] = []
        if not settings.resumed:
            write_durably(folder / MISSION_NAME, json.dumps(mission.model_dump(mode="json", exclude_none=True)))
            files = write_outputs(planned, folder)
        kept = recorder.keep(planned.plan.best.proven).result()
        recorder.course(0.0, kept, "resumed" if settings.resumed else "plan")
    except OSError as error:
        finding = Finding("--out", str(folder), f"cannot be written: {error.strerror or error}; give another folder")
        raise InputError(str(folder), [finding]) from error
    return recorder, files


def _prepare(link: Link, planned: Planned, settings: FlightSettings, aloft: bool) -> tuple[MissionPlace, ...]:
    """What must be done before arming, uploads above all; where an uploaded mission leads.

    A mission uploaded to a vehicle that is flying one would be flown at once, whoever has the vehicle: what remains of
    a flight that is resumed in the air is flown by setpoints.

    Raises:
        LinkError: The vehicle does not hold what was sent.
        ValueError: More items than the autopilot holds, or no room for the log.
    """
    if problems := disk_problems(settings.folder):
        raise ValueError("; ".join(problems))
    plan = plan_file_of(planned)
    upload_safety(link, plan)
    return upload_plan(link, plan) if settings.method is FlightMethod.MISSION and not aloft else ()


def outcome_of(executive: Executive) -> Outcome:
    """How a finished flight ended."""
    match executive.phase:
        case Phase.LANDED:
            return Outcome.DONE if executive.explored else Outcome.EARLY
        case Phase.HANDED_OVER:
            return Outcome.HANDED_OVER
        case _:
            return Outcome.ABORTED


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
    """Ctrl-C and a polite kill tell the flight to come back, instead of ending the process in the air.

    A terminal that goes away (a dropped connection to this computer) says nothing about the flight: it goes on.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_signal: int, _frame: FrameType | None) -> None:
        loop.interrupt()

    def hang_up(_signal: int, _frame: FrameType | None) -> None:
        loop.hang_up()

    handlers = {signal.SIGINT: interrupt, signal.SIGTERM: interrupt, signal.SIGHUP: hang_up}
    before: dict[signal.Signals, Any] = {number: signal.signal(number, handler) for number, handler in handlers.items()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
