"""docs/mission_file.md, written from the schema: `python -m mission.mission_file_docs docs/mission_file.md`."""

from __future__ import annotations

import sys
import textwrap
import typing
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from mission.mission_file import Mission
from mission.mission_file.errors import kind_of, members, sections_in, spelled, unit_of
from mission.mission_file.values import LOCAL_PLANE_M
from mission.mission_file.vehicle import DEFAULT_PRESET, PRESETS, Vehicle

INTRODUCTION = """\
# The mission file

This page is written from the schema by `python -m mission.mission_file_docs docs/mission_file.md`, and a test checks
that it was: change the schema, not the page.

A mission file is [TOML](https://toml.io). Only `[site]`, `[information]` and `[planner]` must be there; everything else
has a default that is safe; `name = "…"` above them all says what the mission is called. `mission check MISSION.toml`
says everything that is wrong with a file at once, or prints what it resolves to, with the unit and the source of every
value.

**Positions** are metres east, north and up of `site.origin`. Wherever one is wanted,
`{ lla_deg_m = [latitude, longitude, altitude above sea level] }` may stand instead, or the key may end in `_lla_deg_m`
in place of `_enu_m` (`start_lla_deg_m = […]`); in a table that wants one position only, `lla_deg_m = […]` alone will
do. Corners of polygons need no altitude.

**File names** are relative to the mission file; in `--set` they are relative to the working directory.

**`--set a.b=value`** overrides any entry from the command line: the value is TOML or a bare text, numbers step into
lists (`--set obstacle.0.radius_m=3`), and a whole section may be given at once
(`--set 'information={ kind = "uniform" }'`, which is how to change its kind).

**Numbers** are finite, in the unit that the key's name ends with, and never in quotes.
"""


def document() -> str:
    """The whole page."""
    parts = [INTRODUCTION]
    for name, field in Mission.model_fields.items():
        annotation = typing.get_type_hints(Mission, include_extras=True)[name]
        tables = sections_in(field.annotation)
        if not tables:
            continue
        many = typing.get_origin(members_origin(annotation)) is tuple
        parts.append(f"## `{'[[' if many else '['}{name}{']]' if many else ']'}`\n")
        if len(tables) > 1:
            described = "obstacle" if name == "no_fly" else name
            kinds = ", ".join(f"[`{kind_of(table)}`](#{described}-{kind_of(table)})" for table in tables)
            parts.append(f"{SEVERAL[name]} `kind` is one of {kinds}.\n")
        if name == "no_fly":
            continue
        for table in tables:
            if len(tables) > 1:
                parts.append(f'### <a id="{name}-{kind_of(table)}"></a>`kind = "{kind_of(table)}"`\n')
            parts += _table(table)
        if name == "vehicle":
            parts.append(_presets())
    return "\n".join(parts)


SEVERAL = {
    "information": "Where time should be spent.",
    "obstacle": "Something solid; as many tables as there are obstacles. Its surface is kept away from by "
    "`vehicle.radius_m` and `flight.clearance_margin_m`.",
    "no_fly": "A forbidden volume; described and kept away from as an obstacle is, and exported as an exclusion fence.",
}


def members_origin(annotation: Any) -> Any:
    """An annotation without the `Annotated` around it."""
    return typing.get_args(annotation)[0] if typing.get_origin(annotation) is typing.Annotated else annotation


def _table(table: type[BaseModel]) -> Iterator[str]:
    """What a table is, its entries, and the tables inside it."""
    yield _sentence(table.__doc__) + "\n"
    rows = [
        _row(table, name, field)
        for name, field in table.model_fields.items()
        if not (name == "kind" and kind_of(table) is not None)
    ]
    if rows:
        yield "| entry | unit | default | meaning |\n| --- | --- | --- | --- |\n" + "\n".join(rows) + "\n"
    for name, field in table.model_fields.items():
        for inner in sections_in(field.annotation):
            yield f"`{name}`: {_sentence(inner.__doc__)}\n"
            inner_rows = [_row(inner, key, entry) for key, entry in inner.model_fields.items()]
            yield "| entry | unit | default | meaning |\n| --- | --- | --- | --- |\n" + "\n".join(inner_rows) + "\n"


def _row(table: type[BaseModel], name: str, field: FieldInfo) -> str:
    return f"| `{name}` | {unit_of(name)} | {_default(table, name, field)} | {_meaning(field)} |"


def _default(table: type[BaseModel], name: str, field: FieldInfo) -> str:
    if name in PRESETS[DEFAULT_PRESET] and field.is_required() and table is Vehicle:
        return "the preset's"
    if field.is_required():
        example = f", e.g. `{spelled(field.examples[0])}`" if field.examples else ""
        return f"needed{example}"
    if field.default is PydanticUndefined or field.default is None:
        return f"absent, e.g. `{spelled(field.examples[0])}`" if field.examples else "absent"
    return f"`{spelled(field.default)}`"


def _meaning(field: FieldInfo) -> str:
    said = _sentence(field.description)
    choices = [choice for member in members(field.annotation) for choice in typing.get_args(member)]
    if choices and all(isinstance(choice, str) for choice in choices):
        said += f" One of {', '.join(f'`{choice}`' for choice in choices)}."
    return f"{said}{_range(field)}".replace("|", "\\|")


def _range(field: FieldInfo) -> str:
    signs = {Gt: ("gt", "above"), Ge: ("ge", "at least"), Lt: ("lt", "below"), Le: ("le", "at most")}
    bounds = []
    for bound in field.metadata:
        if type(bound) in signs:
            attribute, word = signs[type(bound)]
            value = getattr(bound, attribute)
            if abs(value) != LOCAL_PLANE_M:
                bounds.append(f"{word} {value:,.10g}")
    return f" ({', '.join(bounds)})" if bounds else ""


def _sentence(text: str | None) -> str:
    return " ".join(textwrap.dedent(text or "").split())


def _presets() -> str:
    """A column a preset."""
    names = list(PRESETS)
    rows = [f"| entry | {' | '.join(f'`{name}`' for name in names)} |", "| --- |" + " --- |" * len(names)]
    for key in PRESETS[names[0]]:
        rows.append(f"| `{key}` | {' | '.join(spelled(PRESETS[name][key]).strip(chr(34)) for name in names)} |")
    return "The presets:\n\n" + "\n".join(rows) + "\n"


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(document(), encoding="utf-8")
