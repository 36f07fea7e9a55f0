"""The folder a flight leaves, written ahead of what it records.

`log.jsonl` has one JSON object a line: a header with format and version, then what happened, in order, each with the
flight clock `t` and this machine's monotonic clock `host`. A line is handed to the system before the flight acts on it,
and plans are on the disk before they are flown: after a crash or a kill everything up to the last line is there
(`mission.flying.flight_log` reads it back).

A full disk does not end a flight: lines are lost and counted, and when there is room again the log goes on behind them.
"""

from __future__ import annotations

import json
import os
import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mission.executive.course import CoursePoint
from planner.trajectory import Trajectory
from sim_bridge.state import Setpoint, Vector, VehicleState

FORMAT = "ergonaut-log"
VERSION = 1
LOG_NAME = "log.jsonl"
SUMMARY_NAME = "summary.json"

JsonValue = Any


class Recorder:
    """Writes the log of one flight.

    Args:
        folder: Where it goes; made if it is not there.
        header: What the header says besides format and version.

    Raises:
        OSError: The folder cannot be written.
    """

    def __init__(self, folder: Path, header: Mapping[str, JsonValue]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._lock = threading.Lock()
        # Unbuffered: a line is with the system when `write` returns, and what was not written is known.
        self._file = (folder / LOG_NAME).open("ab", buffering=0)
        self._torn = b""
        self.lost_lines = 0
        self.fault: OSError | None = None
        self.plans = len(list(folder.glob("course-*.json")))
        self.write("header", 0.0, format=FORMAT, version=VERSION, **header)
        if self.fault is not None:
            self._file.close()
            raise self.fault

    def write(self, kind: str, time_s: float, **fields: JsonValue) -> None:
        """Record something that happened; where that fails, `fault` says why and `lost_lines` how often it did.

        Args:
            kind: What it was.
            time_s: Flight clock.
            fields: Its particulars; finite numbers only.
        """
        stamps = {"kind": kind, "t": round(time_s, 4), "host": round(time.monotonic(), 4)}
        line = json.dumps({**stamps, **fields}, allow_nan=False, separators=(",", ":"))
        with self._lock:
            if not self._file.closed:
                self._append(f"{line}\n".encode())

    def _append(self, line: bytes) -> None:
        data = self._torn + line
        try:
            written = self._file.write(data)
        except OSError as error:
            self.lost_lines += 1
            self.fault = error
            return
        # A line that was cut short goes on where it was cut, or everything behind it could not be read.
        self._torn = data[written:]
        if not self._torn:
            self.fault = None

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
            battery=state.battery_fraction,
            failsafe=state.failsafe,
            target=None if target_m is None else _rounded(target_m),
        )

    def course(self, time_s: float, trajectory: Trajectory, origin: str) -> int:
        """Put a curve on the disk before it is flown.

        Args:
            time_s: Flight clock.
            trajectory: The curve.
            origin: Where it comes from: "plan", "replan".

        Returns:
            Its number.

        Raises:
            OSError: It is not on the disk.
        """
        number = self.plans
        self.plans += 1
        curve: dict[str, JsonValue] = {
            "control_points_enu_m": trajectory.control_points_m.tolist(),
            "knot_interval_s": trajectory.knot_interval_s,
            "start_s": trajectory.start_s,
        }
        if trajectory.heading_control_rad is not None:
            curve["heading_control_enu_rad"] = trajectory.heading_control_rad.tolist()
        write_durably(self.folder / f"course-{number:03d}.json", json.dumps(curve))
        self.write("course", time_s, number=number, origin=origin, start_s=trajectory.start_s, end_s=trajectory.end_s)
        return number

    def close(self) -> None:
        """End the log."""
        with self._lock:
            if not self._file.closed:
                try:
                    os.fsync(self._file.fileno())
                except OSError as error:
                    self.fault = error
                self._file.close()


def write_durably(path: Path, text: str) -> None:
    """Write a file so that it is either whole or not there, also after a power cut.

    Raises:
        OSError: It is not there.
    """
    partial = path.with_name(path.name + ".partial")
    with partial.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    partial.replace(path)


def _rounded(vector: Vector) -> list[float]:
    return [round(value, 4) for value in vector]
