"""The folder a flight leaves: what happened, in order, and the curves that were flown.

`log.jsonl` has one JSON object a line: a header with format and version, then what happened, in order, each with the
flight clock `t` and this machine's monotonic clock `host`. Whoever records waits for nothing: lines are written on a
thread of their own (`mission.flying.log_writer`) within moments, and are on the disk within a second. A curve is on the
disk before it is flown, and has its line when it is. After a kill everything but the last moments is there, after a
power cut everything but the last second (`mission.flying.flight_log` reads it back).

A full disk does not end a flight: lines are lost and counted, and when there is room again the log goes on behind them.
"""

from __future__ import annotations

import concurrent.futures
import dataclasses
import json
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mission.executive.course import CoursePoint
from mission.flying.log_writer import LogWriter, sync_folder, write_durably
from planner.gate import ProvenTrajectory
from sim_bridge.state import Setpoint, Vector, VehicleState

FORMAT = "ergonaut-log"
VERSION = 1
LOG_NAME = "log.jsonl"
SUMMARY_NAME = "summary.json"

JsonValue = Any


@dataclasses.dataclass(frozen=True)
class Kept:
    """A curve that is on the disk.

    Attributes:
        number: Of its file.
        trajectory: The curve.
    """

    number: int
    trajectory: ProvenTrajectory


class Recorder:
    """Writes the log of one flight.

    Args:
        folder: Where it goes; made if it is not there.
        header: What the header says besides format and version.
        goes_on: Whether it goes on behind the log of an earlier flight; otherwise there must be none.

    Raises:
        OSError: The folder cannot be written, or holds a flight already.
    """

    def __init__(self, folder: Path, header: Mapping[str, JsonValue], *, goes_on: bool = False) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        sync_folder(folder.parent)
        self.folder = folder
        self._lock = threading.Lock()
        self._next_number = 1 + max((_number(path) for path in folder.glob("course-*.json")), default=-1)
        first = _line("header", 0.0, {"format": FORMAT, "version": VERSION, **header})
        self._writer = LogWriter(folder / LOG_NAME, first, goes_on=goes_on)

    @property
    def fault(self) -> OSError | None:
        """Why the last line was not written; None: it was."""
        return self._writer.fault

    @property
    def lost_lines(self) -> int:
        """Lines that were not written."""
        return self._writer.lost_lines

    def write(self, kind: str, time_s: float, **fields: JsonValue) -> None:
        """Record something that happened; where that fails, `fault` says why and `lost_lines` how often it did.

        Args:
            kind: What it was.
            time_s: Flight clock.
            fields: Its particulars; finite numbers only.
        """
        self._writer.append(_line(kind, time_s, fields))

    def setpoint(self, time_s: float, point: CoursePoint, setpoint: Setpoint) -> None:
        """Record a setpoint as it leaves."""
        self.write(
            "setpoint",
            time_s,
            s=round(point.curve_s, 4),
            p=_rounded(setpoint.position_enu_m),
            v=_rounded(setpoint.velocity_enu_mps),
            a=_rounded(setpoint.acceleration_enu_mps2),
            yaw=round(setpoint.yaw_enu_rad, 4),
        )

    def telemetry(self, time_s: float, state: VehicleState, phase: str, target_m: Vector | None) -> None:
        """Record what the vehicle told, and where the course was at that moment."""
        self.write(
            "telemetry",
            time_s,
            vehicle_s=round(state.time_s, 4),
            phase=phase,
            p=_rounded(state.position_enu_m),
            v=_rounded(state.velocity_enu_mps),
            yaw=round(state.yaw_enu_rad, 4),
            mode=state.mode_name,
            armed=state.armed,
            landed=state.landed.name,
            tilt=None if state.tilt_enu_mps2 is None else _rounded(state.tilt_enu_mps2),
            battery=state.battery_fraction,
            failsafe=state.failsafe,
            target=None if target_m is None else _rounded(target_m),
        )

    def keep(self, trajectory: ProvenTrajectory) -> concurrent.futures.Future[Kept]:
        """Put a curve on the disk, which must come before it is flown; an OSError says that it is not there."""
        with self._lock:
            number = self._next_number
            self._next_number += 1
        kept: concurrent.futures.Future[Kept] = concurrent.futures.Future()

        def told(written: concurrent.futures.Future[None]) -> None:
            if (error := written.exception()) is not None:
                kept.set_exception(error)
            else:
                kept.set_result(Kept(number, trajectory))

        path = self.folder / f"course-{number:03d}.json"
        self._writer.do(lambda: write_durably(path, _curve(trajectory))).add_done_callback(told)
        return kept

    def course(self, time_s: float, kept: Kept, origin: str) -> None:
        """Record that a curve is flown from now on.

        Args:
            time_s: Flight clock.
            kept: The curve, which is on the disk.
            origin: Where it comes from: "plan", "resumed", "slowed", "replan".
        """
        curve = kept.trajectory
        self.write("course", time_s, number=kept.number, origin=origin, start_s=curve.start_s, end_s=curve.end_s)

    def put(self, path: Path, text: str) -> concurrent.futures.Future[None]:
        """Have another file written, without waiting for it."""
        return self._writer.do(lambda: write_durably(path, text))

    def close(self) -> None:
        """End the log."""
        self._writer.close()


def _line(kind: str, time_s: float, fields: Mapping[str, JsonValue]) -> bytes:
    stamps = {"kind": kind, "t": round(time_s, 4), "host": round(time.monotonic(), 4)}
    return f"{json.dumps({**stamps, **fields}, allow_nan=False, separators=(',', ':'))}\n".encode()


def _curve(trajectory: ProvenTrajectory) -> str:
    curve: dict[str, JsonValue] = {
        "control_points_enu_m": trajectory.control_points_m.tolist(),
        "knot_interval_s": trajectory.knot_interval_s,
        "start_s": trajectory.start_s,
    }
    if trajectory.heading_control_rad is not None:
        curve["heading_control_enu_rad"] = trajectory.heading_control_rad.tolist()
    return json.dumps(curve)


def _number(path: Path) -> int:
    digits = path.stem.removeprefix("course-")
    return int(digits) if digits.isdecimal() else -1


def _rounded(vector: tuple[float, ...]) -> list[float]:
    return [round(value, 4) for value in vector]
