"""`mission view`: a flight's recording in the Rerun viewer."""

from __future__ import annotations

import typer

from mission.console import Exit, JsonOption, emit, refuse, say
from mission.findings import InputError
from mission.verbs.push import FlightArgument


def view(folder: FlightArgument, as_json: JsonOption = False) -> None:
    """Open a flight's recording in the viewer; it is written anew where it is missing."""
    from mission.view import RECORDING_NAME, open_viewer

    recording = folder / RECORDING_NAME
    if not recording.is_file():
        from mission.flying.flight_folder import draw_outputs, read_flight_folder

        try:
            draw_outputs(read_flight_folder(folder))
        except InputError as error:
            raise refuse(error, as_json) from error
    code = open_viewer(recording)
    if as_json:
        emit({"recording": str(recording), "viewer_exit": code})
    if code:
        say(f"the viewer ended with {code}: it needs a screen; `mission report {folder}` makes a page instead")
        raise typer.Exit(Exit.COULD_NOT)
