"""What must hold between the sections of a mission file, checked before anything is planned.

Each check says which sections it needs and is run wherever those are sound, so that one mistake does not hide another.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from mission.findings import Finding
from mission.mission_file import Mission
from mission.mission_file.errors import spelled
from mission.mission_file.obstacle import Terrain
from mission.site.endurance import endurance_budget
from mission.site.fence import fence_holds, planned_fence

if TYPE_CHECKING:
    from mission.site.reachable import Spare
    from planner.information import DensityGrid

Check = Callable[[Mission], Iterator[Finding]]

AXES = ("east", "north", "up")
CLIMB_STEP_M = 0.5
NO_WAY = "obstacles (with vehicle.radius_m and flight.clearance_margin_m around them) or the fence leave no way"


def findings_between(sections: Mapping[str, Any]) -> list[Finding]:
    """Everything that is wrong between the sections that are sound.

    Args:
        sections: Sections of `Mission` by name; those that did not parse are absent.
    """
    mission = Mission.model_construct(**sections)
    return [
        finding for needed, check in CHECKS if all(name in sections for name in needed) for finding in check(mission)
    ]


def findings_for_flying(mission: Mission) -> list[Finding]:
    """Why a mission that can be planned and exported cannot be flown; empty: it can."""
    if mission.vehicle.preset != "fixed-wing":
        return []
    return [
        Finding(
            "vehicle.preset",
            '"fixed-wing"',
            "is for planning: a flight climbs, waits and brakes on the spot, and its paths start and end at rest, "
            "which no wing carries; plan and export the mission (`mission plan`) for another ground station, or choose "
            "the preset of a multirotor",
        )
    ]


def _ends(mission: Mission) -> Iterator[tuple[str, tuple[float, float, float]]]:
    yield "planner.start_enu_m", mission.planner.start_enu_m
    if mission.planner.end_enu_m is not None:
        yield "planner.end_enu_m", mission.planner.end_enu_m


def ends_in_the_box(mission: Mission) -> Iterator[Finding]:
    """Start and end lie in the volume that is never left."""
    import shapely

    low, high = mission.site.box_m
    for path, position in _ends(mission):
        outside = [
            f"{axis} must be {least:g} … {most:g}"
            for axis, value, least, most in zip(AXES, position, low, high, strict=True)
            if not least <= value <= most
        ]
        if outside:
            yield Finding(path, spelled(position), f"lies outside the site's volume: {', '.join(outside)}")
        elif not shapely.Polygon(planned_fence(mission.site)).covers(shapely.Point(position[:2])):
            yield Finding(
                path, spelled(position), "lies outside site.polygon_enu_m: move it inside, or move the polygon"
            )


def home_in_the_fence(mission: Mission) -> Iterator[Finding]:
    """The autopilot's fence holds home and the rally points; PX4 accepts one that does not, and ignores it."""
    path = "site.home_enu_m" if mission.site.home_enu_m is not None else "planner.start_enu_m"
    home = mission.home_enu_m
    if not fence_holds(mission.site, home[:2]):
        yield Finding(
            path,
            spelled(home),
            "home lies outside the fence (site's volume and fence_margin_m): an autopilot would ignore the fence or "
            "refuse to arm; move home inside, or enlarge the site",
        )
    for index, place in enumerate(mission.site.rally_enu_m):
        if not fence_holds(mission.site, place[:2]):
            yield Finding(f"site.rally_enu_m.{index}", spelled(place), "this rally point lies outside the fence")


def takeoff_reaches_the_box(mission: Mission) -> Iterator[Finding]:
    """The climb ends at a height where the mission may fly."""
    floor, ceiling = mission.site.box_m[0][2], mission.site.box_m[1][2]
    home_up = mission.home_enu_m[2]
    reached = home_up + mission.takeoff_altitude_m
    if mission.flight.takeoff_altitude_m is not None and not floor <= reached <= ceiling:
        yield Finding(
            "flight.takeoff_altitude_m",
            f"{mission.takeoff_altitude_m:g}",
            f"that is {reached:g} m above the origin, outside the site's {floor:g} … {ceiling:g} m: write "
            f"{max(floor - home_up, 0.1):g} … {ceiling - home_up:g}",
        )
    elif mission.takeoff_altitude_m <= 0.0:
        yield Finding(
            "planner.start_enu_m",
            spelled(mission.planner.start_enu_m),
            f"lies {-mission.takeoff_altitude_m:g} m below home, which is at up = {home_up:g}: give site.home_enu_m",
        )


