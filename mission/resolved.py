"""A resolved mission as rows: every entry, its value, its unit, and where the value comes from."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Iterator
from typing import Any

from mission.loading import Document
from mission.mission_file import Mission
from mission.mission_file.errors import unit_of
from mission.mission_file.values import Section
from mission.mission_file.vehicle import PRESETS


class Source(enum.Enum):
    """Where a value comes from."""

    FILE = "file"
    COMMAND_LINE = "--set"
    PRESET = "preset"
    DEFAULT = "default"
    DERIVED = "derived"


@dataclasses.dataclass(frozen=True)
class Entry:
    """One entry of a resolved mission.

    Attributes:
        path: Dotted path.
        value: As TOML has it; None: not given, and nothing stands for it.
        unit: As the key's name says; empty where it has none.
        source: Where the value comes from.
    """

    path: str
    value: Any
    unit: str
    source: Source


def resolved_entries(mission: Mission, document: Document) -> Iterator[Entry]:
    """Every entry of a mission, in the order of the sections.

    Args:
        mission: The mission.
        document: The file and overrides that it came from.
    """
    derived = {
        "site.home_enu_m": list(mission.home_enu_m),
        "flight.takeoff_altitude_m": mission.takeoff_altitude_m,
        "planner.modes": list(mission.modes),
    }
    for path, value in _leaves("", mission):
        source = _source_of(path, document)
        if value is None and path in derived:
            value, source = derived[path], Source.DERIVED
        yield Entry(path, value, unit_of(path.rpartition(".")[2]), source)


def _leaves(path: str, value: Any) -> Iterator[tuple[str, Any]]:
    """Dotted path and value of everything that is not a table."""
    match value:
        case Section():
            for name in type(value).model_fields:
                yield from _leaves(f"{path}.{name}" if path else name, getattr(value, name))
        case tuple() if value and isinstance(value[0], Section):
            for index, entry in enumerate(value):
                yield from _leaves(f"{path}.{index}", entry)
        case tuple():
            yield path, _listed(value)
        case bool() | int() | float() | str() | None:
            yield path, value
        case _:
            yield path, str(value)


def _listed(value: Any) -> Any:
    return [_listed(entry) for entry in value] if isinstance(value, tuple) else value


def _source_of(path: str, document: Document) -> Source:
    place: Any = document.data
    for step in path.split("."):
        if isinstance(place, list) and step.isdecimal() and int(step) < len(place):
            place = place[int(step)]
        elif isinstance(place, dict) and step in place:
            place = place[step]
        elif isinstance(place, dict) and step.endswith("_enu_m") and any(k.endswith("lla_deg_m") for k in place):
            return Source.FILE
        else:
            section, _, key = path.partition(".")
            figures = next(iter(PRESETS.values()))
            return Source.PRESET if section == "vehicle" and key in figures else Source.DEFAULT
    overridden = any(path == given or path.startswith(f"{given}.") for given in document.overridden)
    return Source.COMMAND_LINE if overridden else Source.FILE
