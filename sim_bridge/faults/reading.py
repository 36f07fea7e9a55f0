"""Faults as people write them: in a TOML or JSON file, or in a word on the command line."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, TypeAdapter, ValidationError

from sim_bridge.faults.kinds import AnyFault

_FAULTS = TypeAdapter(list[Annotated[AnyFault, Field(discriminator="kind")]])
_WORD = re.compile(r"(?P<kind>[a-z-]+)@(?P<begin>[0-9.]+)(\+(?P<duration>[0-9.]+))?(?P<rest>(\s+\w+=\S+)*)\s*")


def read_faults(path: Path) -> list[AnyFault]:
    """Read a file: `[[fault]]` tables in TOML, or the same as JSON, each with `kind` and `begin_s`.

    Raises:
        ValueError: Not readable, or a fault that is none; all that is wrong at once.
        OSError: The file cannot be opened.
    """
    text = path.read_text()
    try:
        content = json.loads(text) if path.suffix == ".json" else tomllib.loads(text)
    except (json.JSONDecodeError, tomllib.TOMLDecodeError) as error:
        raise ValueError(f"{path} cannot be read: {error}") from error
    if not isinstance(content, Mapping) or set(content) != {"fault"} or not isinstance(content["fault"], list):
        raise ValueError(f'{path} must hold a list "fault" and nothing else: write [[fault]], kind = "link-cut", …')
    return _checked(content["fault"], str(path))


def parse_fault(text: str) -> AnyFault:
    """Read one from the command line.

    Args:
        text: `KIND@BEGIN[+DURATION] [KEY=VALUE …]`, seconds and TOML values, such as
            `bad-line@10+60 loss=0.2 delay_s=0.2` or `gps-glitch@30+10 offset_ned_m=[5,0,0]`.

    Raises:
        ValueError: It cannot be read, or is no fault.
    """
    match = _WORD.fullmatch(text.strip())
    example = 'write KIND@BEGIN[+DURATION] [KEY=VALUE …], such as "bad-line@10+60 loss=0.2"'
    if match is None:
        raise ValueError(f'got "{text}": {example}')
    keys = "\n".join(match["rest"].split())
    try:
        fault: dict[str, Any] = {"kind": match["kind"], "begin_s": float(match["begin"]), **tomllib.loads(keys)}
        if match["duration"]:
            fault["duration_s"] = float(match["duration"])
    except ValueError as error:
        raise ValueError(f'got "{text}": {error}: {example}') from error
    return _checked([fault], f'"{text}"')[0]


def _checked(faults: Iterable[object], where: str) -> list[AnyFault]:
    try:
        return _FAULTS.validate_python(list(faults))
    except ValidationError as error:
        raise ValueError("\n".join(f"{where}: {_words(problem)}" for problem in error.errors())) from error


def _words(problem: Mapping[str, Any]) -> str:
    number, *path = problem["loc"]
    place = f"fault {int(number) + 1}" + "".join(f".{part}" for part in path)
    return f"{place}: {problem['msg']} (got {problem['input']!r})"