def end_is_reachable(mission: Mission) -> Iterator[Finding]:
    """There is time to get from start to end at all."""
    start, end = mission.planner.start_enu_m, mission.planner.ends_at_m
    if end is None:
        return
    vehicle = mission.vehicle
    up = end[2] - start[2]
    vertical_s = up / vehicle.max_climb_mps if up > 0.0 else -up / vehicle.max_descent_mps
    # Speeding up and braking cost the time of half of each at full speed.
    straight_s = math.dist(start, end) / vehicle.max_speed_mps + vehicle.max_speed_mps / vehicle.max_acceleration_mps2
    least_s = max(vertical_s, straight_s) if math.dist(start, end) > 0.0 else 0.0
    if mission.planner.duration_s < least_s:
        yield Finding(
            "planner.duration_s",
            f"{mission.planner.duration_s:g}",
            f"the way from start to end alone takes {least_s:.1f} s at the vehicle's limits: write more than that",
        )


def endurance_suffices(mission: Mission) -> Iterator[Finding]:
    """The battery lasts for the whole flight, the way home and the reserve."""
    budget = endurance_budget(mission)
    if budget.spare_s < 0.0:
        longest = mission.planner.duration_s + budget.spare_s
        yield Finding(
            "planner.duration_s",
            f"{mission.planner.duration_s:g}",
            f"the flight needs {budget.needed_s:.0f} s (climb {budget.climb_s:.0f}, to the start "
            f"{budget.approach_s:.0f}, path {budget.path_s:.0f}, way home {budget.return_s:.0f}, descent "
            f"{budget.descent_s:.0f}, reserve {budget.reserve_s:.0f}) and vehicle.endurance_s is "
            f"{budget.endurance_s:.0f}: "
            + (
                f"write at most {math.floor(longest)}"
                if longest >= 1.0
                else "not even without exploring; the vehicle needs more endurance_s, or a smaller reserve_fraction"
            ),
        )


def stays_clear_of_obstacles(mission: Mission) -> Iterator[Finding]:
    """Obstacle files are readable; start, end and the climb keep their distance; there is room and information left."""
    from mission.site.ground import heights_are_kept, home_stands_on_it
    from mission.site.information import density_of
    from mission.site.reachable import reachable, spare_in
    from mission.site.solids import solids_of
    from planner.height_field import HeightField
    from planner.obstacles import ObstacleField

    keep_out_m = mission.keep_out_m
    fields: list[tuple[str, ObstacleField]] = []
    solids = []
    sound = True
    listed = [("obstacle", i, e) for i, e in enumerate(mission.obstacle)]
    listed += [("no_fly", i, e) for i, e in enumerate(mission.no_fly)]
    for section, index, entry in listed:
        try:
            shapes = solids_of(entry, mission)
        except ValueError as error:
            sound = False
            yield Finding(f"{section}.{index}.file", "", str(error))
            continue
        path = f"{section}.{index}"
        if isinstance(entry, Terrain) and isinstance(shapes[0], HeightField):
            yield from home_stands_on_it(path, entry, shapes[0], mission)
            yield from heights_are_kept(path, entry, shapes[0], _ends(mission))
        # Without heights that are kept above the ground: of those it was told what they are.
        fields.append((path, ObstacleField.of(shapes[:1] if isinstance(entry, Terrain) else shapes)))
        solids += shapes
    for path, position in _ends(mission):
        yield from _too_near(path, spelled(position), "it", np.array([position]), fields, keep_out_m)
    home = mission.home_enu_m
    climb = np.arange(home[2] + keep_out_m, home[2] + mission.takeoff_altitude_m, CLIMB_STEP_M)
    if len(climb):
        column = np.column_stack([np.full((len(climb), 2), home[:2]), climb])
        # The climb begins on the ground, below every height that is kept above it. What the start is too near to was
        # told already, where that is where the climb ends.
        start = np.array([mission.planner.start_enu_m])
        told = [home[:2] == tuple(start[0, :2]) and field.distance(start)[0] < keep_out_m for _, field in fields]
        standing = [(path, field.standing) for (path, field), known in zip(fields, told, strict=True) if not known]
        yield from _too_near("site.home_enu_m", spelled(home), "the climb above it", column, standing, keep_out_m)
    for index, place in enumerate(mission.site.rally_enu_m):
        # A return that leads there comes down from above everything.
        descent = np.arange(home[2] + keep_out_m, max(place[2], mission.site.box_m[1][2]), CLIMB_STEP_M)
        column = np.column_stack([np.full((len(descent), 2), place[:2]), descent])
        standing = [(path, field.standing) for path, field in fields]
        path = f"site.rally_enu_m.{index}"
        yield from _too_near(path, spelled(place), "the descent to it", column, standing, keep_out_m)
    if mission.flight.end == "land" and (end := mission.planner.ends_at_m) is not None:
        heights = np.arange(home[2] + keep_out_m, end[2], CLIMB_STEP_M)
        below = np.column_stack([np.full((len(heights), 2), end[:2]), heights])
        standing = [(path, field.standing) for path, field in fields]
        if len(below):
            path = "planner.end_enu_m" if mission.planner.end_enu_m is not None else "planner.start_enu_m"
            yield from _too_near(path, spelled(end), "the landing below it", below, standing, keep_out_m)
    try:
        density = density_of(mission.information, mission.site)
    except ValueError as error:
        yield Finding(_information_entry(mission), "", str(error))
        return
    if not sound:
        return
    spare_m = spare_in(mission.site, ObstacleField.of(solids), keep_out_m)
    try:
        explored = reachable(density, spare_m)
    except ValueError:
        yield Finding(
            "flight.clearance_margin_m",
            f"{mission.flight.clearance_margin_m:g}",
            f"no information is left that is {keep_out_m:g} m (vehicle.radius_m and this margin) from every obstacle: "
            "make the margin smaller, or move the obstacles or the information",
        )
        return
    yield from _there_is_a_way(mission, explored, spare_m)


