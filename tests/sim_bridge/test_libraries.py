"""What the two libraries are that MAVLink is spoken with, and how they are used."""

import importlib.metadata
import subprocess
import sys

import mavsdk
import mavsdk.asyncio
import pytest

from sim_bridge.codec import Codec, mavlink, messages


def test_the_libraries_are_the_ones_that_were_observed():
    assert importlib.metadata.version("mavsdk").startswith("4.1")
    assert importlib.metadata.version("pymavlink") == "2.4.50"


def test_mavsdk_is_a_binding_without_a_server():
    needed = importlib.metadata.requires("mavsdk") or []
    assert not [name for name in needed if name.startswith(("grpc", "protobuf"))]
    assert not hasattr(mavsdk.System, "connect")
    assert hasattr(mavsdk, "Mavsdk")
    assert hasattr(mavsdk.asyncio, "Mavsdk")


@pytest.mark.parametrize("module", ["sim_bridge.codec", "sim_bridge.link.client", "sim_bridge.simulator"])
def test_no_global_state_of_mavutil_is_used_and_version_2_is_spoken(module):
    says = (
        f"import sys, {module}; from sim_bridge.codec import Codec, mavlink; "
        "frame = Codec(1).encode(mavlink.MAVLink_ping_message(0, 0, 0, 0)); "
        "print(frame[0], 'pymavlink.mavutil' in sys.modules)"
    )
    ended = subprocess.run([sys.executable, "-c", says], capture_output=True, text=True, check=True, env={})
    assert ended.stdout.split() == [str(0xFD), "False"]


def test_garbage_decodes_to_bad_data_and_a_setpoint_to_itself():
    for garbage in (b"junk", b"\xfd" * 40, b"\xfd\x02\x00\x00\x01\x01\x01\x00\x00\x00ab\x00\x00"):
        assert {message.get_type() for message in messages(garbage)} == {"BAD_DATA"}
        assert Codec(1).decode(garbage) == []
        robust = mavlink.MAVLink(None)
        robust.robust_parsing = True
        assert {message.get_type() for message in robust.parse_buffer(garbage + bytes(300)) or ()} == {"BAD_DATA"}
    numbers = [float(number) for number in range(11)]
    sent = mavlink.MAVLink_set_position_target_local_ned_message(5, 1, 1, 1, 2048, *numbers)
    (received,) = messages(Codec(245, 190).encode(sent))
    assert received.to_dict() == sent.to_dict()
