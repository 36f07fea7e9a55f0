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
    "PX4: one transfer at a time, whose partner hears the errors of others; it ends after 5 s without a word": (
        "test_px4_transfers::test_a_count_before_the_first_item_is_taken_for_a_repetition_whoever_sends_it",
        "test_px4_transfers::test_a_count_after_the_first_item_is_an_error_for_the_partner_and_the_upload_goes_on",
        "test_px4_transfers::test_every_count_puts_the_end_of_a_stalled_upload_off",
        "test_px4_transfers::test_an_unfinished_download_blocks_uploads_until_five_seconds_of_silence",
        "test_px4_transfers::test_a_second_station_takes_over_a_download_of_the_same_kind_only",
    ),
    "PX4: the plan that is held already, uploaded again, changes nothing": (
        "test_px4_transfers::test_the_same_mission_uploaded_again_in_flight_does_not_begin_again",
        "test_px4_transfers::test_a_fence_that_is_held_already_is_not_looked_at_again",
        "test_uploads_held_up::test_a_fence_that_does_not_hold_home_is_refused_also_when_the_vehicle_holds_it_already",
    ),
    "PX4: nothing but NaN is no stream; a NaN position beside a velocity is an ignored one": (
        "test_px4_offboard::test_a_setpoint_of_nan_alone_is_no_stream",
        "test_px4_offboard::test_a_nan_position_beside_a_velocity_flies_the_velocity",
    ),
    "PX4: whatever it accepts it flies or ends, and lives on": (
        "test_px4_plans::test_a_circle_may_have_any_radius",
        "test_px4_plans::test_a_jump_to_an_item_that_is_not_there_ends_the_mission",
        "test_fuzz_plans::test_no_accepted_plan_makes_a_vehicle_fall_over",
    ),
    "A return goes to the nearest of home and the rally points": (
        "test_rally_points::test_a_return_goes_to_the_nearest_of_home_and_the_rally_points",
    ),
    "The origin of the local frame is set anew by every boot": (
        "test_faults::test_a_reboot_puts_the_origin_where_the_vehicle_is",
    ),
    "PX4 hears what is for its autopilot or all of it, about missions also as 190; Copter is any component": (
        "test_unusual_requests::test_px4_obeys_what_is_for_its_autopilot_or_for_all_of_it",
        "test_unusual_requests::test_px4_answers_about_parameters_to_its_own_components",
        "test_unusual_requests::test_px4_answers_about_missions_also_as_the_mission_planner",
        "test_unusual_requests::test_px4_hears_setpoints_for_its_own_components",
        "test_unusual_requests::test_copter_hears_what_is_for_every_system_and_for_components_that_nobody_is",
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
