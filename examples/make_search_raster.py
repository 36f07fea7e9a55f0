"""Draws examples/search_probability.npz: where a walker who is missing since yesterday may be.

The shape follows what search teams use: distances from the last known point that fit a log-normal distribution
(quartiles of 0.5, 0.9 and 1.6 km), more along paths and the stream, less on steep ground. The land is made up.

Run it from anywhere: python examples/make_search_raster.py
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter, map_coordinates

CELL_M = 30.0
CELLS = 100
"""Three kilometres a side; rows run from north to south, columns from west to east."""

LAST_KNOWN_M = (120.0, -180.0)
MEDIAN_M, SPREAD = 900.0, 0.85
PATHS_M = (
    ((-1500, -900), (-700, -650), (-250, -400), (120, -180), (420, 160), (560, 620), (900, 1000), (1500, 1180)),
    ((120, -180), (-160, 120), (-340, 480), (-360, 900), (-620, 1500)),
    ((420, 160), (800, 60), (1150, -240), (1500, -260)),
)
STREAM_M = ((-1500, 420), (-900, 380), (-420, 130), (-60, -20), (240, -330), (380, -800), (720, -1500))


def distance_to_line_m(corners_m: tuple[tuple[int, int], ...], east_m: np.ndarray, north_m: np.ndarray) -> np.ndarray:
    """Distance of every cell from a polyline, by drawing it finely into the grid."""
    drawn = np.ones(east_m.shape, dtype=bool)
    corners = np.array(corners_m, dtype=float)
    for start, end in itertools.pairwise(corners):
        for place in start + np.linspace(0.0, 1.0, 200)[:, None] * (end - start):
            column = int((place[0] + CELLS * CELL_M / 2) / CELL_M)
            row = int((CELLS * CELL_M / 2 - place[1]) / CELL_M)
            if 0 <= row < CELLS and 0 <= column < CELLS:
                drawn[row, column] = False
    return distance_transform_edt(drawn) * CELL_M


def land_m(seed: int) -> np.ndarray:
    """Heights of hills of every size, rougher where they are smaller."""
    random = np.random.default_rng(seed)
    height = np.zeros((CELLS, CELLS))
    for octave in range(5):
        coarse = random.normal(size=(4 * 2**octave, 4 * 2**octave))
        place = np.linspace(0.0, coarse.shape[0] - 1.0, CELLS)
        height += 110.0 * 0.5**octave * map_coordinates(coarse, np.meshgrid(place, place, indexing="ij"), order=3)
    return height


def probability() -> np.ndarray:
    """The chance of each cell, shape (row, column), sums to one."""
    axis = (np.arange(CELLS) + 0.5) * CELL_M - CELLS * CELL_M / 2
    east, north = np.meshgrid(axis, axis[::-1])
    distance = np.maximum(np.hypot(east - LAST_KNOWN_M[0], north - LAST_KNOWN_M[1]), CELL_M / 2)
    # A log-normal density of distance, spread over the circle of that radius.
    ring = np.exp(-0.5 * (np.log(distance / MEDIAN_M) / SPREAD) ** 2) / distance**2
    paths = sum(np.exp(-0.5 * (distance_to_line_m(p, east, north) / 45.0) ** 2) for p in PATHS_M)
    stream = np.exp(-0.5 * (distance_to_line_m(STREAM_M, east, north) / 40.0) ** 2)
    slope = np.hypot(*np.gradient(gaussian_filter(land_m(seed=7), 1.0), CELL_M))
    walkable = 1.0 / (1.0 + (slope / 0.25) ** 2)
    chance = ring * (0.6 + 1.5 * paths + 0.8 * stream) * (0.15 + walkable)
    chance = gaussian_filter(chance, 0.7)
    return (chance / chance.sum()).astype(np.float32)


if __name__ == "__main__":
    target = Path(__file__).parent / "search_probability.npz"
    np.savez_compressed(target, probability=probability())
    print(f"wrote {target}")
