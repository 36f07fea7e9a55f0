"""`mission push`: new information, obstacles, no-fly volumes or a wish of the operator, into a flight under way."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mission.console import Exit, JsonOption, emit, refuse, say
from mission.findings import Finding, InputError

FlightArgument = Annotated[Path, typer.Argument(metavar="DIR", help="The folder of the flight.", show_default=False)]


def push(
    folder: FlightArgument,
    file: Annotated[
        Path, typer.Argument(metavar="FILE.json", help="What to push: obstacle, no_fly, information, command.")
    ],
    timeout_s: Annotated[float, typer.Option("--timeout", metavar="S", min=0.0, help="How long to wait.")] = 10.0,
    as_json: JsonOption = False,
) -> None:
    """Push new information, obstacles or a command into a running flight, and say whether it was taken in."""
    from mission.flying.intake import push_into

    try:
        answer = push_into(folder, file, timeout_s)
    except InputError as error:
        raise refuse(error, as_json) from error
    except (OSError, UnicodeDecodeError) as error:
        finding = Finding("FILE.json", str(file), f"cannot be read: {error}")
        raise refuse(InputError(str(file), [finding]), as_json) from error
    if answer is None:
        say(f"no flight in {folder} took it within {timeout_s:g} s, and it is withdrawn: is the flight still running?")
        answer = {"accepted": False, "reason": "nobody answered"}
    else:
        # That it was taken in is how the reason begins.
        say(answer["reason"] if answer["accepted"] else f"refused: {answer['reason']}")
    if as_json:
        emit(answer)
    if not answer["accepted"]:
        raise typer.Exit(Exit.COULD_NOT)
