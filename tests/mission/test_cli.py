import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from mission.cli import app
from mission.plan_file import write_plan_file

RUN = CliRunner()
EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def plan_path(plan_file, tmp_path):
    path = tmp_path / "plan.json"
    write_plan_file(plan_file, path)
    return path


def test_check_prints_the_resolved_mission_with_units_and_sources(sound):
    result = RUN.invoke(app, ["check", str(sound), "--set", "planner.seed=7"], env={"COLUMNS": "140"})
    assert result.exit_code == 0
    lines = {line.split()[0]: line for line in result.stdout.splitlines() if line.strip()}
    assert lines["planner.seed"].split()[1:] == ["7", "--set"]
    assert lines["vehicle.max_climb_mps"].split()[1:] == ["3", "m/s", "preset"]
    assert lines["flight.clearance_margin_m"].split()[1:] == ["1", "metres", "default"]
    assert "of 1200 s" in result.stdout


def test_check_with_json_prints_one_object_and_nothing_else(sound):
    result = RUN.invoke(app, ["check", str(sound), "--json"])
    document = json.loads(result.stdout)
    assert document["mission"]["planner"]["duration_s"] == 600.0
    assert document["flight_s"] <= document["endurance_s"]
    assert {"path": "planner.seed", "value": 0, "unit": "", "source": "default"} in document["entries"]


@pytest.mark.parametrize("format", ["qgc", "wpl", "csv", "geojson", "kml"])
def test_export_writes_a_file_or_to_standard_output(format, plan_path, tmp_path):
    shown = RUN.invoke(app, ["export", str(plan_path), "--format", format])
    target = tmp_path / "out"
    written = RUN.invoke(app, ["export", str(plan_path), "--format", format, "--out", str(target), "--json"])
    assert (shown.exit_code, written.exit_code) == (0, 0)
    assert target.read_text() == shown.stdout
    assert json.loads(written.stdout) == {"file": str(target), "format": format}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["export", "gone.json", "--format", "qgc"], "No such file"),
        (["export", "gone.json", "--format", "gpx"], "gpx"),
        (["export", "gone.json", "--format", "csv", "--json"], "--out"),
        (["check"], "MISSION.toml"),
        (["chekc", "x"], "chekc"),
        (["plan", "gone.toml"], "No such file"),
        (["plan", "gone.toml", "--seed", "x"], "--seed"),
    ],
)
def test_bad_arguments_are_refused_with_exit_code_2_and_said_on_stderr(arguments, said):
    result = RUN.invoke(app, arguments)
    assert result.exit_code == 2
    assert said in result.stderr
    assert "Traceback" not in result.output


def test_a_folder_that_cannot_be_written_is_said(plan_path, tmp_path):
    target = tmp_path / "no such folder" / "out.csv"
    result = RUN.invoke(app, ["export", str(plan_path), "--format", "csv", "--out", str(target)])
    assert result.exit_code == 2
    assert "cannot be written" in result.stderr


@pytest.mark.parametrize("verb", [[], ["check"], ["plan"], ["export"]])
def test_every_verb_has_help(verb):
    result = RUN.invoke(app, [*verb, "--help"])
    assert result.exit_code == 0
    assert "Usage" in result.stdout
    assert "--json" in result.stdout or not verb


def test_help_comes_without_loading_the_planner():
    code = (
        "import sys; from typer.testing import CliRunner; from mission.cli import app; "
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0; "
        "sys.exit(bool({'jax', 'matplotlib', 'mavsdk', 'rerun'} & set(sys.modules)))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


@pytest.mark.parametrize(
    ("name", "usual", "asked"), [("OPENBLAS_NUM_THREADS", "1", "3"), ("XLA_PYTHON_CLIENT_PREALLOCATE", "false", "true")]
)
def test_libraries_are_told_how_to_share_before_they_are_loaded(name, usual, asked):
    code = (
        "import atexit, os, sys; import mission.cli; assert not {'numpy', 'jax'} & set(sys.modules); "
        f"atexit.register(lambda: print(os.environ['{name}'])); "
        "sys.argv = ['mission', '--help']; mission.cli.main()"
    )
    rest = {one: value for one, value in os.environ.items() if one != name}
    for environment, told in ((rest, usual), (rest | {name: asked}, asked)):
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == told


@pytest.mark.parametrize("verb", ["plan", "fly"])
def test_a_folder_that_cannot_be_made_is_said_before_the_work(verb, tmp_path, monkeypatch):
    def solve(*_args, **_kwargs):
        raise AssertionError("it was solved first")

    monkeypatch.setattr("mission.planning.plan", solve)
    (tmp_path / "file").touch()
    target = tmp_path / "file" / "out"
    result = RUN.invoke(app, [verb, str(EXAMPLES / "room.toml"), "--out", str(target), "--json"])
    assert result.exit_code == 2
    assert json.loads(result.stdout)["findings"][0]["path"] == "--out"
    assert "give another folder" in result.stderr
