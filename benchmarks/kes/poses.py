"""Places and headings together (R³ × S¹): the Lie group among those of the paper that a drone with a camera needs.

Taken: random mixtures of peaks in the unit cube, each to be looked at from all sides alike (p(x)/2π), the product's
solver, best of two, T = 100 s, at most 45°/s of yaw. Beside the paths that explore headings: paths that explore places
alone and look where they go, and the lawnmower that does so.

python -m benchmarks.kes.poses
"""

from __future__ import annotations

import math

import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np

from benchmarks.claims import print_claims
from benchmarks.kes.report import save
from benchmarks.peaked import mixture
from benchmarks.quality import CUBE, problem_of
from benchmarks.timing import without_baseline
from planner.judging import Judge, at_middles
from planner.kernel_metric_of import metric_of_poses
from planner.lawnmower import Lawnmowers
from planner.problem import HeadingRule, Metric, Options
from planner.solver import solve
from planner.yaw import along_travel

SEEDS, LENGTH, MODES = 3, 7.0, (8, 8, 8)
POSES = Options(candidates=2, modes=MODES, metric=Metric.KERNEL, heading=HeadingRule.EXPLORED)
PLACES = Options(candidates=2, modes=MODES, metric=Metric.KERNEL)
SECTORS = 8


def evenness(positions: np.ndarray, headings: np.ndarray, mass: np.ndarray) -> float:
    """How evenly headings are shared out over `SECTORS` where the densest half of the information is, in [0, 1]."""
    cells = tuple(np.clip((positions * mass.shape).astype(int), 0, np.array(mass.shape) - 1).T)
    ordered = np.sort(mass.ravel())[::-1]
    least = ordered[np.searchsorted(np.cumsum(ordered), 0.5 * ordered.sum())]
    sectors = np.floor(np.mod(headings[mass[cells] >= least], 2.0 * np.pi) / (2.0 * np.pi / SECTORS)).astype(int)
    share = np.bincount(sectors, minlength=SECTORS) / max(len(sectors), 1)
    return float(-np.sum(share * np.log(np.maximum(share, 1e-12))) / math.log(SECTORS))


def main() -> None:
    """Print and draw."""
    rows: list[list[float]] = []
    shown = None
    for seed in range(SEEDS):
        information = mixture(CUBE, seed)
        problem = problem_of(CUBE, information, LENGTH, np.full(3, 0.1))
        judge = Judge(problem, POSES)
        figures, looks = [], []
        for options in (POSES, PLACES):
            with without_baseline():
                plan = solve(problem, options)
            samples = at_middles(plan.best.trajectory)
            headings = plan.best.trajectory.headings_at(samples.time_s)
            figures.append(judge.ergodic_metric(samples.position_m, headings))
            flown = along_travel(samples.position_m) if headings is None else headings
            looks.append(evenness(samples.position_m, flown, information.mass))
            if shown is None:
                shown = (samples.position_m, flown, information.mass)
            if options is POSES:
                lawnmower, path = Lawnmowers(problem, plan.best.report.length_m).best(judge.ergodic_metric)
        rows.append([*figures, lawnmower, *looks, evenness(path, along_travel(path), information.mass)])
    explored, places, lawnmower, looks, looks_of_places, looks_of_lawnmower = np.array(rows).T
    metric = metric_of_poses(problem_of(CUBE, mixture(CUBE, 0), LENGTH, np.full(3, 0.1)), POSES)
    generator = np.random.default_rng(0)
    poses = np.column_stack([generator.uniform(size=(200, 3)), generator.uniform(-9.0, 9.0, size=200)])
    weight = jnp.full(200, 1.0 / 200.0)
    values = [
        float(metric(jnp.asarray(poses + np.array([0.0, 0.0, 0.0, turn]), jnp.float32), weight))
        for turn in (0.0, 1.234)
    ]
    ratio = float(np.median(explored / lawnmower))
    print_claims(
        "KES: poses (R³ × S¹)",
        [
            (
                "generalises to Lie groups",
                f"turning every pose by the same angle changes E by {abs(values[1] / values[0] - 1.0):.0e} of it",
                "holds on R³ × S¹; SE(3) is not built, as nothing here flies in it"
                if abs(values[1] / values[0] - 1.0) < 1e-5
                else "does not hold",
            ),
            (
                "ergodic coverage there",
                f"E over the lawnmower's, which looks along its rows (medians of {SEEDS}): headings explored "
                f"{ratio:.2f}, places alone {np.median(places / lawnmower):.2f}; evenness of {SECTORS} headings over "
                f"the densest half: {np.median(looks):.2f}, {np.median(looks_of_places):.2f}, lawnmower "
                f"{np.median(looks_of_lawnmower):.2f}",
                "holds" if ratio < 1.0 and (explored < places).all() else "does not hold everywhere",
            ),
        ],
    )
    assert shown is not None
    positions, headings, mass = shown
    figure, axis = plt.subplots(figsize=(3.4, 3.4))
    axis.imshow(mass.sum(axis=2).T, origin="lower", extent=(0, 1, 0, 1), cmap="Blues")
    axis.plot(*positions[:, :2].T, color="tab:red", linewidth=0.8)
    some = slice(None, None, max(1, len(positions) // 60))
    axis.quiver(
        *positions[some, :2].T, np.cos(headings[some]), np.sin(headings[some]), width=0.004, scale=22, color="black"
    )
    axis.set(title="places and headings, from above", xticks=[], yticks=[])
    axis.title.set_fontsize(9)
    save(figure, "poses")


if __name__ == "__main__":
    main()
