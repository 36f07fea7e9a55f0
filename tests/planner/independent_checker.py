"""Confirms a plan from plan.json alone, sharing nothing with the planner.

By hand: `python -m tests.planner.independent_checker PLAN.json`.
The streamed samples are joined by quintic Hermite pieces (position, velocity and acceleration at both ends) and looked
at twenty times as often as they are streamed. Limits are taken from the mission in the file, not only from what the
plan says of itself.
"""

from __future__ import annotations

import dataclasses
import json
import math
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from scipy.interpolate import BSpline

from tests.planner.independent_surfaces import heights_above, points_distance, terrain_distance, voxels_distance

TIMES_FINER = 20
# Between two samples the flown spline may have a knot, which a quintic rounds off.
CLEARANCE_TOLERANCE_M = 1e-4
PLACE_TOLERANCE_M = 2e-3
SPEED_TOLERANCE = 1e-3
ACCELERATION_TOLERANCE = 0.05
TURNING_SHARE = 0.02
SAMPLE_TOLERANCE = 1e-6
ANGLE_TOLERANCE = 1e-6
SPLINE_TOLERANCE = 1e-6


@dataclasses.dataclass(frozen=True)
class Confirmed:
    """What was measured, and what is wrong (nothing: the plan is confirmed)."""

    faults: tuple[str, ...]
    min_clearance_m: float
    max_speed_mps: float
    max_acceleration_mps2: float


def check(plan: dict[str, Any], times_finer: int = TIMES_FINER) -> Confirmed:
    """Measure a plan."""
    flown = plan["trajectory"]
    time = np.array(flown["time_s"], dtype=float)
    position, velocity, acceleration = (
        np.array(flown[key], dtype=float) for key in ("position_enu_m", "velocity_enu_mps", "acceleration_enu_mps2")
    )
    yaw = np.array(flown["yaw_enu_rad"], dtype=float)
    shapes = {position.shape, velocity.shape, acceleration.shape}
    if shapes != {(len(time), 3)} or yaw.shape != time.shape:
        return Confirmed((f"samples do not belong together: {sorted(map(str, shapes))}",), -np.inf, np.inf, np.inf)
    everything = np.concatenate([time, yaw, position.ravel(), velocity.ravel(), acceleration.ravel()])
    if not np.isfinite(everything).all() or not (np.diff(time) > 0.0).all():
        return Confirmed(("samples are not finite, or time does not increase",), -np.inf, np.inf, np.inf)
    fine_position, fine_velocity, fine_acceleration = hermite(time, position, velocity, acceleration, times_finer)

    clearance = clearances(plan, fine_position)
    speed = np.linalg.norm(fine_velocity, axis=1)
    force = np.linalg.norm(fine_acceleration, axis=1)
    faults = [
        *_fits_together(time, position, velocity, acceleration),
        *_keeps_clear(plan, clearance),
        *_keeps_limits(plan, fine_velocity, speed, force, np.linalg.norm(acceleration, axis=1).max()),
        *_keeps_budgets(plan, time, acceleration, fine_position),
        *_turns_no_faster(plan, fine_position, fine_velocity, fine_acceleration),
        *_stays_inside(plan, fine_position),
        *_keeps_its_height(plan, fine_position),
        *_begins_and_ends(plan, time, position, velocity),
        *_turns(plan, time, yaw),
        *_follows_its_spline(plan, time, position, velocity, acceleration),
        *_looks_as_planned(plan, time, yaw),
    ]
    return Confirmed(tuple(faults), float(clearance.min(initial=np.inf)), float(speed.max()), float(force.max()))


