"""CSV: the selected curve at the streaming rate, local and geodetic."""

from __future__ import annotations

import csv
import io

from mission.plan_file import PlanFile
from sim_bridge.frames import geodetics_from_enu

COLUMNS = (
    "time_s",
    "east_m",
    "north_m",
    "up_m",
    "latitude_deg",
    "longitude_deg",
    "altitude_amsl_m",
    "velocity_east_mps",
    "velocity_north_mps",
    "velocity_up_mps",
    "acceleration_east_mps2",
    "acceleration_north_mps2",
    "acceleration_up_mps2",
    "yaw_enu_rad",
)


def sample_table(plan: PlanFile) -> str:
    """A row a sample, with a heading that names units and axes."""
    origin, flown = plan.origin, plan.trajectory
    places = geodetics_from_enu(flown.position_enu_m, origin.point())
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for time, position, place, velocity, acceleration, yaw in zip(
        flown.time_s,
        flown.position_enu_m,
        places,
        flown.velocity_enu_mps,
        flown.acceleration_enu_mps2,
        flown.yaw_enu_rad,
        strict=True,
    ):
        rows.writerow(
            [
                f"{time:.4f}",
                *(f"{axis:.4f}" for axis in position),
                f"{place.latitude_deg:.9f}",
                f"{place.longitude_deg:.9f}",
                f"{place.altitude_amsl_m:.4f}",
                *(f"{axis:.4f}" for axis in (*velocity, *acceleration)),
                f"{yaw:.5f}",
            ]
        )
    return text.getvalue()
