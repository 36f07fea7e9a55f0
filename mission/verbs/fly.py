"""`mission fly`: plans a mission and flies it, to the landed vehicle."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from mission.console import Exit, JsonOption, MissionArgument, SetOption, emit, output_folder, refuse, say, show
from mission.findings import Finding, InputError

if TYPE_CHECKING:
    from mission.flying.flight import FlightSettings, Flown
    from mission.planning import Planned

LinkOption = Annotated[
    str | None,
    typer.Option(
        "--link",
        metavar="LINK",
        help="sim (the built-in vehicle), udp://HOST:PORT (listens), udpout://HOST:PORT, tcp://HOST:PORT or "
        "serial:///dev/ttyUSB0:57600; absent: link.address of the mission.",
    ),
]
ModeOption = Annotated[
    str | None,
    typer.Option("--mode", metavar="offboard|mission", help="Stream setpoints, or upload waypoints and watch."),
]
SpeedOption = Annotated[
    float, typer.Option("--speed", metavar="X", min=0.1, max=100.0, help="How fast the built-in vehicle's time runs.")
]
ViewOption = Annotated[bool, typer.Option("--view", help="Open the recording when the flight has ended.")]


def fly(
    mission_file: MissionArgument,
    link: LinkOption = None,
    mode: ModeOption = None,
    speed: SpeedOption = 1.0,
    view: ViewOption = False,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Where to write; absent: a new folder below `flights` here."),
    ] = None,
    overrides: SetOption = None,
    as_json: JsonOption = False,
) -> None:
    """Plan a mission, fly it, replan on the way, land, and leave a folder with everything about it."""
    from mission.cautions import cautions_about, cautions_about_plan
    from mission.checks import findings_for_flying
    from mission.flying.folder_claim import claimed
    from mission.flying.recorder import LOG_NAME
    from mission.loading import load

    changes = [*(overrides or ())]
    changes += [f'link.address="{link}"'] if link is not None else []
    changes += [f'flight.mode="{mode}"'] if mode is not None else []
    with contextlib.ExitStack() as stack:
        try:
            mission = load(mission_file, changes)
            if reasons := [*findings_for_flying(mission), *findings_for_speed(speed, mission.link.address)]:
                raise InputError(str(mission_file), reasons)
            from mission.flying.flight import default_folder, settings_of

            folder = output_folder(out or default_folder(mission))
            # Held from here on: a solve is long enough for somebody else to begin a flight there.
            stack.enter_context(claimed(folder))
            if (folder / LOG_NAME).exists():
                advice = "holds a flight already: give another folder, or `mission resume` it"
                raise InputError(str(folder), [Finding("--out", str(folder), advice)])
        except InputError as error:
            raise refuse(error, as_json) from error

        from mission.progress import SolveProgress

        with SolveProgress() as progress:
            from mission.planning import plan as solve_mission

            planned = solve_mission(mission, progress=progress.update)
        if planned.plan.selected is None:
            with contextlib.suppress(OSError):
                # Nothing was written into it; what was there before stays.
                folder.rmdir()
            say(f"nothing to fly: {planned.plan.status.value}; `mission plan {mission_file}` says why")
            if as_json:
                emit({"outcome": "nothing to fly", "landed": False, "status": planned.plan.status.value})
            raise typer.Exit(Exit.COULD_NOT)
        for caution in (*cautions_about(mission), *cautions_about_plan(planned)):
            say(f"! {caution}")
        settings = settings_of(mission, folder=folder, speed=speed)
        carry_out(planned, settings, view=view, as_json=as_json)


def findings_for_speed(speed: float, address: str) -> list[Finding]:
    """What is wrong with a speed on a link: only the built-in vehicle's time can run faster or slower."""
    from mission.flying.connecting import SIM

    if speed == 1.0 or address == SIM:
        return []
    return [Finding("--speed", f"{speed:g}", f"{address} lives in its own time: leave it out, or give --link {SIM}")]


def carry_out(planned: Planned, settings: FlightSettings, *, view: bool, as_json: bool) -> None:
    """Fly, say what came of it, and end with the exit code that belongs to it.

    Raises:
        typer.Exit: Unless everything went as planned.
    """
    from mission.flying.flight import Outcome, fly_planned
    from mission.flying.flight_progress import watcher_for
    from sim_bridge.link.client import LinkError

    try:
        flown = fly_planned(planned, settings, watcher_for())
    except InputError as error:
        raise refuse(error, as_json) from error
    except (LinkError, ValueError) as error:
        say(str(error))
        if as_json:
            emit({"outcome": "aborted", "landed": False, "why": str(error)})
        raise typer.Exit(Exit.COULD_NOT) from error
    _report(flown)
    if as_json:
        emit({**flown.summary, "folder": str(flown.folder), "files": list(flown.files)})
    if view:
        from mission.view import RECORDING_NAME, open_viewer

        open_viewer(flown.folder / RECORDING_NAME)
    if flown.interrupted:
        raise typer.Exit(Exit.INTERRUPTED)
    if flown.outcome not in (Outcome.DONE, Outcome.HANDED_OVER) or flown.summary["violations"]:
        raise typer.Exit(Exit.COULD_NOT)


def _report(flown: Flown) -> None:
    """The summary as a table, on stderr."""
    from rich.table import Table
    from rich.text import Text

    table = Table(title=f"{flown.outcome.value}", title_justify="left", box=None, pad_edge=False, show_header=False)
    table.add_column(style="dim")
    table.add_column()
    for label, text in rows_of(flown.summary):
        table.add_row(label, Text(text))
    show(table)
    say(f"in {flown.folder}: " + ", ".join(Path(file).name for file in flown.files))


def rows_of(summary: dict[str, Any]) -> list[tuple[str, str]]:
    """A flight's summary as labels and values for a person."""
    from mission.flying.air import drag_words, wind_words
    from mission.flying.summary import clearance_words

    def number(key: str, unit: str, digits: int, scale: float = 1.0) -> str:
        value = summary.get(key)
        return "–" if value is None else f"{value * scale:.{digits}f} {unit}".rstrip()

    refused = ", ".join(f"{count} × {reason}" for reason, count in summary["replans_refused"].items())
    error = f"mean {number('tracking_error_mean_m', 'm', 2)}, at most {number('tracking_error_max_m', 'm', 2)}"
    searched = summary.get("probability_found") is not None
    return [
        ("why it ended", str(summary["why"])),
        ("in the air", number("flown_s", "s", 0)),
        ("flown", number("length_m", "m", 0)),
        (clearance_words(summary), number("min_clearance_m", "m", 2)),
        ("greatest speed", number("max_speed_mps", "m/s", 2)),
        ("from the course", error),
        ("ergodic metric flown", number("ergodic_metric", "", 5)),
        *([("probability of having found it", number("probability_found", "", 3))] if searched else []),
        ("drag", drag_words(summary)),
        ("wind", wind_words(summary)),
        ("battery used", number("battery_used", "%", 0, 100.0)),
        (
            "replans",
            f"{summary['replans_taken']} of {summary['replans_asked']} taken" + (f" ({refused})" if refused else ""),
        ),
        ("Offboard lost", f"{summary['offboard_lost']} times"),
        ("violations", "; ".join(summary["violations"]) or "none"),
    ]
