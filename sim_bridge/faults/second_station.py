"""Another ground station that talks to the same vehicle, as a state machine."""

from __future__ import annotations

import math

from sim_bridge.codec import Codec, mavlink

SYSTEM = 255
_HEARTBEAT_S = 1.0
_QUESTION_S = 2.0


class OtherStation:
    """What a ground control program does that was left running beside ours.

    Heartbeats, now and then a question whose answers are not for us, and perhaps an upload that it never goes on with,
    and beside which it asks for no plan. A list that it asked for it does not read on: it ends that transfer at once.

    Args:
        vehicle_system: Whom it talks to.
        uploads: Whether it begins to upload a mission.
    """

    def __init__(self, vehicle_system: int, *, uploads: bool) -> None:
        self._target = (vehicle_system, mavlink.MAV_COMP_ID_AUTOPILOT1)
        self._uploads = uploads
        self._codec = Codec(SYSTEM, mavlink.MAV_COMP_ID_MISSIONPLANNER)
        self._heartbeat_s = self._question_s = -math.inf
        self._began = False

    def tick(self, now_s: float) -> list[bytes]:
        """The datagrams that it sends now, unsigned."""
        said = []
        if now_s - self._heartbeat_s >= _HEARTBEAT_S:
            self._heartbeat_s = now_s
            said.append(
                mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
            )
        if now_s - self._question_s >= _QUESTION_S:
            self._question_s = now_s
            if not self._uploads:
                said.append(mavlink.MAVLink_mission_request_list_message(*self._target))
                said.append(mavlink.MAVLink_mission_ack_message(*self._target, mavlink.MAV_MISSION_ACCEPTED))
            wanted = mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION
            said.append(
                mavlink.MAVLink_command_long_message(
                    *self._target, mavlink.MAV_CMD_REQUEST_MESSAGE, 0, wanted, 0, 0, 0, 0, 0, 0
                )
            )
        if self._uploads and not self._began:
            self._began = True
            said.append(mavlink.MAVLink_mission_count_message(*self._target, 5))
        return [self._codec.encode(message) for message in said]
