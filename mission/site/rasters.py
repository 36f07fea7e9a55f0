"""Maps of cells from files: arrays of numpy, and GeoTIFFs."""

from __future__ import annotations

import dataclasses
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from jaxtyping import Float

from sim_bridge.state import GeodeticPoint

MOST_CELLS = 2**28
"""Larger arrays are refused before they fill the memory; cut them out of their surroundings first."""


@dataclasses.dataclass(frozen=True)
class Raster:
    """A map of cells in the local frame.

    Attributes:
        values: Shape (east, north).
        low_m: South-western corner of the first cell, shape (2,).
        cell_m: Edge lengths of a cell along east and north, shape (2,).
    """

    values: Float[np.ndarray, "east north"]
    low_m: Float[np.ndarray, "2"]
    cell_m: Float[np.ndarray, "2"]

    @property
    def high_m(self) -> Float[np.ndarray, "2"]:
        """North-eastern corner of the last cell."""
        return self.low_m + np.array(self.values.shape) * self.cell_m

    def clipped(self, low_m: Float[np.ndarray, "2"], high_m: Float[np.ndarray, "2"]) -> Raster:
        """The cells that touch a rectangle.

        Raises:
            ValueError: None does.
        """
        first = np.floor((np.asarray(low_m) - self.low_m) / self.cell_m).astype(int)
        last = np.ceil((np.asarray(high_m) - self.low_m) / self.cell_m).astype(int)
        first, last = np.clip(first, 0, self.values.shape), np.clip(last, 0, self.values.shape)
        if (first >= last).any():
            raise ValueError(
                f"the raster covers east {self.low_m[0]:.0f} … {self.high_m[0]:.0f} m and north {self.low_m[1]:.0f} … "
                f"{self.high_m[1]:.0f} m, which does not touch the box: move it with center_enu_m, or move the box"
            )
        return Raster(
            np.array(self.values[first[0] : last[0], first[1] : last[1]], dtype=float),
            self.low_m + first * self.cell_m,
            self.cell_m,
        )


def read_array(path: Path, key: str | None = None) -> np.ndarray:
    """A numeric array from a `.npy` (mapped, not loaded) or `.npz` file; objects are never unpickled.

    Args:
        path: The file.
        key: Which array of an `.npz`; None: the only one, or `probability`.

    Raises:
        ValueError: Not such a file, no such key, not numbers, or too large.
    """
    try:
        if path.suffix.lower() == ".npz":
            with np.load(path, allow_pickle=False) as archive:
                array = archive[_key_in(path, key)]
        else:
            array = np.load(path, allow_pickle=False, mmap_mode="r")
    except (OSError, EOFError, zipfile.BadZipFile, ValueError) as error:
        # What numpy advises of a file that is none of its own, or holds objects, nobody should do.
        why = "it is none, or holds objects instead of numbers" if "pickle" in str(error) else error
        raise ValueError(f"{path.name} cannot be read as a numpy file: {why}") from error
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{path.name} holds {array.dtype}, and numbers are needed")
    return array


def _key_in(path: Path, key: str | None) -> str:
    """Which array of an archive is meant, from its table of contents and headers alone."""
    with zipfile.ZipFile(path) as archive:
        names = [name.removesuffix(".npy") for name in archive.namelist()]
        chosen = key if key is not None else names[0] if len(names) == 1 else "probability"
        if chosen not in names:
            raise ValueError(f"it has no array '{chosen}'; it holds {', '.join(names)}: write key = \"{names[0]}\"")
        with archive.open(f"{chosen}.npy") as member:
            version = np.lib.format.read_magic(member)
            read_header = (
                np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
            )
            shape, _, _ = read_header(member)
    if np.prod(shape, dtype=float) > MOST_CELLS:
        raise ValueError(f"its shape {shape} is too large: cut out what is needed first")
    return chosen


