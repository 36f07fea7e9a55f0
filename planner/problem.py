"""What to explore, with which vehicle, in what time: the planner's one input, checked once."""

from __future__ import annotations

import dataclasses
import enum

import numpy as np
from jaxtyping import Float

from planner.effort import Search
from planner.information import DensityGrid
from planner.obstacles import ObstacleField
from planner.priors import Prior
from planner.trajectory import Motion, Turning
from planner.workspace import Workspace


@dataclasses.dataclass(frozen=True)
class Limits:
    """What the vehicle can do; every number positive.

    Attributes:
        max_speed_mps: Bound on the norm of the velocity.
        max_climb_mps: Bound on the upward velocity.
        max_descent_mps: Bound on the downward velocity.
        max_acceleration_mps2: Bound on the norm of the acceleration.
        max_yaw_rate_radps: Bound on the rate of the heading.
        max_jerk_mps3: Bound on the norm of the jerk; infinite: none.
        max_turn_rate_radps: Bound on the rate at which the horizontal velocity turns, for vehicles that cannot turn on
            the spot; infinite: none. The heading's own rate is `max_yaw_rate_radps`.

    Raises:
        ValueError: A limit that is not positive, or not finite where it must be.
    """

    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float
    max_acceleration_mps2: float
    max_yaw_rate_radps: float = float(np.deg2rad(45.0))
    max_jerk_mps3: float = float("inf")
    max_turn_rate_radps: float = float("inf")

    @property
    def turning_acceleration_mps2(self) -> float:
        """Greatest acceleration across the path at full speed: the vehicle's, or what its turn rate allows."""
        return min(self.max_acceleration_mps2, self.max_turn_rate_radps * self.max_speed_mps)

    def __post_init__(self) -> None:
        for name, value in dataclasses.asdict(self).items():
            unbounded = name in ("max_jerk_mps3", "max_turn_rate_radps") and value == np.inf
            if not ((np.isfinite(value) and value > 0.0) or unbounded):
                raise ValueError(f"{name} must be positive and finite, got {value}")


@dataclasses.dataclass(frozen=True)
class Covered:
    """What was flown before this plan, as the metric remembers it.

    Attributes:
        mean_basis: Time average of the basis functions F_k over the flown path, shape of `modes`.
        duration_s: Time flown.
        poses: Places (unit cube) and headings (radians) on the way, each for the same time, shape (sample, 4): what a
            metric of poses remembers; None: only places are known.
        places: Places (unit cube) on the way, each for the same time, shape (sample, 3): what a metric of places that
            has no basis remembers; None: only the mean basis is known.
    """

    mean_basis: Float[np.ndarray, "k0 k1 k2"]
    duration_s: float
    poses: Float[np.ndarray, "sample 4"] | None = None
    places: Float[np.ndarray, "sample 3"] | None = None


@dataclasses.dataclass(frozen=True)
class Problem:
    """A volume to explore and a vehicle to do it with.

    Attributes:
        workspace: The box, local ENU metres; paths never leave it.
        information: Where time should be spent, over the workspace; cut out beforehand what cannot be reached.
        obstacles: What to stay away from (no-fly volumes too).
        limits: What the vehicle can do.
        start: Motion at the first moment.
        end_position_m: Where to end, at rest; None: anywhere, at rest.
        duration_s: Time of the whole path.
        vehicle_radius_m: Distance from the vehicle's centre to its outermost part.
        clearance_margin_m: Least distance between that and every obstacle.
        fence_polygon_m: Shape (corner, 2): paths stay inside it; None: only the box holds them.
        covered: What was flown before; None: nothing.
        max_length_m: Bound on the length of the path; infinite: none.
        start_turning: Heading at the first moment, where it is planned too; None: as it suits.
        search: Where the information comes from when it is a search effort, which changes with what was searched and
            what is left; None: the information stays as it is.

    Raises:
        ValueError: A duration, radius or margin that makes no sense, or end points outside the box.
    """

    workspace: Workspace
    information: DensityGrid
    obstacles: ObstacleField
    limits: Limits
    start: Motion
    end_position_m: Float[np.ndarray, "3"] | None
    duration_s: float
    vehicle_radius_m: float
    clearance_margin_m: float
    fence_polygon_m: Float[np.ndarray, "corner 2"] | None = None
    covered: Covered | None = None
    search: Search | None = None
    max_length_m: float = float("inf")
    start_turning: Turning | None = None

    def __post_init__(self) -> None:
        if not self.max_length_m > 0.0:
            raise ValueError(f"max_length_m must be positive, got {self.max_length_m}")
        if not (np.isfinite(self.duration_s) and self.duration_s > 0.0):
            raise ValueError(f"duration_s must be positive and finite, got {self.duration_s}")
        for name in ("vehicle_radius_m", "clearance_margin_m"):
            if not (np.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} must be finite and not negative, got {getattr(self, name)}")
        for name, point in (("start", self.start.position_m), ("end_position_m", self.end_position_m)):
            if point is not None and not self.workspace.contains(point):
                raise ValueError(
                    f"{name} {np.round(point, 3).tolist()} lies outside the box "
                    f"{self.workspace.box_min_m.tolist()} … {self.workspace.box_max_m.tolist()}: move it inside"
                )

    @property
    def keep_out_m(self) -> float:
        """Least distance from the vehicle's centre to an obstacle's surface."""
        return self.vehicle_radius_m + self.clearance_margin_m

    @property
    def reach_m(self) -> float:
        """Length that a path can have at the most."""
        return min(self.max_length_m, self.limits.max_speed_mps * self.duration_s)


