"""Obstacles from measured files: points, meshes, voxels and terrain become distances for the planner."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path

import numpy as np
from jaxtyping import Float
from scipy.ndimage import distance_transform_edt

from mission.mission_file.obstacle import Mesh, Points, Terrain, Voxels
from mission.site.nearness import demand_near
from mission.site.position_table import read_positions
from mission.site.rasters import Raster, read_array, read_geotiff, read_raster
from planner import distance_grid
from planner.distance_grid import DistanceGrid
from planner.height_field import HeightField, band, ground
from planner.workspace import Workspace
from sim_bridge.state import GeodeticPoint

MOST_TRIANGLES = 2_000_000
# Of what is kept from obstacles: what a grid of distances cannot prove is about a cell.
CELL_SHARE = 0.25
LEAST_CELL_M = 0.02
# Terrain is read so many cells past the region, so that its border is surrounded by posts,
BORDER_POSTS = 2.0
# and as far as what is kept from it reaches, with what is allowed on top to round corners and bridge samples.
REACH_SHARE = 3.0
KEPT = 8


@dataclasses.dataclass(frozen=True)
class Frame:
    """Where a file's contents are put.

    Attributes:
        origin: Of the local frame; heights above the sea are measured from its altitude.
        low_m: Lower corner of where distances are wanted.
        high_m: Upper corner.
        keep_out_m: What is kept from obstacles: cells are made small against it where memory allows.
    """

    origin: GeodeticPoint
    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]
    keep_out_m: float

    @property
    def region(self) -> Workspace:
        """Where distances are wanted."""
        return Workspace(np.array(self.low_m), np.array(self.high_m))

    @property
    def cell_m(self) -> float:
        """The cell wanted for a grid of distances."""
        return max(CELL_SHARE * self.keep_out_m, LEAST_CELL_M)

    @property
    def reach_m(self) -> float:
        """How far beyond the region ground counts."""
        return REACH_SHARE * self.keep_out_m

    def border_m(self, raster_cell_m: float) -> float:
        """How far beyond the region a raster of the ground is read."""
        return max(BORDER_POSTS * raster_cell_m, self.reach_m + raster_cell_m)


def grid_of(entry: Points | Mesh | Voxels, frame: Frame) -> DistanceGrid:
    """The distances to what a file describes; kept, so that a check, a plan and a picture read it once.

    Args:
        entry: The file, and how it is to be read.
        frame: Where its contents are put.

    Raises:
        ValueError: A file that cannot be used, with its name.
    """
    return _grid_of(entry, frame, _version(entry.file))  # pyright: ignore[reportArgumentType] (frozen, so hashable)


@functools.lru_cache(maxsize=KEPT)
def _grid_of(entry: Points | Mesh | Voxels, frame: Frame, _: object) -> DistanceGrid:
    region, cell_m, name = frame.region, frame.cell_m, entry.file.name
    match entry:
        case Points():
            positions_m = read_positions(entry.file, frame.origin).position_m
            demand_near(name, [positions_m], frame.low_m, frame.high_m, "is it meant for this site.origin?")
            return distance_grid.from_points(positions_m, entry.radius_m, region, cell_m)
        case Mesh():
            vertices, faces = _read_mesh(entry)
            vertices += np.array(entry.position_enu_m)
            demand_near(name, [vertices], frame.low_m, frame.high_m, "is position_enu_m right, and is it in metres?")
            return distance_grid.from_mesh(vertices, faces, region, cell_m)
        case Voxels():
            occupied = np.asarray(read_array(entry.file))
            if occupied.ndim != 3 or not np.isfinite(occupied).all():
                raise ValueError(
                    f"{name} has the shape {occupied.shape}; finite numbers along three axes (east, north, "
                    "up) are needed"
                )
            if not occupied.any():
                raise ValueError(f"{name} holds no occupied cell: leave the entry out")
            low_m = np.array(entry.min_enu_m)
            corners_m = np.array([low_m, low_m + entry.cell_m * np.array(occupied.shape)])
            demand_near(name, [corners_m], frame.low_m, frame.high_m, "are min_enu_m and cell_m right?")
            return distance_grid.from_voxels(occupied != 0, low_m, entry.cell_m, region)


def surfaces_of(entry: Terrain, frame: Frame) -> tuple[HeightField, ...]:
    """The ground, and the heights above it that are kept.

    Args:
        entry: The file, and how it is to be read.
        frame: Where its contents are put.

    Raises:
        ValueError: A file that cannot be used, with its name, or gaps in it.
    """
    return _surfaces_of(entry, frame, _version(entry.file))  # pyright: ignore[reportArgumentType] (as above)


@functools.lru_cache(maxsize=KEPT)
def _surfaces_of(entry: Terrain, frame: Frame, _: object) -> tuple[HeightField, ...]:
    raster = _raster_of(entry, frame)
    _demand_heights(entry.file.name, raster, frame.region)
    above_m = frame.origin.altitude_amsl_m if entry.heights == "above-sea-level" else 0.0
    heights = _filled(raster.values) - above_m
    # A single row or column goes on to both sides.
    heights = np.pad(heights, [(0, max(0, 2 - count)) for count in heights.shape], mode="edge")
    first_post_m = raster.low_m + 0.5 * raster.cell_m
    field = ground(heights, first_post_m, raster.cell_m, frame.region, frame.cell_m, frame.reach_m)
    return field, *band(field, entry.least_height_m, entry.greatest_height_m, frame.keep_out_m)


def _version(file: Path) -> tuple[int, int]:
    """What differs when a file was written anew."""
    try:
        state = file.stat()
    except OSError as error:
        raise ValueError(f"{file.name} cannot be read: {error.strerror or error}") from error
    return state.st_mtime_ns, state.st_size


def _demand_heights(name: str, raster: Raster, region: Workspace) -> None:
    # Of the cells on the border those whose middles lie inside.
    inset = np.minimum(0.5 * raster.cell_m, 0.5 * region.lengths_m[:2])
    site = raster.clipped(region.box_min_m[:2] + inset, region.box_max_m[:2] - inset)
    missing = ~np.isfinite(site.values)
    if missing.any():
        east, north = site.low_m + (np.argwhere(missing)[0] + 0.5) * site.cell_m
        raise ValueError(
            f"{name} has no height in {int(missing.sum())} of {missing.size} cells of the site, the first at east "
            f"{east:.0f}, north {north:.0f} m: fill the gaps, or move the box"
        )


def _filled(heights_m: Float[np.ndarray, "east north"]) -> Float[np.ndarray, "east north"]:
    """Where the file tells no height, that of the nearest cell goes on."""
    nearest = distance_transform_edt(~np.isfinite(heights_m), return_distances=False, return_indices=True)
    return heights_m[tuple(np.asarray(nearest))]


def _raster_of(entry: Terrain, frame: Frame) -> Raster:
    low, high = frame.region.box_min_m[:2], frame.region.box_max_m[:2]
    if entry.file.suffix.lower() in (".tif", ".tiff"):
        return read_geotiff(entry.file, frame.origin, low, high, frame.border_m)
    if entry.cell_m is None:
        raise ValueError(f"{entry.file.name} does not say how large its cells are: write cell_m")
    raster = read_raster(
        entry.file,
        key=entry.key,
        cell_m=entry.cell_m,
        center_m=entry.center_enu_m or (0.0, 0.0),
        north_first=entry.rows == "north-to-south",
    )
    border = frame.border_m(float(raster.cell_m.max()))
    part = raster.clipped(low - border, high + border)
    uncovered = np.maximum(part.low_m - low, high - part.high_m).max()
    if uncovered > raster.cell_m.max():
        raise ValueError(
            f"{entry.file.name} ends {uncovered:.0f} m inside the site: it must cover the box and home; a larger "
            "raster is needed, or another center_enu_m"
        )
    return part


def _read_mesh(entry: Mesh) -> tuple[np.ndarray, np.ndarray]:
    try:
        import trimesh
    except ImportError as error:
        raise ValueError("meshes need trimesh: pip install trimesh") from error
    name = entry.file.name
    try:
        mesh = trimesh.load_mesh(entry.file)
    except (OSError, ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        raise ValueError(f"{name} cannot be read as a mesh: {error or type(error).__name__}") from error
    if isinstance(mesh, trimesh.Scene):
        mesh = mesh.to_mesh()
    vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces)
    if not 0 < len(faces) <= MOST_TRIANGLES:
        raise ValueError(f"{name} has {len(faces)} triangles; from one to {MOST_TRIANGLES} are needed")
    if not mesh.is_watertight:
        raise ValueError(f"{name} is not a closed surface, so nothing is inside it: close its holes")
    return vertices, faces
