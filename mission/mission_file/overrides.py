"""`--set a.b=value`: entries of a mission file from the command line."""

from __future__ import annotations

import tomllib
from typing import Any

from mission.mission_file.values import CommandLineText


def _marked(value: Any) -> Any:
    """Texts marked as coming from the command line, so that file names start at the working directory."""
    match value:
        case str():
            return CommandLineText(value)
        case list():
            return [_marked(entry) for entry in value]
        case dict():
            return {key: _marked(entry) for key, entry in value.items()}
        case _:
            return value


def override_value(text: str) -> Any:
    """The value of an override: TOML, or a bare text such as a file name.

    Raises:
        ValueError: It begins as a TOML value with brackets or quotes and does not end as one.
    """
    try:
        parsed = tomllib.loads(f"value = {text}")
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        if text.startswith(("[", "{", '"', "'")):
            raise ValueError(f"the value is not valid TOML ({error}); quote the whole for the shell") from error
        return CommandLineText(text)
    return _marked(parsed["value"]) if list(parsed) == ["value"] else CommandLineText(text)


def apply_override(data: dict[str, Any], override: str) -> str:
    """Lays one override over the tables of a mission file, in place.

    Args:
        data: The tables.
        override: `a.b=value`; a number steps into a list (`obstacle.0.radius_m=3`), its length appends.

    Returns:
        The dotted path that was set.

    Raises:
        ValueError: It is not of that form, or leads through something that is not a table.
    """
    path, separator, text = override.partition("=")
    steps = [step.strip() for step in path.split(".")]
    if not separator or not all(steps):
        raise ValueError("write --set section.entry=value, for example --set planner.seed=3")
    value = override_value(text.strip())
    place: Any = data
    for number, step in enumerate(steps):
        here = ".".join(steps[:number])
        last = number == len(steps) - 1
        if isinstance(place, dict):
            if last:
                place[step] = value
            else:
                place = place.setdefault(step, {})
        elif isinstance(place, list):
            if not step.isdecimal() or int(step) > len(place):
                raise ValueError(f"{here} is a list of {len(place)}: '{step}' must be a number from 0 to {len(place)}")
            index = int(step)
            if index == len(place):
                place.append({})
            if last:
                place[index] = value
            else:
                place = place[index]
        else:
            raise ValueError(f"{here} is {place!r}, which has no entry '{step}'")
    return ".".join(steps)
