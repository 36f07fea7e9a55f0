"""The table of statements: every one has its tests, and the page of facts has no statement that is not in it.

Every test that is named runs by itself; this file sees to it that none of them is renamed or deleted without its
statement, and that nothing is written down as a fact without a test.
"""

import ast
import functools
import re
from pathlib import Path

import pytest

from tests.sim_bridge.statements_of_libraries import NOT_SHOWN_BY_A_TEST, OF_LIBRARIES
from tests.sim_bridge.statements_of_vehicles import OF_VEHICLES

TESTS = Path(__file__).parents[1]
# Found out since, in the sources of both autopilots.
FURTHER_STATEMENTS = {
    "PX4: landed from Offboard it stands in Offboard again, and arms there for a stream only": (
        "test_px4_offboard::test_landed_from_offboard_it_stands_in_offboard_again_and_arms_only_after_another_mode",
        "test_link::test_a_px4_that_stands_in_offboard_after_a_flight_is_armed_for_the_next",
    ),
    "A second ground station that uploads meanwhile is refused by PX4 with ERROR": (
        "test_px4_plans::test_a_second_ground_station_that_uploads_meanwhile_is_refused_and_the_first_goes_on",
    ),
    "What is for another system is not answered": (
        "test_px4_commands::test_what_is_for_another_system_is_not_answered",
        "test_station::test_two_vehicles_answer_only_to_their_own_ids",
        "test_ardupilot_answers::test_a_command_for_another_system_is_neither_obeyed_nor_answered",
    ),
}
STATEMENTS = OF_VEHICLES | OF_LIBRARIES
EVERY_STATEMENT = STATEMENTS | FURTHER_STATEMENTS


@functools.cache
def names_of_tests(module: str) -> frozenset[str]:
    (path,) = TESTS.glob(f"*/{module}.py")
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return frozenset(node.name for node in tree.body if isinstance(node, ast.FunctionDef))


@functools.cache
def page() -> str:
    """The page of facts, which lies beside the checkout where there is one; without its headings."""
    found = [folder / "shared" / "MAVLINK.md" for folder in Path(__file__).parents]
    paths = [path for path in found if path.exists()]
    if not paths:
        pytest.skip("the page of facts is not beside this checkout")
    lines = paths[0].read_text(encoding="utf-8").splitlines()
    return "\n".join(line for line in lines if not line.startswith("#"))


@pytest.mark.parametrize("statement", EVERY_STATEMENT)
def test_every_statement_has_its_tests(statement):
    assert EVERY_STATEMENT[statement]
    for reference in EVERY_STATEMENT[statement]:
        module, test = reference.split("::")
        assert test in names_of_tests(module), f"{reference} is gone, which showed: {statement}"


@pytest.mark.parametrize("statement", [*STATEMENTS, *NOT_SHOWN_BY_A_TEST])
def test_every_statement_is_one_of_the_page(statement):
    assert statement in page()


def test_nothing_on_the_page_is_without_a_row():
    rest = page()
    for statement in sorted([*STATEMENTS, *NOT_SHOWN_BY_A_TEST], key=len, reverse=True):
        # A sentence of the same words elsewhere is the same statement.
        rest = rest.replace(statement, "")
    left = [line.strip(" -") for line in rest.splitlines() if re.search(r"\w", line)]
    assert left == [], "no row quotes these words: write the test first, then the row"
