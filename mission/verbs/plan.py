"""`mission plan`: a set of different paths, proven, with the best one as files for every program."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mission.console import Exit, JsonOption, MissionArgument, SetOption, emit, output_folder, refuse, say, show
from mission.findings import Finding, InputError

if TYPE_CHECKING:
    from mission.candidates import RankedCandidate
    from mission.planning import Planned


def plan(
    mission_file: MissionArgument,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write; absent: a folder `plans/NAME` here."),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="N", help="Overrides planner.seed.")] = None,
    show_candidates: Annotated[
        bool, typer.Option("--candidates", help="Compare all candidates in a table, and draw them (candidates.png).")
    ] = False,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find a set of different paths, prove them, and write the best one in every format, with a picture."""
    from mission.loading import load

    settings = [*(overrides or ()), *([f"planner.seed={seed}"] if seed is not None else [])]
    try:
        mission = load(mission_file, settings)
        folder = output_folder(out if out is not None else Path("plans") / mission_file.stem)
    except InputError as error:
        raise refuse(error, as_json) from error

    from mission.plan_output import summary_of, write_outputs
    from mission.progress import SolveProgress

    with SolveProgress() as progress:
        from mission.planning import plan as solve_mission

        planned = solve_mission(mission, progress=progress.update)
    rows = None
    if show_candidates:
        from mission.candidates import ranked_candidates

        say(f"comparing {len(planned.plan.candidates)} candidates …")
        rows = ranked_candidates(planned)
    say("writing and drawing …")
    try:
        files = write_outputs(planned, folder, rows)
    except OSError as error:
        finding = Finding("--out", str(folder), f"cannot be written: {error.strerror or error}")
        raise refuse(InputError(str(folder), [finding]), as_json) from error
    if rows is not None:
        _print_candidates(rows, planned.plan.selected)
    _report(planned, files)
    if as_json:
        emit(summary_of(planned, files, rows))
    if planned.plan.selected is None:
        raise typer.Exit(Exit.COULD_NOT)


def _report(planned: Planned, files: list[Path]) -> None:
    """What came out, for the person."""
    from mission.cautions import cautions_about, cautions_about_plan
    from planner.plan import Status

    found = planned.plan
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
            f"candidate {found.selected} of 0 … {len(found.candidates) - 1} ({feasible} passed the gate), grown from "
            f"{best.seed_pattern}: ergodic metric {best.ergodic_metric:.4g}, a lawnmower of its length "
            f"{found.lawnmower_ergodic_metric:.4g}"
        )
        if best.probability_found is not None and found.lawnmower_probability_found is not None:
            say(
                f"it finds what it looks for with probability {best.probability_found:.3f}, the best lawnmower of its "
                f"length with {found.lawnmower_probability_found:.3f}"
            )
        say(
            f"length {best.report.length_m:.1f} m, duration {best.report.duration_s:.1f} s, speed up to "
            f"{best.report.max_speed_mps:.2f} m/s, {near if not planned.problem.obstacles.is_empty else 'no obstacles'}"
        )
    match found.status:
        case Status.STEP_LIMIT:
            say("it ran short of time: with a larger planner.time_limit_s the plan gets better")
        case Status.DIVERGED:
            say('! the steps diverged and the paths are the seeds: write planner.method = "default"')
        case _:
            pass
    for caution in (*cautions_about(planned.mission), *cautions_about_plan(planned)):
        say(f"! {caution}")
    compiling = f", and {planned.compile_s:.0f} s of compiling" if planned.compile_s >= 0.5 else ""
    say(f"solved in {planned.solve_s:.1f} s{compiling}; wrote {', '.join(str(file) for file in files)}")


def _print_candidates(rows: list[RankedCandidate], selected: int | None) -> None:
    """A row a candidate, best first; the selected one is marked."""
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold")
    searching = any(row.candidate.probability_found is not None for row in rows)
    finds = ("finds",) if searching else ()
    for heading in ("", "candidate", "grown from", "E", "E / lawnmower's", *finds, "length [m]", "clearance [m]"):
        table.add_column(Text(heading), justify="left" if heading == "grown from" else "right")
    table.add_column(Text("to selected [m]"), justify="right")
    table.add_column("gate")
    for row in rows:
        report = row.candidate.report
        table.add_row(
            f"→ {row.rank}" if row.index == selected else str(row.rank),
            str(row.index),
            row.candidate.seed_pattern,
            f"{row.candidate.ergodic_metric:.4g}",
            _shown(row.over_lawnmower, ".2f"),
            *((_shown(row.candidate.probability_found or 0.0, ".3f"),) if searching else ()),
            f"{report.length_m:.1f}",
            _shown(report.min_clearance_m, ".2f"),
            _shown(row.distance_to_selected_m, ".4g"),
            row.verdict,
        )
    show(table)


def _shown(value: float, format: str) -> str:
    """A number, or a dash where there is none."""
    return f"{value:{format}}" if math.isfinite(value) else "–"
