"""What the verbs share at the terminal: one JSON object on stdout, the rest on stderr, exit codes."""

from __future__ import annotations

import enum
import json
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer

from mission.findings import Finding, InputError


class Exit(enum.IntEnum):
    """What the process ends with."""

    DONE = 0
    COULD_NOT = 1
    BAD_INPUT = 2
    INTERRUPTED = 130


MissionArgument = Annotated[Path, typer.Argument(metavar="MISSION.toml", help="The mission file.", show_default=False)]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="a.b=value",
        help="Overrides an entry of the mission file; as often as needed. The value is TOML or a bare text; numbers "
        "step into lists (obstacle.0.radius_m=3); file names are relative to the working directory.",
        show_default=False,
    ),
]
JsonOption = Annotated[
    bool, typer.Option("--json", help="One JSON object on standard output; everything else on standard error.")
]


def say(text: str) -> None:
    """A line for the person, on stderr."""
    print(text, file=sys.stderr)


def emit(document: dict[str, Any]) -> None:
    """The one JSON object of a verb, on stdout.

    Raises:
        ValueError: A number in it is not finite.
    """
    print(json.dumps(document, allow_nan=False))


def findings_as_json(findings: Sequence[Finding]) -> list[dict[str, str]]:
    """Findings as the rows of `--json`."""
    return [{"path": finding.path, "got": finding.got, "advice": finding.advice} for finding in findings]


def output_folder(folder: Path) -> Path:
    """A folder to write into, made where it is not there: asked for before the work whose fruit it takes.

    Raises:
        InputError: It cannot be made, or written into.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        finding = Finding("--out", str(folder), f"cannot be written: {error.strerror or error}; give another folder")
        raise InputError(str(folder), [finding]) from error
    return folder


def refuse(error: InputError, as_json: bool) -> typer.Exit:
    """Says everything that is wrong with an input; raise what comes back."""
    from rich.console import Console
    from rich.text import Text

    console = Console(stderr=True, highlight=False, soft_wrap=True)
    count = len(error.findings)
    console.print(Text(f"{error.source}: {count} {'entry' if count == 1 else 'entries'} to mend", style="bold"))
    for finding in error.findings:
        line = Text("  ")
        line.append(finding.path, style="bold red")
        line.append(": ")
        if finding.got:
            line.append(f"got {finding.got}; ")
        line.append(finding.advice)
        console.print(line)
    if as_json:
        emit({"error": f"{count} to mend in {error.source}", "findings": findings_as_json(error.findings)})
    return typer.Exit(Exit.BAD_INPUT)
