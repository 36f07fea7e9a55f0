"""Faults of one kind that overlap: the one that began last counts, and none ends another."""

import math

import pytest

from sim_bridge.faults import AnyFault, parse_fault
from sim_bridge.px4.vehicle import Px4
from sim_bridge.station import Station
from sim_bridge.vehicle.body import VehicleConfig
from tests.sim_bridge.ground_station import TICK_S, mavlink
from tests.sim_bridge.line_client import GROUND
from tests.sim_bridge.test_station import heard


def station(*words: str, also: tuple[AnyFault, ...] = ()) -> Station:
    return Station(Px4(VehicleConfig(GROUND, wander_m=0.0)), faults=[*map(parse_fault, words), *also])


def line(one: Station) -> tuple[float, bool]:
    return one._inward.quality.loss, one._outward.cut


def gps(one: Station) -> bool:
    return one.autopilot.body.estimator.has_gps


def glitch(one: Station) -> tuple[float, float, float]:
    return one.autopilot.body.estimator.gps_glitch_ned_m


def wind(one: Station) -> tuple[float, float, float]:
    return one.autopilot.body.rotor.wind.mean_ned_mps


def derating(one: Station) -> float:
    return one.autopilot.body.rotor.derating


def refusal(one: Station) -> str:
    return one.autopilot.refusal


NONE = (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("long", "short", "state", "usual", "in_long", "in_short"),
    [
        ("bad-line@1+10 loss=0.5", "bad-line@2+2 loss=0.1", line, (0.0, False), (0.5, False), (0.1, False)),
        ("link-cut@1+10", "link-cut@2+2", line, (0.0, False), (0.0, True), (0.0, True)),
        ("gps-loss@1+10", "gps-loss@2+2", gps, True, False, False),
        ("gps-glitch@1+10 offset_ned_m=[5,0,0]", "gps-glitch@2+2 offset_ned_m=[0,7,0]", glitch,
         NONE, (5, 0, 0), (0, 7, 0)),
        ("wind@1+10 mean_ned_mps=[5,0,0]", "wind@2+2 mean_ned_mps=[0,7,0]", wind, NONE, (5, 0, 0), (0, 7, 0)),
        ("motor-derating@1+10 thrust=0.9", "motor-derating@2+2 thrust=0.6", derating, 1.0, 0.9, 0.6),
        ("arming-refused@1+10 reason='a'", "arming-refused@2+2 reason='b'", refusal, "", "a", "b"),
    ],
)  # fmt: skip
def test_a_fault_that_ends_within_another_does_not_end_it(long, short, state, usual, in_long, in_short):
    for words in ((long, short), (short, long)):
        one = station(*words)
        for at_s, wanted in ((0.5, usual), (1.5, in_long), (3.0, in_short), (5.0, in_long), (10.9, in_long)):
            one.advance(at_s)
            assert state(one) == wanted, at_s
        one.advance(11.1)
        assert state(one) == usual


def test_a_fault_that_outlasts_the_one_it_began_in_goes_on():
    one = station("motor-derating@1+3 thrust=0.9", "motor-derating@2+6 thrust=0.6")
    for at_s, thrust in ((1.5, 0.9), (3.0, 0.6), (5.0, 0.6), (8.5, 1.0)):
        one.advance(at_s)
        assert derating(one) == thrust


def test_heartbeats_stay_frozen_until_the_last_freeze_is_over():
    one, beats = station("heartbeat-frozen@1+10", "heartbeat-frozen@2+2"), []
    for step in range(1, 1500):
        if "HEARTBEAT" in heard(one.advance(TICK_S * step)):
            beats.append(TICK_S * step)
    assert not [at_s for at_s in beats if 1.0 < at_s < 11.0]
    assert [at_s for at_s in beats if at_s > 11.0]


def test_a_fault_of_another_kind_does_not_undo_a_jump_of_the_estimate():
    one = station("estimator-jump@1 offset_ned_m=[6,0,0]", "gps-glitch@2+1 offset_ned_m=[0,3,0]", "wind@4+1")
    for step in range(1, 2000):
        one.advance(TICK_S * step)
    offset = one.autopilot.body.estimator.offset_ned_m
    assert math.dist(offset, (6.0, 0.0, 0.0)) < 0.2


def test_second_stations_that_overlap_all_talk():
    one, asked = station("second-station@1+10", "second-station@2+2"), []
    for step in range(1, 1500):
        for message in one.advance(TICK_S * step):
            decoded = mavlink.MAVLink(None).parse_buffer(message) or ()
            asked += [TICK_S * step for m in decoded if m.get_type() == "COMMAND_ACK" and m.target_system == 255]
    # Every two seconds, from each.
    assert len([at_s for at_s in asked if 4.0 < at_s < 11.0]) in (3, 4)
    assert len(asked) in (6, 7)
    assert max(asked) < 11.0
