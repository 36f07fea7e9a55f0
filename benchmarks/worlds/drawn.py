"""Worlds drawn by chance, from rooms to kilometres, each as the planner's problem and as a mission file's entries.

Sizes of arrays come in few classes, so that a thousand worlds share a few dozen compilations: a class fixes how many
knots a path has and about how many obstacles of each kind there are. Everything else is chance.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from mission.mission_file.obstacle import Terrain
from mission.site.scans import Frame, surfaces_of
from planner.distance_grid import from_voxels
from planner.information import gaussians, uniform
from planner.obstacles import Box, Cylinder, Obstacle, ObstacleField, Prism, Sphere
from planner.problem import Limits, Options, Problem
from planner.scene import KNOTS_PER_HALF_WAVE, TURN_SHARE
from planner.trajectory import Motion
from planner.workspace import Workspace
from sim_bridge.state import GeodeticPoint

CANDIDATES = 2
FLAT_MODES, DEEP_MODES = (8, 8, 1), (6, 6, 4)
SMALLEST_M, LARGEST_M = 3.0, 3000.0
VOXELS = (16, 16, 8)
PLACES_TRIED = 200
# Rough ground: cells of the raster a box width, how far it goes on beyond the box, what is kept from it, as shares of
# the width, and the box's proportions: with these fixed the grids of distances have one size.
CELLS_A_WIDTH, GROUND_BEYOND, GROUND_KEPT = 24, 0.25, 0.04
GROUND_BOX = np.array([1.0, 0.75, 0.4])
ORIGIN = {"latitude_deg": 47.4, "longitude_deg": 8.5, "altitude_amsl_m": 488.0}


@dataclasses.dataclass(frozen=True)
class WorldClass:
    """What worlds of the same array sizes have in common.

    Attributes:
        flat: Whether there is only one altitude.
        segments: Of a path.
        fewest: Obstacles of each kind, at least.
        most: Obstacles of each kind, at most.
        voxels: Whether a grid of cells stands among the shapes.
        fenced: Whether a polygon holds the flight.
        rough: Whether there is ground below, rough and with cliffs, in the box and around it.
    """

    flat: bool
    segments: int
    fewest: int
    most: int
    voxels: bool = False
    fenced: bool = False
    rough: bool = False


CLASSES = (
    WorldClass(flat=True, segments=48, fewest=1, most=4),
    WorldClass(flat=True, segments=96, fewest=5, most=8),
    WorldClass(flat=True, segments=96, fewest=9, most=10),
    WorldClass(flat=True, segments=64, fewest=1, most=4, fenced=True),
    WorldClass(flat=True, segments=128, fewest=0, most=0, fenced=True),
    WorldClass(flat=False, segments=48, fewest=1, most=4),
    WorldClass(flat=False, segments=96, fewest=5, most=8),
    WorldClass(flat=False, segments=64, fewest=9, most=10),
    WorldClass(flat=False, segments=64, fewest=5, most=8, fenced=True),
    WorldClass(flat=False, segments=64, fewest=1, most=4, voxels=True),
    WorldClass(flat=False, segments=64, fewest=0, most=0, rough=True),
    WorldClass(flat=False, segments=96, fewest=1, most=4, rough=True),
)


@dataclasses.dataclass(frozen=True)
class World:
    """A world.

    Attributes:
        seed: Draws the same world again.
        kind: Its class.
        problem: As the planner is given it.
        options: How it is solved.
        entries: Its obstacles as a mission file has them, for the checker.
    """

    seed: int
    kind: WorldClass
    problem: Problem
    options: Options
    entries: list[dict[str, Any]]

    @property
    def obstacles(self) -> int:
        """How many bodies there are, a grid counting as one."""
        return len([entry for entry in self.entries if not entry.get("voxel")]) + self.kind.voxels


def draw(seed: int, folder: Path) -> World:
    """The world of a seed; ground becomes a file in a folder."""
    rng = np.random.default_rng(seed)
    kind = CLASSES[seed % len(CLASSES)]
    modes = FLAT_MODES if kind.flat else DEEP_MODES
    box = _box(rng, kind)
    width_m = float(box.lengths_m[0])
    speed = float(np.clip(width_m / rng.uniform(5.0, 20.0), 0.3, 20.0))
    limits = Limits(
        max_speed_mps=speed,
        max_climb_mps=speed * rng.uniform(0.3, 0.8),
        max_descent_mps=speed * rng.uniform(0.2, 0.6),
        max_acceleration_mps2=speed / rng.uniform(0.8, 3.0),
    )
    half_wave_m = float((box.lengths_m[:2] / (np.array(modes[:2]) - 1)).min())
    interval_s = max(TURN_SHARE * speed / limits.max_acceleration_mps2, half_wave_m / speed / KNOTS_PER_HALF_WAVE)
    # As much time as makes the planner choose so many knots, but always enough to cross the box three times.
    duration_s = max(kind.segments * interval_s * 0.98, 3.0 * float(np.linalg.norm(box.lengths_m)) / speed)
    radius_m, margin_m = (float(width_m * rng.uniform(0.002, 0.01)) for _ in range(2))
    if kind.rough:
        radius_m = width_m * GROUND_KEPT * rng.uniform(0.1, 0.9)
        margin_m = width_m * GROUND_KEPT - radius_m
    fence = _fence(rng, box) if kind.fenced else None
    entries = _entries(rng, kind, box)
    shapes: list[Obstacle] = [_shape(entry) for entry in entries]
    if kind.voxels:
        occupied = _occupied(rng)
        cell_m = box.lengths_m / np.array(VOXELS)
        shapes.append(from_voxels(occupied, box.box_min_m, cell_m, box))
        entries += [_cell(box, cell_m, np.array(index)) for index in np.argwhere(occupied)]
    if kind.rough:
        entries.append(_ground(rng, box, folder))
        low, high = (tuple(corner.tolist()) for corner in (box.box_min_m, box.box_max_m))
        frame = Frame(GeodeticPoint(**ORIGIN), low, high, radius_m + margin_m)
        shapes += surfaces_of(Terrain.model_validate(entries[-1]), frame)
    draft = Problem(
        workspace=box,
        information=uniform(box, (32, 32, 8)) if rng.random() < 0.3 else _mixture(rng, box),
        obstacles=ObstacleField.of(shapes),
        limits=limits,
        start=Motion.at_rest(0.5 * (box.box_min_m + box.box_max_m)),
        end_position_m=None,
        duration_s=duration_s,
        vehicle_radius_m=radius_m,
        clearance_margin_m=margin_m,
        fence_polygon_m=fence,
    )
    start = _free_place(rng, draft, None if not kind.flat else 0.5)
    ending = rng.random()
    end = None if ending < 0.15 else start if ending < 0.3 else _free_place(rng, draft, 0.5 if kind.flat else None)
    problem = dataclasses.replace(draft, start=Motion.at_rest(start), end_position_m=end)
    # As many knots as the class has, which is what the planner chooses, or fewer in wide and low worlds.
    step_s = duration_s / (2 * kind.segments)
    options = Options(candidates=CANDIDATES, modes=modes, seed=seed, time_step_s=step_s)
    return World(seed, kind, problem, options, entries)


def _box(rng: np.random.Generator, kind: WorldClass) -> Workspace:
    """From a room to kilometres; no higher than aircraft may fly."""
    width = float(np.exp(rng.uniform(np.log(SMALLEST_M), np.log(LARGEST_M))))
    depth = width * rng.uniform(0.5, 1.0)
    height = 0.1 * width if kind.flat else width * rng.uniform(0.15, 1.0)
    if kind.rough:
        width = min(width, 120.0 / GROUND_BOX[2])
        depth, height = width * GROUND_BOX[1:]
    low = rng.uniform(-1.0, 1.0, 3) * width
    low[2] = abs(low[2]) * 0.1
    return Workspace(low, low + np.array([width, depth, min(height, 120.0)]))


def _entries(rng: np.random.Generator, kind: WorldClass, box: Workspace) -> list[dict[str, Any]]:
    """Bodies of every kind; in flat worlds all stand in the way, in the others some are to be flown over or under."""
    counts = {name: int(rng.integers(kind.fewest, kind.most + 1)) for name in ("sphere", "cylinder", "box", "prism")}
    total = sum(counts.values())
    width = float(box.lengths_m[0])
    largest = 0.1 * width * np.sqrt(8.0 / max(total, 8))
    low, high = box.box_min_m, box.box_max_m
    entries: list[dict[str, Any]] = []
    for name, count in counts.items():
        for _ in range(count):
            center = rng.uniform(low, high)
            size = float(rng.uniform(0.15, 1.0) * largest)
            floor, ceiling = float(low[2] - 1.0), float(high[2] + 1.0)
            if kind.flat:
                center[2] = 0.5 * (low[2] + high[2])
            elif rng.random() < 0.7:
                ceiling = float(rng.uniform(low[2], high[2]))
            entries.append(_entry(rng, name, center, size, floor, ceiling))
    return entries


def _entry(
    rng: np.random.Generator, name: str, center: np.ndarray, size: float, floor: float, ceiling: float
) -> dict[str, Any]:
    match name:
        case "sphere":
            return {"kind": "sphere", "center_enu_m": center.tolist(), "radius_m": size}
        case "cylinder":
            flat = center[:2].tolist()
            return {
                "kind": "cylinder",
                "center_enu_m": flat,
                "radius_m": size,
                "floor_m": floor,
                "ceiling_m": ceiling,
            }
        case "box":
            half = size * rng.uniform(0.4, 1.3, 2)
            return {
                "kind": "box",
                "min_enu_m": [*(center[:2] - half).tolist(), floor],
                "max_enu_m": [*(center[:2] + half).tolist(), ceiling],
            }
        case _:
            # A star around its centre: simple, seldom convex.
            angle = np.sort(rng.uniform(0.0, 2.0 * np.pi, 8) + np.arange(8) * 1e-3)
            spoke = size * rng.uniform(0.4, 1.2, 8)
            corners = center[:2] + spoke[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)
            return {"kind": "prism", "polygon_enu_m": corners.tolist(), "floor_m": floor, "ceiling_m": ceiling}


def _shape(entry: dict[str, Any]) -> Obstacle:
    match entry["kind"]:
        case "sphere":
            return Sphere(np.array(entry["center_enu_m"]), entry["radius_m"])
        case "cylinder":
            return Cylinder(np.array(entry["center_enu_m"]), entry["radius_m"], entry["floor_m"], entry["ceiling_m"])
        case "box":
            return Box(np.array(entry["min_enu_m"]), np.array(entry["max_enu_m"]))
        case _:
            return Prism(np.array(entry["polygon_enu_m"]), entry["floor_m"], entry["ceiling_m"])


def _occupied(rng: np.random.Generator) -> np.ndarray:
    """A few towers of cells; the two opposite corners keep the grid's extent the same in every world."""
    occupied = np.zeros(VOXELS, dtype=bool)
    for _ in range(5):
        x, y = (int(rng.integers(0, n - 2)) for n in VOXELS[:2])
        occupied[x : x + 2, y : y + 2, : int(rng.integers(1, VOXELS[2] + 1))] = True
    occupied[0, 0, 0] = occupied[-1, -1, -1] = True
    return occupied


