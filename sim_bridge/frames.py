"""Frames: the only file where an axis swaps or a sign flips.

| frame      | axes               | anchored at                                                            |
|------------|--------------------|------------------------------------------------------------------------|
| ENU        | east, north, up    | the mission's origin, tangent to WGS84                                 |
| geodetic   | lat, lon, AMSL     | WGS84; heights are taken above sea level throughout                    |
| LOCAL_NED  | north, east, down  | the vehicle's GPS_GLOBAL_ORIGIN (not its home), the autopilot's own map |

Autopilots do not use a tangent plane. PX4 projects on a sphere (azimuthal equidistant), ArduPilot scales degrees:
against WGS84 that is 0.3 m at 141 m and 3 m at 1.4 km. So a position goes from ENU through latitude and longitude into
the vehicle's own map, and lands where it was meant.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pymap3d

from sim_bridge.dialects import Autopilot
from sim_bridge.state import GeodeticPoint, Setpoint, Vector

PX4_EARTH_RADIUS_M = 6_371_000.0
ARDUPILOT_M_PER_DEGREE = 0.011131884502145034 * 1e7


def enu_from_geodetic(point: GeodeticPoint, origin: GeodeticPoint) -> Vector:
    """A WGS84 position in the tangent plane of an origin, metres."""
    east, north, up = pymap3d.geodetic2enu(
        point.latitude_deg,
        point.longitude_deg,
        point.altitude_amsl_m,
        origin.latitude_deg,
        origin.longitude_deg,
        origin.altitude_amsl_m,
    )
    return float(east), float(north), float(up)


def geodetic_from_enu(position_enu_m: Vector, origin: GeodeticPoint) -> GeodeticPoint:
    """A position in the tangent plane of an origin as WGS84."""
    latitude, longitude, altitude = pymap3d.enu2geodetic(
        *position_enu_m, origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m
    )
    return GeodeticPoint(float(latitude), float(longitude), float(altitude))


def geodetics_from_enu(positions_enu_m: Sequence[Vector], origin: GeodeticPoint) -> list[GeodeticPoint]:
    """The same for many positions at once, in a thousandth of the time."""
    if not len(positions_enu_m):
        return []
    east, north, up = np.array(positions_enu_m, dtype=float).T.copy()
    places = pymap3d.enu2geodetic(east, north, up, origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m)
    return [GeodeticPoint(*place) for place in np.stack(places, axis=1).tolist()]


def ned_from_enu(vector_enu: Vector) -> Vector:
    """East, north, up as north, east, down; its own inverse."""
    east, north, up = vector_enu
    return north, east, -up


def enu_from_ned(vector_ned: Vector) -> Vector:
    """North, east, down as east, north, up; its own inverse."""
    north, east, down = vector_ned
    return east, north, -down


def yaw_ned_from_enu(yaw_enu_rad: float) -> float:
    """Heading counter-clockwise from east as clockwise from north, in (−π, π]; its own inverse."""
    return wrapped(0.5 * math.pi - yaw_enu_rad)


def wrapped(angle_rad: float) -> float:
    """The same angle in (−π, π]."""
    return math.pi - (math.pi - angle_rad) % (2.0 * math.pi)


def local_ned_from_geodetic(autopilot: Autopilot, point: GeodeticPoint, vehicle_origin: GeodeticPoint) -> Vector:
    """A WGS84 position in a vehicle's LOCAL_NED, by the map of its autopilot."""
    down = vehicle_origin.altitude_amsl_m - point.altitude_amsl_m
    match autopilot:
        case Autopilot.PX4:
            latitude, longitude = math.radians(point.latitude_deg), math.radians(point.longitude_deg)
            latitude_0 = math.radians(vehicle_origin.latitude_deg)
            turn = longitude - math.radians(vehicle_origin.longitude_deg)
            cosine = math.sin(latitude_0) * math.sin(latitude) + math.cos(latitude_0) * math.cos(latitude) * math.cos(
                turn
            )
            arc = math.acos(max(-1.0, min(1.0, cosine)))
            stretch = arc / math.sin(arc) if arc > 1e-12 else 1.0
            north = math.cos(latitude_0) * math.sin(latitude) - math.sin(latitude_0) * math.cos(latitude) * math.cos(
                turn
            )
            east = math.cos(latitude) * math.sin(turn)
            return stretch * north * PX4_EARTH_RADIUS_M, stretch * east * PX4_EARTH_RADIUS_M, down
        case Autopilot.ARDUPILOT:
            north = (point.latitude_deg - vehicle_origin.latitude_deg) * ARDUPILOT_M_PER_DEGREE
            middle = math.radians(0.5 * (point.latitude_deg + vehicle_origin.latitude_deg))
            turn_deg = (point.longitude_deg - vehicle_origin.longitude_deg + 180.0) % 360.0 - 180.0
            return north, turn_deg * ARDUPILOT_M_PER_DEGREE * math.cos(middle), down


