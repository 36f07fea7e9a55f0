"""Distances to measured obstacles for the independent checker: from samples of their surfaces, by scipy's trees.

A sampled surface is never nearer than the surface itself, so nothing is called a fault that is none.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import RegularGridInterpolator
from scipy.spatial import KDTree

SAMPLES_A_CELL = 6
REACH_CELLS = 30
CLOSEST = 1000
CORNERS = 27


def array_of(entry: dict[str, Any]) -> np.ndarray:
    """The array that an entry's file holds."""
    file = Path(entry["file"])
    if file.suffix not in (".npy", ".npz"):
        raise ValueError(f"{file.name} cannot be checked: only .npy and .npz are read here")
    found = np.load(file)
    if isinstance(found, np.ndarray):
        return found
    return found[entry.get("key") or found.files[0]]


def ground_of(entry: dict[str, Any], origin: dict[str, float]) -> RegularGridInterpolator:
    """Height above the origin at (east, north), bilinear between the middles of cells."""
    rows, cell = np.asarray(array_of(entry), dtype=float), entry["cell_m"]
    if entry.get("rows", "north-to-south") == "north-to-south":
        rows = rows[::-1]
    if entry.get("heights", "above-sea-level") == "above-sea-level":
        rows = rows - origin["altitude_amsl_m"]
    center = entry.get("center_enu_m") or (0.0, 0.0)
    north, east = (
        middle + (np.arange(count) - 0.5 * (count - 1)) * cell
        for middle, count in zip(center[::-1], rows.shape, strict=True)
    )
    return RegularGridInterpolator((east, north), rows.T)


def terrain_distance(entry: dict[str, Any], origin: dict[str, float], points: np.ndarray) -> np.ndarray:
    """From points to the ground; not positive below it."""
    ground = ground_of(entry, origin)
    step, reach = entry["cell_m"] / SAMPLES_A_CELL, REACH_CELLS * entry["cell_m"]
    axes = [
        np.arange(max(axis[0], low - reach), min(axis[-1], high + reach), step)
        for axis, low, high in zip(ground.grid, points[:, :2].min(axis=0), points[:, :2].max(axis=0), strict=True)
    ]
    low, high = (np.array([axis[end] for axis in ground.grid]) for end in (0, -1))
    flat = np.clip(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2), low, high)
    surface = KDTree(np.column_stack([flat, ground(flat)]))
    above = heights_above(entry, origin, points)
    found, nearest = (np.asarray(part) for part in surface.query(points))
    # On cliffs samples are far apart: where it is closest, the surface around the nearest is looked at once more.
    close = np.argsort(found)[:CLOSEST]
    offsets = np.linspace(-step, step, SAMPLES_A_CELL**2 + 1)
    around = np.stack(np.meshgrid(offsets, offsets, indexing="ij"), axis=-1).reshape(-1, 2)
    for some in np.array_split(close, max(1, len(close) // 100)):
        places = np.clip(flat[nearest[some], None] + around, low, high)
        beside = np.concatenate([places, ground(places)[..., None]], axis=-1)
        found[some] = np.minimum(found[some], np.linalg.norm(beside - points[some, None], axis=-1).min(axis=1))
    return np.where(above > 0.0, found, above)


def heights_above(entry: dict[str, Any], origin: dict[str, float], points: np.ndarray) -> np.ndarray:
    """How high points are above the ground."""
    return points[:, 2] - ground_of(entry, origin)(points[:, :2])


def points_distance(entry: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """From points to a cloud of balls."""
    return KDTree(array_of(entry)[:, :3]).query(points)[0] - entry["radius_m"]


def voxels_distance(entry: dict[str, Any], points: np.ndarray) -> np.ndarray:
    """From points to the nearest of the occupied cells whose middles are near."""
    cell = entry["cell_m"]
    middles = np.array(entry["min_enu_m"]) + (np.argwhere(array_of(entry) != 0) + 0.5) * cell
    near = middles[KDTree(middles).query(points, k=min(CORNERS, len(middles)))[1].reshape(len(points), -1)]
    beyond = np.maximum(np.abs(near - points[:, None]) - 0.5 * cell, 0.0)
    return np.linalg.norm(beyond, axis=-1).min(axis=1)
