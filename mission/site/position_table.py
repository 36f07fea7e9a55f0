"""Positions from files: CSV with named columns, or a numpy array."""

from __future__ import annotations

import csv
import dataclasses
import math
from pathlib import Path

import numpy as np
from jaxtyping import Float

from mission.site.rasters import read_array
from sim_bridge.frames import enu_from_geodetic
from sim_bridge.state import GeodeticPoint

LOCAL = ("east_m", "north_m", "up_m")
GEODETIC = ("latitude_deg", "longitude_deg", "altitude_amsl_m")


@dataclasses.dataclass(frozen=True)
class PositionTable:
    """Weighted positions.

    Attributes:
        position_m: Shape (row, 3), local ENU.
        weight: Shape (row,), one where the file has none.
    """

    position_m: Float[np.ndarray, "row 3"]
    weight: Float[np.ndarray, "row"]


def read_positions(path: Path, origin: GeodeticPoint) -> PositionTable:
    """Positions from a CSV file or a numpy array.

    A CSV file has the columns east_m, north_m, up_m or latitude_deg, longitude_deg, altitude_amsl_m, and may have
    weight; an array has three or four columns: east, north, up, weight.

    Raises:
        ValueError: A file that is not such a table, with the line.
    """
    match path.suffix.lower():
        case ".npy" | ".npz":
            rows = np.asarray(read_array(path), dtype=float)
            if rows.ndim != 2 or rows.shape[1] not in (3, 4):
                raise ValueError(f"{path.name} has the shape {rows.shape}; three or four columns are needed")
        case ".csv" | ".txt":
            rows = _rows_of(path, origin)
        case other:
            raise ValueError(f"{path.name}: '{other}' is not known here, use .csv or .npy")
    weight = rows[:, 3] if rows.shape[1] == 4 else np.ones(len(rows))
    if not len(rows):
        raise ValueError(f"{path.name} holds no positions")
    if not np.isfinite(rows).all():
        raise ValueError(
            f"{path.name}: row {int(np.argmin(np.isfinite(rows).all(axis=1))) + 1} holds a non-finite number"
        )
    if (weight < 0.0).any() or not weight.any():
        raise ValueError(f"{path.name}: weights must not be negative, and not all zero")
    return PositionTable(rows[:, :3], weight)


def _rows_of(path: Path, origin: GeodeticPoint) -> Float[np.ndarray, "row 4"]:
    try:
        with path.open(encoding="utf-8-sig", newline="") as text:
            reader = csv.DictReader(text, skipinitialspace=True)
            names = tuple(name.strip() for name in reader.fieldnames or ())
            reader.fieldnames = list(names)
            columns = next((c for c in (LOCAL, GEODETIC) if set(c) <= set(names)), None)
            if columns is None:
                raise ValueError(
                    f"{path.name} has the columns {', '.join(names) or '(none)'}; it needs {', '.join(LOCAL)} or "
                    f"{', '.join(GEODETIC)} in its first line"
                )
            rows = []
            for row in reader:
                if None in row or None in row.values():
                    raise ValueError(
                        f"{path.name}, line {reader.line_num}: it has not as many entries as the first line"
                    )
                try:
                    numbers = [float(row[name]) for name in columns]
                    weight = float(row["weight"]) if row.get("weight") not in (None, "") else 1.0
                except (TypeError, ValueError) as error:
                    raise ValueError(f"{path.name}, line {reader.line_num}: {error}") from error
                if columns is GEODETIC and all(map(math.isfinite, numbers)):
                    numbers = enu_from_geodetic(GeodeticPoint(*numbers), origin)
                rows.append([*numbers, weight])
    except OSError as error:
        raise ValueError(f"{path.name} cannot be read: {error.strerror or error}") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path.name} is not a table of comma-separated text: {error}") from error
    return np.array(rows, dtype=float).reshape(-1, 4)
