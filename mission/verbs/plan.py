"""`mission plan`: a set of different paths, proven, with the best one as files for every program."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mission.console import Exit, JsonOption, MissionArgument, SetOption, emit, refuse, say
from mission.findings import Finding, InputError

if TYPE_CHECKING:
    from mission.planning import Planned

WIDE = 160
"""Columns of a table that goes to a file."""


def plan(
    mission_file: MissionArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write; absent: a folder `plans/NAME` here."),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="N", help="Overrides planner.seed.")] = None,
    show_candidates: Annotated[bool, typer.Option("--candidates", help="Print a row for each candidate.")] = False,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find a set of different paths, prove them, and write the best one in every format, with a picture."""
    from mission.loading import load

    settings = [*(overrides or ()), *([f"planner.seed={seed}"] if seed is not None else [])]
    try:
        mission = load(mission_file, settings)
    except InputError as error:
        raise refuse(error, as_json) from error
    folder = out if out is not None else Path("plans") / mission_file.stem

    from mission.plan_output import summary_of, write_outputs
    from mission.progress import SolveProgress

    with SolveProgress() as progress:
        from mission.planning import plan as solve_mission

        planned = solve_mission(mission, progress=progress.update)
    try:
        files = write_outputs(planned, folder)
    except OSError as error:
        finding = Finding("--out", str(folder), f"cannot be written: {error.strerror or error}")
        raise refuse(InputError(str(folder), [finding]), as_json) from error
    _report(planned, files, show_candidates)
    if as_json:
        emit(summary_of(planned, files))
    if planned.plan.selected is None:
        raise typer.Exit(Exit.COULD_NOT)


def _report(planned: Planned, files: list[Path], show_candidates: bool) -> None:
    """What came out, for the person."""
    found = planned.plan
    if show_candidates:
        _print_candidates(planned)
    if found.selected is None:
        say(f"nothing to fly: {found.status.value}. What the gate found, candidate by candidate:")
        for index, candidate in enumerate(found.candidates):
            say(f"  {index} ({candidate.seed_pattern}): {'; '.join(v.text for v in candidate.report.violations[:3])}")
        say("give it more time (planner.time_limit_s) or room (duration_s, clearance_margin_m), or move start and end")
    else:
        best, feasible = found.best, sum(candidate.feasible for candidate in found.candidates)
        clearance = best.report.min_clearance_m
        near = f"clearance {clearance:.2f} m (margin {planned.problem.clearance_margin_m:g})"
        say(
            f"candidate {found.selected} of {len(found.candidates)} ({feasible} passed the gate), grown from "
            f"{best.seed_pattern}: ergodic metric {best.ergodic_metric:.4g}, a lawnmower of its length "
            f"{found.lawnmower_ergodic_metric:.4g}"
        )
        say(
            f"length {best.report.length_m:.1f} m, duration {best.report.duration_s:.1f} s, speed up to "
            f"{best.report.max_speed_mps:.2f} m/s, {near if not planned.problem.obstacles.is_empty else 'no obstacles'}"
        )
    say(f"solved in {planned.solve_s:.1f} s; wrote {', '.join(str(file) for file in files)}")


def _print_candidates(planned: Planned) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("", "grown from", "ergodic metric", "length [m]", "clearance [m]", "gate"):
        table.add_column(heading, justify="left" if heading in ("grown from", "gate") else "right")
    for index, candidate in enumerate(planned.plan.candidates):
        report = candidate.report
        table.add_row(
            f"→ {index}" if index == planned.plan.selected else str(index),
            candidate.seed_pattern,
            f"{candidate.ergodic_metric:.4g}",
            f"{report.length_m:.1f}",
            f"{report.min_clearance_m:.2f}",
            "passed" if candidate.feasible else report.violations[0].text,
        )
    console = Console(stderr=True, highlight=False)
    if not console.is_terminal:
        console.width = WIDE
    console.print(table)
