"""`mission resume`: goes on with a flight that was interrupted, covering what remains."""

from __future__ import annotations

import typer

from mission.console import Exit, JsonOption, emit, refuse, say
from mission.findings import InputError
from mission.verbs.fly import LinkOption, ModeOption, SpeedOption, ViewOption, carry_out
from mission.verbs.push import FlightArgument


def resume(
    folder: FlightArgument,
    link: LinkOption = None,
    mode: ModeOption = None,
    speed: SpeedOption = 1.0,
    view: ViewOption = False,
    as_json: JsonOption = False,
) -> None:
    """Continue a flight that was interrupted: what remains of its exploration, not what was done."""
    from mission.executive.events import FlightMethod
    from mission.flying.flight import FlightSettings
    from mission.flying.flight_folder import read_flight_folder
    from mission.flying.resuming import resumption

    try:
        flight = read_flight_folder(folder)
    except InputError as error:
        raise refuse(error, as_json) from error
    try:
        left = resumption(flight)
    except ValueError as error:
        say(str(error))
        if as_json:
            emit({"outcome": "aborted", "landed": False, "why": str(error)})
        raise typer.Exit(Exit.COULD_NOT) from error
    if left is None:
        say(f"the flight in {folder} explored everything: there is nothing left")
        if as_json:
            emit({"outcome": "nothing left", "landed": None, "remaining_s": 0.0})
        return
    say(f"{left.left.remaining_s:.0f} s of the exploration are left")
    header = flight.log.header
    settings = FlightSettings(
        link=link if link is not None else str(header.get("link", flight.mission.link.address)),
        method=FlightMethod(mode if mode is not None else header.get("mode", flight.mission.flight.mode)),
        speed=speed,
        folder=folder,
        from_s=left.from_s,
        flown_m=left.left.flown_m,
        flown_yaw_rad=left.left.flown_yaw_rad,
    )
    carry_out(left.planned, settings, view=view, as_json=as_json)
