"""The values a mission file is made of: what may be written, and what it becomes.

Everything is local ENU metres after parsing: a geodetic position is converted here, with the origin and the folder of
the file handed in as pydantic's validation context (`Context`).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError

from mission.findings import Finding
from sim_bridge.frames import enu_from_geodetic
from sim_bridge.state import GeodeticPoint

LOCAL_PLANE_M = 100_000.0
"""How far from the origin a flat local frame is still a fair description."""

ORIGIN_MISSING = "origin_missing"
"""Type of the error of a geodetic position whose origin is itself wrong; the origin's own error is what is shown."""


class CommandLineText(str):
    """A text that came from `--set`: file names in it are relative to the working directory."""


@dataclasses.dataclass(frozen=True)
class Context:
    """What values are read against.

    Attributes:
        folder: What relative file names in the mission file are relative to.
        origin: Of the local frame; None while it is unknown.
    """

    folder: Path
    origin: GeodeticPoint | None


class Section(BaseModel):
    """A table of the mission file: unknown keys, NaN and values of the wrong type are refused."""

    model_config = ConfigDict(
        extra="forbid", frozen=True, strict=True, allow_inf_nan=False, use_attribute_docstrings=True
    )

    @model_validator(mode="before")
    @classmethod
    def _place_geodetic_keys(cls, data: Any) -> Any:
        """Puts `start_lla_deg_m = […]`, or a lone `lla_deg_m = […]`, where the position in metres is wanted."""
        if not isinstance(data, dict):
            return data
        wanted = [name for name in cls.model_fields if name.endswith("_enu_m")]
        placed = dict(data)
        for name in wanted:
            spellings = [name.removesuffix("enu_m") + "lla_deg_m"]
            if len(wanted) == 1:
                spellings.append("lla_deg_m")
            for spelling in spellings:
                if spelling in placed and name not in placed:
                    value = placed.pop(spelling)
                    many = isinstance(value, list) and value and isinstance(value[0], list)
                    placed[name] = [{"lla_deg_m": point} for point in value] if many else {"lla_deg_m": value}
        return placed

    def findings(self) -> Iterator[Finding]:
        """What is wrong between the entries of this section, with paths relative to it."""
        yield from ()


def _geodetic(value: object, numbers: tuple[int, ...], ground_m: float) -> GeodeticPoint:
    """The point of `{ lla_deg_m = [latitude, longitude, altitude] }`, checked; on the ground where no altitude is."""
    if not isinstance(value, list) or len(value) not in numbers:
        raise PydanticCustomError("lla", "write lla_deg_m = [latitude, longitude, altitude above sea level]")
    if not all(isinstance(number, int | float) and not isinstance(number, bool) for number in value):
        raise PydanticCustomError("lla", "latitude, longitude and altitude must be numbers")
    latitude, longitude, *rest = (float(number) for number in value)
    altitude = rest[0] if rest else ground_m
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0 and abs(altitude) <= LOCAL_PLANE_M):
        raise PydanticCustomError(
            "lla",
            "latitude must lie within ±90°, longitude within ±180° and altitude be in metres: are the two exchanged?",
        )
    return GeodeticPoint(latitude, longitude, altitude)


def _context(info: ValidationInfo) -> Context:
    if not isinstance(info.context, Context):
        raise TypeError("geodetic positions and file names need validation with context=Context(folder, origin)")
    return info.context


def _enu_from_file(value: object, info: ValidationInfo, numbers: tuple[int, ...]) -> object:
    if not isinstance(value, dict):
        return value
    if list(value) != ["lla_deg_m"]:
        raise PydanticCustomError("lla", "write a list of metres, or {{ lla_deg_m = [latitude, longitude, altitude] }}")
    origin = _context(info).origin
    point = _geodetic(value["lla_deg_m"], numbers, origin.altitude_amsl_m if origin is not None else 0.0)
    if origin is None:
        raise PydanticCustomError(ORIGIN_MISSING, "site.origin is needed to place it")
    enu = enu_from_geodetic(point, origin)
    if max(abs(axis) for axis in enu) > LOCAL_PLANE_M:
        raise PydanticCustomError(
            "lla",
            "it lies {distance_km} km from site.origin: are latitude and longitude exchanged?",
            {"distance_km": round(max(abs(axis) for axis in enu) / 1000.0)},
        )
    return list(enu)


def _position_from_file(value: object, info: ValidationInfo) -> object:
    return _enu_from_file(value, info, (3,))


def _horizontal_from_file(value: object, info: ValidationInfo) -> object:
    enu = _enu_from_file(value, info, (2, 3))
    return enu[:2] if isinstance(value, dict) and isinstance(enu, list) else enu


def _path_from_file(value: object, info: ValidationInfo) -> object:
    if not isinstance(value, str):
        return value
    context = _context(info)
    folder = Path.cwd() if isinstance(value, CommandLineText) else context.folder
    path = (folder / Path(value).expanduser()).resolve()
    if path.is_dir():
        raise PydanticCustomError("file", "{path} is a folder, and a file is needed", {"path": str(path)})
    if not path.is_file():
        raise PydanticCustomError(
            "file",
            "there is no such file: it was looked for at {path} (names are relative to the mission file, in --set to "
            "the working directory)",
            {"path": str(path)},
        )
    return path


Coordinate = Annotated[float, Field(ge=-LOCAL_PLANE_M, le=LOCAL_PLANE_M)]
"""Metres along one local axis."""

Length = Annotated[float, Field(ge=0.001, le=LOCAL_PLANE_M)]
"""A positive number of metres, a millimetre or more."""

Position = Annotated[tuple[Coordinate, Coordinate, Coordinate], Strict(False), BeforeValidator(_position_from_file)]
"""[east, north, up] in metres from the origin, or `{ lla_deg_m = [latitude, longitude, altitude] }`."""

Horizontal = Annotated[tuple[Coordinate, Coordinate], Strict(False), BeforeValidator(_horizontal_from_file)]
"""[east, north] in metres from the origin, or `{ lla_deg_m = [latitude, longitude] }`."""

Polygon = Annotated[tuple[Horizontal, ...], Strict(False), Field(min_length=3)]
"""Corners in order, either way round; the last is joined to the first."""

InputFile = Annotated[Path, BeforeValidator(_path_from_file)]
"""A file that exists; relative names start at the mission file's folder."""


def polygon_fault(corners_m: Polygon) -> str | None:
    """What is wrong with a polygon, in words; None where nothing is.

    Args:
        corners_m: Shape (corner, 2), metres.
    """
    import shapely
    from shapely.validation import explain_validity

    shape = shapely.Polygon(corners_m)
    if not shape.is_valid:
        return f"its edges cross or touch ({explain_validity(shape)}): list the corners in order around the area"
    if shape.area <= 0.0:
        return "it encloses no area: list at least three corners that are not in a line"
    return None
