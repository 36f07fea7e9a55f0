"""Whole plans of mutated items, uploaded to the end, read back and flown by both personalities: nothing raises."""

import math
import random
import struct

import pytest

from sim_bridge.ardupilot.defaults import PARAMETERS as ARDUPILOT_PARAMETERS
from sim_bridge.dialects import Autopilot
from sim_bridge.px4.defaults import PARAMETERS as PX4_PARAMETERS
from sim_bridge.simulator import make_autopilot
from sim_bridge.state import GeodeticPoint
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import HOLD, GroundStation, mavlink
from tests.sim_bridge.test_fuzz import COMMANDS

GROUND = GeodeticPoint(47.3977, 8.5456, 488.0)
ODD = (math.nan, math.inf, -math.inf, 3.4e38, -3.4e38, 1e5, 1e-45, -1.0, 0.0)
ODD_WHOLE = (-(2**31), 2**31 - 1, -1, 0, 1, 2, 3, 4, 5, 6, 7, 90)
COMMANDS_OF = (
    (16, 17, 18, 19, 20, 21, 22, 31, 82, 93, 112, 115, 177, 178, 179, 189, 195, 201, 206),
    (5000, 5001, 5002, 5003, 5004),
    (5100,),
)
FRAMES = (0, 2, 3, 5, 6)
LATITUDES_E7 = (473977000, 473979000, 473974000, 2**31 - 1, -(2**31), 0, 900000000)
LONGITUDES_E7 = (85456000, 85458000, 85453000, 2**31 - 1, -(2**31), 0)
TELEMETRY = (1, 24, 32, 33, 42, 74, 85, 147, 242, 245)
KINDS = (0, 0, 0, 1, 1, 2)
ROUNDS = 4


def _sound(chance: random.Random, kind: int) -> list:
    """A plan as a ground station makes it: (command, p1, p2) of each item."""
    mission = [(22, 0.0, 0.0), (178, 1.0, 4.0), (177, 3.0, 2.0), (16, 0.0, 0.0), (19, 2.0, 0.0), (20, 0.0, 0.0)]
    polygon, circle = [(chance.choice((5001, 5002)), 3.0, 0.0)] * 3, [(chance.choice((5003, 5004)), 60.0, 0.0)]
    listed = (mission, chance.choice((polygon, circle, polygon + circle)), [(5100, 0.0, 0.0)] * 2)[kind]
    items = []
    for seq, (command, p1, p2) in enumerate(listed):
        frame = mavlink.MAV_FRAME_MISSION if command in (20, 177, 178) else mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT
        place = (LATITUDES_E7[seq % 3], LONGITUDES_E7[seq % 2])
        head = (1, 1, seq, frame, command, 0, 1, p1, p2, 0.0, 0.0)
        items.append(mavlink.MAVLink_mission_item_int_message(*head, *place, 20.0, kind))
    return items


def _mutated(chance: random.Random, kind: int) -> list:
    """A plan of which a few fields are odd, and perhaps one item is in the form with degrees."""
    items = _sound(chance, kind)
    for _ in range(chance.randrange(5)):
        one = chance.choice(items)
        match chance.randrange(7):
            case 0:
                one.command = chance.choice(COMMANDS_OF[kind])
            case 1:
                one.frame = chance.choice(FRAMES)
            case 2:
                one.x, one.y = chance.choice(LATITUDES_E7), chance.choice(LONGITUDES_E7)
            case _:
                setattr(one, chance.choice(("param1", "param1", "param1", "param2", "param4", "z")), chance.choice(ODD))
    if chance.random() < 0.2:
        old = chance.choice(items)
        params = (old.param1, old.param2, old.param3, old.param4)
        head = (1, 1, old.seq, old.frame, old.command, 0, 1, *params)
        place = chance.choice(((47.3978, 8.5457), (chance.choice(ODD), chance.choice(ODD))))
        items[old.seq] = mavlink.MAVLink_mission_item_message(*head, *place, old.z, kind)
    return items


