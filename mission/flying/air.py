"""What the air did to a vehicle in flight: its drag, and the wind, from how it had to lean.

Rotors drag in their plane, in proportion to the speed through the air (M. Faessler, A. Franchi and D. Scaramuzza,
Differential Flatness of Quadrotor Dynamics Subject to Rotor Drag, 2018).
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mission.flying.flight_log import FlightLog

# Over so long the noise of a velocity hardly matters for its change, and a turn is not yet smeared.
_WINDOW_S = 1.0
_LEAST_SAMPLES, _LEAST_WINDOWS = 5, 30
# Standard error of the drag beyond which a flight has not shown it: it flew too slowly, too short, or all one way.
_LARGEST_ERROR_PER_S = 0.05
_LEAST_DRAG_PER_S = 0.05
_WORTH_SETTING_PER_S = 0.1


@dataclasses.dataclass(frozen=True)
class Air:
    """The air as a flight felt it.

    Attributes:
        drag_per_s: Deceleration per speed through the air, 1/s.
        drag_error_per_s: Its standard error, 1/s.
        wind_enu_mps: Where the wind blew to, on average, metres per second; None: there is too little drag to tell.
    """

    drag_per_s: float
    drag_error_per_s: float
    wind_enu_mps: tuple[float, float] | None


def air_of(log: FlightLog) -> Air | None:
    """The drag and the wind of a flight; None: it does not show them.

    A vehicle that carries its weight leans by what it accelerates and by what the air takes: tilt − dv/dt = d·(v − w),
    with the drag d and the wind w the same for the whole flight, solved for by least squares.
    """
    moved, taken = _averages(log)
    if len(moved) < _LEAST_WINDOWS:
        return None
    # Unknown are d, d·w east and d·w north; the rows are all that was measured east, then all north.
    one, none = np.ones(len(moved)), np.zeros(len(moved))
    rows = np.vstack([np.column_stack([moved[:, 0], -one, none]), np.column_stack([moved[:, 1], none, -one])])
    told = np.concatenate([taken[:, 0], taken[:, 1]])
    solved, _, rank, _ = np.linalg.lstsq(rows, told, rcond=None)
    if rank < rows.shape[1]:
        return None
    variance = float(np.sum((told - rows @ solved) ** 2)) / (len(told) - rows.shape[1])
    error = math.sqrt(variance * float(np.linalg.inv(rows.T @ rows)[0, 0]))
    if error > _LARGEST_ERROR_PER_S:
        return None
    drag = max(0.0, float(solved[0]))
    blown = solved[1:] / drag if drag >= _LEAST_DRAG_PER_S else None
    return Air(drag, error, None if blown is None else (float(blown[0]), float(blown[1])))


def _averages(log: FlightLog) -> tuple[Float[np.ndarray, "window 2"], Float[np.ndarray, "window 2"]]:
    """By windows on course: the mean velocity, and the mean of what the air took, m/s²."""
    usable = (log.on_course() | log.exploring()) & np.isfinite(log.tilt_mps2).all(axis=1)
    moved, taken = [], []
    if not usable.any():
        return np.zeros((0, 2)), np.zeros((0, 2))
    window = np.floor(log.time_s / _WINDOW_S).astype(int)
    for number in np.unique(window[usable]):
        inside = np.flatnonzero((window == number) & usable)
        lasted_s = log.time_s[inside[-1]] - log.time_s[inside[0]]
        if len(inside) < _LEAST_SAMPLES or lasted_s < 0.5 * _WINDOW_S:
            continue
        velocity, tilt = log.velocity_mps[inside, :2], log.tilt_mps2[inside]
        moved.append(velocity.mean(axis=0))
        taken.append(tilt.mean(axis=0) - (velocity[-1] - velocity[0]) / lasted_s)
    return np.array(moved).reshape(-1, 2), np.array(taken).reshape(-1, 2)


def air_summary(log: FlightLog) -> dict[str, float | None] | None:
    """`air_of` as a summary has it."""
    air = air_of(log)
    if air is None:
        return None
    east, north = air.wind_enu_mps or (math.nan, math.nan)
    return {
        "drag_per_s": air.drag_per_s,
        "drag_error_per_s": air.drag_error_per_s,
        "wind_mps": math.hypot(east, north) if air.wind_enu_mps else None,
        # As winds are told: clockwise from north, where it comes from.
        "wind_from_deg": math.degrees(math.atan2(-east, -north)) % 360.0 if air.wind_enu_mps else None,
    }


def drag_words(summary: Mapping[str, Any]) -> str:
    """The drag of a flight's summary for a person, and what to set where setpoints leaned against another."""
    air, leaned = summary.get("air"), summary.get("drag_leaned_against_per_s")
    if air is None:
        return "–"
    shown = f"{air['drag_per_s']:.2f} ± {air['drag_error_per_s']:.2f} 1/s"
    if leaned is None or abs(air["drag_per_s"] - leaned) < _WORTH_SETTING_PER_S:
        return shown
    return f"{shown}, leaned against {leaned:g}: vehicle.drag_per_s = {air['drag_per_s']:.2f} keeps nearer to the path"


def wind_words(summary: Mapping[str, Any]) -> str:
    """The mean wind of a flight's summary for a person."""
    air = summary.get("air")
    if air is None or air["wind_mps"] is None:
        return "–"
    return f"{air['wind_mps']:.1f} m/s from {air['wind_from_deg']:.0f}°"
