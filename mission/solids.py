"""`[[obstacle]]` and `[[no_fly]]` entries as shapes the planner measures distances to."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from mission.buildings import read_buildings
from mission.mission_file import Mission
from mission.mission_file import obstacle as entries
from mission.mission_file.obstacle import NoFly, Obstacle
from planner import obstacles as shapes
from planner.obstacles import ObstacleField
from sim_bridge.state import GeodeticPoint


def solids_of(entry: Obstacle | NoFly, origin: GeodeticPoint) -> tuple[shapes.Obstacle, ...]:
    """The shapes of one entry.

    Args:
        entry: From the mission file.
        origin: Of the local frame; files with longitude and latitude need it.

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
                for building in read_buildings(entry, origin)
            )
        case entries.Points() | entries.Mesh() | entries.Voxels() | entries.Terrain():
            raise ValueError(
                f'obstacles of kind "{entry.kind}" cannot be planned around by this version: describe it with spheres, '
                "cylinders, boxes, prisms or GeoJSON"
            )


def solids_in(mission: Mission) -> Iterator[shapes.Obstacle]:
    """Every shape of a mission, no-fly volumes too.

    Raises:
        ValueError: A file that cannot be used.
    """
    origin = mission.site.origin.point()
    for entry in (*mission.obstacle, *mission.no_fly):
        yield from solids_of(entry, origin)


def obstacle_field_of(mission: Mission) -> ObstacleField:
    """Every shape of a mission as one signed distance.

    Raises:
        ValueError: A file that cannot be used.
    """
    return ObstacleField.of(solids_in(mission))
