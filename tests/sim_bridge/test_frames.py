"""Frames against pyproj and against their own inverses."""

import math

import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.dialects import Autopilot
from sim_bridge.frames import (
    VehicleFrame,
    enu_from_geodetic,
    enu_from_ned,
    geodetic_from_enu,
    geodetic_from_local_ned,
    geodetics_from_enu,
    local_ned_from_geodetic,
    ned_from_enu,
    yaw_ned_from_enu,
)
from sim_bridge.state import GeodeticPoint, Setpoint

ORIGIN = GeodeticPoint(47.3977, 8.5456, 488.0)
VEHICLE = GeodeticPoint(47.3990, 8.5440, 486.5)

offsets = st.floats(-8000.0, 8000.0)


@given(offsets, offsets, st.floats(-100.0, 500.0))
def test_geodetic_positions_agree_with_pyproj(east: float, north: float, up: float) -> None:
    to_ecef = pyproj.Transformer.from_crs("EPSG:4979", "EPSG:4978", always_xy=True)
    place = geodetic_from_enu((east, north, up), ORIGIN)
    here = to_ecef.transform(place.longitude_deg, place.latitude_deg, place.altitude_amsl_m)
    there = to_ecef.transform(ORIGIN.longitude_deg, ORIGIN.latitude_deg, ORIGIN.altitude_amsl_m)
    assert math.dist(here, there) == pytest.approx(math.hypot(east, north, up), abs=1e-4)
    assert enu_from_geodetic(place, ORIGIN) == pytest.approx((east, north, up), abs=1e-4)


@given(offsets, offsets, st.floats(-100.0, 500.0), st.sampled_from(Autopilot))
def test_a_vehicles_map_is_undone_by_its_inverse(north: float, east: float, down: float, autopilot: Autopilot) -> None:
    place = geodetic_from_local_ned(autopilot, (north, east, down), VEHICLE)
    assert local_ned_from_geodetic(autopilot, place, VEHICLE) == pytest.approx((north, east, down), abs=1e-3)


def test_px4s_map_is_the_azimuthal_equidistant_one_on_its_sphere() -> None:
    sphere = pyproj.Proj(proj="aeqd", lat_0=VEHICLE.latitude_deg, lon_0=VEHICLE.longitude_deg, R=6_371_000.0)
    place = GeodeticPoint(47.41, 8.57, 500.0)
    east, north = sphere(place.longitude_deg, place.latitude_deg)
    assert local_ned_from_geodetic(Autopilot.PX4, place, VEHICLE) == pytest.approx((north, east, -13.5), abs=1e-4)


# How far PX4's map is off, at 141 m, 1.4 km and 7 km to the north-east.
@pytest.mark.parametrize(("offset", "off_m"), [(100.0, 0.3), (1000.0, 3.0), (5000.0, 15.0)])
def test_the_maps_differ_from_the_tangent_plane_as_much_as_real_vehicles_do(offset: float, off_m: float) -> None:
    place = geodetic_from_enu((offset, offset, 0.0), ORIGIN)
    north, east, _ = local_ned_from_geodetic(Autopilot.PX4, place, ORIGIN)
    assert math.hypot(north - offset, east - offset) == pytest.approx(off_m, rel=0.25)


@pytest.mark.parametrize("autopilot", Autopilot)
def test_a_setpoint_reaches_the_place_that_was_meant(autopilot: Autopilot) -> None:
    frame = VehicleFrame(ORIGIN)
    setpoint = Setpoint((900.0, -700.0, 60.0), (1.0, 2.0, 3.0), (0.1, 0.2, 0.3), math.radians(30.0))
    position, velocity, acceleration, yaw_deg = frame.setpoint_ned(setpoint, autopilot, VEHICLE)
    assert frame.position_enu(autopilot, VEHICLE, position) == pytest.approx(setpoint.position_enu_m, abs=1e-3)
    assert velocity == (2.0, 1.0, -3.0)
    assert acceleration == (0.2, 0.1, -0.3)
    assert yaw_deg == pytest.approx(60.0)


def test_swapping_axes_twice_changes_nothing() -> None:
    assert enu_from_ned(ned_from_enu((1.0, 2.0, 3.0))) == (1.0, 2.0, 3.0)
    assert yaw_ned_from_enu(yaw_ned_from_enu(2.5)) == pytest.approx(2.5)


@pytest.mark.parametrize(("yaw_enu", "yaw_ned"), [(0.0, 90.0), (90.0, 0.0), (180.0, -90.0), (-90.0, 180.0)])
def test_east_is_ninety_degrees_on_a_compass(yaw_enu: float, yaw_ned: float) -> None:
    assert math.degrees(yaw_ned_from_enu(math.radians(yaw_enu))) == pytest.approx(yaw_ned)


def test_many_positions_at_once_are_where_each_is_alone() -> None:
    rows = [(0.0, 0.0, 0.0), (1500.0, -800.0, 60.0), (-3.0, 4.0, -5.0)]
    assert geodetics_from_enu([], ORIGIN) == []
    for together, row in zip(geodetics_from_enu(rows, ORIGIN), rows, strict=True):
        alone = geodetic_from_enu(row, ORIGIN)
        assert together.latitude_deg == pytest.approx(alone.latitude_deg, abs=1e-12)
        assert together.longitude_deg == pytest.approx(alone.longitude_deg, abs=1e-12)
        assert together.altitude_amsl_m == pytest.approx(alone.altitude_amsl_m, abs=1e-6)
