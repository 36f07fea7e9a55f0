"""`mission check`: everything that is wrong with a mission file, or the mission it resolves to."""

from __future__ import annotations

from mission.console import JsonOption, MissionArgument, SetOption, emit, refuse, say, show
from mission.findings import InputError


def check(mission_file: MissionArgument, overrides: SetOption = None, as_json: JsonOption = False) -> None:
    """Say everything that is wrong with a mission file at once, or print what it resolves to."""
    from mission.cautions import cautions_about
    from mission.loading import mission_from_document, read_document
    from mission.resolved import resolved_entries
    from mission.site.endurance import endurance_budget

    try:
        document = read_document(mission_file, overrides or ())
        mission = mission_from_document(document)
    except InputError as error:
        raise refuse(error, as_json) from error
    entries = list(resolved_entries(mission, document))
    budget = endurance_budget(mission)
    cautions = cautions_about(mission)
    for caution in cautions:
        say(f"! {caution}")
    if as_json:
        emit(
            {
                "mission": mission.model_dump(mode="json"),
                "entries": [
                    {"path": e.path, "value": e.value, "unit": e.unit, "source": e.source.value} for e in entries
                ],
                "flight_s": budget.needed_s,
                "endurance_s": budget.endurance_s,
                "warnings": cautions,
            }
        )
        return
    _print_table(mission.name, entries)
    print(
        f"\nFlight: climb {budget.climb_s:.0f} s, to the start {budget.approach_s:.0f} s, path {budget.path_s:.0f} s, "
        f"way home {budget.return_s:.0f} s, descent {budget.descent_s:.0f} s; with a reserve of {budget.reserve_s:.0f} "
        f"s that is {budget.needed_s:.0f} s of {budget.endurance_s:.0f} s."
    )


def _print_table(name: str, entries: list) -> None:
    """The resolved mission, what was not written in the file dimmed."""
    from rich.table import Table
    from rich.text import Text

    from mission.mission_file.errors import spelled
    from mission.resolved import Source

    table = Table(title=Text(name), title_justify="left", box=None, pad_edge=False, header_style="bold")
    for heading in ("entry", "value", "unit", "from"):
        table.add_column(heading, overflow="fold")
    section = ""
    for entry in entries:
        if entry.value is None:
            continue
        head = entry.path.partition(".")[0]
        if section and head != section:
            table.add_row()
        section = head
        given = entry.source in (Source.FILE, Source.COMMAND_LINE)
        table.add_row(
            entry.path,
            Text(spelled(entry.value)),
            entry.unit,
            entry.source.value,
            style=None if given else "dim",
        )
    show(table, stderr=False)
