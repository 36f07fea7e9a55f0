"""`[site]`: where the mission is, and the volume that is never left."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, Strict

from mission.findings import Finding
from mission.mission_file.values import Coordinate, Polygon, Position, Section, polygon_fault
from sim_bridge.state import GeodeticPoint


class Origin(Section):
    """Where the local frame has its zero; its altitude is that of the ground there."""

    latitude_deg: Annotated[float, Field(ge=-89.0, le=89.0, examples=[47.3977])]
    """Latitude, WGS84."""
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0, examples=[8.5456])]
    """Longitude, WGS84."""
    altitude_amsl_m: Annotated[float, Field(ge=-500.0, le=9000.0, examples=[488.0])]
    """Height above mean sea level."""

    def point(self) -> GeodeticPoint:
        """The origin as the vehicle side knows it."""
        return GeodeticPoint(self.latitude_deg, self.longitude_deg, self.altitude_amsl_m)


class Site(Section):
    """Where the mission is, and the volume that is never left: a box, or a polygon with a floor and a ceiling."""

    origin: Annotated[
        Origin,
        Field(examples=[{"latitude_deg": 47.3977, "longitude_deg": 8.5456, "altitude_amsl_m": 488.0}]),
    ]
    """Zero of the local frame (east, north, up)."""
    box_min_enu_m: Annotated[Position | None, Field(examples=[[0.0, 0.0, 20.0]])] = None
    """Lower south-western corner of the box."""
    box_max_enu_m: Annotated[Position | None, Field(examples=[[500.0, 500.0, 80.0]])] = None
    """Upper north-eastern corner of the box."""
    polygon_enu_m: Annotated[Polygon | None, Field(examples=[[[0.0, 0.0], [500.0, 0.0], [250.0, 400.0]]])] = None
    """Corners of the fence, instead of a box."""
    floor_m: Annotated[Coordinate | None, Field(examples=[20.0])] = None
    """Lowest height flown, with `polygon_enu_m`."""
    ceiling_m: Annotated[Coordinate | None, Field(examples=[80.0])] = None
    """Greatest height flown, with `polygon_enu_m`."""
    fence_margin_m: Annotated[float, Field(ge=0.0, le=1000.0)] = 3.0
    """How far outside that volume the fence lies that the autopilot is given, so that drifting is not a breach."""
    home_enu_m: Annotated[Position | None, Field(examples=[[0.0, 0.0, 0.0]])] = None
    """Where the vehicle stands before take-off; absent: on the ground (up = 0) below the start."""
    rally_enu_m: Annotated[tuple[Position, ...], Strict(False)] = ()
    """Where the vehicle's own return may land: at the nearest of home and these; what is flown home lands at home."""

    @property
    def box_m(self) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
        """The two corners of the box that is explored: as given, or around the polygon."""
        if self.box_min_enu_m is not None and self.box_max_enu_m is not None:
            return self.box_min_enu_m, self.box_max_enu_m
        assert self.polygon_enu_m is not None
        assert self.floor_m is not None
        assert self.ceiling_m is not None
        east, north = zip(*self.polygon_enu_m, strict=True)
        return (min(east), min(north), self.floor_m), (max(east), max(north), self.ceiling_m)

    def findings(self) -> Iterator[Finding]:
        """A box or a polygon, complete and not empty."""
        as_polygon = self.polygon_enu_m is not None
        wanted, unwanted = ("box_min_enu_m", "box_max_enu_m"), ("polygon_enu_m", "floor_m", "ceiling_m")
        if as_polygon:
            wanted, unwanted = unwanted, wanted
        for key in wanted:
            if getattr(self, key) is None:
                example = type(self).model_fields[key].examples
                yield Finding(
                    key,
                    "",
                    f"is missing: write {key} = {example[0] if example else '…'}"
                    + ("" if as_polygon else ", or give polygon_enu_m, floor_m and ceiling_m instead of a box"),
                )
        for key in unwanted:
            if getattr(self, key) is not None:
                yield Finding(
                    key,
                    str(getattr(self, key)),
                    "belongs to the other way of giving the volume: give either box_min_enu_m and box_max_enu_m, or "
                    "polygon_enu_m, floor_m and ceiling_m",
                )
        if self.box_min_enu_m is not None and self.box_max_enu_m is not None:
            for axis, low, high in zip(("east", "north", "up"), self.box_min_enu_m, self.box_max_enu_m, strict=True):
                if not low < high:
                    yield Finding(
                        "box_max_enu_m",
                        str(list(self.box_max_enu_m)),
                        f"the box has no extent {axis}: {high:g} must be greater than box_min_enu_m's {low:g}",
                    )
        if self.floor_m is not None and self.ceiling_m is not None and not self.floor_m < self.ceiling_m:
            yield Finding(
                "ceiling_m", f"{self.ceiling_m:g}", f"must be greater than floor_m, which is {self.floor_m:g}"
            )
        if self.polygon_enu_m is not None and (fault := polygon_fault(self.polygon_enu_m)):
            yield Finding("polygon_enu_m", f"{len(self.polygon_enu_m)} corners", fault)
