"""What the planner returns: a set of candidates, which of them were proven, and the one to fly."""

from __future__ import annotations

import dataclasses
import enum

import numpy as np

from planner.diversity import Diversity
from planner.gate import ProvenTrajectory
from planner.gate_report import GateReport
from planner.trajectory import Trajectory


class Status(enum.Enum):
    """How a solve ended; all but the last leave something to fly."""

    CONVERGED = "converged"
    KEPT = "an earlier path goes on: nothing was solved"
    STEP_LIMIT = "step limit reached"
    DIVERGED = "the steps diverged: the seeds are left"
    INFEASIBLE = "no candidate passed the gate"


@dataclasses.dataclass(frozen=True)
class Candidate:
    """One path of the set: proven, or refused.

    Attributes:
        trajectory: The curve, local ENU.
        seed_pattern: What the candidate grew from ("lawnmower", "random", …).
        cost: L of the likelihood exp(−λL), by which candidates are ranked.
        ergodic_metric: The metric of the whole flight with this path.
        refusal: Why the gate refused the curve; None: the curve is proven.
        probability_found: Of a search, that this path finds what it looks for; None: there is nothing to find.

    Raises:
        ValueError: Neither a proof nor a refusal, or both.
    """

    trajectory: Trajectory
    seed_pattern: str
    cost: float
    ergodic_metric: float
    refusal: GateReport | None = None
    probability_found: float | None = None

    def __post_init__(self) -> None:
        if self.feasible != (self.refusal is None) or (self.refusal is not None and self.refusal.passed):
            raise ValueError("a candidate is a proven trajectory, or any other with the report that refuses it")

    @property
    def objective(self) -> float:
        """What the path is for (`objective_of`)."""
        return objective_of(self.ergodic_metric, self.probability_found)

    @property
    def feasible(self) -> bool:
        """Whether the gate passed it."""
        return isinstance(self.trajectory, ProvenTrajectory)

    @property
    def proven(self) -> ProvenTrajectory:
        """The curve as something that may be flown.

        Raises:
            ValueError: The gate refused it.
        """
        if not isinstance(self.trajectory, ProvenTrajectory):
            raise ValueError(f"the gate refused this candidate: {self.report.violations[0].text}")
        return self.trajectory

    @property
    def report(self) -> GateReport:
        """What the gate measured and which limits are broken."""
        if isinstance(self.trajectory, ProvenTrajectory):
            return self.trajectory.report
        assert self.refusal is not None, "what is not proven was refused"
        return self.refusal


def objective_of(ergodic_metric: float, probability_found: float | None) -> float:
    """What a path is for, less is better: E, or of a search the probability that it finds nothing."""
    return ergodic_metric if probability_found is None else 1.0 - probability_found


@dataclasses.dataclass(frozen=True)
class Plan:
    """A set of candidates.

    Attributes:
        status: How the solve ended.
        candidates: In the order of the seeds.
        selected: Index of the path to fly; None where no candidate passed the gate.
        lawnmower_ergodic_metric: The baseline: the best lawnmower of the selected path's length over the same free
            space. NaN where it is not known: for a replan, which is compared with staying on the course, and for an
            earlier path that goes on.
        diversity: How different those are that passed the gate; where none did, all.
        steps: Optimisation steps taken.
        lawnmower_probability_found: Of a search, what the best lawnmower of that length finds; None for a replan, and
            where there is nothing to find.

    Raises:
        ValueError: What is selected was refused.
    """

    status: Status
    candidates: tuple[Candidate, ...]
    selected: int | None
    lawnmower_ergodic_metric: float
    diversity: Diversity
    steps: int
    lawnmower_probability_found: float | None = None

    def __post_init__(self) -> None:
        if self.selected is not None and not self.candidates[self.selected].feasible:
            raise ValueError(f"candidate {self.selected} was refused by the gate: it cannot be selected")

    @property
    def lawnmower_objective(self) -> float:
        """What `Candidate.objective` of the best lawnmower is; NaN where it is not known."""
        return objective_of(self.lawnmower_ergodic_metric, self.lawnmower_probability_found)

    @property
    def best(self) -> Candidate:
        """The selected candidate.

        Raises:
            ValueError: No candidate passed the gate.
        """
        if self.selected is None:
            raise ValueError(f"there is nothing to fly: {self.status.value}")
        return self.candidates[self.selected]

    def ranked(self) -> tuple[Candidate, ...]:
        """The candidates that passed the gate, best first: what a flight switches to."""
        passed = [candidate for candidate in self.candidates if candidate.feasible]
        return tuple(sorted(passed, key=lambda candidate: candidate.cost))

    def costs(self) -> np.ndarray:
        """Cost of every candidate, +∞ where the gate refused it."""
        return np.array([c.cost if c.feasible else np.inf for c in self.candidates])
