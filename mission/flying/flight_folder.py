"""The folder a flight leaves, read back: the mission with what was pushed, the plan, the log; and what is drawn.

| file             | what                                                                  |
|------------------|-----------------------------------------------------------------------|
| mission.json     | the resolved mission                                                  |
| plan.json …      | the plan it began with, as `mission plan` writes it                   |
| course-NNN.json  | every curve that was flown, on the disk before it was                 |
| log.jsonl        | everything that happened (`mission.flying.recorder`)                         |
| inbox/           | what was pushed, and what became of it                                |
| summary.json     | what the flight came to                                               |
| flight.png, recording.rrd, report.html | the pictures                                    |
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
from pathlib import Path
from typing import Any

from mission.findings import Finding, InputError
from mission.flying.flight_log import FlightLog, read_flight_log
from mission.flying.intake import ANSWER_SUFFIX, INBOX, PUSHED_SUFFIX, TAKEN_SUFFIX, read_push, with_push
from mission.flying.recorder import SUMMARY_NAME
from mission.loading import Document, mission_from_document
from mission.mission_file import Mission
from mission.plan_file import read_plan_file
from mission.site.problem import options_from_mission, problem_from_mission
from planner.problem import Options, Problem
from planner.trajectory import Trajectory

MISSION_NAME = "mission.json"
PLAN_NAME = "plan.json"
PICTURE_NAME = "flight.png"


@dataclasses.dataclass(frozen=True)
class FlightFolder:
    """A flight as it lies on the disk.

    Attributes:
        path: The folder.
        mission: What was asked, with the obstacles that were pushed.
        problem: The same for the planner, with the information that was pushed.
        options: How it was planned.
        candidates: The proven alternatives it began with; empty where the plan is not there.
        log: What was flown.
        summary: What it came to; None: it did not end.
    """

    path: Path
    mission: Mission
    problem: Problem
    options: Options
    candidates: tuple[Trajectory, ...]
    log: FlightLog
    summary: dict[str, Any] | None


def read_flight_folder(path: Path) -> FlightFolder:
    """Read a flight back.

    Raises:
        InputError: The folder is not a flight's, or something in it was changed.
    """
    log = read_flight_log(path)
    mission = _mission_in(path)
    problem = problem_from_mission(mission)
    for name in sorted(answer.stem for answer in (path / INBOX).glob(f"*{ANSWER_SUFFIX}")):
        if _json_in(path / INBOX / f"{name}{ANSWER_SUFFIX}").get("accepted"):
            file = path / INBOX / f"{name}{TAKEN_SUFFIX}"
            if not file.exists():
                file = file.with_suffix(PUSHED_SUFFIX)
            push = read_push(file.name, file.read_text(encoding="utf-8"), mission, file.parent)
            mission, problem = with_push(mission, problem, push)
    candidates: tuple[Trajectory, ...] = ()
    if (path / PLAN_NAME).is_file():
        plan = read_plan_file(path / PLAN_NAME)
        others = (entry for index, entry in enumerate(plan.candidates) if entry.feasible and index != plan.selected)
        candidates = tuple(entry.spline.trajectory() for entry in others)
        began = plan.candidates[plan.selected].spline.trajectory()
        if not log.courses or log.courses[0][1].start_s > began.start_s:
            # What was flown first is what was planned, and stands here too.
            log = dataclasses.replace(log, courses=((0.0, began), *log.courses))
    summary = None
    with contextlib.suppress(InputError):
        # What it came to can be worked out again from the log.
        summary = _json_in(path / SUMMARY_NAME)
    return FlightFolder(path, mission, problem, options_from_mission(mission), candidates, log, summary)


def draw_outputs(flight: FlightFolder) -> list[Path]:
    """Draw everything that is drawn from a flight: the picture, the recording, the report.

    Returns:
        The files written.
    """
    from mission.flying.summary import summarize
    from mission.pictures.flight_picture import draw_flight
    from mission.report import write_report
    from mission.view import RECORDING_NAME, record_flight

    fastest_mps = flight.mission.vehicle.max_speed_mps
    summary = flight.summary or summarize(flight.log, flight.problem, flight.options, fastest_mps)
    picture, recording = flight.path / PICTURE_NAME, flight.path / RECORDING_NAME
    draw_flight(flight.log, flight.mission, flight.problem, summary, picture)
    record_flight(recording, flight.log, flight.mission, flight.problem, flight.candidates)
    report = write_report(flight.path, flight.log, summary, _json_in(flight.path / MISSION_NAME))
    return [picture, recording, report]


def _mission_in(path: Path) -> Mission:
    return mission_from_document(Document(str(path / MISSION_NAME), path.resolve(), _json_in(path / MISSION_NAME)))


def _json_in(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(str(path), [Finding("file", path.name, f"cannot be read: {error}")]) from error
    if not isinstance(data, dict):
        raise InputError(str(path), [Finding("file", path.name, "must hold one object")])
    return data
