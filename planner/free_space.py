"""Where the vehicle's centre may be, and ways around what is in the way.

Paths are polylines in metres. A blocked stretch is first stepped around: sideways, over or under, whichever is the
shortest; where that fails, the shortest way through a graph of free cells is taken (`planner.routing`). Nothing here is
proven: the gate proves.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float

from planner.polygon import KeepIn
from planner.polyline import densified, length_of, without_repeats
from planner.problem import Problem
from planner.routing import Routes

# Paths keep a little more than the least distance, so that smoothing them does not cut into it.
ALLOWANCE = 1.15
PUSHES = 3
# A step around: samples along the blocked stretch, offsets tried, and the largest as a multiple of its length.
STEP_SAMPLES = 9
RUNGS = 10
# Tried in this order: (multiple, whether up and down instead of left and right).
TRIES = ((1.0, False), (1.0, True), (4.0, False))
LEG_SHARES = np.array([0.25, 0.5, 0.75])[:, None]


class FreeSpace:
    """The box less the inflated obstacles, inside the fence.

    Args:
        problem: Box, fence, obstacles and vehicle.
        allowance: What is kept, as a multiple of what must be.

    Attributes:
        low_m: Lower corner of the box.
        high_m: Upper corner of the box.
        is_open: Whether there is nothing but the box.
        climb_cost: Level metres that could be flown in the time of climbing one.
        descent_cost: The same for descending.
    """

    def __init__(self, problem: Problem, allowance: float = ALLOWANCE) -> None:
        self.low_m = problem.workspace.box_min_m
        self.high_m = problem.workspace.box_max_m
        self._field = problem.obstacles
        self._keep_out_m = allowance * problem.keep_out_m
        self._fence = None if problem.fence_polygon_m is None else KeepIn.of(problem.fence_polygon_m)
        self._fence_inset_m = 0.01 * float((self.high_m - self.low_m)[:2].min())
        self.is_open = self._fence is None and self._field.is_empty
        limits = problem.limits
        self.climb_cost = max(1.0, limits.max_speed_mps / limits.max_climb_mps)
        self.descent_cost = max(1.0, limits.max_speed_mps / limits.max_descent_mps)

    @cached_property
    def routes(self) -> Routes:
        """Ways through free cells, for where stepping around fails."""
        return Routes(self.low_m, self.high_m, self.margin, max(self.climb_cost, self.descent_cost))

    def margin(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Distance to the nearest thing in the way less what must be kept; negative: not free. Metres."""
        margin = self._field.distance(points_m) - self._keep_out_m
        if self._fence is not None:
            margin = np.minimum(margin, self._fence.distance(points_m[..., :2]) - self._fence_inset_m)
        return margin

    def flown_lengths(self, points_m: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "leg"]:
        """Length of each leg; of a steep one, what could be flown level in its time."""
        step = np.diff(points_m, axis=0)
        up = step[:, 2]
        steep = np.where(up > 0.0, up * self.climb_cost, -up * self.descent_cost)
        return np.maximum(np.linalg.norm(step, axis=1), steep)

    def clipped(self, points_m: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch 3"]:
        """Points moved into the box."""
        return np.clip(points_m, self.low_m, self.high_m)

    def pushed(self, points_m: Float[np.ndarray, "point 3"]) -> Float[np.ndarray, "point 3"]:
        """Points moved out of what they are in, the steepest way; those deep inside may stay blocked."""
        points = self.clipped(points_m)
        if self.is_open:
            return points
        step = 1e-4 * float((self.high_m - self.low_m).min())
        offsets = step * np.concatenate([np.eye(3), -np.eye(3)])
        blocked = np.arange(len(points))
        for _ in range(PUSHES):
            margin = self.margin(points[blocked])
            blocked, margin = blocked[margin < 0.0], margin[margin < 0.0]
            if blocked.size == 0:
                break
            around = self.margin(points[blocked, None] + offsets)
            slope = (around[:, :3] - around[:, 3:]) / (2.0 * step)
            norm = np.maximum(np.linalg.norm(slope, axis=1, keepdims=True), 1e-3)
            points[blocked] = self.clipped(points[blocked] + (step - margin[:, None]) * slope / norm)
        return points

    def path_through(self, waypoints_m: Float[np.ndarray, "waypoint 3"]) -> Float[np.ndarray, "point 3"]:
        """The polyline through waypoints, led around what is in the way; waypoints that are blocked are passed by.

        Args:
            waypoints_m: Two or more; the first and the last are kept as they are.
        """
        waypoints = self.clipped(np.asarray(waypoints_m, dtype=float))
        if self.is_open:
            return waypoints
        dense = densified(waypoints, self._spacing_m(waypoints))
        free = self.margin(dense) >= 0.0
        free[[0, -1]] = True
        if free.all():
            return waypoints
        kept = dense[free]
        gaps = np.flatnonzero(np.diff(np.flatnonzero(free)) > 1)
        pieces, begin = [], 0
        for gap, detour in zip(gaps, self._detours(kept[gaps], kept[gaps + 1]), strict=True):
            pieces += [kept[begin : gap + 1], detour]
            begin = gap + 1
        return without_repeats(np.concatenate([*pieces, kept[begin:]]))

    def _spacing_m(self, waypoints: Float[np.ndarray, "waypoint 3"]) -> float:
        """Between samples: fine enough to meet what must be kept, coarse enough for a long path."""
        coarsest = 0.01 * float((self.high_m - self.low_m)[:2].max())
        return max(min(coarsest, max(2.0 * self._keep_out_m, 0.2 * coarsest)), length_of(waypoints) / 4000.0)

    def _detours(
        self, entry: Float[np.ndarray, "gap 3"], leave: Float[np.ndarray, "gap 3"]
    ) -> list[Float[np.ndarray, "point 3"]]:
        """For each blocked stretch the points between its ends that lead around it."""
        share = np.linspace(0.0, 1.0, STEP_SAMPLES)[:, None]
        chord = entry[:, None] + share * (leave - entry)[:, None]
        free = self.margin(chord) >= 0.0
        free[:, [0, -1]] = True
        # A corner that lies in an obstacle is cut.
        found = {int(gap): np.zeros((0, 3)) for gap in np.flatnonzero(free.all(axis=1))}
        for reach, vertical in TRIES:
            pending = np.array([gap for gap in range(len(entry)) if gap not in found], dtype=int)
            if pending.size:
                steps = self._steps_around(
                    entry[pending], leave[pending], chord[pending], free[pending], reach, vertical
                )
                found.update({int(gap): step for gap, step in zip(pending, steps, strict=True) if step is not None})
        return [
            found[gap] if gap in found else self.routes.between(entry[gap], leave[gap]) for gap in range(len(entry))
        ]

    def _steps_around(
        self,
        entry: Float[np.ndarray, "gap 3"],
        leave: Float[np.ndarray, "gap 3"],
        chord: Float[np.ndarray, "gap sample 3"],
        chord_free: Bool[np.ndarray, "gap sample"],
        reach: float,
        vertical: bool,
    ) -> list[Float[np.ndarray, "point 3"] | None]:
        """The chord pushed to one side (or up or down), each sample as far as it needs; none where that is not free."""
        along = leave - entry
        level = np.linalg.norm(along[:, :2], axis=1, keepdims=True)
        left = np.stack([-along[:, 1], along[:, 0], 0.0 * along[:, 0]], axis=1)
        # A climb on the spot has no left: it steps north.
        left = np.where(level > 1e-9, left / np.maximum(level, 1e-9), [0.0, 1.0, 0.0])
        aside = np.broadcast_to([0.0, 0.0, 1.0], left.shape) if vertical else left
        ways = np.stack([aside, -aside], axis=1)
        longest = reach * (np.linalg.norm(along, axis=1) + 2.0 * self._keep_out_m)
        rungs = longest[:, None] * np.arange(RUNGS + 1) / RUNGS
        points = chord[:, None, None] + rungs[:, None, 1:, None, None] * ways[:, :, None, None]
        inside = ((points >= self.low_m) & (points <= self.high_m)).all(axis=-1)
        free = inside & (self.margin(points) >= 0.0)
        needed = np.where(free.any(axis=2), np.argmax(free, axis=2) + 1, RUNGS + 1)
        needed = np.where(chord_free[:, None], 0, needed)
        worst = needed.max(axis=2)
        # Offsets are reached a sample early and left a sample late: a wall across the way is followed to its corner.
        padded = np.pad(needed, ((0, 0), (0, 0), (1, 1)))
        wide = np.maximum(needed, np.maximum(padded[:, :, :-2], padded[:, :, 2:]))
        way = np.argmin(worst, axis=1)
        every = np.arange(len(entry))
        offset = np.take_along_axis(rungs, np.minimum(wide[every, way], RUNGS), axis=1)
        paths = self.clipped(chord + offset[:, :, None] * ways[every, way][:, None])
        whole = np.concatenate([entry[:, None], paths, leave[:, None]], axis=1)
        between = whole[:, :-1, None] + LEG_SHARES * np.diff(whole, axis=1)[:, :, None]
        # A touch is no harm: what is kept here is more than what must be.
        sound = (self.margin(between) > -0.02 * self._keep_out_m - 1e-9).all(axis=(1, 2))
        sound &= worst[every, way] <= RUNGS
        return [path if good else None for path, good in zip(paths, sound, strict=True)]
