"""What is known of real vehicles, statement by statement, and the test of the built-in vehicle that shows each.

Observed on PX4 1.15.2 and ArduCopter 4.5. Every test that is named here runs by itself; this file only sees to it that
none of them is renamed or deleted without its statement.
"""

import ast
from pathlib import Path

import pytest

STATEMENTS = {
    # Frames.
    "LOCAL_NED is anchored at the origin, not at home, and home lies 1-2 m off in height": (
        "test_px4_commands::test_home_is_not_the_origin_and_lies_one_to_two_metres_off_in_height",
        "test_ardupilot::test_home_is_not_the_origin",
    ),
    "Each autopilot has its own map of the earth": (
        "test_px4_commands::test_positions_of_the_map_are_those_of_a_sphere",
        "test_ardupilot::test_its_map_scales_degrees",
    ),
    "PX4: GLOBAL_RELATIVE_ALT setpoints fly metres off; global ones above sea level are right": (
        "test_px4_offboard::test_a_setpoint_relative_to_home_flies_metres_off_as_in_1_15_2",
        "test_px4_offboard::test_a_global_setpoint_above_sea_level_goes_where_it_says",
    ),
    "Take-off altitude is above sea level on PX4, above home on ArduPilot": (
        "test_px4_commands::test_take_off_is_above_sea_level_and_ends_in_hold",
        "test_ardupilot::test_take_off_is_above_home",
    ),
    "Rally points are relative to home only": ("test_px4_plans::test_rally_points_are_relative_to_home_only",),
    # PX4.
    "PX4: custom_mode is sub << 24 | main << 16": ("test_px4_commands::test_modes_are_main_and_sub_mode",),
    "PX4: heartbeats at 1 Hz show a change up to a second after the ack": (
        "test_px4_commands::test_the_heartbeat_comes_once_a_second_and_is_a_px4_quadrotors",
        "test_px4_commands::test_the_heartbeat_shows_a_change_up_to_a_second_after_the_ack",
    ),
    "PX4: ready some 36 s after boot; arming before is temporarily rejected, with a text in chunks": (
        "test_px4_commands::test_it_is_ready_some_36_seconds_after_boot",
        "test_px4_commands::test_arming_before_it_is_ready_is_temporarily_rejected_and_says_why_in_two_chunks",
    ),
    "PX4: Offboard without a stream: accepted but not armed on the ground, temporarily rejected in flight": (
        "test_px4_offboard::test_disarmed_without_a_stream_the_mode_is_accepted_and_arming_is_rejected",
        "test_px4_offboard::test_in_flight_without_a_stream_the_mode_is_temporarily_rejected",
        "test_px4_offboard::test_stream_then_mode_then_arm_flies_from_the_ground",
    ),
    "PX4: landed from Offboard it stands in Offboard again, and arms there for a stream only": (
        "test_px4_offboard::test_landed_from_offboard_it_stands_in_offboard_again_and_arms_only_after_another_mode",
        "test_link::test_a_px4_that_stands_in_offboard_after_a_flight_is_armed_for_the_next",
    ),
    "PX4: two setpoints a second keep Offboard, below that it flaps": (
        "test_px4_offboard::test_two_setpoints_a_second_keep_offboard",
        "test_px4_offboard::test_below_two_a_second_the_mode_flaps",
    ),
    "PX4: COM_OF_LOSS_T after the last setpoint it does what COM_OBL_RC_ACT says": (
        "test_px4_offboard::test_a_second_after_the_last_setpoint_it_sinks_to_the_ground_in_position_mode",
        "test_px4_offboard::test_with_com_obl_rc_act_5_it_holds",
        "test_px4_offboard::test_com_of_loss_t_says_how_long_a_gap_may_be",
    ),
    "PX4: when setpoints resume it is in Offboard again by itself, unless another mode was commanded": (
        "test_px4_offboard::test_when_setpoints_resume_it_enters_offboard_again_by_itself",
        "test_px4_offboard::test_it_does_not_come_back_after_another_mode_was_commanded",
    ),
    "PX4: other frames, other targets and masks that ignore everything are no stream": (
        "test_px4_offboard::test_other_frames_and_an_all_ignored_mask_count_as_no_stream",
        "test_px4_offboard::test_setpoints_for_another_system_are_no_stream",
    ),
    "PX4: NaN is not rejected and means stop here": (
        "test_px4_offboard::test_nan_is_not_rejected_and_means_stop_here",
    ),
    "PX4: what is commanded is flown without smoothing, within the parameters' limits": (
        "test_px4_offboard::test_a_velocity_is_clipped_to_the_parameters",
        "test_px4_offboard::test_a_velocity_step_accelerates_at_about_five",
        "test_px4_offboard::test_a_parameter_changed_in_flight_changes_the_limit",
    ),
    "Feed-forward is worth metres of tracking": (
        "test_px4_offboard::test_on_the_circle_of_real_flights_positions_alone_lag_by_metres_and_velocities_halve_that",
        "test_ardupilot::test_velocity_and_acceleration_each_help_to_follow_a_circle",
    ),
    "PX4: the estimate itself wanders 0.8 m": (
        "test_px4_commands::test_the_estimate_wanders_by_the_better_part_of_a_metre",
    ),
    "PX4: the first item is asked for with MISSION_REQUEST, later ones with MISSION_REQUEST_INT": (
        "test_px4_plans::test_the_first_item_is_asked_for_with_mission_request_and_later_ones_with_request_int",
        "test_px4_plans::test_a_client_that_refuses_mission_request_as_mavsdk_does_is_asked_the_other_way_at_once",
    ),
    "PX4: a lost item is asked for again for 5 s, then a text and no ack; the old mission stays": (
        "test_px4_plans::test_a_lost_item_is_asked_for_every_quarter_second_for_five_seconds_then_a_text_and_no_ack",
        "test_px4_plans::test_a_lost_item_that_comes_after_all_goes_on_with_the_upload",
    ),
    "PX4: ACCEPTED is no sanity check": ("test_px4_plans::test_accepted_is_no_sanity_check",),
    "PX4: MISSION_ITEM_REACHED is repeated each second": (
        "test_px4_plans::test_a_mission_is_flown_item_after_item_and_reached_is_repeated_each_second",
    ),
    "PX4: DO_SET_MISSION_CURRENT is unsupported, MISSION_SET_CURRENT works": (
        "test_px4_commands::test_an_unknown_command_is_unsupported_and_one_for_another_system_fails",
        "test_px4_plans::test_mission_set_current_jumps",
    ),
    "PX4: a mission uploaded in flight starts at item 0 at once": (
        "test_px4_plans::test_a_new_mission_uploaded_in_flight_starts_at_item_0_at_once",
    ),
    "PX4: a fence without home is accepted, then a text says it is invalid, and it is not enforced": (
        "test_px4_plans::test_a_fence_that_does_not_contain_home_is_accepted_then_a_text_says_it_is_invalid"
        "_and_it_is_not_enforced",
    ),
    "PX4: a breach in Offboard holds while the stream runs on": (
        "test_px4_plans::test_a_breach_in_offboard_holds_while_the_stream_runs_on",
    ),
    "Unknown parameters get no reply, unknown commands UNSUPPORTED": (
        "test_px4_commands::test_an_unknown_parameter_gets_no_reply",
        "test_px4_commands::test_an_unknown_command_is_unsupported_and_one_for_another_system_fails",
        "test_ardupilot::test_an_unknown_command_is_unsupported_and_an_unknown_parameter_gets_no_reply",
    ),
    # ArduPilot.
    "ArduPilot: custom_mode is a plain number": (
        "test_ardupilot::test_the_heartbeat_is_a_copters_and_its_mode_a_plain_number",
    ),
    "ArduPilot: only heartbeats and texts come until more is asked for": (
        "test_ardupilot::test_only_heartbeats_and_texts_come_until_more_is_asked_for",
    ),
    "ArduPilot: ready some 40 s after boot; arming before FAILED with a text": (
        "test_ardupilot::test_arming_before_it_is_ready_fails_with_a_text_and_some_forty_seconds_after_boot_it_does_not",
    ),
    "ArduPilot: a GUIDED accepted in the first 2 s is silently undone": (
        "test_ardupilot::test_guided_accepted_in_the_first_two_seconds_is_silently_undone",
    ),
    "Both disarm 10 s after arming without a take-off": (
        "test_px4_commands::test_an_armed_vehicle_that_does_not_take_off_disarms_by_itself",
        "test_ardupilot::test_it_disarms_ten_seconds_after_arming_without_a_take_off",
    ),
    "ArduPilot: a setpoint during the climb cancels the take-off": (
        "test_ardupilot::test_a_setpoint_during_the_climb_cancels_the_take_off",
    ),
    "ArduPilot: a position is held for ever, a velocity for 3 s, and it stays in GUIDED": (
        "test_ardupilot::test_a_position_target_is_held_for_ever",
        "test_ardupilot::test_a_velocity_target_stops_after_three_seconds_and_it_stays_in_guided",
    ),
    "ArduPilot: a partial mask means stop": (
        "test_ardupilot::test_all_three_axes_are_required_and_a_partial_mask_means_stop",
    ),
    "ArduPilot: a NaN setpoint crashes it": ("test_ardupilot::test_a_nan_setpoint_ends_the_flight",),
    "ArduPilot: item 0 is home, items are asked for with MISSION_REQUEST only": (
        "test_ardupilot::test_items_are_asked_for_only_with_mission_request",
        "test_ardupilot::test_items_come_back_in_frame_3_and_item_0_is_home",
    ),
    "ArduPilot: a lost item is asked for each second for 8 s, then OPERATION_CANCELLED": (
        "test_ardupilot::test_a_lost_item_is_asked_for_every_second_for_eight_seconds_then_the_upload_is_cancelled",
    ),
    "ArduPilot: at most 650 items; nonsense is refused by its parameter": (
        "test_ardupilot::test_more_than_650_items_have_no_space",
        "test_ardupilot::test_nonsense_is_refused_by_parameter",
    ),
    "A second ground station that uploads meanwhile is refused": (
        "test_px4_plans::test_a_second_ground_station_that_uploads_meanwhile_is_refused_and_the_first_goes_on",
        "test_ardupilot::test_a_second_ground_station_that_uploads_meanwhile_is_denied",
    ),
    "ArduPilot: the ground station failsafe watches system 255": (
        "test_ardupilot::test_the_ground_station_failsafe_watches_system_255",
    ),
    # Protocol.
    "IN_PROGRESS lengthens the wait": ("test_px4_commands::test_a_long_command_is_in_progress_until_it_is_done",),
    "What is for another system is not answered": (
        "test_px4_commands::test_what_is_for_another_system_is_not_answered",
        "test_station::test_two_vehicles_answer_only_to_their_own_ids",
    ),
    "Parameters travel bytewise on PX4, as their values on ArduPilot": (
        "test_px4_commands::test_parameters_travel_bytewise",
        "test_ardupilot::test_parameters_travel_as_their_values",
    ),
    "PING, TIMESYNC, AUTOPILOT_VERSION are answered, FTP with a NAK": (
        "test_px4_commands::test_ping_and_timesync_are_answered",
        "test_px4_commands::test_the_version_is_told_on_request_and_says_1_15_2",
        "test_px4_commands::test_ftp_is_answered_with_a_nak",
    ),
    "The messages a client needs come by themselves": (
        "test_px4_commands::test_the_messages_a_client_needs_come_by_themselves",
        "test_px4_commands::test_message_rates_can_be_changed_stopped_and_asked_for",
    ),
    "mavsdk flies both": ("test_simulator::test_mavsdk_arms_takes_off_flies_a_circle_returns_and_lands",),
}


def names_of_tests(module: str) -> set[str]:
    tree = ast.parse((Path(__file__).parent / f"{module}.py").read_text(encoding="utf-8"))
    return {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize("statement", STATEMENTS)
def test_every_statement_has_its_tests(statement):
    for reference in STATEMENTS[statement]:
        module, test = reference.split("::")
        assert test in names_of_tests(module), f"{reference} is gone, which showed: {statement}"
