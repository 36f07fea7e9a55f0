"""CSV: the selected curve at the streaming rate, local and geodetic."""

from __future__ import annotations

import csv
import io

import numpy as np
import pymap3d

from mission.plan_file import PlanFile

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
    # Tens of thousands of rows: all at once what `sim_bridge.frames.geodetic_from_enu` does for one.
    east, north, up = np.array(flown.position_enu_m).T.copy()
    places = pymap3d.enu2geodetic(east, north, up, origin.latitude_deg, origin.longitude_deg, origin.altitude_amsl_m)
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(COLUMNS)
    for time, position, latitude, longitude, altitude, velocity, acceleration, yaw in zip(
        flown.time_s,
        flown.position_enu_m,
        *places,
        flown.velocity_enu_mps,
        flown.acceleration_enu_mps2,
        flown.yaw_enu_rad,
        strict=True,
    ):
        rows.writerow(
            [
                f"{time:.4f}",
                *(f"{axis:.4f}" for axis in position),
                f"{latitude:.9f}",
                f"{longitude:.9f}",
                f"{altitude:.4f}",
                *(f"{axis:.4f}" for axis in (*velocity, *acceleration)),
                f"{yaw:.5f}",
            ]
        )
    return text.getvalue()
