"""What a setpoint's mask leaves out is not looked at, and what it says is flown; on both personalities."""

import math

import pytest

from tests.sim_bridge import test_ardupilot as copter
from tests.sim_bridge import test_px4_offboard as px4
from tests.sim_bridge.ground_station import (
    NAN,
    OFFBOARD,
    POSITION_ONLY,
    POSITION_VELOCITY,
    POSITION_VELOCITY_ACCELERATION,
    VELOCITY_ONLY,
    GroundStation,
    mavlink,
)

NOTHING = (NAN, NAN, NAN)
STILL = (0.0, 0.0, 0.0)
PLACE = (15.0, -10.0, -24.0)
# Position, velocity, acceleration; what each mask ignores is not a number.
MEANT = {
    POSITION_ONLY: (PLACE, NOTHING, NOTHING),
    POSITION_VELOCITY: (PLACE, STILL, NOTHING),
    POSITION_VELOCITY_ACCELERATION: (PLACE, STILL, STILL),
    VELOCITY_ONLY: (NOTHING, (3.0, -2.0, 0.0), NOTHING),
}
masks = pytest.mark.parametrize("mask", list(MEANT))


def heading_deg(gs: GroundStation) -> float:
    return math.degrees(gs.vehicle.body.rotor.yaw_rad)


def test_the_masks_are_the_numbers_of_the_page():
    assert list(MEANT) == [2552, 2496, 2048, 2503]


@masks
def test_px4_flies_what_a_mask_says_and_looks_at_nothing_else(mask):
    gs = px4.in_offboard()
    position, velocity, acceleration = MEANT[mask]
    gs.forget()
    gs.wait(12.0, do=lambda: gs.setpoint(position, velocity, acceleration, 0.5, mask))
    assert gs.custom_mode == OFFBOARD
    check(gs, mask)
    assert gs.all("COMMAND_ACK") == []


@masks
def test_copter_flies_what_a_mask_says_and_looks_at_nothing_else(mask):
    gs = copter.station()
    copter.take_off(gs)
    position, velocity, acceleration = MEANT[mask]
    gs.forget()
    gs.wait(15.0, do=lambda: gs.setpoint(position, velocity, acceleration, 0.5, mask))
    assert copter.mode(gs) == copter.GUIDED
    check(gs, mask)
    assert gs.all("COMMAND_ACK") == []


def check(gs: GroundStation, mask: int) -> None:
    if mask == VELOCITY_ONLY:
        assert gs.velocity == pytest.approx(MEANT[mask][1], abs=0.3)
    else:
        assert math.dist(gs.position, PLACE) < 1.0
    assert heading_deg(gs) == pytest.approx(math.degrees(0.5), abs=5.0)


@pytest.mark.parametrize(("forward", "right"), [(3.0, 0.0), (0.0, 3.0), (2.0, -2.0)])
def test_in_px4s_frame_8_a_velocity_is_the_bodys(forward, right):
    gs = px4.in_offboard()
    yaw = math.radians(30.0)
    gs.wait(6.0, do=lambda: gs.setpoint(px4.HIGH, yaw_rad=yaw, mask=POSITION_VELOCITY))
    assert heading_deg(gs) == pytest.approx(30.0, abs=3.0)
    frame = mavlink.MAV_FRAME_BODY_NED
    gs.wait(6.0, do=lambda: gs.setpoint(NOTHING, (forward, right, 0.0), yaw_rad=yaw, mask=VELOCITY_ONLY, frame=frame))
    assert gs.custom_mode == OFFBOARD
    north = forward * math.cos(yaw) - right * math.sin(yaw)
    east = forward * math.sin(yaw) + right * math.cos(yaw)
    assert gs.velocity == pytest.approx((north, east, 0.0), abs=0.4)
