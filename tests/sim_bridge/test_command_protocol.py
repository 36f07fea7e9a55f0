"""Commands over a line, on both personalities: how soon they are answered, and what a repetition is."""

import pytest

from sim_bridge.dialects import Autopilot
from tests.sim_bridge.ground_station import mavlink
from tests.sim_bridge.line_client import Client

both = pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM


def ready(autopilot: Autopilot) -> Client:
    client = Client(autopilot, [])
    client.wait(8.0)
    return client


def arm(client: Client, confirmation: int) -> None:
    client.send(mavlink.MAVLink_command_long_message(1, 1, ARM, confirmation, 1.0, 0, 0, 0, 0, 0, 0))


@both
def test_an_acknowledgement_comes_within_fifteen_milliseconds(autopilot):
    client = ready(autopilot)
    for _ in range(20):
        asked_s = client.now_s
        arm(client, 0)
        client.wait(0.1)
        (answered_s,) = [at for at, message in client.heard if at > asked_s and message.get_type() == "COMMAND_ACK"]
        assert answered_s - asked_s <= 0.015


@both
def test_a_repetition_with_a_raised_confirmation_is_answered_again_and_done_once(autopilot):
    client = ready(autopilot)
    client.wait(0.5)
    begun_s = client.now_s
    for attempt in range(3):
        arm(client, attempt)
        client.wait(0.5)
    acks = client.all("COMMAND_ACK", begun_s)
    assert [(ack.command, ack.result) for ack in acks] == [(ARM, mavlink.MAV_RESULT_ACCEPTED)] * 3
    told = [text.text for text in client.all("STATUSTEXT", begun_s)]
    assert len([text for text in told if text.startswith(("Armed", "Arming"))]) == 1
