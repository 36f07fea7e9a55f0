"""The candidates of a plan side by side: what each is worth, against the lawnmower of its own length and the selected.

| column              | unit | meaning                                                                      |
|---------------------|------|------------------------------------------------------------------------------|
| rank                |      | from one: those that passed the gate by cost, then those that did not        |
| over the lawnmower  | 1    | E over that of the best lawnmower of the candidate's own length              |
| distance            | m    | mean over time of the distance to the selected path at the same moment       |
"""

from __future__ import annotations

import dataclasses
import math
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.judging import Judge, at_middles
from planner.lawnmower import Lawnmowers
from planner.plan import Candidate

if TYPE_CHECKING:
    from mission.planning import Planned

MOST_COMPARED = 48
"""Candidates that are compared with lawnmowers: for hundreds that takes minutes, and nobody flies the last of them."""


@dataclasses.dataclass(frozen=True)
class RankedCandidate:
    """A candidate beside the others.

    Attributes:
        rank: From one, best first.
        index: Its place in the set.
        candidate: What was found and measured.
        lawnmower_ergodic_metric: E of the best lawnmower of its own length; NaN where the candidate has no length or is
            not among the best `MOST_COMPARED`.
        distance_to_selected_m: Mean over time; zero for the selected itself, NaN where none was selected.
    """

    rank: int
    index: int
    candidate: Candidate
    lawnmower_ergodic_metric: float
    distance_to_selected_m: float

    @property
    def over_lawnmower(self) -> float:
        """E as a multiple of the lawnmower's."""
        return self.candidate.ergodic_metric / self.lawnmower_ergodic_metric

    @property
    def verdict(self) -> str:
        """What the gate says of it: "passed", or what is broken most."""
        violations = self.candidate.report.violations
        if not violations:
            return "passed"
        return max(violations, key=lambda broken: _times_over(broken.measured, broken.limit)).text


def ranked_candidates(planned: Planned) -> list[RankedCandidate]:
    """Every candidate, best first. A lawnmower is fitted to the best, which takes some tenths of a second each."""
    plan, problem = planned.plan, planned.problem
    judge = Judge(problem, planned.options)
    chosen = None if plan.selected is None else at_middles(plan.best.trajectory).position_m
    order = sorted(
        range(len(plan.candidates)),
        key=lambda index: (not plan.candidates[index].feasible, _last_if_unknown(plan.candidates[index].cost)),
    )
    rows = []
    for rank, index in enumerate(order, start=1):
        candidate = plan.candidates[index]
        baseline, length_m = math.nan, candidate.report.length_m
        if rank <= MOST_COMPARED and math.isfinite(length_m) and length_m > 0.0:
            baseline, _ = Lawnmowers(problem, length_m).best(judge.ergodic_metric)
        distance_m = math.nan
        if chosen is not None:
            apart = np.linalg.norm(at_middles(candidate.trajectory).position_m - chosen, axis=1)
            distance_m = float(apart.mean())
        rows.append(RankedCandidate(rank, index, candidate, baseline, distance_m))
    return rows


def candidates_as_json(rows: list[RankedCandidate]) -> list[dict[str, Any]]:
    """What the comparison adds to the rows of `mission plan --json`, in the order of the set."""
    return [
        {
            "rank": row.rank,
            "lawnmower_ergodic_metric": _finite(row.lawnmower_ergodic_metric),
            "ergodic_metric_over_lawnmower": _finite(row.over_lawnmower),
            "mean_distance_to_selected_m": _finite(row.distance_to_selected_m),
            "verdict": row.verdict,
        }
        for row in sorted(rows, key=lambda row: row.index)
    ]


def _times_over(measured: float, limit: float) -> float:
    """By how much a condition is broken, in units of its limit: conditions of different units compare so."""
    return abs(measured - limit) / max(abs(limit), 1e-9)


def _last_if_unknown(cost: float) -> float:
    return cost if math.isfinite(cost) else math.inf


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
