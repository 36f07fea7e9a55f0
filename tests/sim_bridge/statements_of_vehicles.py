"""What is known of real vehicles, in the words in which it is known, and the tests that show each statement.

Each key is a quotation from the page of facts; with `statements_of_libraries` they are all of it.
"""

MAVSDK = (
    "test_simulator::test_mavsdk_arms_takes_off_flies_a_circle_returns_and_lands",
    "test_simulator::test_mavsdk_uploads_a_mission_and_a_fence_and_reads_both_back",
    "test_simulator::test_mavsdk_writes_parameters_and_reads_them_back",
)
LINK_FLIES = "test_link::test_a_vehicle_is_armed_flown_by_setpoints_and_landed"
LINK_UPLOADS = "test_link::test_a_mission_a_fence_and_rally_points_are_uploaded_and_read_back"
MASKS = (
    "test_setpoint_masks::test_the_masks_are_the_numbers_of_the_page",
    "test_setpoint_masks::test_px4_flies_what_a_mask_says_and_looks_at_nothing_else",
    "test_setpoint_masks::test_copter_flies_what_a_mask_says_and_looks_at_nothing_else",
)
FENCES = (
    "test_fences::test_px4_holds_where_an_area_ends",
    "test_fences::test_copter_returns_where_an_area_ends_if_it_watches_them",
)
COPTER_CIRCLE = "test_ardupilot::test_velocity_and_acceleration_each_help_to_follow_a_circle"
PX4_CIRCLE = (
    "test_px4_offboard::test_on_the_circle_of_real_flights_positions_alone_lag_by_metres_and_velocities_halve_that"
)
NO_STREAM = "test_px4_offboard::test_other_frames_and_an_all_ignored_mask_count_as_no_stream"
SETTINGS = (
    "test_vehicle_settings::test_px4_settings_that_are_not_safe_are_refused_with_the_parameter_to_change",
    "test_vehicle_settings::test_limits_are_the_smaller_of_the_two_and_it_is_said",
    "test_vehicle_settings::test_a_curve_is_slowed_down_until_every_limit_holds",
)
FENCE_WITHOUT_HOME = (
    "test_px4_plans::test_a_fence_that_does_not_contain_home_is_accepted_then_a_text_says_it_is_invalid"
    "_and_it_is_not_enforced"
)
NUMBERS = (
    "test_state::test_a_setpoint_that_is_not_all_numbers_cannot_be_made",
    "test_stream_gate::test_a_setpoint_with_anything_that_is_no_number_does_not_leave",
    "test_link_patience::test_a_parameter_that_is_no_number_does_not_leave",
)
SIGNED_ONLY = (
    "test_signing::test_a_vehicle_with_a_key_answers_what_is_signed_and_nothing_else",
    "test_link_parts::test_with_a_key_unsigned_wrongly_signed_and_repeated_messages_are_refused",
    "test_link::test_with_a_key_both_ends_hear_each_other_and_nobody_else",
    "test_link::test_a_vehicle_without_the_key_is_not_believed",
    "test_second_station::test_a_second_station_without_the_key_is_not_answered",
)
PX4_STREAMS = (
    "test_px4_commands::test_the_messages_a_client_needs_come_by_themselves",
    "test_ardupilot_answers::test_all_that_a_client_needs_comes_when_it_is_asked_for",
)

