"""The `mission` command: its verbs, each a file in `mission.verbs`."""

from __future__ import annotations

import io
import os
import sys
import traceback

import typer

from mission.console import Exit, document_of_the_verb, emit, say, silence
from mission.interrupts import Interrupts
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


WORDS = {
    Exit.COULD_NOT: "could not: standard error says why",
    Exit.BAD_INPUT: "the command line is not as it must be: standard error says why",
    Exit.INTERRUPTED: "interrupted",
}

LIBRARIES = {
    # The matrices here are small: threads that share a product wait for each other, on busy cores a hundred times as
    # long as it takes.
    "OPENBLAS_NUM_THREADS": "1",
    # Of a GPU the first process would else take three quarters of the memory, and leave too little to replanning.
    "XLA_PYTHON_CLIENT_PREALLOCATE": "false",
}
"""What libraries read when a verb first imports them, unless the environment says otherwise; processes begun from here
inherit it."""


def main() -> None:
    """Runs the command line; the exit code is 0 done, 1 could not, 2 bad input, 130 interrupted."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            # A terminal that knows no "m/s²" shows a question mark.
            stream.reconfigure(errors="replace")
    for name, value in LIBRARIES.items():
        os.environ.setdefault(name, value)
    document_of_the_verb.clear()
    with Interrupts():
        code, why = _ended()
        if code == Exit.INTERRUPTED:
            say(why)
        try:
            if code and "--json" in sys.argv and not document_of_the_verb:
                emit({"error": why, "exit_code": code})
            sys.stdout.flush()
        except OSError as error:
            say(f"standard output cannot be written: {error.strerror or error}")
            silence(sys.stdout)
            code = code or Exit.COULD_NOT
    sys.exit(code)


def _ended() -> tuple[int, str]:
    """Runs a verb: its exit code, and why it is that."""
    try:
        app()
    except KeyboardInterrupt:
        return Exit.INTERRUPTED, WORDS[Exit.INTERRUPTED]
    except SystemExit as ended:
        code = Exit.INTERRUPTED if Interrupts.asked else Exit(ended.code or 0)
        return code, WORDS.get(code, "")
    except OSError as error:
        # Verbs answer for the files they are given: what is left is where they print to.
        why = f"standard output cannot be written: {error.strerror}" if error.filename is None else str(error)
        say(why)
        silence(sys.stdout)
        return Exit.COULD_NOT, why
    except Exception as error:  # noqa: BLE001 (a fault of the program's own: told whole, and in the object too)
        traceback.print_exc()
        return Exit.COULD_NOT, f"{type(error).__name__}: {error}"
    return Exit.DONE, ""