def _cell(box: Workspace, cell_m: np.ndarray, index: np.ndarray) -> dict[str, Any]:
    low = box.box_min_m + index * cell_m
    return {"kind": "box", "min_enu_m": low.tolist(), "max_enu_m": (low + cell_m).tolist(), "voxel": True}


def _ground(rng: np.random.Generator, box: Workspace, folder: Path) -> dict[str, Any]:
    """Hills, and cliffs that run north or east: some of them just outside the box, where paths come close unseen."""
    cell_m = float(box.lengths_m[0]) / CELLS_A_WIDTH
    middle = 0.5 * (box.box_min_m + box.box_max_m)
    half = np.ceil((0.5 + GROUND_BEYOND) * box.lengths_m[:2] / cell_m)
    axes = [cell_m * np.arange(0.5 - count, count) for count in half]
    east, north = np.meshgrid(*axes, indexing="ij")
    share = np.zeros(east.shape)
    for _ in range(int(rng.integers(1, 5))):
        top, wide = rng.uniform(-0.6, 0.6, 2) * box.lengths_m[:2], rng.uniform(0.05, 0.3) * box.lengths_m[0]
        share += rng.uniform(0.05, 0.3) * np.exp(-0.5 * ((east - top[0]) ** 2 + (north - top[1]) ** 2) / wide**2)
    share += rng.uniform(0.0, 0.04) * rng.random(share.shape)
    for _ in range(int(rng.integers(0, 4))):
        axis, side = int(rng.integers(2)), rng.choice([-1.0, 1.0])
        foot_m = 0.5 * box.lengths_m[axis] + cell_m * rng.uniform(-2.0, 5.0)
        share += rng.uniform(0.2, 2.0) * (side * (east, north)[axis] > foot_m)
    # The box is free at its middle.
    inner = (np.abs(east) < 0.3 * box.lengths_m[0]) & (np.abs(north) < 0.3 * box.lengths_m[1])
    share *= min(1.0, 0.6 / share[inner].max())
    heights = box.box_min_m[2] + box.lengths_m[2] * share
    file = folder / "ground.npy"
    np.save(file, heights.T[::-1])
    return {
        "kind": "terrain",
        "file": file,
        "cell_m": cell_m,
        "center_enu_m": middle[:2].tolist(),
        "heights": "above-origin",
    }


