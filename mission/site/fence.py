"""The fence an autopilot is given: a little outside the volume that the paths stay in."""

from __future__ import annotations

from mission.mission_file.site import Site

Corner = tuple[float, float]


def planned_fence(site: Site) -> tuple[Corner, ...]:
    """Corners of the area that paths stay in, counter-clockwise: the polygon, or the box's base."""
    import shapely

    low, high = site.box_m
    shape = shapely.Polygon(site.polygon_enu_m) if site.polygon_enu_m else shapely.box(*low[:2], *high[:2])
    return _corners(shape)


def autopilot_fence(site: Site) -> tuple[Corner, ...]:
    """Corners of the fence to upload, counter-clockwise, `site.fence_margin_m` outside the planned one."""
    import shapely

    shape = shapely.Polygon(planned_fence(site)).buffer(site.fence_margin_m, join_style="mitre")
    assert isinstance(shape, shapely.Polygon)
    return _corners(shape)


def fence_holds(site: Site, east_north_m: Corner) -> bool:
    """Whether a place lies inside the autopilot's fence."""
    import shapely

    return bool(shapely.Polygon(autopilot_fence(site)).covers(shapely.Point(east_north_m)))


def _corners(shape) -> tuple[Corner, ...]:  # noqa: ANN001
    import shapely

    ring = shapely.orient_polygons(shape).exterior.coords[:-1]
    return tuple((float(east), float(north)) for east, north in ring)
