"""ArduPilot Copter's parameters and what its streams hold, as far as the built-in vehicle has them."""

from __future__ import annotations

from sim_bridge.codec import mavlink
from sim_bridge.vehicle.services import SERVED

READY_AFTER_S = 40.0
DEAD_RECKONING_S = 7.0
RELEASE = (4, 5, 7)
CAPABILITIES = (
    SERVED | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FLOAT | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_C_CAST
)

PARAMETERS: dict[str, float] = {
    "AUTO_OPTIONS": 0,
    "BATT_CAPACITY": 3300,
    "BATT_CRT_MAH": 0.0,
    "BATT_CRT_VOLT": 0.0,
    "BATT_FS_CRT_ACT": 0,
    "BATT_FS_LOW_ACT": 0,
    "BATT_LOW_MAH": 0.0,
    "BATT_LOW_VOLT": 10.5,
    "DISARM_DELAY": 10,
    "FENCE_ACTION": 1,
    "FENCE_ALT_MAX": 100.0,
    "FENCE_ENABLE": 0,
    "FENCE_MARGIN": 2.0,
    "FENCE_RADIUS": 300.0,
    "FENCE_TYPE": 7,
    "FRAME_CLASS": 1,
    "FS_EKF_ACTION": 1,
    "FS_GCS_ENABLE": 0,
    "FS_GCS_TIMEOUT": 5.0,
    "GUID_OPTIONS": 0,
    "GUID_TIMEOUT": 3.0,
    "LAND_ALT_LOW": 1000.0,
    "LAND_SPEED": 50,
    "LAND_SPEED_HIGH": 0,
    "PILOT_SPEED_DN": 0,
    "PILOT_SPEED_UP": 250,
    "RALLY_INCL_HOME": 1,
    "RALLY_LIMIT_KM": 0.3,
    "RTL_ALT": 1500,
    "RTL_ALT_FINAL": 0,
    "RTL_CONE_SLOPE": 3.0,
    "RTL_LOIT_TIME": 5000,
    "RTL_SPEED": 0,
    "SYSID_MYGCS": 255,
    "SYSID_THISMAV": 1,
    "WPNAV_ACCEL": 250.0,
    "WPNAV_RADIUS": 200.0,
    "WPNAV_SPEED": 1000.0,
    "WPNAV_SPEED_DN": 150.0,
    "WPNAV_SPEED_UP": 250.0,
}

HEARTBEAT_HZ = {mavlink.MAVLINK_MSG_ID_HEARTBEAT: 1.0}
"""All that comes without being asked for, besides texts."""

STREAMS: dict[int, tuple[int, ...]] = {
    mavlink.MAV_DATA_STREAM_EXTENDED_STATUS: (
        mavlink.MAVLINK_MSG_ID_SYS_STATUS,
        mavlink.MAVLINK_MSG_ID_MISSION_CURRENT,
        mavlink.MAVLINK_MSG_ID_GPS_RAW_INT,
        mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED,
    ),
    mavlink.MAV_DATA_STREAM_POSITION: (
        mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED,
    ),
    mavlink.MAV_DATA_STREAM_EXTRA1: (mavlink.MAVLINK_MSG_ID_ATTITUDE,),
    mavlink.MAV_DATA_STREAM_EXTRA2: (mavlink.MAVLINK_MSG_ID_VFR_HUD,),
    mavlink.MAV_DATA_STREAM_EXTRA3: (
        mavlink.MAVLINK_MSG_ID_SYSTEM_TIME,
        mavlink.MAVLINK_MSG_ID_BATTERY_STATUS,
        mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS,
    ),
}
"""What REQUEST_DATA_STREAM switches, by group."""

TELEMETRY = (
    *(message for group in STREAMS.values() for message in group),
    mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE,
    mavlink.MAVLINK_MSG_ID_HOME_POSITION,
    mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN,
)
"""What can be asked for at a rate."""
