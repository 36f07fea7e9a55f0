"""`QGC WPL 110`: the tab-separated waypoint list of Mission Planner, MAVProxy and others; item 0 is home."""

from __future__ import annotations

from mission.mission_items import Command, home_of, mission_items
from mission.plan_file import PlanFile

ABOVE_SEA_LEVEL = 0
"""MAV_FRAME_GLOBAL."""


def waypoint_list(plan: PlanFile) -> str:
    """The plan as a waypoint list.

    Parameters that are left to the autopilot are written 0: not every reader of this format knows NaN, and ArduPilot
    may refuse it.

    Raises:
        ValueError: More items than the autopilot holds.
    """
    home = home_of(plan)
    place = f"{home.latitude_deg:.9f}\t{home.longitude_deg:.9f}\t{home.altitude_amsl_m:.4f}"
    rows = [f"0\t1\t{ABOVE_SEA_LEVEL}\t{int(Command.WAYPOINT)}\t0\t0\t0\t0\t{place}\t1"]
    for index, item in enumerate(mission_items(plan), start=1):
        params = "\t".join(f"{param or 0.0:.6g}" for param in item.params)
        place = f"{item.latitude_deg:.9f}\t{item.longitude_deg:.9f}\t{item.altitude_m:.4f}"
        rows.append(f"{index}\t0\t{item.frame}\t{int(item.command)}\t{params}\t{place}\t1")
    return "\n".join(["QGC WPL 110", *rows]) + "\n"
