"""`[[obstacle]]` and `[[no_fly]]`: what to stay away from."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from mission.findings import Finding
from mission.mission_file.values import (
    Coordinate,
    Horizontal,
    InputFile,
    Length,
    Polygon,
    Position,
    Section,
    polygon_fault,
)


class Sphere(Section):
    """A ball."""

    kind: Literal["sphere"]
    """`sphere`"""
    center_enu_m: Annotated[Position, Field(examples=[[250.0, 250.0, 50.0]])]
    """Its middle."""
    radius_m: Annotated[Length, Field(examples=[20.0])]
    """Its radius."""


def _upside_down(floor_m: float, ceiling_m: float) -> Iterator[Finding]:
    """A lower end that is not below the upper one."""
    if not floor_m < ceiling_m:
        yield Finding("ceiling_m", f"{ceiling_m:g}", f"must be greater than floor_m, which is {floor_m:g}")


class Cylinder(Section):
    """An upright cylinder."""

    kind: Literal["cylinder"]
    """`cylinder`"""
    center_enu_m: Annotated[Horizontal, Field(examples=[[100.0, 200.0]])]
    """Its axis."""
    radius_m: Annotated[Length, Field(examples=[5.0])]
    """Its radius."""
    floor_m: Annotated[Coordinate, Field(examples=[0.0])]
    """Height of its lower end."""
    ceiling_m: Annotated[Coordinate, Field(examples=[60.0])]
    """Height of its upper end."""

    def findings(self) -> Iterator[Finding]:
        """The floor below the ceiling."""
        yield from _upside_down(self.floor_m, self.ceiling_m)


class Box(Section):
    """A box with its edges along east, north and up."""

    kind: Literal["box"]
    """`box`"""
    min_enu_m: Annotated[Position, Field(examples=[[10.0, 10.0, 0.0]])]
    """Lower south-western corner."""
    max_enu_m: Annotated[Position, Field(examples=[[30.0, 25.0, 40.0]])]
    """Upper north-eastern corner."""

    def findings(self) -> Iterator[Finding]:
        """An extent along every axis."""
        for axis, low, high in zip(("east", "north", "up"), self.min_enu_m, self.max_enu_m, strict=True):
            if not low < high:
                yield Finding(
                    "max_enu_m",
                    str(list(self.max_enu_m)),
                    f"the box has no extent {axis}: {high:g} must be greater than min_enu_m's {low:g}",
                )


class Prism(Section):
    """An upright prism over a polygon."""

    kind: Literal["prism"]
    """`prism`"""
    polygon_enu_m: Annotated[Polygon, Field(examples=[[[0.0, 0.0], [40.0, 0.0], [40.0, 30.0]]])]
    """Corners of its base."""
    floor_m: Annotated[Coordinate, Field(examples=[0.0])]
    """Height of its lower end."""
    ceiling_m: Annotated[Coordinate, Field(examples=[60.0])]
    """Height of its upper end."""

    def findings(self) -> Iterator[Finding]:
        """A simple polygon, and the floor below the ceiling."""
        yield from _upside_down(self.floor_m, self.ceiling_m)
        if fault := polygon_fault(self.polygon_enu_m):
            yield Finding("polygon_enu_m", f"{len(self.polygon_enu_m)} corners", fault)


class GeoJson(Section):
    """Buildings: every polygon of a GeoJSON file (longitude, latitude) becomes a prism; courtyards are filled."""

    kind: Literal["geojson"]
    """`geojson`"""
    file: Annotated[InputFile, Field(examples=["city_buildings.geojson"])]
    """The file."""
    height_property: str = "height_m"
    """Property of each polygon that says how high above the ground it ends."""
    base_property: str = "base_m"
    """Property that says how high above the ground it begins; where a polygon lacks it, on the ground."""
    ground_m: Coordinate = 0.0
    """Height of the ground that these are above."""


class Points(Section):
    """A cloud of points (from a laser scanner, say), each a small ball; CSV or `.npy`, columns as for samples."""

    kind: Literal["points"]
    """`points`"""
    file: Annotated[InputFile, Field(examples=["scan.csv"])]
    """The file."""
    radius_m: Annotated[Length, Field(examples=[0.5])]
    """Radius of each ball: at least half the spacing of the points, so that surfaces are closed."""


class Mesh(Section):
    """A closed surface of triangles in local metres (`.stl`, `.obj`, `.ply`; with the `mesh` extra)."""

    kind: Literal["mesh"]
    """`mesh`"""
    file: Annotated[InputFile, Field(examples=["tower.stl"])]
    """The file."""
    position_enu_m: Position = (0.0, 0.0, 0.0)
    """Where the mesh's own zero lies."""


class Voxels(Section):
    """Occupied cells: a three-dimensional `.npy` array (east, north, up), occupied where it is not zero."""

    kind: Literal["voxels"]
    """`voxels`"""
    file: Annotated[InputFile, Field(examples=["occupied.npy"])]
    """The file."""
    min_enu_m: Annotated[Position, Field(examples=[[0.0, 0.0, 0.0]])]
    """Lower south-western corner of the first cell."""
    cell_m: Annotated[Length, Field(examples=[0.5])]
    """Edge length of a cell."""


class Terrain(Section):
    """The ground: a raster of heights (`.npy`, `.npz` or GeoTIFF), solid below.

    Where the raster ends its outermost heights go on: it should reach further beyond the box than is kept from
    obstacles.
    """

    kind: Literal["terrain"]
    """`terrain`"""
    file: Annotated[InputFile, Field(examples=["elevation.tif"])]
    """The file: metres above the origin, or above sea level (`heights`)."""
    key: str | None = None
    """Which array of an `.npz` file; absent: the only one."""
    cell_m: Length | None = None
    """Edge length of a cell; needed for `.npy` and `.npz`."""
    rows: Literal["north-to-south", "south-to-north"] = "north-to-south"
    """Which way the rows run."""
    center_enu_m: Horizontal | None = None
    """Where the middle of the raster lies; absent: at the origin. A GeoTIFF lies where it says."""
    heights: Literal["above-origin", "above-sea-level"] = "above-sea-level"
    """What the heights are measured from."""
    least_height_m: Annotated[Length | None, Field(examples=[40.0])] = None
    """Least height above the ground that paths keep; absent: clearance alone counts."""
    greatest_height_m: Annotated[Length | None, Field(examples=[120.0])] = None
    """Greatest height above the ground that paths keep; absent: no limit but the box."""

    def findings(self) -> Iterator[Finding]:
        """The least height below the greatest."""
        least, greatest = self.least_height_m, self.greatest_height_m
        if least is not None and greatest is not None and not least < greatest:
            yield Finding(
                "greatest_height_m", f"{greatest:g}", f"must be greater than least_height_m, which is {least:g}"
            )


Obstacle = Annotated[
    Sphere | Cylinder | Box | Prism | GeoJson | Points | Mesh | Voxels | Terrain, Field(discriminator="kind")
]
"""Anything solid."""

NoFly = Annotated[Cylinder | Box | Prism, Field(discriminator="kind")]
"""A volume that is forbidden; it is kept away from as an obstacle is, and exported as an exclusion fence."""
