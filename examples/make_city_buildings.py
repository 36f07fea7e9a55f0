"""Draws examples/city_buildings.geojson: a made-up quarter of a town, streets, a square, a church and two towers.

Run it from anywhere: python examples/make_city_buildings.py
"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pymap3d

ORIGIN_DEG = (47.3977, 8.5456)
"""Latitude and longitude of the south-western corner of the quarter; the same as in city.toml."""

STREET_M = 26.0
BLOCKS_EAST_M = (0.0, 84.0, 96.0, 108.0, 92.0)
BLOCKS_NORTH_M = (0.0, 78.0, 92.0, 80.0)


def rectangle(west: float, south: float, width: float, depth: float, turn_deg: float = 0.0) -> np.ndarray:
    """Corners of a rectangle, turned about its middle."""
    half = np.array([width, depth]) / 2.0
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    angle = np.deg2rad(turn_deg)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return corners @ turn.T + np.array([west, south]) + half


def ring(east: float, north: float, radius: float, corners: int) -> np.ndarray:
    """Corners of a regular polygon."""
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    return np.array([east, north]) + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def angle_block(west: float, south: float, width: float, depth: float, wing: float) -> np.ndarray:
    """Corners of a building of two wings at a right angle."""
    east, north = west + width, south + depth
    return np.array(
        [
            [west, south],
            [east, south],
            [east, south + wing],
            [west + wing, south + wing],
            [west + wing, north],
            [west, north],
        ]
    )


def buildings() -> list[tuple[np.ndarray, float, str]]:
    """Corners, height in metres and name of every building."""
    random = np.random.default_rng(3)
    built: list[tuple[np.ndarray, float, str]] = []
    west = STREET_M
    for column, width in enumerate(BLOCKS_EAST_M[1:]):
        south = STREET_M
        for row, depth in enumerate(BLOCKS_NORTH_M[1:]):
            if (column, row) == (1, 1):
                # The square: a church with its tower, and otherwise nothing.
                built.append((rectangle(west + 30.0, south + 34.0, 34.0, 18.0, 12.0), 24.0, "church"))
                built.append((rectangle(west + 20.0, south + 34.0, 10.0, 10.0, 12.0), 58.0, "church tower"))
            elif (column, row) == (2, 2):
                built.append((ring(west + width / 2, south + depth / 2, 21.0, 8), 82.0, "round tower"))
                built.append((rectangle(west, south, width, 14.0), 12.0, "arcade"))
            elif (column, row) == (3, 0):
                built.append((rectangle(west + 8.0, south + 10.0, 36.0, 36.0, 20.0), 74.0, "tower"))
                built.append((rectangle(west + 58.0, south, 30.0, depth), 22.0, "offices"))
            else:
                height = float(np.round(random.uniform(16.0, 40.0)))
                built.append((angle_block(west, south, width * 0.62, depth, 17.0), height, "corner house"))
                for place in range(2):
                    size = (depth - 12.0) / 2.0
                    house = rectangle(west + width * 0.70, south + place * (size + 12.0), width * 0.30, size)
                    built.append((house, float(np.round(random.uniform(14.0, 48.0))), "house"))
            south += depth + STREET_M
        west += width + STREET_M
    return built


def feature_collection() -> dict[str, object]:
    """The buildings as GeoJSON, longitude first."""
    features = []
    for corners, height_m, name in buildings():
        latitude, longitude, _ = pymap3d.enu2geodetic(corners[:, 0].copy(), corners[:, 1].copy(), 0.0, *ORIGIN_DEG, 0.0)
        places = [[round(float(x), 7), round(float(y), 7)] for x, y in zip(longitude, latitude, strict=True)]
        features.append(
            {
                "type": "Feature",
                "properties": {"name": name, "height_m": height_m},
                "geometry": {"type": "Polygon", "coordinates": [[*places, places[0]]]},
            }
        )
    return {"type": "FeatureCollection", "features": features}


if __name__ == "__main__":
    target = Path(__file__).parent / "city_buildings.geojson"
    lines = ",\n".join("    " + json.dumps(feature) for feature in feature_collection()["features"])
    target.write_text(f'{{\n  "type": "FeatureCollection",\n  "features": [\n{lines}\n  ]\n}}\n', encoding="utf-8")
    print(f"wrote {target}")
