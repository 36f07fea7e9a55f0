"""Random and mutated frames into both personalities: nothing raises, nothing grows, and the vehicle lives on."""

import math
import random
import resource
import struct

import pytest
from pymavlink.generator.mavcrc import x25crc

from sim_bridge.dialects import Autopilot
from tests.sim_bridge.ground_station import TICK_S, mavlink
from tests.sim_bridge.line_client import Client

HEARD = [
    "COMMAND_LONG",
    "COMMAND_INT",
    "SET_MODE",
    "MISSION_COUNT",
    "MISSION_ITEM",
    "MISSION_ITEM_INT",
    "MISSION_REQUEST",
    "MISSION_REQUEST_INT",
    "MISSION_REQUEST_LIST",
    "MISSION_CLEAR_ALL",
    "MISSION_ACK",
    "MISSION_SET_CURRENT",
    "PARAM_SET",
    "PARAM_REQUEST_READ",
    "PARAM_REQUEST_LIST",
    "SET_POSITION_TARGET_LOCAL_NED",
    "SET_POSITION_TARGET_GLOBAL_INT",
    "PING",
    "TIMESYNC",
    "HEARTBEAT",
    "FILE_TRANSFER_PROTOCOL",
    "REQUEST_DATA_STREAM",
]
ODD_NUMBERS = (0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 3.4e38, 1e-45, 21196.0, 1e10)
COMMANDS = (16, 20, 21, 22, 176, 178, 179, 192, 193, 207, 212, 224, 246, 300, 400, 410, 510, 511, 512, 519, 520)
KINDS = {kind.msgname: kind for kind in mavlink.mavlink_map.values()}


CLIENT, VEHICLE = (245, 190), (1, 1)
"""System and component of either end."""


def framed(kind, payload: bytes, sequence: int, sender=CLIENT) -> bytes:
    """A frame with the right checksum around any payload."""
    head = struct.pack("<BBBBBB", len(payload), 0, 0, sequence & 0xFF, *sender) + kind.id.to_bytes(3, "little")
    checksum = x25crc(head + payload)
    checksum.accumulate(bytes([kind.crc_extra]))
    return b"\xfd" + head + payload + struct.pack("<H", checksum.crc)


def sensible(chance: random.Random, kind) -> bytes:
    """A payload whose fields are of the kind that decisions are made on, or odd."""
    values = []
    for name, form in zip(kind.ordered_fieldnames, _forms(kind), strict=True):
        if form.endswith("s"):
            values.append(chance.choice((b"MPC_XY_VEL_MAX", b"FENCE_ENABLE", b"\xff\xfe", b"")))
        elif form in "fd":
            values.append(chance.choice(ODD_NUMBERS) if chance.random() < 0.5 else chance.uniform(-100.0, 100.0))
        else:
            low, high = (
                (0, 1 << 8 * struct.calcsize(form))
                if form.isupper()
                else (-(1 << 8 * struct.calcsize(form) - 1), 1 << 8 * struct.calcsize(form) - 1)
            )
            number = chance.choice((low, high - 1, 0, 1, 2, 3, 4, 5, 6, 9))
            if name == "command":
                number = chance.choice(COMMANDS)
            if name in ("target_system", "target_component"):
                number = chance.choice((0, 1, 1, 1, 1, 1, 7))
            values.append(max(low, min(high - 1, number)))
    return struct.pack("<" + "".join(_forms(kind)), *values)


def _forms(kind) -> list[str]:
    """struct's letter for each field; arrays of bytes as one string."""
    letters = {"char": "c", "uint8_t": "B", "int8_t": "b", "uint16_t": "H", "int16_t": "h", "uint32_t": "I"}
    letters |= {"int32_t": "i", "uint64_t": "Q", "int64_t": "q", "float": "f", "double": "d"}
    of = dict(zip(kind.fieldnames, kind.fieldtypes, strict=True))
    lengths = dict(zip(kind.ordered_fieldnames, kind.array_lengths, strict=True))
    return [f"{lengths[name]}s" if lengths[name] else letters[of[name]] for name in kind.ordered_fieldnames]


def frame(chance: random.Random, sequence: int, heard=HEARD, sender=CLIENT) -> bytes:
    """Sensible, random or broken."""
    kind = KINDS[chance.choice(heard)] if chance.random() < 0.9 else chance.choice(list(KINDS.values()))
    luck = chance.random()
    known = luck < 0.6 and kind.msgname in heard
    payload = sensible(chance, kind) if known else chance.randbytes(kind.unpacker.size)
    data = bytearray(framed(kind, payload, sequence, sender))
    if luck > 0.9:
        for _ in range(chance.randrange(1, 5)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        data = data[: chance.randrange(1, len(data) + 1)]
    return bytes(data)


def fuzz(autopilot: Autopilot, frames: int, seed: int) -> list[bytes]:
    """Let a vehicle in the air hear so many frames, a few each tick.

    It is restarted now and then, as some of them end the flight.

    Returns:
        What it said in the last second.
    """
    chance, client = random.Random(seed), Client(autopilot, [])
    client.fly()
    client.hold_ned_m = None
    station, now_s = client.station, client.now_s
    for sequence in range(frames):
        station.put(frame(chance, sequence), now_s)
        if sequence % 5 == 0:
            now_s += TICK_S
            station.advance(now_s)
        if sequence % 1000 == 999:
            station.autopilot.reboot(now_s, 0.0, recovers_in_air=True)
            rotor = station.autopilot.body.rotor
            rotor.position_ned_m, rotor.battery = (0.0, 0.0, -50.0), 1.0
            station.autopilot.body.armed = True
    station.autopilot.reboot(now_s, 0.0, recovers_in_air=False)
    return [data for step in range(150) for data in station.advance(now_s + TICK_S * (step + 1))]


@pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())
@pytest.mark.parametrize("seed", range(4))
def test_no_frame_makes_a_vehicle_fall_over(autopilot, seed):
    assert fuzz(autopilot, 2500, seed)


@pytest.mark.slow
@pytest.mark.parametrize("autopilot", Autopilot, ids=lambda one: one.name.lower())
def test_half_a_million_frames_each_neither_raise_nor_grow_memory(autopilot):
    fuzz(autopilot, 50_000, 98)
    before_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert fuzz(autopilot, 500_000, 99)
    grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kib
    assert grown_kib < 20_000
