"""From what pydantic found to what a person can act on: dotted path, value got, what to write."""

from __future__ import annotations

import dataclasses
import difflib
import re
import types
import typing
from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from mission.findings import Finding
from mission.mission_file.values import ORIGIN_MISSING

UNITS = (
    ("_enu_m", "metres from the origin"),
    ("_lla_deg_m", "degrees, degrees and metres above sea level"),
    ("_amsl_m", "metres above sea level"),
    ("_degps", "degrees per second"),
    ("_mps2", "m/s²"),
    ("_mps", "m/s"),
    ("_per_s", "1/s"),
    ("_deg", "degrees"),
    ("_hz", "Hz"),
    ("_m", "metres"),
    ("_s", "seconds"),
)
"""Longest suffix first: what the end of a key says about its unit."""


def unit_of(key: str) -> str:
    """The unit that a key's name carries; empty where it has none."""
    return next((unit for suffix, unit in UNITS if key.endswith(suffix)), "")


def spelled(value: object) -> str:
    """A value as it would be written in TOML, shortened where it is long."""
    match value:
        case bool():
            text = str(value).lower()
        case str():
            text = f'"{value}"'
        case list() | tuple():
            text = "[" + ", ".join(map(spelled, value)) + "]"
        case Mapping():
            text = "{ " + ", ".join(f"{key} = {spelled(entry)}" for key, entry in value.items()) + " }"
        case float():
            text = f"{value:.8g}"
        case None:
            return ""
        case _:
            text = str(value)
    return text if len(text) <= 80 else text[:77] + "…"


def members(annotation: Any) -> tuple[Any, ...]:
    """The types an annotation allows, without `Annotated`, `None` and containers around them."""
    origin = typing.get_origin(annotation)
    if origin is typing.Annotated:
        return members(typing.get_args(annotation)[0])
    if origin in (typing.Union, types.UnionType):
        return tuple(m for part in typing.get_args(annotation) if part is not type(None) for m in members(part))
    if origin is tuple:
        first = typing.get_args(annotation)[0]
        return members(first) if Ellipsis in typing.get_args(annotation) else (annotation,)
    return (annotation,)


def sections_in(annotation: Any) -> tuple[type[BaseModel], ...]:
    """The tables an annotation allows."""
    return tuple(m for m in members(annotation) if isinstance(m, type) and issubclass(m, BaseModel))


def kind_of(section: type[BaseModel]) -> str | None:
    """What `kind` says in a table of this sort; None where it has none or a free choice."""
    field = section.model_fields.get("kind")
    choices = typing.get_args(field.annotation) if field is not None else ()
    return choices[0] if len(choices) == 1 else None


@dataclasses.dataclass(frozen=True)
class _Place:
    """Where an error is.

    Attributes:
        path: Steps of the dotted path, without pydantic's union tags.
        tables: The sorts of table that the last step is an entry of.
        siblings: The sorts of table that might stand there instead, with another `kind`.
        inside: The sorts of table that the last step itself may be.
    """

    path: tuple[str, ...]
    tables: tuple[type[BaseModel], ...]
    siblings: tuple[type[BaseModel], ...]
    inside: tuple[type[BaseModel], ...]

    @property
    def key(self) -> str:
        """The last step that is a name."""
        return next((step for step in reversed(self.path) if not step.isdigit()), "")


def _place(whole: type[BaseModel], location: tuple[int | str, ...]) -> _Place:
    path: list[str] = []
    tables = siblings = inside = (whole,)
    for step in location:
        tagged = tuple(table for table in inside if kind_of(table) == step)
        if tagged and len(inside) > 1:
            siblings, inside = inside, tagged
            continue
        path.append(str(step))
        if isinstance(step, str):
            tables = inside
            fields = [table.model_fields[step] for table in tables if step in table.model_fields]
            inside = tuple(found for field in fields for found in sections_in(field.annotation))
    return _Place(tuple(path), tables, siblings, inside)


def _example(tables: tuple[type[BaseModel], ...], key: str) -> str:
    for table in tables:
        field = table.model_fields.get(key)
        if field is not None and field.examples:
            return spelled(field.examples[0])
    return "…"


