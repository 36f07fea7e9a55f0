"""What is known of libraries and files, in the words in which it is known, and the tests that show each statement."""

from tests.sim_bridge.statements_of_vehicles import LINK_FLIES, LINK_UPLOADS, MAVSDK

LIBRARIES = "test_libraries::test_the_libraries_are_the_ones_that_were_observed"
QGC_PARTS = "test_exports::test_the_qgroundcontrol_plan_has_every_part_it_must"
QGC_READ = "test_exports::test_mavsdk_reads_the_qgroundcontrol_plan_back_item_by_item"
WPL_PARTS = "test_exports::test_the_waypoint_list_has_home_first_and_numbers_in_every_column"
WPL_READ = "test_exports::test_mavsdk_reads_the_waypoint_list_back_item_by_item"
GEOJSON = "test_exports::test_shapely_reads_the_geojson_and_finds_the_path_inside_the_fence"
KML = "test_exports::test_the_kml_path_is_absolute_with_longitude_first"
RECORDING = "test_flight_outputs::test_everything_is_drawn_from_the_folder_alone"

OF_LIBRARIES: dict[str, tuple[str, ...]] = {
    # Roles of the two libraries.
    "**mavsdk 4.1**": (LIBRARIES,),
    "(a ctypes binding of its C++ library: no server process, no gRPC; the old `from mavsdk import System` API is "
    "gone; front ends `mavsdk` and `mavsdk.asyncio`)": ("test_libraries::test_mavsdk_is_a_binding_without_a_server",),
    "is the flight client: connection, health, parameters, arming, take-off, Offboard/GUIDED stream, mission and fence "
    "upload, RTL, land, telemetry.": (
        *MAVSDK,
        LINK_FLIES,
        LINK_UPLOADS,
        "test_link::test_parameters_are_read_and_written_and_unknown_ones_are_none",
    ),
    "Its Offboard plugin sends a setpoint the moment it is set (so any rate is possible) and repeats the last one at "
    "20 Hz from a C++ thread, so a slow solver never starves the stream;": (
        "test_link_patience::test_each_setpoint_leaves_when_it_is_set_and_the_last_again_and_again",
        "test_link::test_after_the_stream_is_closed_not_one_setpoint_leaves",
    ),
    "therefore a stale setpoint needs our own watchdog (0.5 s without a fresh one → hold here, zero velocity).": (
        "test_streamer::test_a_flight_that_nobody_watches_brakes_on_its_course_and_stands_with_zero_velocity",
        "test_streamer::test_a_setpoint_that_cannot_be_sent_ends_the_stream_and_is_not_repeated",
    ),
    "It sends to all UDP remotes: vehicles filter target ids.": (
        "test_px4_offboard::test_setpoints_for_another_system_are_no_stream",
        "test_ardupilot_answers::test_setpoints_for_another_system_move_nothing",
        "test_station::test_two_vehicles_answer_only_to_their_own_ids",
    ),
    "On ArduPilot it asks for no streams: set the telemetry rates.": (
        "test_ardupilot::test_only_heartbeats_and_texts_come_until_more_is_asked_for",
        "test_link_patience::test_a_copter_is_asked_for_every_stream_that_is_needed",
    ),
    "Command time-out 0.5 s × 3;": (
        "test_link_patience::test_a_command_that_is_not_answered_is_repeated_three_times_and_given_up",
    ),
    "a lost heartbeat is noticed after 3.0 s;": (
        "test_link_patience::test_a_vehicle_whose_heartbeats_end_is_noticed_as_lost",
    ),
    "flight_mode comes from the heartbeat, so it can be 1 s stale.": (
        "test_px4_commands::test_the_heartbeat_shows_a_change_up_to_a_second_after_the_ack",
        "test_link_telemetry::test_without_positions_the_heartbeat_still_tells_the_mode",
    ),
    "**pymavlink 2.4.50** is the codec of the built-in vehicle:": (
        LIBRARIES,
        "test_station::test_messages_survive_the_codec_and_carry_their_sender",
    ),
    "import one dialect (`pymavlink.dialects.v20.common`), never `mavutil`'s globals. MAVLINK20=1 must be set before "
    "import.": ("test_libraries::test_no_global_state_of_mavutil_is_used_and_version_2_is_spoken",),
    "garbage decodes to BAD_DATA with robust parsing.": (
        "test_libraries::test_garbage_decodes_to_bad_data_and_a_setpoint_to_itself",
        "test_station::test_garbage_and_mutated_frames_are_left_out_and_what_follows_is_still_heard",
    ),
    # Files.
    '`.plan`: fileType "Plan", version 1, groundStation; mission version 2 (items, plannedHomePosition [lat, lon, '
    "AMSL], firmwareType 12 PX4 or 3 ArduPilot, vehicleType 2, cruiseSpeed, hoverSpeed);": (QGC_PARTS, QGC_READ),
    "SimpleItem: command, frame, params[7] with null for NaN and lat, lon, alt last, autoContinue, doJumpId from 1, "
    "AltitudeMode/Altitude/AMSLAltAboveTerrain all three or none;": (QGC_PARTS, QGC_READ),
    "geoFence version 2 and rallyPoints version 2 always present.": (
        QGC_PARTS,
        "test_exports::test_mavsdk_reads_the_fence_and_the_rally_points_back",
    ),
    "`QGC WPL 110`: tab-separated index, current, frame, command, p1–p4, lat, lon, alt, autocontinue; item 0 is "
    "home.": (
        WPL_PARTS,
        WPL_READ,
    ),
    "KML and GeoJSON are lon,lat; `.plan` is lat,lon.": (KML, GEOJSON, QGC_PARTS),
    "KML needs an altitudeMode.": (KML,),
    "GeoJSON: accept any winding, write RFC 7946.": (
        GEOJSON,
        "test_mission_file::test_buildings_may_be_drawn_either_way_round",
    ),
    "mavsdk's `import_qgroundcontrol_mission` and `import_mission_planner_mission` are independent checks of ours.": (
        QGC_READ,
        WPL_READ,
    ),
    # Rerun.
    "`RecordingStream(...).save(path, default_blueprint=…)`, LineStrips3D, Points3D, Boxes3D, Mesh3D, Volume3D "
    "(float16, order z, y, x), Scalars, TextLog; whole series with send_columns, static things once. `rerun rrd verify "
    "FILE` for tests.": (RECORDING,),
    "Bind to 127.0.0.1 (it defaults to all interfaces), analytics off.": (
        "test_viewer::test_the_viewer_listens_on_loopback_only_and_tells_nobody",
    ),
}
NOT_SHOWN_BY_A_TEST = {
    ", and read in their sources and documentation.": "where it is known from",
    "Where this page and a guess disagree, this page is what happened.": "a rule for readers",
    "33 µs a setpoint round trip;": "how fast a codec is depends on the machine",
    "On reading, expand ComplexItem's TransectStyleComplexItem.Items.": "plans of ground stations are not read here",
    "A headless picture: Debian's mesa-vulkan-drivers and libvulkan1, then "
    "`rerun.experimental.ViewerClient.spawn(headless=True, …)`, `.open`, `.save_screenshot`, `.get_state`, `.quit` "
    "(about 2 s).": "needs a driver for graphics, which is not wherever tests run; pictures are drawn without it",
}
"""And why not."""
