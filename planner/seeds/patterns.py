"""The search patterns that teams fly by hand, as flat polylines (IAMSAR Manual, vol. II, ch. 5).

They cover a `Region`: the box, or what the fence leaves of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from planner.polygon import KeepIn
from planner.problem import Problem

CLOUD = 65


class Region:
    """A flat area, as a cloud of its points.

    Attributes:
        points_m: Shape (point, 2).
        headings_rad: Headings worth flying rows along, from east: the longest side first.
        center_m: Middle of the area's extent.
        half_m: Half of the area's extent.
    """

    def __init__(self, problem: Problem) -> None:
        low, high = problem.workspace.box_min_m[:2], problem.workspace.box_max_m[:2]
        axes = [np.linspace(a, b, CLOUD) for a, b in zip(low, high, strict=True)]
        cloud = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)
        along_east = bool(high[0] - low[0] >= high[1] - low[1])
        headings = [0.0, 0.5 * np.pi] if along_east else [0.5 * np.pi, 0.0]
        if problem.fence_polygon_m is not None:
            inside = KeepIn.of(problem.fence_polygon_m).distance(cloud) >= 0.0
            cloud = cloud[inside] if inside.any() else cloud
            # The fence's long axis, where it is not the box's.
            _, directions = np.linalg.eigh(np.cov(cloud.T))
            slanted = float(np.arctan2(directions[1, 1], directions[0, 1]) % np.pi)
            if np.abs(np.sin(2.0 * slanted)) > 0.1:
                headings.insert(0, slanted)
        self.points_m = cloud
        self.headings_rad = tuple(headings)
        low, high = cloud.min(axis=0), cloud.max(axis=0)
        self.center_m, self.half_m = 0.5 * (low + high), 0.5 * (high - low)
        self._rows: dict[tuple[float, int], Float[np.ndarray, "row 3"]] = {}

    def rows(self, heading_rad: float, count: int) -> Float[np.ndarray, "row 3"]:
        """Parallel rows over the area, the outer ones half a spacing from its border; kept for the next who asks.

        Args:
            heading_rad: Their direction, from east.
            count: How many; those that meet nothing of the area are left out.

        Returns:
            Of each where it begins and ends along the heading, and how far to the left of it it lies, metres.
        """
        if (heading_rad, count) not in self._rows:
            along = self.points_m @ [np.cos(heading_rad), np.sin(heading_rad)]
            left, spacing = self._left_m(heading_rad), self.spacing_m(heading_rad, count)
            # Points of the cloud this close to a row say how far it goes.
            reach = max(0.5 * spacing, float(np.ptp(left)) / (CLOUD - 1))
            middles = left.min() + (np.arange(count) + 0.5) * spacing
            met = ((middle, along[np.abs(left - middle) <= reach]) for middle in middles)
            self._rows[heading_rad, count] = np.array(
                [(near.min(), near.max(), middle) for middle, near in met if near.size]
            )
        return self._rows[heading_rad, count]

    def spacing_m(self, heading_rad: float, count: int) -> float:
        """Between so many rows along a heading."""
        return float(np.ptp(self._left_m(heading_rad))) / count

    def _left_m(self, heading_rad: float) -> Float[np.ndarray, "point"]:
        """How far to the left of a heading the points lie."""
        return self.points_m @ [-np.sin(heading_rad), np.cos(heading_rad)]


def lawnmower(
    region: Region, heading_rad: float, rows: int, inset_m: float | None = None
) -> Float[np.ndarray, "point 2"]:
    """Parallel rows flown to and fro, the outer ones half a spacing from the border.

    Args:
        region: What is covered.
        heading_rad: Direction of the first row, from east.
        rows: How many.
        inset_m: How far rows end before the border; None: half a spacing.

    Returns:
        Ends of the rows in the order flown.
    """
    first, last, left = region.rows(heading_rad, rows).T
    inset = 0.5 * region.spacing_m(heading_rad, rows) if inset_m is None else inset_m
    middle = 0.5 * (first + last)
    ends = np.stack([np.minimum(first + inset, middle), np.maximum(last - inset, middle)], axis=1)
    ends[1::2] = ends[1::2, ::-1]
    along = np.array([np.cos(heading_rad), np.sin(heading_rad)])
    across = np.array([-along[1], along[0]])
    return (ends[..., None] * along + left[:, None, None] * across).reshape(-1, 2)


def spiral(region: Region, turns: float, steps_a_turn: int = 24) -> Float[np.ndarray, "point 2"]:
    """An Archimedean spiral from the middle outward, stretched to the area."""
    count = max(2, round(turns * steps_a_turn) + 1)
    angle = np.linspace(0.0, 2.0 * np.pi * turns, count)
    # The last turn lies half a spacing from the border.
    radius = angle / (2.0 * np.pi * (turns + 0.5))
    return region.center_m + radius[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1) * region.half_m


def expanding_square(region: Region, center_m: Float[np.ndarray, "2"], legs: int) -> Float[np.ndarray, "point 2"]:
    """Legs of 1, 1, 2, 2, 3, 3 … spacings, each a quarter turn on, until the area's border is reached.

    Args:
        region: What is covered; legs end at its extent.
        center_m: Datum.
        legs: How many legs, which sets the spacing.
    """
    low, high = region.center_m - region.half_m, region.center_m + region.half_m
    reach = float(np.maximum(high - center_m, center_m - low).max())
    spacing = 2.0 * reach / (legs / 2.0 + 1.0)
    length = spacing * (np.arange(legs) // 2 + 1)
    turn = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])[np.arange(legs) % 4]
    points = center_m + np.concatenate([np.zeros((1, 2)), np.cumsum(length[:, None] * turn, axis=0)])
    inset = np.minimum(0.5 * spacing, 0.2 * region.half_m)
    return np.clip(points, low + inset, high - inset)


def sectors(center_m: Float[np.ndarray, "2"], radius_m: float, count: int, heading_rad: float) -> np.ndarray:
    """A sector search: out, across, back through the datum, `count` diameters in all.

    Args:
        center_m: Datum, where the information is greatest.
        radius_m: Length of a leg.
        count: Diameters.
        heading_rad: Direction of the first leg, from east.

    Returns:
        Shape (2·count, 2): the datum, then the ends of the legs.
    """
    # Each diameter is crossed once; its two ends are joined to the neighbouring diameters' by chords.
    angle = heading_rad + np.pi * np.arange(count) / count
    ends = np.stack([np.cos(angle), np.sin(angle)], axis=1) * radius_m
    sign = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)[:, None]
    pairs = np.stack([center_m - sign * ends, center_m + sign * ends], axis=1).reshape(-1, 2)
    return np.concatenate([center_m[None], pairs[1:]])


def layered_rows(
    region: Region,
    heading_rad: float,
    rows: int,
    altitudes_m: Sequence[float],
    inset_m: float | None = None,
) -> Float[np.ndarray, "point 3"]:
    """A lawnmower in one or more level layers, each across the one before.

    Args:
        region: What is covered.
        heading_rad: Direction of the first layer's rows, from east.
        rows: How many in all; the first layers get what is left over.
        altitudes_m: Of the layers, in the order flown.
        inset_m: How far rows end before the border; None: half a spacing.
    """
    parts: list[np.ndarray] = []
    each, more = divmod(rows, len(altitudes_m))
    for layer, altitude in enumerate(altitudes_m):
        count = each + (1 if layer < more else 0)
        if count == 0:
            break
        flat = lawnmower(region, heading_rad + 0.5 * np.pi * layer, count, inset_m)
        if parts and np.linalg.norm(flat[0] - parts[-1][-1, :2]) > np.linalg.norm(flat[-1] - parts[-1][-1, :2]):
            flat = flat[::-1]
        parts.append(np.column_stack([flat, np.full(len(flat), altitude)]))
    return np.concatenate(parts)
