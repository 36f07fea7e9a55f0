"""What a flight came to, measured on what was flown and not on what was meant."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from jaxtyping import Float

from mission.flying.air import air_summary
from mission.flying.belief import covered_by
from mission.flying.flight_log import FlightLog
from planner.problem import Metric, Options, Problem
from planner.spectral_metric import mode_weights

# Estimates wander and gusts push: what is flown counts as broken beyond these, what is planned has no allowance.
SPEED_ALLOWANCE = 1.02
POSITION_ALLOWANCE_M = 0.25
# That metric takes the square of their number.
MOST_KERNEL_SAMPLES = 1500


def summarize(log: FlightLog, problem: Problem, options: Options, fastest_mps: float) -> dict[str, Any]:
    """The summary of a flight, as JSON has it.

    Args:
        log: What was flown.
        problem: What was asked, with the obstacles known at the end.
        options: How it was planned: they say which metric.
        fastest_mps: What the vehicle may fly; plans leave it a reserve below that (`vehicle.speed_reserve`).

    Returns:
        Seconds, metres and shares; null where nothing was measured.
    """
    flying = np.array([bool(armed) for armed in log.armed], dtype=bool)
    position, speed = log.position_m, np.linalg.norm(log.velocity_mps, axis=1)
    error = np.linalg.norm(position - log.target_m, axis=1)[log.on_course()]
    error = error[np.isfinite(error)]
    clearance = clearance_m(log, problem)[flying]
    # Of a flight that was resumed neither the time on the ground between counts, nor where it was carried meanwhile.
    in_flight = flying[:-1] & flying[1:]
    steps = np.linalg.norm(np.diff(position, axis=0), axis=1)[in_flight]
    replans = log.of_kind("replan")
    refused: dict[str, int] = {}
    for replan in replans:
        if not replan["taken"]:
            reason = replan["reason"].split(":")[0]
            refused[reason] = refused.get(reason, 0) + 1
    battery = log.battery_fraction[np.isfinite(log.battery_fraction)]
    return {
        "flown_s": float(np.diff(log.time_s)[in_flight].sum()),
        "explored_s": _explored_s(log),
        "length_m": float(steps.sum()),
        "min_clearance_m": None if problem.obstacles.is_empty or not len(clearance) else float(clearance.min()),
        "clearance_counts_height_limits": problem.obstacles.has_height_limits,
        "max_speed_mps": float(speed.max()) if len(speed) else 0.0,
        "tracking_error_mean_m": float(error.mean()) if len(error) else None,
        "tracking_error_max_m": float(error.max()) if len(error) else None,
        "air": air_summary(log),
        "ergodic_metric": _flown_metric(log, problem, options),
        "probability_found": _probability_found(log, problem),
        "battery_used": float(battery.max() - battery.min()) if len(battery) else None,
        "replans_asked": len(replans),
        "replans_taken": sum(replan["taken"] for replan in replans),
        "replans_refused": refused,
        "violations": violations(log, problem, fastest_mps),
        "phases": [event["phase"] for event in log.of_kind("phase")],
        "warnings": [event["text"] for event in log.of_kind("say") if event["warning"]],
    }


def clearance_m(log: FlightLog, problem: Problem) -> Float[np.ndarray, "time"]:
    """Distance from the hull to the nearest obstacle at every sample of telemetry.

    The ground, and heights that are kept above it, count while exploring: on its way up and down a vehicle is nearer.
    """
    standing = np.asarray(problem.obstacles.standing.distance(log.position_m))
    nearest = np.asarray(problem.obstacles.distance(log.position_m))
    return np.where(log.exploring(), nearest, standing) - problem.vehicle_radius_m


def clearance_words(summary: Mapping[str, Any]) -> str:
    """What the least clearance of a summary is called: heights that are kept above the ground may be in it."""
    limited = summary.get("clearance_counts_height_limits")
    return "from obstacles and height limits, least" if limited else "least clearance"


def violations(log: FlightLog, problem: Problem, fastest_mps: float) -> list[str]:
    """Where the flown path broke a limit, a sentence a kind.

    Clearance and the fence are held against the whole flight in the air, the box and the speed against the
    exploration.
    """
    found = []
    exploring = log.exploring()
    airborne = log.armed & _in_air(log)
    position, speed = log.position_m, np.linalg.norm(log.velocity_mps, axis=1)
    if airborne.any() and not problem.obstacles.is_empty:
        clearance = clearance_m(log, problem)[airborne]
        least = problem.clearance_margin_m - _allowance_m(problem.clearance_margin_m)
        if clearance.min() < least:
            at_s = log.time_s[airborne][int(clearance.argmin())]
            found.append(f"clearance {clearance.min():.2f} m at {at_s:.1f} s, limit {problem.clearance_margin_m:g} m")
    if exploring.any():
        fastest = float(speed[exploring].max())
        if fastest > SPEED_ALLOWANCE * fastest_mps:
            found.append(f"speed {fastest:.2f} m/s, limit {fastest_mps:g} m/s")
        low, high = problem.workspace.box_min_m, problem.workspace.box_max_m
        outside = float(np.maximum(low - position[exploring], position[exploring] - high).max())
        if outside > POSITION_ALLOWANCE_M:
            found.append(f"{outside:.2f} m outside the box")
    return found


def _allowance_m(margin_m: float) -> float:
    """How much of the margin tracking may use up: the margin is there for that, but never all of it."""
    return min(POSITION_ALLOWANCE_M, 0.5 * margin_m)


def _in_air(log: FlightLog) -> np.ndarray:
    return np.array(
        [phase not in ("arming", "disarming", "landed", "checking the vehicle") for phase in log.phase], dtype=bool
    )


def _explored_s(log: FlightLog) -> float:
    progress = log.of_kind("progress")
    return float(progress[-1]["explored_s"]) if progress else 0.0


def _probability_found(log: FlightLog, problem: Problem) -> float | None:
    """Of a search, that what was explored has found it; None: it is none."""
    return None if problem.search is None else problem.search.probability_found(log.position_m[log.exploring()])


def _flown_metric(log: FlightLog, problem: Problem, options: Options) -> float | None:
    """E of what was explored, by the metric that it was planned with."""
    position_m, yaw_rad = log.position_m[log.exploring()], log.yaw_rad[log.exploring()]
    if len(position_m) < 2:
        return None
    if options.metric is Metric.KERNEL:
        from planner.judging import Judge

        some = np.unique(np.linspace(0, len(position_m) - 1, MOST_KERNEL_SAMPLES).round().astype(int))
        return Judge(problem, options).ergodic_metric(position_m[some], yaw_rad[some])
    covered = covered_by(position_m, 1.0, problem, options.modes)
    residual = covered.mean_basis - problem.information.coefficients(options.modes)
    return float(np.sum(mode_weights(options.modes, options.metric_weights) * residual**2))
