"""`[planner]`: from where to where, how long, and how to search."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, Strict

from mission.findings import Finding
from mission.mission_file.values import Position, Section

Modes = Annotated[int, Field(ge=1, le=256)]

FEWEST_SAMPLES, MOST_SAMPLES = 16, 2048
"""What `planner.scene` has segments for."""

MOST_COEFFICIENTS = 500_000
"""More modes than this cost minutes a step and resolve nothing that a flight could follow."""


class Planner(Section):
    """From where to where, how long, and how to search for the path."""

    start_enu_m: Annotated[Position, Field(examples=[[10.0, 10.0, 30.0]])]
    """Where the path starts, at rest."""
    end_enu_m: Annotated[Position | None, Field(examples=[[10.0, 10.0, 30.0]])] = None
    """Where the path ends, at rest; absent: wherever it is best."""
    closed_tour: bool = False
    """Whether the path ends where it starts; instead of `end_enu_m`."""
    duration_s: Annotated[float, Field(ge=0.1, le=86_400.0, examples=[600.0])]
    """Time from start to end."""
    max_length_m: Annotated[float | None, Field(ge=0.1, le=1e7, examples=[3000.0])] = None
    """Greatest length of the path, with all that replans and resumed flights add; absent: what the speed allows."""
    candidates: Annotated[int, Field(ge=1, le=4096)] = 8
    """How many paths the set has."""
    modes: Annotated[tuple[Modes, Modes, Modes] | None, Strict(False), Field(examples=[[16, 16, 4]])] = None
    """Basis functions along east, north and up; 1 leaves an axis out of the metric. Absent: `[8, 8, 4]`; no altitudes
    (1) where they make no difference, over a flat map and to a search, which takes as many as its swath resolves."""
    kernel: Literal["rbf", "markov", "markov-complete", "identity", "constant", "signature"] = "markov"
    """How candidates repel each other."""
    metric: Literal["spectral", "kernel"] = "spectral"
    """What measures ergodicity."""
    heading: Literal["travel", "explored"] = "travel"
    """Where the nose points: where the vehicle goes, or planned together with the path so that every place of interest
    is looked at from all sides (an inspection with a camera that looks ahead); the second needs `metric = "kernel"`."""
    metric_weights: Literal["linear", "squared"] = "linear"
    """Convention of the spectral weights: (1+‖k‖)^−(v+1)/2 or (1+‖k‖²)^−(v+1)/2."""
    method: Literal["default", "sves"] = "default"
    """The project's own optimiser, or the recipe of the Stein Variational Ergodic Search paper."""
    samples: Annotated[int | None, Field(ge=FEWEST_SAMPLES, le=MOST_SAMPLES, examples=[50])] = None
    """Samples of the path in the metric; absent: chosen from the duration."""
    time_step_s: Annotated[float | None, Field(ge=0.001, le=60.0, examples=[0.1])] = None
    """Time between those samples, instead of their number."""
    time_limit_s: Annotated[float, Field(ge=0.01, le=86_400.0)] = 10.0
    """Time the solver may take, compilation aside. Where that is little it takes fewer steps, and the plan is less
    good."""
    seed: Annotated[int, Field(ge=0, le=2**31 - 1)] = 0
    """Of every random number: the same seed gives the same plan on the same computer, with time enough."""

    @property
    def ends_at_m(self) -> tuple[float, float, float] | None:
        """Where the path ends; None: wherever it is best."""
        return self.start_enu_m if self.closed_tour else self.end_enu_m

    def findings(self) -> Iterator[Finding]:
        """An end and a sampling given one way, samples fine enough, and a metric that measures what is asked for."""
        if self.closed_tour and self.end_enu_m not in (None, self.start_enu_m):
            yield Finding("closed_tour", "true", "end_enu_m is another place than start_enu_m: keep one of the two")
        if self.samples is not None and self.time_step_s is not None:
            yield Finding("time_step_s", f"{self.time_step_s:g}", "samples is given as well: keep one of the two")
        longest_s, shortest_s = self.duration_s / FEWEST_SAMPLES, self.duration_s / MOST_SAMPLES
        if self.time_step_s is not None and self.time_step_s > longest_s:
            yield Finding(
                "time_step_s",
                f"{self.time_step_s:g}",
                f"at least {FEWEST_SAMPLES} samples are needed: write at most {longest_s:g}",
            )
        if self.time_step_s is not None and self.time_step_s < shortest_s:
            yield Finding(
                "time_step_s",
                f"{self.time_step_s:g}",
                f"at most {MOST_SAMPLES} samples are taken: write at least {shortest_s:g}",
            )
        if self.metric == "kernel" and self.metric_weights != "linear":
            yield Finding(
                "metric_weights",
                f'"{self.metric_weights}"',
                'weighs the spectral metric alone, and metric is "kernel": leave it out, or write metric = "spectral"',
            )
        if self.heading == "explored" and self.metric != "kernel":
            yield Finding(
                "heading",
                '"explored"',
                f'needs a metric of places and headings, got "{self.metric}": write metric = "kernel"',
            )
        if self.modes is None:
            return
        if max(self.modes) < 2:
            yield Finding("modes", str(list(self.modes)), "at least one axis must have 2 modes or more: [8, 8, 4]")
        if self.modes[0] * self.modes[1] * self.modes[2] > MOST_COEFFICIENTS:
            yield Finding(
                "modes",
                str(list(self.modes)),
                f"that is {self.modes[0] * self.modes[1] * self.modes[2]:,} coefficients and at most "
                f"{MOST_COEFFICIENTS:,} are reasonable: write fewer on some axis",
            )
