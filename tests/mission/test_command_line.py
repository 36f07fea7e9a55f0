"""The process around the verbs: its one JSON object, its exit code, Ctrl-C, and terminals that are gone or poor."""

import io
import json
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from mission import cli
from mission.interrupts import Interrupts
from mission.progress import SolveProgress
from planner.solver import Progress

EXAMPLES = Path(__file__).parents[2] / "examples"


def ended(arguments, monkeypatch, capsys):
    """Exit code, standard output and standard error of `mission …`."""
    monkeypatch.setattr(sys, "argv", ["mission", *map(str, arguments)])
    with pytest.raises(SystemExit) as caught:
        cli.main()
    said = capsys.readouterr()
    return caught.value.code, said.out, said.err


def swallowed_interrupt():
    """Ctrl-C where what it raises is passed over."""
    try:
        signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        return
    raise AssertionError("nothing was raised")


@pytest.mark.parametrize("verb", ["plan", "fly"])
@pytest.mark.parametrize("swallowed", [False, True])
def test_ctrl_c_while_planning_ends_with_130_also_where_what_it_raises_is_swallowed(
    swallowed, verb, tmp_path, monkeypatch, capsys, planned
):
    def solve(_mission, progress):
        if swallowed:
            swallowed_interrupt()
            return planned
        signal.raise_signal(signal.SIGINT)

    def forbidden(*_args, **_kwargs):
        raise AssertionError("it went on")

    monkeypatch.setattr("mission.planning.plan", solve)
    monkeypatch.setattr("mission.plan_output.write_outputs", forbidden)
    monkeypatch.setattr("mission.verbs.fly.carry_out", forbidden)
    arguments = [verb, EXAMPLES / "room.toml", "--out", tmp_path / "out", "--json"]
    code, out, err = ended(arguments, monkeypatch, capsys)
    assert code == 130
    assert json.loads(out) == {"error": "interrupted", "exit_code": 130}
    assert err.endswith("interrupted\n")


def test_ctrl_c_that_was_swallowed_is_raised_where_the_solver_tells_how_far_it_is():
    with Interrupts(), SolveProgress() as progress:
        progress.update(Progress("seeds", 0.0))
        swallowed_interrupt()
        with pytest.raises(KeyboardInterrupt):
            progress.update(Progress("polish", 0.5))
        Interrupts.asked = False


def test_a_second_ctrl_c_ends_the_process_at_once_whatever_hides_the_first():
    code = (
        "import signal, time; from mission.interrupts import Interrupts\n"
        "with Interrupts():\n"
        "    for _ in range(3):\n"
        "        try: signal.raise_signal(signal.SIGINT)\n"
        "        except KeyboardInterrupt: print('again', flush=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True)
    assert (done.returncode, done.stdout) == (130, "again\n")


@pytest.mark.parametrize("arguments", [["chekc"], ["check"], ["check", "gone.toml"], ["plan", "x", "--seed", "no"]])
def test_there_is_one_json_object_also_where_the_command_line_is_wrong(arguments, monkeypatch, capsys):
    code, out, err = ended([*arguments, "--json"], monkeypatch, capsys)
    assert code == 2
    assert json.loads(out)["error"]
    assert err


def test_a_fault_of_the_program_is_told_whole_and_in_the_object(sound, monkeypatch, capsys):
    def broken(*_):
        raise RuntimeError("a fault")

    monkeypatch.setattr("mission.loading.read_document", broken)
    code, out, err = ended(["check", sound, "--json"], monkeypatch, capsys)
    assert (code, json.loads(out)["error"]) == (1, "RuntimeError: a fault")
    assert "Traceback" in err


class Gone(io.StringIO):
    """A stream whose other end is closed."""

    def write(self, _: str) -> int:
        raise BrokenPipeError(32, "Broken pipe")


def test_where_nobody_reads_what_is_said_the_work_goes_on(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", Gone())
    with SolveProgress() as progress:
        progress.update(Progress("polish", 0.5))
    code, out, _ = ended(["check", "gone.toml", "--json"], monkeypatch, capsys)
    assert code == 2
    assert json.loads(out)["findings"]


def run(arguments, **streams):
    return subprocess.run([sys.executable, "-m", "mission", *map(str, arguments)], check=False, text=True, **streams)


@pytest.mark.parametrize("extra", [[], ["--json"]])
def test_a_full_disk_behind_standard_output_is_said(extra, sound):
    with Path("/dev/full").open("w") as full:
        done = run(["check", sound, *extra], stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 1
    assert "standard output cannot be written: No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_terminal_without_the_letters_gets_others_and_lines_in_a_file_do_not_wrap(sound):
    environment = {"PYTHONIOENCODING": "ascii", "PYTHONPATH": str(EXAMPLES.parent), "PATH": ""}
    done = run(["check", sound], capture_output=True, env=environment)
    assert done.returncode == 0, done.stderr
    (row,) = [line for line in done.stdout.splitlines() if line.startswith("vehicle.max_acceleration_mps2")]
    assert row.split()[1:] == ["3", "m/s?", "preset"]


def test_square_brackets_in_a_name_are_letters(sound, monkeypatch, capsys):
    code, out, _ = ended(["check", sound, "--set", "name='[bold]Field [m]'"], monkeypatch, capsys)
    assert code == 0
    assert out.startswith("[bold]Field [m]")
    assert '"[bold]Field [m]"' in out


def test_the_table_of_candidates_keeps_its_units(planned, capsys):
    from mission.candidates import ranked_candidates
    from mission.verbs.plan import _print_candidates

    _print_candidates(ranked_candidates(planned), planned.plan.selected)
    head = capsys.readouterr().err.splitlines()[0]
    assert all(f"{column} [m]" in head for column in ("length", "clearance", "to selected"))