def _mixture(rng: np.random.Generator, box: Workspace):
    count = int(rng.integers(1, 5))
    mean = box.box_min_m + rng.uniform(0.1, 0.9, (count, 3)) * box.lengths_m
    std = rng.uniform(0.05, 0.25, (count, 3)) * box.lengths_m
    return gaussians(box, mean, std, rng.uniform(0.3, 1.0, count), (32, 32, 8))


def _fence(rng: np.random.Generator, box: Workspace) -> np.ndarray:
    """A polygon of eight corners, now and then with a bay."""
    angle = (np.arange(8) + rng.uniform(-0.2, 0.2, 8)) * np.pi / 4.0
    spoke = rng.uniform(0.75, 1.0, 8)
    if rng.random() < 0.3:
        spoke[rng.integers(8)] = 0.45
    middle = 0.5 * (box.box_min_m + box.box_max_m)[:2]
    return middle + 0.5 * box.lengths_m[:2] * (spoke[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1))


def _free_place(rng: np.random.Generator, problem: Problem, altitude_share: float | None) -> np.ndarray:
    """A place where the vehicle may be, by a hair or by far.

    Raises:
        ValueError: None was found.
    """
    from planner.free_space import FreeSpace

    box, free = problem.workspace, FreeSpace(problem, allowance=1.01)
    places = box.box_min_m + rng.uniform(0.03, 0.97, (PLACES_TRIED, 3)) * box.lengths_m
    if altitude_share is not None:
        places[:, 2] = box.box_min_m[2] + altitude_share * box.lengths_m[2]
    open_places = np.flatnonzero(free.margin(places) >= 0.0)
    if open_places.size == 0:
        raise ValueError("no free place in this world: draw smaller obstacles")
    return places[open_places[0]]
