"""Who ended a climb: the autopilot that finished it, or somebody who took over just before."""

import pytest

from mission.executive.readings import at_altitude
from sim_bridge.state import FlightMode, LandedState, VehicleState


def climbing(mode: FlightMode, up_m: float = 9.5, climb_mps: float = 0.0) -> VehicleState:
    return VehicleState(
        time_s=10.0,
        position_enu_m=(0.0, 0.0, up_m),
        velocity_enu_mps=(0.0, 0.0, climb_mps),
        yaw_enu_rad=0.0,
        armed=True,
        mode=mode,
        mode_name=mode.value,
        landed=LandedState.IN_AIR,
        battery_fraction=0.9,
        waiting_for=(),
        failsafe=False,
        home_enu_m=(0.0, 0.0, 0.0),
    )


@pytest.mark.parametrize("mode", [FlightMode.TAKEOFF, FlightMode.EXTERNAL])
def test_a_climb_is_done_where_the_vehicle_is_level_at_the_height(mode):
    assert at_altitude(climbing(mode), FlightMode.OTHER, 0.0, 10.0)
    assert not at_altitude(climbing(mode, climb_mps=1.0), FlightMode.OTHER, 0.0, 10.0)
    assert not at_altitude(climbing(mode, up_m=6.0), FlightMode.OTHER, 0.0, 10.0)


def test_px4_says_that_a_take_off_is_done_by_holding():
    assert at_altitude(climbing(FlightMode.HOLD, climb_mps=0.8), FlightMode.TAKEOFF, 0.0, 10.0)


def test_a_hold_that_no_take_off_ends_with_is_somebody_elses():
    # Copter climbs in GUIDED and stays in it.
    assert not at_altitude(climbing(FlightMode.HOLD), FlightMode.EXTERNAL, 0.0, 10.0)


@pytest.mark.parametrize("mode", [FlightMode.PILOT, FlightMode.RETURN, FlightMode.LAND])
def test_no_other_mode_ends_a_climb(mode):
    assert not at_altitude(climbing(mode), FlightMode.TAKEOFF, 0.0, 10.0)
