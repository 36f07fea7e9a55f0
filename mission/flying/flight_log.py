"""A flight's log as arrays: what pictures, reports, the summary and a resumed flight are made from."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mission.executive.phases import Phase
from mission.findings import Finding, InputError
from mission.flying.recorder import FORMAT, LOG_NAME, VERSION
from planner.trajectory import Trajectory

EXPLORING = (Phase.FOLLOWING.value, Phase.AUTO_MISSION.value)


@dataclasses.dataclass(frozen=True)
class FlightLog:
    """One flight, over all the times it was resumed.

    Attributes:
        header: The first header.
        time_s: Flight clock of the telemetry, rising over resumptions, shape (time,).
        position_m: Shape (time, 3).
        velocity_mps: Shape (time, 3).
        yaw_rad: Heading, counter-clockwise from east, shape (time,).
        target_m: Where the course was, shape (time, 3); NaN where there was none.
        battery_fraction: Shape (time,); NaN where it was not told.
        phase: What the flight was doing, by sample.
        armed: Shape (time,).
        setpoint_s: Flight clock of the setpoints, shape (setpoint,).
        setpoint_curve_s: Time along the course, shape (setpoint,).
        setpoint_m: Shape (setpoint, 3).
        events: Every line that is neither telemetry nor a setpoint, in order.
        courses: The curves of the exploration, in order, with the flight clock at which each was taken.
    """

    header: dict[str, Any]
    time_s: Float[np.ndarray, "time"]
    position_m: Float[np.ndarray, "time 3"]
    velocity_mps: Float[np.ndarray, "time 3"]
    yaw_rad: Float[np.ndarray, "time"]
    target_m: Float[np.ndarray, "time 3"]
    battery_fraction: Float[np.ndarray, "time"]
    phase: tuple[str, ...]
    armed: Bool[np.ndarray, "time"]
    setpoint_s: Float[np.ndarray, "setpoint"]
    setpoint_curve_s: Float[np.ndarray, "setpoint"]
    setpoint_m: Float[np.ndarray, "setpoint 3"]
    events: tuple[dict[str, Any], ...]
    courses: tuple[tuple[float, Trajectory], ...]

    def exploring(self) -> Bool[np.ndarray, "time"]:
        """Which samples of telemetry belong to the exploration."""
        return np.array([phase in EXPLORING for phase in self.phase], dtype=bool)

    def of_kind(self, kind: str) -> list[dict[str, Any]]:
        """The events of one kind, in order."""
        return [event for event in self.events if event["kind"] == kind]


def read_flight_log(folder: Path) -> FlightLog:
    """Read a flight's log; a last line that a crash cut short is left out.

    Raises:
        InputError: The folder holds no log of this version.
    """
    path = folder / LOG_NAME
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise _refused(folder, f"cannot be read ({error}): give the folder that a flight wrote") from error
    records: list[dict[str, Any]] = []
    offset_s = 0.0
    for number, line in enumerate(lines, start=1):
        try:
            record = json.loads(line)
        except json.JSONDecodeError as error:
            if number == len(lines):
                break
            # A killed process leaves a torn line, and the resumed flight writes on behind it.
            if number < len(lines) and '"kind":"header"' in line:
                record = json.loads(line[line.index('{"kind":"header"') :])
            else:
                raise _refused(folder, f"line {number} is not JSON ({error.msg}): the log was changed") from error
        if record.get("kind") == "header":
            _check_header(folder, record)
            offset_s = max((earlier["t"] for earlier in records), default=0.0)
        record["t"] = float(record["t"]) + offset_s
        records.append(record)
    if not records or records[0].get("kind") != "header":
        raise _refused(folder, "does not begin with a header: it is not a flight's log")
    return _assembled(folder, records)


def _check_header(folder: Path, record: dict[str, Any]) -> None:
    if record.get("format") != FORMAT or record.get("version") != VERSION:
        raise _refused(
            folder,
            f"is {record.get('format')} version {record.get('version')}; this program reads {FORMAT} version {VERSION}",
        )


def _assembled(folder: Path, records: list[dict[str, Any]]) -> FlightLog:
    telemetry = [record for record in records if record["kind"] == "telemetry"]
    setpoints = [record for record in records if record["kind"] == "setpoint"]
    events = tuple(record for record in records if record["kind"] not in ("telemetry", "setpoint"))
    courses = tuple(
        (event["t"], read_course(folder / f"course-{event['number']:03d}.json"))
        for event in events
        if event["kind"] == "course"
    )
    return FlightLog(
        header=records[0],
        time_s=np.array([row["t"] for row in telemetry]),
        position_m=np.array([row["p"] for row in telemetry]).reshape(-1, 3),
        velocity_mps=np.array([row["v"] for row in telemetry]).reshape(-1, 3),
        yaw_rad=np.array([row["yaw"] for row in telemetry], dtype=float),
        target_m=np.array([row["target"] or [np.nan] * 3 for row in telemetry]).reshape(-1, 3),
        battery_fraction=np.array(
            [np.nan if row["battery"] is None else row["battery"] for row in telemetry], dtype=float
        ),
        phase=tuple(row["phase"] for row in telemetry),
        armed=np.array([row["armed"] for row in telemetry], dtype=bool),
        setpoint_s=np.array([row["t"] for row in setpoints]),
        setpoint_curve_s=np.array([row["s"] for row in setpoints]),
        setpoint_m=np.array([row["p"] for row in setpoints]).reshape(-1, 3),
        events=events,
        courses=courses,
    )


def read_course(path: Path) -> Trajectory:
    """Read a curve that a flight wrote.

    Raises:
        InputError: It cannot be read.
    """
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        heading = data.get("heading_control_enu_rad")
        return Trajectory(
            np.array(data["control_points_enu_m"]),
            float(data["knot_interval_s"]),
            float(data["start_s"]),
            None if heading is None else np.array(heading),
        )
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise InputError(str(path), [Finding("file", path.name, f"is not a course of a flight: {error}")]) from error


def _refused(folder: Path, advice: str) -> InputError:
    return InputError(str(folder), [Finding(LOG_NAME, "", advice)])
