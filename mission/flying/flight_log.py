"""A flight's log as arrays: what pictures, reports, the summary and a resumed flight are made from."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from mission.executive.phases import ON_COURSE, Phase
from mission.findings import Finding, InputError
from mission.flying.recorder import FORMAT, LOG_NAME, VERSION
from planner.trajectory import Trajectory

EXPLORING = (Phase.FOLLOWING.value, Phase.AUTO_MISSION.value)
_ON_COURSE = tuple(phase.value for phase in ON_COURSE)


@dataclasses.dataclass(frozen=True)
class FlightLog:
    """One flight, over all the times it was resumed.

    Attributes:
        header: The first header; empty where it is damaged.
        time_s: Flight clock of the telemetry, rising over resumptions, shape (time,).
        position_m: Shape (time, 3).
        velocity_mps: Shape (time, 3).
        yaw_rad: Heading, counter-clockwise from east, shape (time,).
        target_m: Where the course was, shape (time, 3); NaN where there was none.
        tilt_mps2: What the tilt accelerates east and north, shape (time, 2); NaN where it was not told.
        battery_fraction: Shape (time,); NaN where it was not told.
        phase: What the flight was doing, by sample.
        armed: Shape (time,).
        setpoint_s: Flight clock of the setpoints, shape (setpoint,).
        setpoint_curve_s: Time along the course, shape (setpoint,).
        setpoint_m: Shape (setpoint, 3).
        events: Every line that is neither telemetry nor a setpoint, in order.
        courses: The curves of the exploration, in order, with the flight clock at which each was taken.
        skipped: What could not be read, in words.
    """

    header: dict[str, Any]
    time_s: Float[np.ndarray, "time"]
    position_m: Float[np.ndarray, "time 3"]
    velocity_mps: Float[np.ndarray, "time 3"]
    yaw_rad: Float[np.ndarray, "time"]
    target_m: Float[np.ndarray, "time 3"]
    tilt_mps2: Float[np.ndarray, "time 2"]
    battery_fraction: Float[np.ndarray, "time"]
    phase: tuple[str, ...]
    armed: Bool[np.ndarray, "time"]
    setpoint_s: Float[np.ndarray, "setpoint"]
    setpoint_curve_s: Float[np.ndarray, "setpoint"]
    setpoint_m: Float[np.ndarray, "setpoint 3"]
    events: tuple[dict[str, Any], ...]
    courses: tuple[tuple[float, Trajectory], ...]
    skipped: tuple[str, ...] = ()

    def exploring(self) -> Bool[np.ndarray, "time"]:
        """Which samples of telemetry belong to the exploration."""
        return np.array([phase in EXPLORING for phase in self.phase], dtype=bool)

    def on_course(self) -> Bool[np.ndarray, "time"]:
        """Which samples of telemetry are of a vehicle that follows setpoints along a course."""
        return np.array([phase in _ON_COURSE for phase in self.phase], dtype=bool)

    def of_kind(self, kind: str) -> list[dict[str, Any]]:
        """The events of one kind, in order."""
        return [event for event in self.events if event["kind"] == kind]


def read_flight_log(folder: Path) -> FlightLog:
    """Read a flight's log: whatever is sound in it, and what had to be skipped.

    A kill tears a line, a power cut leaves zeros or takes a file, disks decay: none of it makes the rest worthless.

    Raises:
        InputError: The folder holds no log of this version.
    """
    path = folder / LOG_NAME
    try:
        lines = path.read_bytes().splitlines()
    except OSError as error:
        raise _refused(folder, f"cannot be read ({error}): give the folder that a flight wrote") from error
    records: list[dict[str, Any]] = []
    damaged: list[int] = []
    offset_s = latest_s = before_s = 0.0
    for number, line in enumerate(lines, start=1):
        record = _record(line)
        if record is None:
            damaged.append(number)
            # What a kill tore, and what was written behind it on the same line.
            if (record := _record(line[max(line.rfind(_BEGINS), 0) :])) is None:
                continue
        if record["kind"] == "header":
            _check_header(folder, record)
        if record["kind"] == "header" or record["t"] < before_s - _BACKWARDS_S:
            offset_s = latest_s
        before_s = record["t"]
        record["t"] += offset_s
        latest_s = max(latest_s, record["t"])
        records.append(record)
    if not records:
        raise _refused(folder, "holds nothing that a flight wrote: give the folder of a flight")
    skipped = []
    if damaged:
        skipped = [f"{len(damaged)} damaged lines of {LOG_NAME}, the first of them line {damaged[0]}"]
    return _assembled(folder, records, skipped)


def _record(line: bytes) -> dict[str, Any] | None:
    """A line of the log; None: it is damaged."""
    try:
        record = json.loads(line.decode("utf-8"))
        for name, sound in {"kind": _text, "t": _number, **_FIELDS.get(record["kind"], {})}.items():
            # Logs of earlier versions have not all of them.
            if not sound(record.setdefault(name, None)):
                return None
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return None
    record["t"] = float(record["t"])
    return record


def _text(value: object) -> bool:
    return isinstance(value, str)


def _truth(value: object) -> bool:
    return isinstance(value, bool)


def _number(value: object) -> bool:
    return isinstance(value, int | float) and math.isfinite(value)


def _count(value: object) -> bool:
    return isinstance(value, int)


def _number_or_none(value: object) -> bool:
    return value is None or _number(value)


def _place(value: object) -> bool:
    return isinstance(value, list) and len(value) == 3 and all(map(_number, value))


def _place_or_none(value: object) -> bool:
    return value is None or _place(value)


def _two_or_none(value: object) -> bool:
    return value is None or (isinstance(value, list) and len(value) == 2 and all(map(_number, value)))


_BEGINS = b'{"kind":"'
# No two lines of one flight are that far apart backwards: there a flight was resumed whose header is damaged.
_BACKWARDS_S = 10.0
# What is read of each kind of line, and what it must be.
_FIELDS: dict[str, dict[str, Callable[[object], bool]]] = {
    "telemetry": {
        "p": _place,
        "v": _place,
        "yaw": _number,
        "target": _place_or_none,
        "tilt": _two_or_none,
        "battery": _number_or_none,
        "phase": _text,
        "armed": _truth,
    },
    "setpoint": {"s": _number, "p": _place},
    "course": {"number": _count, "origin": _text, "start_s": _number, "end_s": _number},
    "phase": {"phase": _text},
    "progress": {"explored_s": _number},
    "say": {"text": _text, "warning": _truth},
    "replan": {"taken": _truth, "reason": _text},
}


def _check_header(folder: Path, record: dict[str, Any]) -> None:
    if record.get("format") != FORMAT or record.get("version") != VERSION:
        raise _refused(
            folder,
            f"is {record.get('format')} version {record.get('version')}; this program reads {FORMAT} version {VERSION}",
        )


def _assembled(folder: Path, records: list[dict[str, Any]], skipped: list[str]) -> FlightLog:
    telemetry = [record for record in records if record["kind"] == "telemetry"]
    setpoints = [record for record in records if record["kind"] == "setpoint"]
    events = tuple(record for record in records if record["kind"] not in ("telemetry", "setpoint"))
    courses: list[tuple[float, Trajectory]] = []
    for event in events:
        if event["kind"] != "course":
            continue
        try:
            courses.append((event["t"], read_course(folder / f"course-{event['number']:03d}.json")))
        except InputError as error:
            skipped.append(f"course {event['number']} ({error.findings[0].advice})")
            if event["origin"] == "slowed" and courses:
                # The same path over more time, and what was told since counts in that time.
                before = courses[-1][1]
                factor = (event["end_s"] - event["start_s"]) / before.duration_s
                courses.append((event["t"], before.slowed(factor)))
    return FlightLog(
        header=next((record for record in records if record["kind"] == "header"), {}),
        time_s=np.array([row["t"] for row in telemetry]),
        position_m=np.array([row["p"] for row in telemetry]).reshape(-1, 3),
        velocity_mps=np.array([row["v"] for row in telemetry]).reshape(-1, 3),
        yaw_rad=np.array([row["yaw"] for row in telemetry], dtype=float),
        target_m=np.array([row["target"] or [np.nan] * 3 for row in telemetry]).reshape(-1, 3),
        tilt_mps2=np.array([row["tilt"] or [np.nan] * 2 for row in telemetry]).reshape(-1, 2),
        battery_fraction=np.array(
            [np.nan if row["battery"] is None else row["battery"] for row in telemetry], dtype=float
        ),
        phase=tuple(row["phase"] for row in telemetry),
        armed=np.array([row["armed"] for row in telemetry], dtype=bool),
        setpoint_s=np.array([row["t"] for row in setpoints]),
        setpoint_curve_s=np.array([row["s"] for row in setpoints]),
        setpoint_m=np.array([row["p"] for row in setpoints]).reshape(-1, 3),
        events=events,
        courses=tuple(courses),
        skipped=tuple(skipped),
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