def read_raster(
    path: Path,
    *,
    key: str | None,
    cell_m: float,
    center_m: tuple[float, float],
    north_first: bool,
    anchor_at_peak: bool = False,
) -> Raster:
    """A raster from a numpy file.

    Args:
        path: The file, two-dimensional: rows run north or south, columns east.
        key: Which array of an `.npz` file.
        cell_m: Edge length of a cell.
        center_m: Where the anchor lies, [east, north].
        north_first: Whether the first row is the northernmost.
        anchor_at_peak: Whether the anchor is the middle of the greatest cell (the first of them), else of the raster.

    Raises:
        ValueError: A file that is not two-dimensional numbers, or is empty.
    """
    rows = read_array(path, key)
    if rows.ndim != 2 or rows.size == 0:
        raise ValueError(f"{path.name} has the shape {rows.shape}, and rows and columns of cells are needed")
    values = (rows[::-1] if north_first else rows).T
    anchor = np.array(values.shape) / 2.0
    if anchor_at_peak:
        if not np.isfinite(values).any():
            raise ValueError(f"{path.name} holds nothing but NaN, so it has no peak to anchor")
        anchor = np.array(np.unravel_index(int(np.nanargmax(values)), values.shape)) + 0.5
    return Raster(values, np.asarray(center_m) - anchor * cell_m, np.array([cell_m, cell_m]))


def read_geotiff(
    path: Path,
    origin: GeodeticPoint,
    low_m: Float[np.ndarray, "2"],
    high_m: Float[np.ndarray, "2"],
    border_m: Callable[[float], float] = lambda cell_m: 0.0,
) -> Raster:
    """The part of a GeoTIFF over a rectangle, resampled to cells along east and north.

    The local plane is taken as the azimuthal equidistant projection about the origin. Tangent-plane coordinates differ
    from it by r³/6R² (4 mm at 10 km) and by the share of the Earth's radius that the ground is high (0.2 ‰ at 1.4 km).

    Args:
        path: The file, in any projection; its first band is read, cells without data are NaN.
        origin: Of the local frame.
        low_m: South-western corner.
        high_m: North-eastern corner.
        border_m: How far around the rectangle it is read too, by the edge length of the file's cells.

    Raises:
        ValueError: rasterio is not installed, or the file has no projection or does not reach the rectangle.
    """
    try:
        import rasterio
        from rasterio.enums import Resampling
        from rasterio.errors import RasterioError
        from rasterio.vrt import WarpedVRT
    except ImportError as error:
        raise ValueError("GeoTIFFs need rasterio: pip install rasterio, or save the raster as .npz") from error
    local = f"+proj=aeqd +lat_0={origin.latitude_deg} +lon_0={origin.longitude_deg} +datum=WGS84 +units=m"
    low, high = np.asarray(low_m, dtype=float), np.asarray(high_m, dtype=float)
    try:
        with rasterio.open(path) as source:
            if source.crs is None:
                raise ValueError(f"{path.name} does not say where it lies (no coordinate system)")
            with WarpedVRT(source, crs=local) as warped:
                cell_m = float(warped.res[0])
                left, bottom, right, top = warped.bounds
            if left >= high[0] or right <= low[0] or bottom >= high[1] or top <= low[1]:
                raise ValueError(
                    f"{path.name} covers east {left:.0f} … {right:.0f} m and north {bottom:.0f} … {top:.0f} m from the "
                    "origin, which does not touch the box: is site.origin right?"
                )
            border = border_m(cell_m)
            low, high = low - border, high + border
            count = np.maximum(np.ceil((high - low) / cell_m).astype(int), 1)
            if np.prod(count, dtype=float) > MOST_CELLS:
                raise ValueError(f"{path.name} has cells of {cell_m:.3g} m, too small for a box of this size")
            size_m = (high - low) / count
            transform = rasterio.Affine(size_m[0], 0.0, low[0], 0.0, -size_m[1], high[1])
            with WarpedVRT(
                source,
                crs=local,
                transform=transform,
                width=int(count[0]),
                height=int(count[1]),
                resampling=Resampling.bilinear,
                dtype="float64",
                nodata=np.nan,
            ) as warped:
                rows = warped.read(1)
    except RasterioError as error:
        raise ValueError(f"{path.name} cannot be read as a GeoTIFF: {error}") from error
    return Raster(rows[::-1].T, low, size_m)