OF_VEHICLES: dict[str, tuple[str, ...]] = {
    "Observed on PX4 1.15.2 (SIH quadrotor) and ArduCopter 4.5 (SITL quadrotor) with default parameters": (
        "test_px4_commands::test_the_version_is_told_on_request_and_says_1_15_2",
        "test_ardupilot_answers::test_ftp_is_answered_with_a_nak_and_the_version_on_request",
    ),
    "The built-in vehicle must do the same (`--autopilot px4|ardupilot`), and the flight code must survive both.": (
        *MAVSDK,
        LINK_FLIES,
        "test_faults_in_flight::test_a_fault_in_flight_breaks_nothing",
    ),
    # Frames.
    "LOCAL_NED is anchored at GPS_GLOBAL_ORIGIN, not at home; home altitude differs from the origin's by 1–2 m.": (
        "test_px4_commands::test_home_is_not_the_origin_and_lies_one_to_two_metres_off_in_height",
        "test_ardupilot::test_home_is_not_the_origin",
    ),
    "(x, y, z)_ned = (north, east, −up); yaw_ned = 90° − yaw_enu.": (
        "test_frames::test_a_setpoint_reaches_the_place_that_was_meant",
        "test_frames::test_swapping_axes_twice_changes_nothing",
        "test_frames::test_east_is_ninety_degrees_on_a_compass",
    ),
    "PX4 projects on a sphere (R = 6 371 000 m, azimuthal equidistant);": (
        "test_px4_commands::test_positions_of_the_map_are_those_of_a_sphere",
        "test_frames::test_px4s_map_is_the_azimuthal_equidistant_one_on_its_sphere",
    ),
    "against WGS84 ENU that is 0.3 m at 141 m, 3 m at 1.4 km, 15 m at 7 km.": (
        "test_frames::test_the_maps_differ_from_the_tangent_plane_as_much_as_real_vehicles_do",
    ),
    "ArduPilot: 0.011131884502145034 m per 1e-7 degree.": ("test_ardupilot::test_its_map_scales_degrees",),
    "Convert through latitude and longitude with the vehicle's own projection before streaming local setpoints.": (
        "test_frames::test_a_setpoint_reaches_the_place_that_was_meant",
        "test_frames::test_a_vehicles_map_is_undone_by_its_inverse",
    ),
    "On PX4 never send GLOBAL_RELATIVE_ALT setpoints (frame 6): 1.15.2 has a sign error (flew 2 m off).": (
        "test_px4_offboard::test_a_setpoint_relative_to_home_flies_metres_off_as_in_1_15_2",
        "test_link_patience::test_each_setpoint_leaves_when_it_is_set_and_the_last_again_and_again",
    ),
    "LOCAL_NED (frame 1) and GLOBAL_INT (frame 5, AMSL) are right.": (
        "test_px4_offboard::test_stream_then_mode_then_arm_flies_from_the_ground",
        "test_px4_offboard::test_a_global_setpoint_above_sea_level_goes_where_it_says",
    ),
    "Take-off altitude is AMSL on PX4, above home on ArduPilot.": (
        "test_px4_commands::test_take_off_is_above_sea_level_and_ends_in_hold",
        "test_ardupilot::test_take_off_is_above_home",
    ),
    "Rally points: frame 3 only.": (
        "test_px4_plans::test_rally_points_are_relative_to_home_only",
        "test_exports::test_mavsdk_reads_the_fence_and_the_rally_points_back",
    ),
    # PX4.
    "custom_mode = sub<<24 | main<<16; OFFBOARD 6/0, POSCTL 3/0, AUTO 4 with TAKEOFF 2, HOLD 3, MISSION 4, RTL 5, "
    "LAND 6.": (
        "test_px4_commands::test_modes_are_main_and_sub_mode",
        "test_px4_commands::test_take_off_is_above_sea_level_and_ends_in_hold",
        "test_px4_offboard::test_when_setpoints_resume_it_enters_offboard_again_by_itself",
        "test_link_telemetry::test_modes_mean_the_same_on_both_autopilots",
    ),
    "Heartbeat 1 Hz; acks in 1–15 ms, the heartbeat shows the change up to 1 s later: wait for it.": (
        "test_px4_commands::test_the_heartbeat_comes_once_a_second_and_is_a_px4_quadrotors",
        "test_px4_commands::test_the_heartbeat_shows_a_change_up_to_a_second_after_the_ack",
        "test_command_protocol::test_an_acknowledgement_comes_within_fifteen_milliseconds",
        "test_executive_orders::test_a_vehicle_that_does_not_take_setpoints_lands_where_it_is",
    ),
    "system_status 0 → 3 ready → 4 armed → 5 in failsafe.": (
        "test_px4_offboard::test_the_status_goes_from_nothing_to_ready_to_armed_to_failsafe",
        "test_link_telemetry::test_a_failsafe_is_the_heartbeats_status",
    ),
    "Ready = SYS_STATUS health bit 0x10000000, some 36 s after boot;": (
        "test_px4_commands::test_it_is_ready_some_36_seconds_after_boot",
    ),
    "arming before: TEMPORARILY_REJECTED with STATUSTEXT (text may span two chunks).": (
        "test_px4_commands::test_arming_before_it_is_ready_is_temporarily_rejected_and_says_why_in_two_chunks",
        "test_status_texts::test_text_in_chunks_is_put_together",
    ),
    'Retry, and show the text: "denied" without a reason is the users\' commonest complaint.': (
        "test_executive_orders::test_arming_is_tried_again_and_the_refusal_is_shown_once",
        "test_link::test_arming_that_is_refused_says_why_in_the_vehicles_own_words",
    ),
    "Offboard: stream first (1 s), then mode, then arm.": (
        "test_px4_offboard::test_stream_then_mode_then_arm_flies_from_the_ground",
    ),
    "Disarmed without a stream the mode is ACCEPTED and arming is rejected;": (
        "test_px4_offboard::test_disarmed_without_a_stream_the_mode_is_accepted_and_arming_is_rejected",
    ),
    "in flight without a stream the mode is TEMPORARILY_REJECTED.": (
        "test_px4_offboard::test_in_flight_without_a_stream_the_mode_is_temporarily_rejected",
    ),
    "≥ 2 Hz keeps it; below that it flaps.": (
        "test_px4_offboard::test_two_setpoints_a_second_keep_offboard",
        "test_px4_offboard::test_below_two_a_second_the_mode_flaps",
    ),
    "One second (COM_OF_LOSS_T) after the last valid setpoint: status 5; COM_OBL_RC_ACT = 0 (default, no RC) → POSCTL "
    "and a slow descent to the ground; 5 → HOLD.": (
        "test_px4_offboard::test_a_second_after_the_last_setpoint_it_sinks_to_the_ground_in_position_mode",
        "test_px4_offboard::test_with_com_obl_rc_act_5_it_holds",
        "test_px4_offboard::test_com_of_loss_t_says_how_long_a_gap_may_be",
        "test_px4_failsafe::test_com_obl_rc_act_means",
    ),
    "**When setpoints resume it re-enters OFFBOARD by itself**, unless HOLD/RTL/LAND was commanded.": (
        "test_px4_offboard::test_when_setpoints_resume_it_enters_offboard_again_by_itself",
        "test_px4_offboard::test_it_does_not_come_back_after_another_mode_was_commanded",
    ),
    "Check COM_OBL_RC_ACT, COM_OF_LOSS_T, GF_ACTION, MPC_XY_VEL_MAX, MPC_Z_VEL_MAX_UP/DN, MPC_ACC_HOR before arming, "
    "and clamp to the smaller limits.": (
        *SETTINGS,
        "test_executive::test_a_failed_check_ends_before_anything_is_armed",
    ),
    "Setpoints are never acked.": MASKS,
    "Frame 1 only (8 is body velocity); other frames and an all-ignored mask count as no stream.": (
        "test_setpoint_masks::test_in_px4s_frame_8_a_velocity_is_the_bodys",
        NO_STREAM,
    ),
    'NaN is not rejected: it becomes "stop here".': (
        "test_px4_offboard::test_nan_is_not_rejected_and_means_stop_here",
    ),
    "No smoothing: the commanded curve is what is flown (velocity steps ≈ 5 m/s², clipped at MPC_XY_VEL_MAX 12, up 3, "
    "down 1.5).": (
        "test_px4_offboard::test_a_velocity_is_clipped_to_the_parameters",
        "test_px4_offboard::test_a_velocity_step_accelerates_at_about_five",
        "test_px4_offboard::test_a_parameter_changed_in_flight_changes_the_limit",
        "test_px4_offboard::test_a_fast_smooth_curve_with_feed_forward_is_followed_within_decimetres",
    ),
    "Masks: pos+vel+yaw 2496, pos+vel+acc+yaw 2048, pos+yaw 2552, vel+yaw 2503.": MASKS,
    "Tracking a 5 m circle at 1.5 m/s, 20 Hz: position only 2.34 m mean error, position+velocity 0.88 m.": (
        PX4_CIRCLE,
    ),
    "The estimate itself wanders 0.8 m: acceptance radii under 1 m may never be met.": (
        "test_px4_commands::test_the_estimate_wanders_by_the_better_part_of_a_metre",
        "test_exports::test_the_items_take_off_first_fly_every_waypoint_at_its_speed_and_end_as_asked",
    ),
    "Mission upload: the first item is asked for with MISSION_REQUEST, later ones with MISSION_REQUEST_INT; answer "
    "both with MISSION_ITEM_INT.": (
        "test_px4_plans::test_the_first_item_is_asked_for_with_mission_request_and_later_ones_with_request_int",
        "test_px4_plans::test_a_client_that_refuses_mission_request_as_mavsdk_does_is_asked_the_other_way_at_once",
        LINK_UPLOADS,
    ),
    'A lost item is re-asked every 0.26 s for 5 s, then STATUSTEXT "Operation timeout" and no ack; the old mission '
    "stays.": (
        "test_px4_plans::test_a_lost_item_is_asked_for_every_quarter_second_for_five_seconds_then_a_text_and_no_ack",
        "test_px4_plans::test_a_lost_item_that_comes_after_all_goes_on_with_the_upload",
        "test_plan_transfer::test_a_plan_that_px4_accepts_is_whole_and_one_that_it_does_not_leaves_the_old_one",
    ),
    "**ACCEPTED is no sanity check**: a waypoint 50 km away, latitude 95, NaN or negative altitude were accepted and "
    "flown.": (
        "test_px4_plans::test_accepted_is_no_sanity_check",
        "test_px4_plans::test_nonsense_is_flown",
    ),
    "MISSION_ITEM_REACHED repeats each second: de-duplicate.": (
        "test_px4_plans::test_a_mission_is_flown_item_after_item_and_reached_is_repeated_each_second",
        "test_link_telemetry::test_repeated_reports_of_a_reached_item_are_told_once",
    ),
    "DO_SET_MISSION_CURRENT is UNSUPPORTED: send MISSION_SET_CURRENT.": (
        "test_px4_commands::test_an_unknown_command_is_unsupported_and_one_for_another_system_fails",
        "test_px4_plans::test_mission_set_current_jumps",
        "test_px4_plans::test_mission_set_current_for_another_system_changes_nothing",
    ),
    "A new mission uploaded in flight starts at item 0 at once.": (
        "test_px4_plans::test_a_new_mission_uploaded_in_flight_starts_at_item_0_at_once",
    ),
    "Fence: one that does not contain home is ACCEPTED, then STATUSTEXT says it is invalid and nothing is enforced:": (
        FENCE_WITHOUT_HOME,
    ),
    "check containment yourself and listen after the ack.": (
        "test_preflight::test_a_vehicle_outside_the_fence_it_is_given_is_refused",
        "test_link::test_a_fence_that_does_not_hold_home_is_refused_although_the_vehicle_accepted_it",
    ),
    "Breach in Offboard (GF_ACTION 2) → HOLD, status 5, while the stream runs on.": (
        "test_px4_plans::test_a_breach_in_offboard_holds_while_the_stream_runs_on",
        "test_fences::test_px4_holds_where_an_area_ends",
    ),
    "Unknown parameter: no reply. Unknown command UNSUPPORTED. A command for another system: FAILED.": (
        "test_px4_commands::test_an_unknown_parameter_gets_no_reply",
        "test_px4_commands::test_an_unknown_command_is_unsupported_and_one_for_another_system_fails",
        "test_ardupilot::test_an_unknown_command_is_unsupported_and_an_unknown_parameter_gets_no_reply",
    ),
    "Ports: vehicle i listens for an API client on 14540+i, for a ground station on 14550.": (
        "test_simulator_ports::test_the_first_port_is_14540",
        "test_simulator_ports::test_vehicle_i_speaks_to_the_port_i_behind_the_first_and_all_to_the_ground_stations",
        "test_simulator_ports::test_a_client_and_a_ground_station_hear_the_same_vehicle_and_both_are_answered",
    ),
    # ArduPilot.
    "custom_mode plain: STABILIZE 0, AUTO 3, GUIDED 4, LOITER 5, RTL 6, LAND 9.": (
        "test_ardupilot::test_the_heartbeat_is_a_copters_and_its_mode_a_plain_number",
        "test_ardupilot::test_land_and_return_end_on_the_ground_disarmed",
        "test_ardupilot_plans::test_auto_flies_the_mission",
        "test_link_telemetry::test_modes_mean_the_same_on_both_autopilots",
    ),
    "Only HEARTBEAT and STATUSTEXT arrive until streams are requested.": (
        "test_ardupilot::test_only_heartbeats_and_texts_come_until_more_is_asked_for",
    ),
    "Ready about 40 s after boot; before that arming is FAILED with a text;": (
        "test_ardupilot::test_arming_before_it_is_ready_fails_with_a_text_and_some_forty_seconds_after_boot_it_does_not",
    ),
    "a GUIDED accepted in the first 2 s is silently undone: check the mode again before arming.": (
        "test_ardupilot::test_guided_accepted_in_the_first_two_seconds_is_silently_undone",
        LINK_FLIES,
    ),
    "Auto-disarm 10 s after arming without take-off.": (
        "test_ardupilot::test_it_disarms_ten_seconds_after_arming_without_a_take_off",
        "test_px4_commands::test_an_armed_vehicle_that_does_not_take_off_disarms_by_itself",
    ),
    "GUIDED → arm → NAV_TAKEOFF (above home) → setpoints.": (
        "test_ardupilot_answers::test_guided_then_arming_then_take_off_is_the_only_order",
    ),
    "A setpoint during the climb cancels the take-off.": (
        "test_ardupilot::test_a_setpoint_during_the_climb_cancels_the_take_off",
    ),
    "A position target is held for ever; a velocity target stops after 3.0 s (GUID_TIMEOUT) and it stays in GUIDED.": (
        "test_ardupilot::test_a_position_target_is_held_for_ever",
        "test_ardupilot::test_a_velocity_target_stops_after_three_seconds_and_it_stays_in_guided",
    ),
    'All three axes are required; a partial mask means "stop".': (
        "test_ardupilot::test_all_three_axes_are_required_and_a_partial_mask_means_stop",
    ),
    "**A NaN setpoint crashes it.**": ("test_ardupilot::test_a_nan_setpoint_ends_the_flight",),
    "Every number that leaves us is finite, or it does not leave.": (
        *NUMBERS,
        "test_fault_witness::test_a_number_that_is_none_is_noticed",
    ),
    "Missions: item 0 is home; items are asked for only with MISSION_REQUEST;": (
        "test_ardupilot_plans::test_items_come_back_in_frame_3_and_item_0_is_home",
        "test_ardupilot_plans::test_items_are_asked_for_only_with_mission_request",
    ),
    "a lost one every 1.0 s for 8 s, then MISSION_ACK OPERATION_CANCELLED (15).": (
        "test_ardupilot_plans::test_a_lost_item_is_asked_for_every_second_for_eight_seconds_then_the_upload_is_cancelled",
        "test_plan_transfer::test_an_upload_that_ardupilot_gave_up_leaves_the_first_new_items_in_the_old_plan",
    ),
    "At most 650 items (NO_SPACE).": (
        "test_ardupilot_plans::test_more_than_650_items_have_no_space",
        "test_exports::test_a_plan_of_more_items_than_ardupilot_holds_is_refused_with_what_to_do",
    ),
    "NaN altitude, latitude 95: INVALID_PARAM7, INVALID_PARAM5_X.": (
        "test_ardupilot_plans::test_nonsense_is_refused_by_parameter",
    ),
    "NaN in unused params may be refused: send 0.": (
        "test_ardupilot_answers::test_nan_in_a_parameter_that_is_not_used_may_be_refused_and_nought_is_taken",
        LINK_UPLOADS,
    ),
    "Items come back in frame 3 and with small changes: compare by meaning.": (
        "test_ardupilot_plans::test_items_come_back_in_frame_3_and_item_0_is_home",
        "test_ardupilot_answers::test_heights_come_back_in_whole_centimetres_above_home",
        "test_plan_transfer::test_of_a_waypoint_copter_keeps_the_delay_alone",
        LINK_UPLOADS,
    ),
    "A second ground station uploading: DENIED.": (
        "test_ardupilot_plans::test_a_second_ground_station_that_uploads_meanwhile_is_denied",
        "test_faults::test_a_second_station_that_uploads_keeps_ours_out_for_some_seconds",
    ),
    "Tracking the same circle: position only 1.72 m, position+velocity 0.39 m, with acceleration 0.16 m.": (
        COPTER_CIRCLE,
    ),
    "The GCS failsafe watches system id 255.": (
        "test_ardupilot::test_the_ground_station_failsafe_watches_system_255",
        "test_vehicle_settings::test_copter_settings_that_are_not_safe_are_refused_with_the_parameter_to_change",
    ),
    # Protocol.
    "Mission types: 0 mission, 1 fence (5001/5002 polygon in/exclusion, p1 = vertex count; 5003/5004 circle, p1 = "
    "radius), 2 rally.": (
        *FENCES,
        "test_px4_plans::test_what_was_uploaded_is_read_back",
    ),
    "Encoding lat/lon × 1e7.": (
        "test_px4_plans::test_what_was_uploaded_is_read_back",
        "test_ardupilot_answers::test_heights_come_back_in_whole_centimetres_above_home",
    ),
    "Time-outs 1.5 s, items 0.25 s, 5 retries.": (
        "test_plan_transfer::test_with_a_fifth_lost_px4_still_takes_twenty_items",
        "test_px4_plans::test_a_lost_item_is_asked_for_every_quarter_second_for_five_seconds_then_a_text_and_no_ack",
        "test_link_patience::test_an_upload_that_is_not_answered_is_begun_five_times_and_given_up",
    ),
    "Command retry raises `confirmation`;": (
        "test_command_protocol::test_a_repetition_with_a_raised_confirmation_is_answered_again_and_done_once",
    ),
    "IN_PROGRESS lengthens the wait.": (
        "test_px4_commands::test_a_long_command_is_in_progress_until_it_is_done",
        "test_link_patience::test_a_command_that_is_in_progress_is_waited_for_longer",
        "test_link_answers::test_what_comes_before_the_last_answer_does_no_harm",
    ),
    "Signing: 13 bytes (link id, 48-bit time in 10 µs since 2015-01-01, sha256 prefix);": (
        "test_signing::test_a_signature_is_byte_for_byte_pymavlinks",
        "test_signing::test_a_signature_with_any_bit_changed_is_not_accepted",
        "test_link_parts::test_what_leaves_is_signed_so_that_the_other_end_accepts_it",
    ),
    "monotonic per (system, component, link).": (
        "test_signing::test_times_of_signatures_rise_for_each_system_component_and_link",
        "test_signing::test_all_that_a_vehicle_with_a_key_says_is_signed_with_rising_times",
        "test_link_parts::test_a_recording_from_long_ago_is_refused_on_any_link_id",
    ),
    "A receiver with a key accepts nothing unsigned.": SIGNED_ONLY,
    "A sender's messages count only from the system and component they should come from.": (
        "test_link_parts::test_only_the_vehicle_and_its_autopilot_are_heard",
        "test_link::test_another_system_id_is_not_our_vehicle",
    ),
    "The vehicle streams, for a client to be content: HEARTBEAT 1 Hz, SYS_STATUS (0x20 GPS, 0x10000000 ready), "
    "GLOBAL_POSITION_INT, LOCAL_POSITION_NED 30, ATTITUDE, HOME_POSITION, GPS_GLOBAL_ORIGIN, EXTENDED_SYS_STATE, "
    "BATTERY_STATUS, POSITION_TARGET_LOCAL_NED, MISSION_CURRENT, ESTIMATOR_STATUS;": (
        *PX4_STREAMS,
        "test_px4_commands::test_message_rates_can_be_changed_stopped_and_asked_for",
        "test_simulator::test_mavsdk_arms_takes_off_flies_a_circle_returns_and_lands",
    ),
    "answers PING, TIMESYNC, parameters (PX4 bytewise, ArduPilot cast), AUTOPILOT_VERSION, and FTP with a NAK.": (
        "test_px4_commands::test_ping_and_timesync_are_answered",
        "test_px4_commands::test_parameters_travel_bytewise",
        "test_px4_commands::test_the_version_is_told_on_request_and_says_1_15_2",
        "test_px4_commands::test_ftp_is_answered_with_a_nak",
        "test_ardupilot::test_parameters_travel_as_their_values",
        "test_ardupilot_answers::test_ping_and_timesync_are_answered",
        "test_ardupilot_answers::test_ftp_is_answered_with_a_nak_and_the_version_on_request",
    ),
    # Vehicles.
    "PX4 defaults: MPC_XY_CRUISE 5, XY_VEL_MAX 12, Z up 3, down 1.5 m/s, ACC_HOR 3 (max 5), JERK_AUTO 4, yaw rate "
    "45–60 °/s, NAV_ACC_RAD 10 m.": (
        "test_px4_commands::test_parameters_have_px4s_defaults",
        "test_mission_file::test_presets_have_the_figures_of_their_vehicles",
    ),
    "Crazyflie 2.1: 0.5 m/s (limit 1.0), 2 m/s².": (
        "test_mission_file::test_presets_have_the_figures_of_their_vehicles",
        "test_kinematics::test_a_crazyflie_follows_in_a_room_at_its_limits_without_running_past_them",
    ),
}
