"""What the verbs share at the terminal: one JSON object on stdout, the rest on stderr, exit codes."""

from __future__ import annotations

import contextlib
import enum
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TextIO

import typer

from mission.findings import Finding, InputError

if TYPE_CHECKING:
    from rich.console import RenderableType

WIDE = 160
"""Columns of a table that goes to a file."""


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
    """A line for the person, on stderr; where that is gone, nobody reads it, and the work goes on."""
    try:
        print(text, file=sys.stderr, flush=True)
    except OSError:
        silence(sys.stderr)


def show(table: RenderableType, *, stderr: bool = True, wrapped: bool = True) -> None:
    """A table or a styled line: as wide as the terminal, in a file `WIDE`.

    Args:
        table: What.
        stderr: Whether it is for the person alone; there it may be lost, as what `say` says.
        wrapped: Whether lines end at that width.

    Raises:
        OSError: Standard output cannot be written to.
    """
    from rich.console import Console

    console = Console(stderr=stderr, highlight=False, soft_wrap=not wrapped)
    if not console.is_terminal:
        console.width = WIDE
    try:
        console.print(table)
    except OSError:
        if not stderr:
            raise
        silence(sys.stderr)


def silence(stream: TextIO) -> None:
    """What is still to be written to a stream that is gone goes nowhere, without an error at the end."""
    with contextlib.suppress(OSError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def emit(document: dict[str, Any]) -> None:
    """The one JSON object of a verb, on stdout.

    Raises:
        ValueError: A number in it is not finite.
        OSError: Standard output cannot be written to.
    """
    print(json.dumps(document, allow_nan=False), flush=True)
    document_of_the_verb.append(document)


document_of_the_verb: list[dict[str, Any]] = []
"""What was emitted, so that whatever ends a verb knows whether its object is still owed."""


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
    from rich.text import Text

    count = len(error.findings)
    show(Text(f"{error.source}: {count} {'entry' if count == 1 else 'entries'} to mend", style="bold"), wrapped=False)
    for finding in error.findings:
        line = Text("  ")
        line.append(finding.path, style="bold red")
        line.append(": ")
        if finding.got:
            line.append(f"got {finding.got}; ")
        line.append(finding.advice)
        show(line, wrapped=False)
    if as_json:
        emit({"error": f"{count} to mend in {error.source}", "findings": findings_as_json(error.findings)})
    return typer.Exit(Exit.BAD_INPUT)
