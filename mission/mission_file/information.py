"""`[information]`: where time should be spent."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, Strict

from mission.findings import Finding
from mission.mission_file.values import Horizontal, InputFile, Length, Position, Section


class Uniform(Section):
    """The same everywhere in the free space."""

    kind: Literal["uniform"]
    """`uniform`"""


class Component(Section):
    """One normal distribution of a mixture, its axes along east, north and up."""

    mean_enu_m: Annotated[Position, Field(examples=[[120.0, 300.0, 40.0]])]
    """Its middle."""
    std_m: Annotated[tuple[Length, Length, Length], Strict(False), Field(examples=[[40.0, 60.0, 15.0]])]
    """Standard deviations along east, north and up."""
    weight: Annotated[float, Field(gt=0.0, le=1e12)] = 1.0
    """Its share, relative to the other components."""


class Gaussians(Section):
    """A mixture of normal distributions, cut to the box."""

    kind: Literal["gaussians"]
    """`gaussians`"""
    component: Annotated[
        tuple[Component, ...],
        Strict(False),
        Field(min_length=1, examples=[[{"mean_enu_m": [120.0, 300.0, 40.0], "std_m": [40.0, 60.0, 15.0]}]]),
    ]
    """`[[information.component]]`, one table each."""


class Raster(Section):
    """A map of cells from a file: `.npy`, `.npz`, or GeoTIFF (`.tif`, with the `geo` extra)."""

    kind: Literal["raster"]
    """`raster`"""
    raster: Annotated[InputFile, Field(examples=["search_probability.npz"])]
    """The file: two-dimensional, rows from north to south and columns from west to east; any non-negative weight."""
    key: str | None = None
    """Which array of an `.npz` file; absent: the only one, or `probability`."""
    cell_m: Annotated[Length | None, Field(examples=[30.0])] = None
    """Edge length of a cell; needed for `.npy` and `.npz`, a GeoTIFF knows its own."""
    rows: Literal["north-to-south", "south-to-north"] = "north-to-south"
    """Which way the rows run."""
    anchor: Literal["middle", "peak"] = "middle"
    """Which place of the raster lies at `center_enu_m`: its middle, or its greatest cell."""
    center_enu_m: Annotated[Horizontal | None, Field(examples=[[0.0, 0.0]])] = None
    """Where the anchor lies; absent: at the origin. A GeoTIFF lies where it says."""

    @property
    def georeferenced(self) -> bool:
        """Whether the file itself says where it lies."""
        return self.raster.suffix.lower() in (".tif", ".tiff")

    def findings(self) -> Iterator[Finding]:
        """A file of a known kind, and a place for it."""
        if self.raster.suffix.lower() not in (".npy", ".npz", ".tif", ".tiff"):
            yield Finding("raster", self.raster.name, "must be a .npy, .npz or .tif file")
        elif not self.georeferenced and self.cell_m is None:
            yield Finding("cell_m", "", "is missing: write the edge length of a cell in metres, cell_m = 30.0")
        if self.georeferenced:
            for name in ("cell_m", "center_enu_m"):
                if getattr(self, name) is not None:
                    yield Finding(
                        name, str(getattr(self, name)), "a GeoTIFF says itself where it lies: remove this entry"
                    )
            if self.anchor == "peak":
                yield Finding("anchor", "peak", "a GeoTIFF says itself where it lies: remove this entry")


class SampleSet(Section):
    """Weighted points from a CSV or `.npy` file: places where something was seen, or particles of a filter."""

    kind: Literal["samples"]
    """`samples`"""
    samples: Annotated[InputFile, Field(examples=["sightings.csv"])]
    """The file: columns `east_m, north_m, up_m` (or `latitude_deg, longitude_deg, altitude_amsl_m`), and `weight`."""


Information = Annotated[Uniform | Gaussians | Raster | SampleSet, Field(discriminator="kind")]
