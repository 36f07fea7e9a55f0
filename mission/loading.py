"""Reading a mission file: TOML, overrides, defaults, and everything that is wrong with it at once."""

from __future__ import annotations

import dataclasses
import tomllib
import typing
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter, ValidationError

from mission.findings import Finding, InputError
from mission.mission_file.errors import findings_from, spelled, unknown_key
from mission.mission_file.mission import Mission
from mission.mission_file.overrides import apply_override
from mission.mission_file.site import Origin
from mission.mission_file.values import Context, Section
from sim_bridge.state import GeodeticPoint


@dataclasses.dataclass(frozen=True)
class Document:
    """A mission file as it was written, with its overrides.

    Attributes:
        source: The file, as the user named it.
        folder: What file names in it are relative to.
        data: The tables.
        overridden: Dotted paths of the entries that came from the command line.
    """

    source: str
    folder: Path
    data: dict[str, Any]
    overridden: tuple[str, ...] = ()


def read_document(path: Path | str, overrides: Sequence[str] = ()) -> Document:
    """Reads a mission file and lays overrides over it.

    Args:
        path: The file.
        overrides: `a.b=value` each, the value as TOML or as a bare text.

    Raises:
        InputError: A file that cannot be read or is not TOML, or an override that does not fit.
    """
    source = str(path)
    file = Path(path)
    try:
        text = file.read_text(encoding="utf-8")
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputError(source, [Finding("file", source, f"cannot be read: {reason}")]) from error
    except UnicodeDecodeError as error:
        raise InputError(source, [Finding("file", source, "is not a text file in UTF-8")]) from error
    try:
        data = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(source, [Finding("file", source, f"is not valid TOML: {error}")]) from error
    except RecursionError as error:
        raise InputError(source, [Finding("file", source, "is nested too deeply to be a mission")]) from error
    findings: list[Finding] = []
    overridden: list[str] = []
    for override in overrides:
        try:
            overridden.append(apply_override(data, override))
        except ValueError as error:
            findings.append(Finding("--set", override, str(error)))
    if findings:
        raise InputError(source, findings)
    return Document(source, file.resolve().parent, data, tuple(overridden))


def _origin_of(data: dict[str, Any]) -> GeodeticPoint | None:
    """The origin, as far as it can be read: it places the geodetic positions of every other section."""
    site = data.get("site")
    if not isinstance(site, dict):
        return None
    try:
        return Origin.model_validate(site.get("origin")).point()
    except ValidationError:
        return None


def _inner_findings(value: object) -> list[Finding]:
    """What sections find wrong with themselves, with paths from here."""
    found: list[Finding] = []
    if isinstance(value, tuple):
        for index, entry in enumerate(value):
            found += [finding.under(str(index)) for finding in _inner_findings(entry)]
    elif isinstance(value, Section):
        found += value.findings()
        for name in type(value).model_fields:
            found += [finding.under(name) for finding in _inner_findings(getattr(value, name))]
    return found


def mission_from_document(document: Document) -> Mission:
    """Parses and checks a mission.

    Every section is parsed on its own, so that one mistake does not hide the others, and what spans sections is
    checked wherever the sections it needs are sound.

    Raises:
        InputError: Everything that is wrong.
    """
    from mission.checks import findings_between

    context = Context(document.folder, _origin_of(document.data))
    findings: list[Finding] = []
    sections: dict[str, Any] = {}
    for key, value in document.data.items():
        if key not in Mission.model_fields:
            findings.append(Finding(key, spelled(value), unknown_key(key, (Mission,))))
    annotations = typing.get_type_hints(Mission, include_extras=True)
    for name, field in Mission.model_fields.items():
        if name not in document.data:
            if field.is_required():
                findings.append(Finding(name, "", f"this section is missing: begin it with [{name}]"))
            else:
                sections[name] = field.get_default(call_default_factory=True)
            continue
        try:
            section = TypeAdapter(annotations[name]).validate_python(document.data[name], context=context)
        except ValidationError as error:
            findings += findings_from(name, error.errors(include_url=False), Mission)
            continue
        inner = [finding.under(name) for finding in _inner_findings(section)]
        findings += inner
        if not inner:
            sections[name] = section
    sections["name"] = sections.get("name") or Path(document.source).stem
    findings += findings_between(sections)
    if findings:
        raise InputError(document.source, findings)
    return Mission.model_construct(**sections)


def load(path: Path | str, overrides: Sequence[str] = ()) -> Mission:
    """Reads, resolves and checks a mission file.

    Args:
        path: The TOML file.
        overrides: `a.b=value` each, laid over the file.

    Returns:
        The mission: every default filled in, every position in local ENU metres.

    Raises:
        InputError: Everything that is wrong with it, each with its dotted path and what to write.
    """
    return mission_from_document(read_document(path, overrides))