def _there_is_a_way(mission: Mission, density: DensityGrid, spare_m: Spare) -> Iterator[Finding]:
    """Obstacles and the fence do not close off the end, or the information, from the start."""
    from mission.site.information import workspace_of
    from mission.site.passage import LEAST_SHARE, Passage

    start = np.array(mission.planner.start_enu_m)
    if spare_m(start[None])[0] < 0.0:
        # What it is too near to was told.
        return
    passage = Passage(workspace_of(mission.site), spare_m, start)
    end = mission.planner.end_enu_m
    if end is not None and spare_m(np.array([end]))[0] >= 0.0 and not passage.leads_to(np.array([end]))[0]:
        yield Finding("planner.end_enu_m", spelled(end), f"{NO_WAY} there from the start: move one of the two")
    if passage.share_of(density) < LEAST_SHARE:
        yield Finding(_information_entry(mission), "", f"{NO_WAY} from the start to it: move one of the two")


def _information_entry(mission: Mission) -> str:
    """The entry that a density which cannot be built is to be blamed on."""
    match mission.information.kind:
        case "raster":
            return "information.raster"
        case "samples":
            return "information.samples"
        case "gaussians":
            return "information.component"
        case "uniform":
            return "information"


def _too_near(
    path: str, got: str, what: str, points_m: np.ndarray, fields: list, keep_out_m: float
) -> Iterator[Finding]:
    """Obstacles that points come too near to, the nearest point of each."""
    for obstacle, field in fields:
        nearest = float(field.distance(points_m).min())
        if nearest < 0.0:
            yield Finding(path, got, f"{what} lies inside {obstacle}: move one of the two")
        elif nearest < keep_out_m:
            yield Finding(
                path,
                got,
                f"{what} is {nearest:.2f} m from {obstacle} and must be {keep_out_m:g} m away (vehicle.radius_m and "
                "flight.clearance_margin_m): move it, or make the margin smaller",
            )


def detection_has_a_sensor(mission: Mission) -> Iterator[Finding]:
    """What was seen can only be counted by a sensor that is described, and that looks before it is past."""
    sensor, speed_mps = mission.sensor, mission.vehicle.max_speed_mps
    if mission.belief.kind != "detection":
        return
    if sensor.detection_radius_m is None:
        yield Finding(
            "sensor.detection_radius_m",
            "",
            'is missing and belief.kind = "detection" needs it: write detection_radius_m = 33.0, the radius of what '
            "the camera sees of the ground",
        )
    elif speed_mps > sensor.rate_hz * sensor.detection_radius_m:
        yield Finding(
            "sensor.rate_hz",
            f"{sensor.rate_hz:g}",
            f"at vehicle.max_speed_mps it looks every {speed_mps / sensor.rate_hz:.4g} m and sees no farther than "
            f"{sensor.detection_radius_m:g} m, so ground is passed over: write at least "
            f"{math.ceil(100.0 * speed_mps / sensor.detection_radius_m) / 100.0:g}, or fly more slowly",
        )


def headings_can_be_explored(mission: Mission) -> Iterator[Finding]:
    """A wing looks where it flies."""
    if mission.planner.heading == "explored" and mission.vehicle.preset == "fixed-wing":
        yield Finding(
            "planner.heading",
            '"explored"',
            'a fixed wing looks where it flies: write "travel", or another vehicle.preset',
        )


CHECKS: tuple[tuple[tuple[str, ...], Check], ...] = (
    (("site", "planner"), ends_in_the_box),
    (("site", "planner"), home_in_the_fence),
    (("site", "planner", "flight"), takeoff_reaches_the_box),
    (("planner", "vehicle"), end_is_reachable),
    (("site", "planner", "vehicle", "flight"), endurance_suffices),
    (
        ("site", "planner", "vehicle", "flight", "information", "obstacle", "no_fly"),
        stays_clear_of_obstacles,
    ),
    (("belief", "sensor", "vehicle"), detection_has_a_sensor),
    (("planner", "vehicle"), headings_can_be_explored),
)