def unknown_key(key: str, tables: tuple[type[BaseModel], ...], siblings: tuple[type[BaseModel], ...] = ()) -> str:
    """What to say about an entry that no table of these sorts has."""
    known = sorted({name for table in tables for name in table.model_fields})
    owners = [kind for table in siblings if key in table.model_fields and (kind := kind_of(table))]
    if owners:
        kind = kind_of(tables[0])
        return f'belongs to kind = "{owners[0]}" and this is kind = "{kind}": remove it, or change kind'
    if key.endswith("lla_deg_m"):
        return "the same position is given in metres as well, or is not wanted here: keep one"
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    stem = next((name for name in known if name.split("_")[0] == key.split("_")[0]), None)
    if guess := (near[0] if near else stem):
        unit = unit_of(guess)
        return f"there is no such entry: did you mean {guess}{f' ({unit})' if unit else ''}?"
    return f"there is no such entry: known here are {', '.join(known)}"


def _did_you_mean(got: object, choices: str) -> str:
    near = difflib.get_close_matches(str(got), re.findall(r"'([^']+)'", choices), n=1)
    return f": did you mean '{near[0]}'?" if near else ""


def _bound(value: float) -> str:
    return f"{value:,}" if isinstance(value, int) else f"{value:g}"


def _advice(error: ErrorDetails, place: _Place) -> str:
    """What to write instead."""
    key = place.key
    unit = unit_of(key)
    in_unit = f", in {unit}" if unit else ""
    context = error.get("ctx", {})
    match error["type"]:
        case "missing" if place.path[-1].isdigit():
            return f"a number is missing: write {key} = {_example(place.tables, key)}"
        case "missing":
            return f"is missing: write {key} = {_example(place.tables, key)}"
        case "extra_forbidden":
            return unknown_key(key, place.tables, place.siblings)
        case "float_type" | "float_parsing":
            return f"must be a number without quotes{in_unit}"
        case "int_type" | "int_parsing" | "int_from_float":
            return "must be a whole number without quotes or decimal point"
        case "bool_type" | "bool_parsing":
            return "must be true or false, without quotes"
        case "string_type":
            return f'must be a text in quotes: {key} = "…"'
        case "path_type":
            return f'must be a file name in quotes: {key} = "…"'
        case "finite_number":
            return f"must be a finite number{in_unit}"
        case "greater_than":
            return f"must be greater than {_bound(context['gt'])}{in_unit}"
        case "greater_than_equal":
            return f"must be at least {_bound(context['ge'])}{in_unit}"
        case "less_than":
            return f"must be less than {_bound(context['lt'])}{in_unit}"
        case "less_than_equal":
            return f"must be at most {_bound(context['le'])}{in_unit}"
        case "literal_error":
            choices = str(context["expected"])
            return f"must be {choices}" + _did_you_mean(error["input"], choices)
        case "union_tag_invalid":
            choices = str(context["expected_tags"])
            return f"must be one of {choices}" + _did_you_mean(context["tag"], choices)
        case "union_tag_not_found":
            kinds = ", ".join(f'"{kind}"' for kind in map(kind_of, place.inside) if kind)
            return f"is missing: write kind = one of {kinds}"
        case "tuple_type" | "list_type":
            if place.inside:
                return f"must be tables: begin each with [[{'.'.join(place.path)}]]"
            return f"must be a list in square brackets: {key} = {_example(place.tables, key)}"
        case "too_short":
            return f"has {context['actual_length']} entries and needs at least {context['min_length']}"
        case "too_long":
            return f"has more than {context['max_length']} entries: write {key} = {_example(place.tables, key)}"
        case "model_type" | "model_attributes_type" | "dict_type":
            return f"must be a table: [{'.'.join(place.path)}]"
        case _:
            return error["msg"]


def findings_from(name: str, errors: list[ErrorDetails], whole: type[BaseModel]) -> Iterator[Finding]:
    """Every error of the validation of one section, or of a whole.

    Args:
        name: Of the section; empty: the errors are of the whole itself.
        errors: What pydantic found, located relative to it.
        whole: The table that holds it.
    """
    located = {error["loc"] for error in errors}
    for error in errors:
        if error["type"] == ORIGIN_MISSING:
            continue
        # A list whose only entry is wrong counts as empty too.
        if error["type"] == "too_short" and any(
            other[: len(error["loc"])] == error["loc"] != other for other in located
        ):
            continue
        place = _place(whole, (name, *error["loc"]) if name else error["loc"])
        path, got = place.path, "" if error["type"] == "missing" else spelled(error["input"])
        if error["type"] in ("union_tag_invalid", "union_tag_not_found"):
            path, got = (*path, "kind"), spelled(error.get("ctx", {}).get("tag"))
        yield Finding(".".join(path), got, _advice(error, place))
