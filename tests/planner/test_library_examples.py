"""The examples that use the planner as a library do what their first lines say."""

import runpy
from pathlib import Path

import numpy as np

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_a_set_is_planned_from_arrays(capsys):
    runpy.run_path(str(EXAMPLES / "plan_from_arrays.py"))["main"]()
    said = capsys.readouterr().out
    assert "8 of 8 proven" in said
    assert "converged" in said


def test_a_multirotor_is_controlled_around_a_ball():
    example = runpy.run_path(str(EXAMPLES / "control_multirotor.py"))
    path, level, ball = example["flown"]()
    assert len(path) == 1 + example["STEPS"]
    assert ball.distance(path).min() >= 0.99
    assert all(level.workspace.contains(place) for place in path)
    speed = np.linalg.norm(np.diff(path, axis=0), axis=1) / example["CONTROL_S"]
    assert speed.max() <= 4.0 + 1e-3
    quarters = {(place[0] > 15.0, place[1] > 15.0) for place in path}
    assert len(quarters) == 4, "level ground is covered on every side"
