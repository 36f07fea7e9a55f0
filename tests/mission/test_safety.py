"""The safety page: every test it names exists, and every trigger and alarm stands in it."""

import ast
import re
from pathlib import Path

import pytest

from mission.executive.monitors import Alarm
from mission.executive.phases import Trigger

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "safety.md").read_text(encoding="utf-8")
ROWS = [
    [cell.strip() for cell in line.strip().strip("|").split("|")]
    for line in PAGE.splitlines()
    if line.startswith("| ") and not line.startswith("| hazard |")
]
DEFINED = {
    path.name: {
        node.name for node in ast.parse(path.read_text(encoding="utf-8")).body if isinstance(node, ast.FunctionDef)
    }
    for path in (ROOT / "tests").rglob("test_*.py")
}


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row[0])
def test_every_hazard_has_an_answer_and_tests_that_exist(row):
    _, answer, shown = row
    assert len(answer) > 5
    named = re.findall(r"`([^`]+)`", shown)
    assert named
    for reference in named:
        file, test = reference.split("::")
        assert test in DEFINED.get(file, ()), f"{reference} is gone, which showed: {row[0]}"


def test_every_trigger_and_alarm_stands_in_some_answer():
    answers = {word for row in ROWS for word in re.findall(r"`([A-Z_]+)`", row[1])}
    assert {one.name for one in Trigger} <= answers
    assert {one.name for one in Alarm} <= answers
    assert answers <= {one.name for one in Trigger}


def test_no_two_files_of_tests_have_the_same_name():
    assert len(DEFINED) == len(list((ROOT / "tests").rglob("test_*.py")))
