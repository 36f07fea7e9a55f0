"""The `mission` command: its verbs, each a file in `mission.verbs`."""

from __future__ import annotations

import sys

import typer

from mission.console import Exit, say
from mission.verbs.check import check
from mission.verbs.export import export
from mission.verbs.fly import fly
from mission.verbs.plan import plan
from mission.verbs.push import push
from mission.verbs.report import report
from mission.verbs.resume import resume
from mission.verbs.view import view

app = typer.Typer(
    name="mission",
    help="Plans sets of different exploration flights, proves them safe, and flies them.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
app.command()(check)
app.command()(plan)
app.command()(fly)
app.command()(resume)
app.command()(push)
app.command()(export)
app.command()(view)
app.command()(report)


def main() -> None:
    """Runs the command line; the exit code is 0 done, 1 could not, 2 bad input, 130 interrupted."""
    try:
        app()
    except KeyboardInterrupt:
        say("interrupted")
        sys.exit(Exit.INTERRUPTED)
