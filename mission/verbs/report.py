"""`mission report`: one self-contained HTML file about a flight."""

from __future__ import annotations

from mission.console import JsonOption, emit, refuse, say
from mission.findings import InputError
from mission.verbs.push import FlightArgument


def report(folder: FlightArgument, as_json: JsonOption = False) -> None:
    """Write a flight's report, picture and recording anew from its log, also where the flight never ended."""
    from mission.flying.flight_folder import draw_outputs, read_flight_folder

    try:
        files = draw_outputs(read_flight_folder(folder))
    except InputError as error:
        raise refuse(error, as_json) from error
    say(f"wrote {', '.join(map(str, files))}")
    if as_json:
        emit({"files": [str(file) for file in files]})
