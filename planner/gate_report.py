"""What the gate says of a curve: what was measured on it, and every condition that it breaks."""

from __future__ import annotations

import dataclasses
import enum

import numpy as np
from jaxtyping import Float


class ViolationKind(enum.Enum):
    """What a curve can break."""

    DIVERGED = "diverged"
    CLEARANCE = "clearance"
    BOX = "box"
    FENCE = "fence"
    SPEED = "speed"
    CLIMB = "climb"
    DESCENT = "descent"
    ACCELERATION = "acceleration"
    JERK = "jerk"
    TURN_RATE = "turn rate"
    YAW_RATE = "yaw rate"
    LENGTH = "length"
    START = "start"
    END = "end"
    DURATION = "duration"


@dataclasses.dataclass(frozen=True)
class Violation:
    """One broken condition, at its worst moment.

    Attributes:
        kind: Which condition.
        measured: What the curve does.
        limit: What it may do, in the same unit.
        time_s: When.
        position_m: Where, shape (3,).
        text: The same as a sentence.
    """

    kind: ViolationKind
    measured: float
    limit: float
    time_s: float
    position_m: Float[np.ndarray, "3"]
    text: str


@dataclasses.dataclass(frozen=True)
class GateReport:
    """What was measured on a curve.

    Attributes:
        violations: Every broken condition; none: it may be flown.
        min_clearance_m: Proven least distance from the vehicle's hull to an obstacle; infinite where there is none.
        max_speed_mps: Greatest speed.
        max_climb_mps: Greatest upward velocity.
        max_descent_mps: Greatest downward velocity.
        max_acceleration_mps2: Greatest acceleration.
        max_jerk_mps3: Greatest jerk.
        max_turn_rate_radps: Greatest rate at which the horizontal velocity turns; None where the problem has no limit.
        length_m: Length of the path, by no more than `gate.LENGTH_RESOLUTION` too great.
        duration_s: Time from its first to its last point.
        max_yaw_rate_radps: Greatest rate of the heading that is planned with the path; None where there is none.
    """

    violations: tuple[Violation, ...]
    min_clearance_m: float
    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float
    max_acceleration_mps2: float
    max_jerk_mps3: float
    max_turn_rate_radps: float | None
    length_m: float
    duration_s: float
    max_yaw_rate_radps: float | None = None

    @property
    def passed(self) -> bool:
        """Whether the curve may be flown."""
        return not self.violations