class Kernel(enum.Enum):
    """How candidates repel each other (`planner.kernels`)."""

    RBF = "rbf"
    MARKOV = "markov"
    MARKOV_COMPLETE = "markov-complete"
    IDENTITY = "identity"
    CONSTANT = "constant"
    SIGNATURE = "signature"


class Metric(enum.Enum):
    """What measures ergodicity."""

    SPECTRAL = "spectral"
    KERNEL = "kernel"


class HeadingRule(enum.Enum):
    """Where the nose points: where the vehicle goes, or planned with the path so that every place is seen all round."""

    TRAVEL = "travel"
    EXPLORED = "explored"


class MetricWeights(enum.Enum):
    """The convention of the spectral weights Λ_k (see `planner.spectral_metric`)."""

    LINEAR = "linear"
    SQUARED = "squared"


class Method(enum.Enum):
    """How the set is solved for."""

    DEFAULT = "default"
    SVES = "sves"


@dataclasses.dataclass(frozen=True)
class Options:
    """How to solve; every default is what the benchmarks found best.

    Attributes:
        candidates: How many paths the set has.
        modes: Basis functions per axis; 1 leaves an axis out of the metric.
        kernel: How candidates repel each other.
        metric: What measures ergodicity.
        heading: Whether the heading is planned with the path; only the kernel metric measures poses.
        metric_weights: Convention of the spectral weights.
        method: The product's own optimiser, or the paper's recipe.
        time_step_s: Time between the samples of the metric; None: chosen from the duration.
        seed: Of every random number.
        knot_prior: p(x) of the Stein steps, of how far the free control points (unit cube) are from the seed that they
            grew from; None: every path is as likely, as one that is held to its seed covers little.

    Raises:
        ValueError: A count below one, a time step that is not positive, or a heading to explore without a metric of
            poses.
    """

    candidates: int = 8
    modes: tuple[int, int, int] = (8, 8, 4)
    kernel: Kernel = Kernel.MARKOV
    metric: Metric = Metric.SPECTRAL
    heading: HeadingRule = HeadingRule.TRAVEL
    metric_weights: MetricWeights = MetricWeights.LINEAR
    method: Method = Method.DEFAULT
    time_step_s: float | None = None
    seed: int = 0
    knot_prior: Prior | None = None

    @property
    def explores_headings(self) -> bool:
        """Whether places and headings are explored together."""
        return self.heading is HeadingRule.EXPLORED

    def __post_init__(self) -> None:
        if self.explores_headings and self.metric is not Metric.KERNEL:
            raise ValueError(f"headings are explored by Metric.KERNEL alone, got {self.metric}: use that metric")
        if self.candidates < 1:
            raise ValueError(f"candidates must be at least 1, got {self.candidates}")
        if min(self.modes) < 1 or max(self.modes) < 2:
            raise ValueError(f"modes must be at least 1 each and above 1 on some axis, got {self.modes}")
        if self.time_step_s is not None and not self.time_step_s > 0.0:
            raise ValueError(f"time_step_s must be positive, got {self.time_step_s}")
