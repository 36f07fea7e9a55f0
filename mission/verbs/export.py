"""`mission export`: a plan in another program's format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from mission.console import Exit, JsonOption, emit, refuse, say
from mission.exports import Format
from mission.findings import Finding, InputError


def export(
    plan: Annotated[Path, typer.Argument(metavar="PLAN.json", help="A plan written by `mission plan`.")],
    format: Annotated[Format, typer.Option("--format", help="The format.")],
    out: Annotated[
        Path | None, typer.Option("--out", metavar="FILE", help="Where to; absent: standard output.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Write a plan for QGroundControl, Mission Planner, a spreadsheet, a GIS or Google Earth."""
    from mission.exports import exported
    from mission.plan_file import read_plan_file

    try:
        if as_json and out is None:
            raise InputError(
                "--out", [Finding("--out", "", "name the file: with --json standard output holds the JSON")]
            )
        text = exported(read_plan_file(plan), format)
    except InputError as error:
        raise refuse(error, as_json) from error
    except ValueError as error:
        say(f"{plan}: {error}")
        if as_json:
            emit({"error": str(error)})
        raise typer.Exit(Exit.COULD_NOT) from error
    if out is None:
        typer.echo(text, nl=False)
        return
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        finding = Finding("--out", str(out), f"cannot be written: {error.strerror or error}")
        raise refuse(InputError(str(out), [finding]), as_json) from error
    say(f"wrote {out}")
    if as_json:
        emit({"file": str(out), "format": format.value})