def geodetic_from_local_ned(
    autopilot: Autopilot, position_ned_m: Vector, vehicle_origin: GeodeticPoint
) -> GeodeticPoint:
    """A position in a vehicle's LOCAL_NED as WGS84: the inverse of `local_ned_from_geodetic`."""
    north, east, down = position_ned_m
    altitude = vehicle_origin.altitude_amsl_m - down
    match autopilot:
        case Autopilot.PX4:
            x, y = north / PX4_EARTH_RADIUS_M, east / PX4_EARTH_RADIUS_M
            arc = math.hypot(x, y)
            if arc < 1e-12:
                return GeodeticPoint(vehicle_origin.latitude_deg, vehicle_origin.longitude_deg, altitude)
            latitude_0 = math.radians(vehicle_origin.latitude_deg)
            latitude = math.asin(math.cos(arc) * math.sin(latitude_0) + x * math.sin(arc) * math.cos(latitude_0) / arc)
            turn = math.atan2(
                y * math.sin(arc), arc * math.cos(latitude_0) * math.cos(arc) - x * math.sin(latitude_0) * math.sin(arc)
            )
            return GeodeticPoint(math.degrees(latitude), vehicle_origin.longitude_deg + math.degrees(turn), altitude)
        case Autopilot.ARDUPILOT:
            latitude = vehicle_origin.latitude_deg + north / ARDUPILOT_M_PER_DEGREE
            middle = math.radians(0.5 * (latitude + vehicle_origin.latitude_deg))
            return GeodeticPoint(
                latitude, vehicle_origin.longitude_deg + east / (ARDUPILOT_M_PER_DEGREE * math.cos(middle)), altitude
            )


class VehicleFrame:
    """Between the mission's ENU and one vehicle's LOCAL_NED.

    Args:
        origin: The mission's origin.
    """

    def __init__(self, origin: GeodeticPoint) -> None:
        self._origin = origin

    def position_enu(self, autopilot: Autopilot, vehicle_origin: GeodeticPoint, position_ned_m: Vector) -> Vector:
        """Where a vehicle's LOCAL_NED position lies in the mission."""
        return enu_from_geodetic(geodetic_from_local_ned(autopilot, position_ned_m, vehicle_origin), self._origin)

    def geodetic_enu(self, point: GeodeticPoint) -> Vector:
        """Where a WGS84 position lies in the mission."""
        return enu_from_geodetic(point, self._origin)

    def setpoint_ned(
        self, setpoint: Setpoint, autopilot: Autopilot, vehicle_origin: GeodeticPoint
    ) -> tuple[Vector, Vector, Vector, float]:
        """A setpoint as the vehicle wants it.

        Returns:
            Position (m), velocity (m/s) and acceleration (m/s²) in its LOCAL_NED, and the heading clockwise from north
            in degrees.
        """
        place = geodetic_from_enu(setpoint.position_enu_m, self._origin)
        return (
            local_ned_from_geodetic(autopilot, place, vehicle_origin),
            ned_from_enu(setpoint.velocity_enu_mps),
            ned_from_enu(setpoint.acceleration_enu_mps2),
            math.degrees(yaw_ned_from_enu(setpoint.yaw_enu_rad)),
        )