def _upload(gs: GroundStation, items, kind: int) -> int:
    """To the end, whatever that is."""
    replies = gs.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
    while True:
        for reply in replies:
            if reply.get_type() == "MISSION_ACK":
                return reply.type
        replies = gs.send(items[replies[0].seq])


def _change_parameters(chance: random.Random, gs: GroundStation, autopilot: Autopilot) -> None:
    parameters = PX4_PARAMETERS if autopilot is Autopilot.PX4 else ARDUPILOT_PARAMETERS
    for name in chance.choices(list(parameters), k=chance.randrange(1, 6)):
        value, kind = chance.choice(ODD), mavlink.MAV_PARAM_TYPE_REAL32
        if autopilot is Autopilot.PX4 and isinstance(parameters[name], int):
            (value,) = struct.unpack("<f", struct.pack("<i", chance.choice(ODD_WHOLE)))
            kind = mavlink.MAV_PARAM_TYPE_INT32
        gs.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, kind))


def _order(chance: random.Random, gs: GroundStation) -> None:
    command, place = chance.choice((*COMMANDS, 241, 400)), (chance.choice(LATITUDES_E7), chance.choice(LONGITUDES_E7))
    params = [chance.choice((*ODD, 300.0)) for _ in range(7)]
    if chance.random() < 0.5:
        gs.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *params))
    else:
        frame = chance.choice((*FRAMES, 200))
        gs.send(mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, *params[:4], *place, params[6]))


def _airborne(autopilot: Autopilot) -> GroundStation:
    gs = GroundStation(make_autopilot(autopilot, VehicleConfig(GROUND, ready_after_s=1.0)))
    gs.wait(4.0)
    if autopilot is Autopilot.PX4:
        gs.take_off(15.0)
        return gs
    for message_id in TELEMETRY:
        gs.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, message_id, 1e5)
    gs.command(mavlink.MAV_CMD_DO_SET_MODE, 1.0, 4.0)
    gs.arm()
    gs.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, 0, 0, 0, 15.0)
    gs.wait(12.0)
    return gs


def fuzz_plans(autopilot: Autopilot, seed: int) -> int:
    """Let a vehicle in the air take and fly some plans.

    Returns:
        How many of them it accepted.
    """
    chance, gs, accepted = random.Random(seed), _airborne(autopilot), 0
    for _ in range(ROUNDS):
        if chance.random() < 0.5:
            _change_parameters(chance, gs, autopilot)
        kind = chance.choice(KINDS)
        items = _mutated(chance, kind)
        accepted += _upload(gs, items, kind) == mavlink.MAV_MISSION_ACCEPTED
        gs.send(mavlink.MAVLink_mission_request_list_message(1, 1, kind))
        for seq in range(len(items)):
            gs.send(mavlink.MAVLink_mission_request_int_message(1, 1, seq, kind))
        gs.send(mavlink.MAVLink_mission_ack_message(1, 1, mavlink.MAV_MISSION_ACCEPTED, kind))
        if autopilot is Autopilot.PX4:
            gs.px4_mode(chance.choice((HOLD, *((4, sub) for sub in (2, 4, 4, 4, 5, 6)))))
        else:
            gs.command(mavlink.MAV_CMD_DO_SET_MODE, 1.0, chance.choice((3.0, 3.0, 3.0, 4.0, 6.0, 9.0, 17.0)))
        _order(chance, gs)
        gs.send(mavlink.MAVLink_mission_set_current_message(1, 1, chance.choice((0, 1, 2, 65535))))
        gs.wait(10.0)
    gs.forget()
    gs.wait(5.0)
    assert gs.all("HEARTBEAT")
    return accepted


@pytest.mark.parametrize(
    ("autopilot", "seeds"), [(Autopilot.PX4, range(10)), (Autopilot.ARDUPILOT, range(10, 20))], ids=["px4", "ardupilot"]
)
def test_no_accepted_plan_makes_a_vehicle_fall_over(autopilot, seeds):
    assert sum(fuzz_plans(autopilot, seed) for seed in seeds) >= len(seeds)
