"""Motion planning on hilly ground: twenty paths between the same two points, by each kernel.

Taken: twenty hills (σ = 0.25) at eight times p_map, so that a detour and a hill cost about alike; three free knots;
Adam at 0.05 for 500 steps; kernels of paths see 16 places. Ten terrains, each with its own start sets, which all
contenders share. "Over the best" is in per cent of the least cost that anything found on that terrain. Two paths belong
to one route while their discrete Fréchet distance is below one hill's σ (average linkage); a route is good where its
best path is within a tenth of the best.

python -m benchmarks.sigsvgd.motion_planning
"""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import matplotlib.pyplot as plt
import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

from benchmarks.sigsvgd.report import print_claims, print_table, save
from benchmarks.sigsvgd.terrain import EDGE, SPREAD, Begin, density, descent, hills, start_set
from benchmarks.sigsvgd.transport import Contender
from benchmarks.timing import interleaved_ms
from planner.diversity import diversity, frechet_distances

SEEDS, GOOD = 10, 1.1
TIMED_STEPS, REPEATS = 20, 30


@dataclasses.dataclass(frozen=True)
class Found:
    """A set at its end.

    Attributes:
        paths: Map, shape (particle, time, 2).
        costs: Shape (particle,).
    """

    paths: np.ndarray
    costs: np.ndarray

    @property
    def paths_unit(self) -> np.ndarray:
        """In the unit cube, shape (particle, time, 3)."""
        return np.pad(self.paths / EDGE, ((0, 0), (0, 0), (0, 1)))

    def routes(self) -> np.ndarray:
        """Number of the route that each path belongs to, shape (particle,)."""
        apart = frechet_distances(self.paths_unit)
        return fcluster(linkage(squareform(apart, checks=False), "average"), SPREAD / EDGE, "distance")


def figures(found: Found, least: float) -> np.ndarray:
    """Best, median and mean over the best known, pair distance, distinct plans, routes, good routes."""
    spread, routes = diversity(found.paths_unit), found.routes()
    bests = np.array([found.costs[routes == one].min() for one in np.unique(routes)])
    return np.array(
        [
            100.0 * (found.costs.min() / least - 1.0),
            100.0 * (np.median(found.costs) / least - 1.0),
            100.0 * (np.mean(found.costs) / least - 1.0),
            spread.mean_pair_distance,
            spread.effective_plans,
            len(bests),
            (bests <= GOOD * least).sum(),
        ]
    )


def main() -> None:
    """Print and draw."""
    found: dict[tuple[Begin, Contender], list[Found]] = {}
    for contender in Contender:
        run = descent(contender)
        for begin in Begin:
            sets = (run(hills(seed), start_set(begin, seed)) for seed in range(SEEDS))
            found[begin, contender] = [Found(np.asarray(paths), np.asarray(costs)) for paths, costs in sets]
    least = [min(sets[seed].costs.min() for sets in found.values()) for seed in range(SEEDS)]
    timed = {one: descent(one, TIMED_STEPS) for one in Contender}
    start = start_set(Begin.LINE, 0)
    step_ms = interleaved_ms({one.value: (lambda run=run: run(hills(0), start)) for one, run in timed.items()}, REPEATS)
    rows, medians = [], {}
    for (begin, contender), sets in found.items():
        medians[begin, contender] = np.median(
            [figures(one, floor) for one, floor in zip(sets, least, strict=True)], axis=0
        )
    for begin in Begin:
        for contender in Contender:
            best, middle, mean, apart, distinct, routes, good = medians[begin, contender]
            rows.append(
                f"| {begin.value} | {contender.value} | {best:.2f} % | {middle:.1f} % | {mean:.1f} % | {apart:.3f} "
                f"| {distinct:.2f} | {routes:.1f} | {good:.1f} | {step_ms[contender.value] / TIMED_STEPS:.2f} ms |"
            )
    print_table(
        f"motion planning, medians of {SEEDS} terrains (their best costs {min(least):.1f} to {max(least):.1f})",
        "| start set | kernel | best over the best | median | mean | mean pair distance | distinct plans of 20 "
        "| routes | good routes | step |",
        rows,
    )
    at_line = {one: medians[Begin.LINE, one] for one in Contender}
    anywhere = {one: medians[Begin.ANYWHERE, one] for one in Contender}
    print_claims(
        [
            (
                "lower average costs than competing alternatives (abstract)",
                "; ".join(
                    f"{one.value}: mean {at_line[one][2]:.1f} % and {anywhere[one][2]:.1f} % over the best"
                    for one in Contender
                ),
                _lowest({one: at_line[one][2] for one in Contender}, "near the line")
                + "; "
                + _lowest({one: anywhere[one][2] for one in Contender}, "anywhere"),
            ),
            (
                "diversity over the range of solutions, no mode collapse (abstract)",
                "; ".join(f"{one.value}: {at_line[one][5]:.1f} and {anywhere[one][5]:.1f} routes" for one in Contender),
                _highest({one: at_line[one][5] for one in Contender}, "near the line")
                + "; "
                + _highest({one: anywhere[one][5] for one in Contender}, "anywhere"),
            ),
        ]
    )
    draw(found)


def _lowest(values: dict[Contender, float], where: str) -> str:
    return f"lowest {where}: {min(values, key=lambda one: values[one]).value}"


def _highest(values: dict[Contender, float], where: str) -> str:
    return f"most {where}: {max(values, key=lambda one: values[one]).value}"


def draw(found: dict[tuple[Begin, Contender], list[Found]]) -> None:
    """The first terrain with every set on it."""
    at = np.linspace(0.0, EDGE, 80)
    ground = np.asarray(
        jax.jit(density)(jnp.asarray(hills(0)), jnp.asarray(np.stack(np.meshgrid(at, at), axis=-1), jnp.float32))
    )
    figure, axes = plt.subplots(2, len(Contender), figsize=(2.2 * len(Contender), 4.6))
    for row, begin in zip(axes, Begin, strict=True):
        for axis, contender in zip(row, Contender, strict=True):
            axis.contourf(at, at, ground, 8, cmap="Greys")
            axis.plot(*found[begin, contender][0].paths.transpose(2, 1, 0), linewidth=0.8)
            axis.set(title=contender.value, xlim=(0.0, EDGE), ylim=(0.0, EDGE), aspect="equal", xticks=[], yticks=[])
            axis.title.set_fontsize(8)
        row[0].set_ylabel(begin.value, fontsize=8)
    save(figure, "motion_planning")


if __name__ == "__main__":
    main()
