"""`mission resume`: goes on with a flight that was interrupted, covering what remains."""

from __future__ import annotations

import contextlib
import dataclasses
from typing import TYPE_CHECKING

import typer

from mission.console import Exit, JsonOption, emit, refuse, say
from mission.findings import Finding, InputError
from mission.verbs.fly import LinkOption, ModeOption, SpeedOption, ViewOption, carry_out, findings_for_speed
from mission.verbs.push import FlightArgument

if TYPE_CHECKING:
    from mission.flying.flight_folder import FlightFolder


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
    from mission.flying.connecting import SIM
    from mission.flying.flight import FlightSettings
    from mission.flying.flight_folder import read_flight_folder
    from mission.flying.folder_claim import claimed
    from mission.flying.resuming import resumption

    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(claimed(folder))
            flight = read_flight_folder(folder)
            address, method = _how(flight, link, mode)
            if found := [*_findings(address, method), *findings_for_speed(speed, address)]:
                raise InputError(str(folder), found)
        except InputError as error:
            raise refuse(error, as_json) from error
        for skipped in flight.log.skipped:
            say(f"skipped: {skipped}")
        try:
            resumed = resumption(flight)
        except ValueError as error:
            say(str(error))
            if as_json:
                emit({"outcome": "aborted", "landed": False, "why": str(error)})
            raise typer.Exit(Exit.COULD_NOT) from error
        if resumed is None or (resumed.left.only_home and address == SIM):
            # The built-in vehicle ended with its flight.
            say(f"the flight in {folder} explored everything: there is nothing left")
            if as_json:
                emit({"outcome": "nothing left", "landed": None, "remaining_s": 0.0})
            return
        left = resumed.left
        if left.only_home:
            say("everything is explored, and the vehicle was on its way: where it still flies, it is brought home")
        else:
            say(f"{left.remaining_s:.0f} s of the exploration are left")
        settings = FlightSettings(
            link=address,
            method=FlightMethod(method),
            speed=speed,
            folder=folder,
            from_s=resumed.from_s,
            flown_m=left.flown_m,
            flown_yaw_rad=left.flown_yaw_rad,
            only_home=left.only_home,
        )
        carry_out(resumed.planned, settings, view=view, as_json=as_json)


def _how(flight: FlightFolder, link: str | None, mode: str | None) -> tuple[str, str]:
    """Address and mode: what is given, else as it was flown, else as the mission asks."""
    header, mission = flight.log.header, flight.mission
    return (
        link if link is not None else str(header.get("link", mission.link.address)),
        mode if mode is not None else str(header.get("mode", mission.flight.mode)),
    )


def _findings(address: str, method: str) -> list[Finding]:
    from mission.executive.events import FlightMethod
    from mission.mission_file.flight import Link

    found = [dataclasses.replace(one, path="--link") for one in Link(address=address).findings()]
    if method not in (modes := [one.value for one in FlightMethod]):
        found.append(Finding("--mode", method, f"write {' or '.join(modes)}"))
    return found
