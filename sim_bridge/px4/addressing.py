"""Which messages PX4 takes for its own: each family of them asks its own question."""

from __future__ import annotations

from sim_bridge.codec import Message, mavlink

_COMMANDS = (mavlink.MAVLink_command_long_message, mavlink.MAVLink_command_int_message)
_FOR_ANYONE = (mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION)
_TO_SYSTEM_0_TOO = (
    mavlink.MAVLink_set_position_target_local_ned_message,
    mavlink.MAVLink_set_position_target_global_int_message,
    mavlink.MAVLink_file_transfer_protocol_message,
)
_MISSIONS = (
    mavlink.MAVLink_mission_ack_message,
    mavlink.MAVLink_mission_clear_all_message,
    mavlink.MAVLink_mission_count_message,
    mavlink.MAVLink_mission_item_int_message,
    mavlink.MAVLink_mission_item_message,
    mavlink.MAVLink_mission_request_int_message,
    mavlink.MAVLink_mission_request_list_message,
    mavlink.MAVLink_mission_request_message,
    mavlink.MAVLink_mission_set_current_message,
)
_OURS = (mavlink.MAV_COMP_ID_ALL, mavlink.MAV_COMP_ID_AUTOPILOT1)


def addressed_to_us(message: Message, own: int) -> bool:
    """Whether a message is for this vehicle.

    Args:
        message: Any.
        own: The vehicle's system id.
    """
    system, component = getattr(message, "target_system", own), getattr(message, "target_component", 0)
    match message:
        case mavlink.MAVLink_timesync_message():
            return True
        case mavlink.MAVLink_ping_message():
            # With a target it is an answer.
            return system == component == 0
        case _ if isinstance(message, _COMMANDS) and message.command in _FOR_ANYONE:
            return system in (0, own)
        case _ if isinstance(message, _TO_SYSTEM_0_TOO):
            return system in (0, own) and component in _OURS
        case _ if isinstance(message, _MISSIONS):
            return system == own and component in (*_OURS, mavlink.MAV_COMP_ID_MISSIONPLANNER)
        case _:
            return system == own and component in _OURS