def hermite(
    time: np.ndarray, position: np.ndarray, velocity: np.ndarray, acceleration: np.ndarray, times_finer: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions, velocities and accelerations on the quintics between samples."""
    step = np.diff(time)[:, None]
    x0, x1 = position[:-1], position[1:]
    v0, v1 = velocity[:-1] * step, velocity[1:] * step
    a0, a1 = acceleration[:-1] * step**2, acceleration[1:] * step**2
    rest = x1 - x0 - v0 - 0.5 * a0
    rest_v, rest_a = v1 - v0 - a0, a1 - a0
    c3 = 10.0 * rest - 4.0 * rest_v + 0.5 * rest_a
    c4 = -15.0 * rest + 7.0 * rest_v - rest_a
    c5 = 6.0 * rest - 3.0 * rest_v + 0.5 * rest_a
    u = (np.arange(times_finer + 1) / times_finer)[:, None, None]
    x = x0 + u * (v0 + u * (0.5 * a0 + u * (c3 + u * (c4 + u * c5))))
    v = (v0 + u * (a0 + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / step
    a = (a0 + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / step**2
    return tuple(np.swapaxes(part, 0, 1).reshape(-1, 3) for part in (x, v, a))


def clearances(plan: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """Distance from the hull to the nearest obstacle at each point; without obstacles none."""
    mission = plan["problem"]["mission"]
    bodies = [
        body
        for entry in [*mission.get("obstacle", ()), *mission.get("no_fly", ())]
        for body in _bodies(entry, plan["origin"])
    ]
    if not bodies:
        return np.zeros(0)
    flat = shapely.points(points[:, :2]) if any(body["kind"] == "prism" for body in bodies) else None
    return np.min([_distance(body, points, flat) for body in bodies], axis=0) - mission["vehicle"]["radius_m"]


def _bodies(entry: dict[str, Any], origin: dict[str, float]) -> Iterator[dict[str, Any]]:
    """An entry as upright or round bodies: a GeoJSON file is many."""
    if entry["kind"] != "geojson":
        yield entry | {"origin": origin}
        return
    import pymap3d

    latitude, longitude, height = (origin[key] for key in ("latitude_deg", "longitude_deg", "altitude_amsl_m"))
    for feature in json.loads(Path(entry["file"]).read_text(encoding="utf-8"))["features"]:
        rings = feature["geometry"]["coordinates"]
        rings = [polygon[0] for polygon in rings] if feature["geometry"]["type"] == "MultiPolygon" else [rings[0]]
        ground = entry.get("ground_m", 0.0)
        properties = feature.get("properties") or {}
        for ring in rings:
            lon, lat = np.array([corner[:2] for corner in ring], dtype=float).T.copy()
            east, north, _ = pymap3d.geodetic2enu(lat, lon, np.full(len(lat), height), latitude, longitude, height)
            yield {
                "kind": "prism",
                "polygon_enu_m": np.stack([east, north], axis=1),
                "floor_m": ground + float(properties.get(entry.get("base_property", "base_m")) or 0.0),
                "ceiling_m": ground + float(properties[entry.get("height_property", "height_m")]),
            }


def _distance(body: dict[str, Any], points: np.ndarray, flat: np.ndarray | None) -> np.ndarray:
    """From points to a body, zero inside; `flat` are the same points for shapely, which is slow to make them."""
    match body["kind"]:
        case "sphere":
            return np.maximum(np.linalg.norm(points - body["center_enu_m"], axis=1) - body["radius_m"], 0.0)
        case "box":
            low, high = np.array(body["min_enu_m"]), np.array(body["max_enu_m"])
            return np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=1)
        case "cylinder":
            level = np.linalg.norm(points[:, :2] - body["center_enu_m"], axis=1) - body["radius_m"]
        case "prism":
            level = shapely.distance(shapely.Polygon(body["polygon_enu_m"]), flat)
        case "terrain":
            return terrain_distance(body, body["origin"], points)
        case "points":
            return points_distance(body, points)
        case "voxels":
            return voxels_distance(body, points)
        case other:
            raise ValueError(f'obstacles of kind "{other}" cannot be checked from the plan alone')
    upright = np.maximum(body["floor_m"] - points[:, 2], points[:, 2] - body["ceiling_m"])
    return np.hypot(np.maximum(level, 0.0), np.maximum(upright, 0.0))


def _fits_together(time: np.ndarray, x: np.ndarray, v: np.ndarray, a: np.ndarray) -> Iterator[str]:
    """Positions must be where the velocities lead, and velocities what the accelerations make."""
    step = np.diff(time)[:, None]
    jerk = np.abs(np.diff(a, axis=0)).max(axis=1, keepdims=True) / step
    # Exact on one cubic piece; where a knot lies between the samples, off by no more than the change of the jerk does.
    allowed = np.maximum(jerk, np.max(jerk)) * step**3 / 4.0 + 1e-7
    gap = np.abs(np.diff(x, axis=0) - 0.5 * step * (v[1:] + v[:-1]) + step**2 / 12.0 * (a[1:] - a[:-1]))
    if (gap > allowed).any():
        yield f"positions are up to {gap.max():.4g} m from where the velocities lead"
    gap = np.abs(np.diff(v, axis=0) - 0.5 * step * (a[1:] + a[:-1]))
    if (gap > allowed / step * 4.0).any():
        yield f"velocities are up to {gap.max():.4g} m/s from what the accelerations make"


def _keeps_clear(plan: dict[str, Any], clearance: np.ndarray) -> Iterator[str]:
    margin = plan["problem"]["mission"]["flight"]["clearance_margin_m"]
    if plan["limits"]["clearance_margin_m"] < margin:
        yield f"was proven with a margin of {plan['limits']['clearance_margin_m']} m, the mission wants {margin} m"
    if clearance.size and clearance.min() < margin - CLEARANCE_TOLERANCE_M:
        yield f"clearance {clearance.min():.4f} m is less than {margin} m"


def _keeps_limits(
    plan: dict[str, Any], velocity: np.ndarray, speed: np.ndarray, force: np.ndarray, sampled_force: float
) -> Iterator[str]:
    for what, measured, name, tolerance in (
        ("speed", speed.max(), "max_speed_mps", SPEED_TOLERANCE),
        ("climb", velocity[:, 2].max(), "max_climb_mps", SPEED_TOLERANCE),
        ("descent", -velocity[:, 2].min(), "max_descent_mps", SPEED_TOLERANCE),
        ("acceleration", force.max(), "max_acceleration_mps2", ACCELERATION_TOLERANCE),
        ("acceleration at a sample", sampled_force, "max_acceleration_mps2", SAMPLE_TOLERANCE),
    ):
        limit = min(plan["problem"]["mission"]["vehicle"][name], plan["limits"][name])
        if measured > limit * (1.0 + tolerance):
            yield f"{what} {measured:.4f} exceeds {name} = {limit}"


def _keeps_budgets(
    plan: dict[str, Any], time: np.ndarray, acceleration: np.ndarray, points: np.ndarray
) -> Iterator[str]:
    """Jerk from the change of acceleration between samples, and the length, where they are limited."""
    jerk = plan["limits"].get("max_jerk_mps3")
    if jerk is not None:
        measured = (np.linalg.norm(np.diff(acceleration, axis=0), axis=1) / np.diff(time)).max()
        if measured > jerk * (1.0 + ACCELERATION_TOLERANCE):
            yield f"jerk {measured:.4f} exceeds max_jerk_mps3 = {jerk}"
    length = plan["limits"].get("max_length_m")
    if length is not None:
        measured = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
        if measured > length * (1.0 + SPEED_TOLERANCE):
            yield f"length {measured:.2f} exceeds max_length_m = {length}"


def _turns_no_faster(plan: dict[str, Any], x: np.ndarray, v: np.ndarray, a: np.ndarray) -> Iterator[str]:
    """How fast the direction on the map turns, wherever the vehicle goes somewhere."""
    limit = plan["problem"]["mission"]["vehicle"].get("max_turn_rate_degps")
    if limit is None:
        return
    across, squared = v[:, 0] * a[:, 1] - v[:, 1] * a[:, 0], v[:, 0] ** 2 + v[:, 1] ** 2
    moving = squared > (TURNING_SHARE * plan["limits"]["max_speed_mps"]) ** 2
    rate = np.degrees(np.abs(across[moving]) / squared[moving])
    if rate.max(initial=0.0) > limit * (1.0 + ACCELERATION_TOLERANCE):
        yield f"the path turns at {rate.max():.2f} deg/s at {x[moving][rate.argmax()].round(1)}, limit {limit}"


def _stays_inside(plan: dict[str, Any], points: np.ndarray) -> Iterator[str]:
    limits, site = plan["limits"], plan["problem"]["mission"]["site"]
    boxes = [(limits["box_min_enu_m"], limits["box_max_enu_m"])]
    if site.get("box_min_enu_m") is not None:
        boxes.append((site["box_min_enu_m"], site["box_max_enu_m"]))
    for low, high in boxes:
        outside = max(float((np.array(low) - points).max()), float((points - np.array(high)).max()))
        if outside > PLACE_TOLERANCE_M:
            yield f"leaves the box by {outside:.4f} m"
    for polygon in (limits.get("fence_polygon_enu_m"), site.get("polygon_enu_m")):
        if polygon is not None:
            outside = shapely.distance(shapely.Polygon(polygon), shapely.points(points[:, :2])).max()
            if outside > PLACE_TOLERANCE_M:
                yield f"leaves the fence by {outside:.4f} m"


def _keeps_its_height(plan: dict[str, Any], points: np.ndarray) -> Iterator[str]:
    """Above the ground, where the mission says between which heights."""
    for entry in plan["problem"]["mission"].get("obstacle", ()):
        least, greatest = entry.get("least_height_m"), entry.get("greatest_height_m")
        if entry["kind"] == "terrain" and (least is not None or greatest is not None):
            height = heights_above(entry, plan["origin"], points)
            if height.min() < (least or 0.0) - PLACE_TOLERANCE_M or height.max() > (greatest or np.inf):
                yield f"flies {height.min():.3f} to {height.max():.3f} m above the ground, not {least} to {greatest} m"


def _begins_and_ends(plan: dict[str, Any], time: np.ndarray, x: np.ndarray, v: np.ndarray) -> Iterator[str]:
    asked = plan["problem"]["mission"]["planner"]
    for name, key, place in (("begins", "start_enu_m", x[0]), ("ends", "end_enu_m", x[-1])):
        if asked.get(key) is not None:
            gap = float(np.linalg.norm(place - np.array(asked[key])))
            if gap > PLACE_TOLERANCE_M:
                yield f"{name} {gap:.4f} m from {key}"
    if np.linalg.norm(v[-1]) > 1e-3:
        yield f"ends at {np.linalg.norm(v[-1]):.4f} m/s and not at rest"
    if asked.get("duration_s") is not None and time[-1] - time[0] > asked["duration_s"] * (1.0 + 1e-6):
        yield f"takes {time[-1] - time[0]:.3f} s, the mission gives {asked['duration_s']} s"


def _turns(plan: dict[str, Any], time: np.ndarray, yaw: np.ndarray) -> Iterator[str]:
    rate = np.abs(np.diff(yaw)) / np.diff(time)
    if rate.max() > plan["limits"]["max_yaw_rate_radps"] * (1.0 + ANGLE_TOLERANCE):
        yield f"turns at {rate.max():.4f} rad/s, limit {plan['limits']['max_yaw_rate_radps']}"


def _follows_its_spline(
    plan: dict[str, Any], time: np.ndarray, x: np.ndarray, v: np.ndarray, a: np.ndarray
) -> Iterator[str]:
    """What is streamed and the curve in the file must be the same; scipy evaluates it."""
    if "spline" not in plan:
        return
    spline = plan["spline"]
    points, interval = np.array(spline["control_points_enu_m"]), spline["knot_interval_s"]
    knots = spline["start_s"] + (np.arange(len(points) + 4) - 3.0) * interval
    curve = BSpline(knots, points, 3)
    # The last moment belongs to the last piece.
    inside = np.clip(time, knots[3], np.nextafter(knots[-4], -np.inf))
    for order, (what, sampled) in enumerate((("positions", x), ("velocities", v), ("accelerations", a))):
        gap = np.abs(curve(inside, order) - sampled).max()
        if gap > SPLINE_TOLERANCE:
            yield f"{what} are up to {gap:.4g} off the spline in the file"


def _looks_as_planned(plan: dict[str, Any], time: np.ndarray, yaw: np.ndarray) -> Iterator[str]:
    """Of a heading that was planned, its rate between the samples, and that it is what is streamed."""
    spline = plan.get("spline", {})
    control, asked = spline.get("heading_control_enu_rad"), plan["problem"]["mission"]["planner"].get("heading")
    if control is None:
        if asked == "explored":
            yield "headings were to be explored, and the file has none that was planned"
        return
    interval = spline["knot_interval_s"]
    knots = spline["start_s"] + (np.arange(len(control) + 4) - 3.0) * interval
    curve = BSpline(knots, np.array(control), 3)
    end = np.nextafter(knots[-4], -np.inf)
    limit = min(
        math.radians(plan["problem"]["mission"]["vehicle"]["max_yaw_rate_degps"]), plan["limits"]["max_yaw_rate_radps"]
    )
    fine = np.linspace(knots[3], end, TIMES_FINER * len(time))
    rate = np.abs(curve(fine, 1)).max()
    if rate > limit * (1.0 + ANGLE_TOLERANCE):
        yield f"the planned heading turns at {rate:.4f} rad/s, limit {limit:.4f}"
    gap = np.abs(curve(np.clip(time, knots[3], end)) - yaw).max()
    if gap > ANGLE_TOLERANCE:
        yield f"the heading is up to {gap:.4g} rad off the one that was planned"


def main(arguments: list[str]) -> int:
    """Check each file; 0 where all are confirmed."""
    confirmed = True
    for name in arguments:
        found = check(json.loads(Path(name).read_text(encoding="utf-8")))
        print(
            f"{name}: clearance {found.min_clearance_m:.4f} m, speed {found.max_speed_mps:.4f} m/s, "
            f"acceleration {found.max_acceleration_mps2:.4f} m/s²: {'; '.join(found.faults) or 'confirmed'}"
        )
        confirmed &= not found.faults
    return 0 if confirmed and arguments else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
