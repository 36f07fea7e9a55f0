"""What a mission's terrain must agree with: where home stands, and the heights at which paths begin and end."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from mission.findings import Finding
from mission.mission_file import Mission
from mission.mission_file.errors import spelled
from mission.mission_file.obstacle import Terrain
from planner.height_field import HeightField

HOME_ALLOWANCE_M = 5.0
"""Home may differ so much from the ground below it: maps are no better, nor are positions on a slope."""


def home_stands_on_it(path: str, entry: Terrain, ground: HeightField, mission: Mission) -> Iterator[Finding]:
    """Home is as high as the ground below it, to what is uncertain; heights from another zero never are.

    Args:
        path: Of the entry.
        entry: The terrain as it was written.
        ground: The same as a surface.
        mission: Its home.
    """
    east, north, up = mission.home_enu_m
    post = np.asarray(ground.post_m)
    around = np.array([east, north]) + post * np.array([[0, 0], [-1, 0], [1, 0], [0, -1], [0, 1]])
    heights = np.asarray(ground.height_at(around))
    below = float(heights[0])
    if abs(up - below) <= max(HOME_ALLOWANCE_M, float(np.ptp(heights))):
        return
    absent = ", which is what its absence means" if mission.site.home_enu_m is None else ""
    yield Finding(
        f"{path}.heights",
        f'"{entry.heights}"',
        f"the ground at home is then at up = {below:.6g} m, and home is at up = {up:g} m{absent}: are these heights "
        f"measured from {'sea level' if entry.heights == 'above-origin' else 'the origin'}, or is site.home_enu_m or "
        "site.origin wrong?",
    )


def heights_are_kept(
    path: str, entry: Terrain, ground: HeightField, ends: Iterable[tuple[str, tuple[float, float, float]]]
) -> Iterator[Finding]:
    """Paths begin and end at heights above the ground that they may keep.

    Args:
        path: Of the entry.
        entry: The terrain as it was written.
        ground: The same as a surface.
        ends: Entries of the ends, with their positions.
    """
    least, greatest = entry.least_height_m, entry.greatest_height_m
    for name, position in ends:
        below = float(np.asarray(ground.height_at(np.array([position[:2]])))[0])
        height = position[2] - below
        if (least is not None and height < least) or (greatest is not None and height > greatest):
            allowed = [f"at least {below + least:.6g}"] if least is not None else []
            allowed += [f"at most {below + greatest:.6g}"] if greatest is not None else []
            yield Finding(
                name,
                spelled(position),
                f"is {height:.6g} m above the ground of {path}, and {_kept(least, greatest)} m above it are kept: "
                f"up must be {' and '.join(allowed)}",
            )


def _kept(least: float | None, greatest: float | None) -> str:
    if least is None:
        return f"at most {greatest:g}"
    return f"at least {least:g}" if greatest is None else f"{least:g} … {greatest:g}"
