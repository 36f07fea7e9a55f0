"""The four kinds of areas that a fence is made of, flown into and out of on both personalities."""

import pytest

from tests.sim_bridge import test_ardupilot as copter
from tests.sim_bridge import test_ardupilot_plans as copter_plans
from tests.sim_bridge import test_px4_plans as px4
from tests.sim_bridge.ground_station import HOLD, OFFBOARD, VELOCITY_ONLY, GroundStation, mavlink

FENCES = mavlink.MAV_MISSION_TYPE_FENCE
AROUND = [(-40.0, -40.0), (-40.0, 40.0), (40.0, 40.0), (40.0, -40.0)]
AHEAD = [(40.0, -40.0), (40.0, 40.0), (110.0, 40.0), (110.0, -40.0)]
RTL = copter.RTL


def polygon(command: int, corners) -> list:
    """A ring of places in metres from where the vehicle stands: p1 counts its corners."""
    params = (float(len(corners)), 0.0, 0.0, 0.0)
    return [
        px4.item(seq, command, north_m=north, east_m=east, height_m=0.0, params=params, kind=FENCES)
        for seq, (north, east) in enumerate(corners)
    ]


def circle(command: int, north_m: float, radius_m: float) -> list:
    """A disc ahead or around: p1 is its radius."""
    return [px4.item(0, command, north_m=north_m, height_m=0.0, params=(radius_m, 0.0, 0.0, 0.0), kind=FENCES)]


# Each ends some 40 m to the north of where the vehicle stands.
KINDS = {
    "5001 polygon to stay in": polygon(5001, AROUND),
    "5002 polygon to stay out of": polygon(5002, AHEAD),
    "5003 circle to stay in": circle(5003, 0.0, 40.0),
    "5004 circle to stay out of": circle(5004, 75.0, 35.0),
}
fences = pytest.mark.parametrize("fence", list(KINDS.values()), ids=list(KINDS))


def northward(gs: GroundStation) -> None:
    gs.setpoint(velocity=(4.0, 0.0, 0.0), mask=VELOCITY_ONLY)


@fences
def test_px4_holds_where_an_area_ends(fence):
    gs = px4.station()
    assert px4.upload(gs, fence, FENCES) == mavlink.MAV_MISSION_ACCEPTED
    gs.wait(1.0)
    assert "invalid" not in gs.said.lower()
    gs.take_off()
    gs.wait(1.0, do=lambda: northward(gs))
    assert gs.px4_mode(OFFBOARD) == mavlink.MAV_RESULT_ACCEPTED
    gs.wait(8.0, do=lambda: northward(gs))
    assert gs.custom_mode == OFFBOARD
    gs.wait(15.0, do=lambda: northward(gs))
    assert gs.custom_mode == HOLD
    assert gs.status == mavlink.MAV_STATE_CRITICAL
    assert 38.0 < gs.position[0] - gs.last("HOME_POSITION").x < 55.0


@fences
@pytest.mark.parametrize("watched", [True, False])
def test_copter_returns_where_an_area_ends_if_it_watches_them(fence, watched):
    polygons = 4
    gs = copter.station(parameters=(("FENCE_ENABLE", 1), ("FENCE_TYPE", polygons if watched else 1)))
    assert copter_plans.upload(gs, fence, FENCES) == mavlink.MAV_MISSION_ACCEPTED
    copter.take_off(gs)
    gs.wait(8.0, do=lambda: northward(gs))
    assert copter.mode(gs) == copter.GUIDED
    gs.wait(8.0, do=lambda: northward(gs))
    assert copter.mode(gs) == (RTL if watched else copter.GUIDED)
    assert ("Fence breached" in gs.said) is watched
    gs.wait(4.0)
    assert (gs.position[0] < 60.0) is watched
