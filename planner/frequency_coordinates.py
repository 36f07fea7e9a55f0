"""Coordinates in which all frequencies of a path curve alike: z = z₀ + C·(s ∘ y).

The acceleration limit makes a path stiff: it is a second difference, so its curvature grows with the fourth power of
the number of knots (and that of a limit on jerk with the sixth). C is the cosine basis over time, and s the inverse
root of the curvature that the metric, and the limits on speed, acceleration and jerk, give each frequency. Descent in y
is descent in z with the constant matrix kernel C·s²·Cᵀ, by which the metric reached with the same number of steps is
two to five times lower (benchmarks/README.md).

| symbol | identifier  | unit | shape          |
|--------|-------------|------|----------------|
| C      | `cosines`   | 1    | knot frequency |
| s      | `scale`     | unit | frequency axis |
"""

from __future__ import annotations

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import scipy.fft
from jaxtyping import Array, Float

from planner.scene import Scene

# Curvature of E/E_ref over all knots, and the share of the limits taken to be active: the balance in s.
METRIC_CURVATURE = 100.0
ACTIVE_SHARE = 0.1


class FrequencyCoordinates(eqx.Module):
    """The coordinates y of candidates of one size.

    Attributes:
        cosines: The orthonormal cosine basis over time (DCT-II), a column a frequency.
        scale: How far a unit of each coordinate moves a path, by frequency and axis.
    """

    cosines: Float[Array, "knot frequency"]
    scale: Float[Array, "frequency axis"]

    @classmethod
    def of(cls, scene: Scene, knots: int, penalty: float | Float[Array, ""]) -> FrequencyCoordinates:
        """The coordinates of paths with so many free control points.

        Args:
            scene: Whose limits they must keep.
            knots: Free control points.
            penalty: How firmly, ρ.
        """
        basis = scipy.fft.idct(np.eye(knots), norm="ortho", axis=0)
        return cls(jnp.asarray(basis, jnp.float32), frequency_scale(scene, knots, jnp.asarray(penalty)))

    def move(self, y: Float[Array, "*batch frequency axis"]) -> Float[Array, "*batch knot axis"]:
        """How y moves the control points, unit cube."""
        return jnp.einsum("kf,...fa->...ka", self.cosines, self.scale * y)

    def gradient(self, by_knot: Float[Array, "*batch knot axis"]) -> Float[Array, "*batch frequency axis"]:
        """The gradient by y of what has this gradient by control points."""
        return self.scale * jnp.einsum("kf,...ka->...fa", self.cosines, by_knot)


def frequency_scale(scene: Scene, knots: int, penalty: Float[Array, ""]) -> Float[Array, "frequency axis"]:
    """S of paths with so many free control points, for conditions kept as firmly as ρ does."""
    difference = 2.0 * np.sin(0.5 * np.pi * np.arange(knots) / knots)[:, None]
    slowest = jnp.minimum(scene.max_speed_mps, jnp.minimum(scene.max_climb_mps, scene.max_descent_mps))
    speed = jnp.stack([scene.max_speed_mps, scene.max_speed_mps, slowest])
    first = 2.0 * difference * scene.lengths_m / (speed * scene.knot_interval_s)
    across = jnp.minimum(scene.max_acceleration_mps2, scene.max_turn_rate_radps * scene.max_speed_mps)
    second = 2.0 * difference**2 * scene.lengths_m / (across * scene.knot_interval_s**2)
    third = 2.0 * difference**3 * scene.lengths_m / (scene.max_jerk_mps3 * scene.knot_interval_s**3)
    limited = first**2 + second**2 + third**2
    if scene.has_headings:
        # Of a heading only the rate is limited.
        turned = 2.0 * difference / (scene.max_yaw_rate_turns_per_s * scene.knot_interval_s)
        limited = jnp.concatenate([limited, turned**2], axis=1)
    return (METRIC_CURVATURE / knots + penalty * ACTIVE_SHARE * limited) ** -0.5
