"""`[[obstacle]]` and `[[no_fly]]` entries as what the planner measures distances to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mission.mission_file import Mission
from mission.mission_file import obstacle as entries
from mission.mission_file.obstacle import NoFly, Obstacle
from mission.site.buildings import read_buildings
from mission.site.scans import Frame, grid_of, surfaces_of
from planner import obstacles as shapes
from planner.obstacles import ObstacleField


def solids_of(entry: Obstacle | NoFly, mission: Mission) -> tuple[shapes.Obstacle, ...]:
    """What one entry of a mission stands for.

    Args:
        entry: One of its obstacles or no-fly volumes.
        mission: Its origin, its site, and what it keeps from obstacles.

    Raises:
        ValueError: A file that cannot be used.
    """
    match entry:
        case entries.Sphere():
            return (shapes.Sphere(np.array(entry.center_enu_m), entry.radius_m),)
        case entries.Cylinder():
            return (shapes.Cylinder(np.array(entry.center_enu_m), entry.radius_m, entry.floor_m, entry.ceiling_m),)
        case entries.Box():
            return (shapes.Box(np.array(entry.min_enu_m), np.array(entry.max_enu_m)),)
        case entries.Prism():
            return (shapes.Prism(np.array(entry.polygon_enu_m), entry.floor_m, entry.ceiling_m),)
        case entries.GeoJson():
            return tuple(
                shapes.Prism(building.polygon_m, building.floor_m, building.ceiling_m)
                for building in read_buildings(entry, frame_of(mission))
            )
        case entries.Points() | entries.Mesh() | entries.Voxels():
            return (grid_of(entry, frame_of(mission)),)
        case entries.Terrain():
            return surfaces_of(entry, frame_of(mission))


def frame_of(mission: Mission) -> Frame:
    """Where files of obstacles are put: distances are wanted in the box, at home and in the climb above it."""
    box_min, box_max = mission.site.box_m
    east, north, up = mission.home_enu_m
    low_m, high_m = (
        (min(box_min[0], east), min(box_min[1], north), min(box_min[2], up)),
        (max(box_max[0], east), max(box_max[1], north), max(box_max[2], up + mission.takeoff_altitude_m)),
    )
    return Frame(mission.site.origin.point(), low_m, high_m, mission.keep_out_m)


def solids_in(mission: Mission) -> Iterator[shapes.Obstacle]:
    """Everything that a mission stays away from, no-fly volumes too.

    Raises:
        ValueError: A file that cannot be used.
    """
    for entry in (*mission.obstacle, *mission.no_fly):
        yield from solids_of(entry, mission)


def obstacle_field_of(mission: Mission) -> ObstacleField:
    """The same as one signed distance.

    Raises:
        ValueError: A file that cannot be used.
    """
    return ObstacleField.of(solids_in(mission))
