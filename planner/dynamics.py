"""Vehicles as functions from a state and a control to the next state; local ENU metres and seconds.

| symbol | identifier    | unit              | shape        |
|--------|---------------|-------------------|--------------|
| x      | `state`       | as the class says | state        |
| u      | `control`     | as the class says | control      |
| dt     | `duration_s`  | s                 |              |
| f      | `step()`      |                   | state        |

A control is held for the whole step. Limits hold by projection: onto a convex set that contains the present velocity a
projection never moves farther than was asked for, so a speed limit cannot break the acceleration limit.

Vehicles are plain constants: a compiled function holds for one of them. Headings are counter-clockwise from east;
flight path angles are positive upwards.
"""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

Vector = Float[np.ndarray, "control"]


@dataclasses.dataclass(frozen=True)
class SingleIntegrator:
    """State: position (3). Control: velocity (3), in a ball cut by climb and descent.

    Attributes:
        max_speed_mps: Bound on the norm of the velocity.
        max_climb_mps: Bound on the upward velocity.
        max_descent_mps: Bound on the downward velocity.
    """

    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float

    def __post_init__(self) -> None:
        _positive(self)

    @property
    def control_low(self) -> Vector:
        """Least of each control."""
        return np.array([-self.max_speed_mps, -self.max_speed_mps, -min(self.max_descent_mps, self.max_speed_mps)])

    @property
    def control_high(self) -> Vector:
        """Most of each control."""
        return np.array([self.max_speed_mps, self.max_speed_mps, min(self.max_climb_mps, self.max_speed_mps)])

    def step(
        self, state: Float[Array, "state"], control: Float[Array, "control"], duration_s: float | Float[Array, ""]
    ) -> Float[Array, "state"]:
        """Exact."""
        velocity = _within_speed(control, self.max_speed_mps, self.max_climb_mps, self.max_descent_mps)
        return state + duration_s * velocity


@dataclasses.dataclass(frozen=True)
class DoubleIntegrator:
    """State: position (3), velocity (3). Control: acceleration (3), in a ball. No limit of speed.

    Attributes:
        max_acceleration_mps2: Bound on the norm of the acceleration.
    """

    max_acceleration_mps2: float

    def __post_init__(self) -> None:
        _positive(self)

    @property
    def control_low(self) -> Vector:
        """Least of each control."""
        return np.full(3, -self.max_acceleration_mps2)

    @property
    def control_high(self) -> Vector:
        """Most of each control."""
        return np.full(3, self.max_acceleration_mps2)

    def step(
        self, state: Float[Array, "state"], control: Float[Array, "control"], duration_s: float | Float[Array, ""]
    ) -> Float[Array, "state"]:
        """Exact."""
        acceleration = _within_ball(control, self.max_acceleration_mps2)
        position, velocity = state[:3], state[3:]
        position = position + duration_s * (velocity + 0.5 * duration_s * acceleration)
        return jnp.concatenate([position, velocity + duration_s * acceleration])


@dataclasses.dataclass(frozen=True)
class DubinsCar:
    """State: position (3), heading. Control: turn rate (1). Constant speed and altitude.

    Attributes:
        speed_mps: Its speed.
        min_turn_radius_m: Of its tightest circle.
    """

    speed_mps: float
    min_turn_radius_m: float

    def __post_init__(self) -> None:
        _positive(self)

    @property
    def control_low(self) -> Vector:
        """Least of each control."""
        return -self.control_high

    @property
    def control_high(self) -> Vector:
        """Most of each control."""
        return np.array([self.speed_mps / self.min_turn_radius_m])

    def step(
        self, state: Float[Array, "state"], control: Float[Array, "control"], duration_s: float | Float[Array, ""]
    ) -> Float[Array, "state"]:
        """Exact: an arc, as its chord."""
        most = self.speed_mps / self.min_turn_radius_m
        turn = duration_s * jnp.clip(control[0], -most, most)
        chord = duration_s * self.speed_mps * jnp.sinc(turn / (2.0 * jnp.pi))
        middle = state[3] + 0.5 * turn
        east, north = chord * jnp.cos(middle), chord * jnp.sin(middle)
        return state + jnp.stack([east, north, jnp.zeros_like(east), turn])


@dataclasses.dataclass(frozen=True)
class Aircraft:
    """State: position (3), flight path angle, heading. Control: speed, rates of both angles (SVES eq. 35).

    Departure: speed, rates and flight path angle have limits; it cannot stop.

    Attributes:
        min_speed_mps: Least speed.
        max_speed_mps: Greatest speed, above the least.
        max_path_angle_rad: Bound on climb and dive.
        max_path_rate_radps: Bound on the rate of the flight path angle.
        max_turn_rate_radps: Bound on the rate of the heading.
    """

    min_speed_mps: float
    max_speed_mps: float
    max_path_angle_rad: float
    max_path_rate_radps: float
    max_turn_rate_radps: float

    def __post_init__(self) -> None:
        _positive(self)
        if not self.min_speed_mps <= self.max_speed_mps:
            raise ValueError(f"min_speed_mps {self.min_speed_mps} is above max_speed_mps {self.max_speed_mps}")

    @property
    def control_low(self) -> Vector:
        """Least of each control."""
        return np.array([self.min_speed_mps, -self.max_path_rate_radps, -self.max_turn_rate_radps])

    @property
    def control_high(self) -> Vector:
        """Most of each control."""
        return np.array([self.max_speed_mps, self.max_path_rate_radps, self.max_turn_rate_radps])

    def step(
        self, state: Float[Array, "state"], control: Float[Array, "control"], duration_s: float | Float[Array, ""]
    ) -> Float[Array, "state"]:
        """Second order in the duration: the direction is that of half way."""
        speed = jnp.clip(control[0], self.min_speed_mps, self.max_speed_mps)
        path_rate = jnp.clip(control[1], -self.max_path_rate_radps, self.max_path_rate_radps)
        turn_rate = jnp.clip(control[2], -self.max_turn_rate_radps, self.max_turn_rate_radps)
        path, heading = state[3], state[4]
        next_path = jnp.clip(path + duration_s * path_rate, -self.max_path_angle_rad, self.max_path_angle_rad)
        next_heading = heading + duration_s * turn_rate
        middle, across = 0.5 * (path + next_path), 0.5 * (heading + next_heading)
        direction = jnp.stack([jnp.cos(across) * jnp.cos(middle), jnp.sin(across) * jnp.cos(middle), jnp.sin(middle)])
        return jnp.concatenate([state[:3] + duration_s * speed * direction, jnp.stack([next_path, next_heading])])


@dataclasses.dataclass(frozen=True)
class Multirotor:
    """State: position (3), velocity (3), heading. Control: acceleration (3), yaw rate.

    Attributes:
        max_speed_mps: Bound on the norm of the velocity.
        max_climb_mps: Bound on the upward velocity.
        max_descent_mps: Bound on the downward velocity.
        max_acceleration_mps2: Bound on the norm of the acceleration.
        max_yaw_rate_radps: Bound on the rate of the heading.
    """

    max_speed_mps: float
    max_climb_mps: float
    max_descent_mps: float
    max_acceleration_mps2: float
    max_yaw_rate_radps: float

    def __post_init__(self) -> None:
        _positive(self)

    @property
    def control_low(self) -> Vector:
        """Least of each control."""
        return -self.control_high

    @property
    def control_high(self) -> Vector:
        """Most of each control."""
        return np.array([*[self.max_acceleration_mps2] * 3, self.max_yaw_rate_radps])

    def step(
        self, state: Float[Array, "state"], control: Float[Array, "control"], duration_s: float | Float[Array, ""]
    ) -> Float[Array, "state"]:
        """Exact for the acceleration that the speed limits leave."""
        acceleration = _within_ball(control[:3], self.max_acceleration_mps2)
        yaw_rate = jnp.clip(control[3], -self.max_yaw_rate_radps, self.max_yaw_rate_radps)
        position, velocity = state[:3], state[3:6]
        next_velocity = _within_speed(
            velocity + duration_s * acceleration, self.max_speed_mps, self.max_climb_mps, self.max_descent_mps
        )
        position = position + 0.5 * duration_s * (velocity + next_velocity)
        return jnp.concatenate([position, next_velocity, (state[6] + duration_s * yaw_rate)[None]])


Dynamics = SingleIntegrator | DoubleIntegrator | DubinsCar | Aircraft | Multirotor


def rollout(
    dynamics: Dynamics,
    state: Float[Array, "state"],
    controls: Float[Array, "time control"],
    duration_s: float | Float[Array, ""],
) -> Float[Array, "time+1 state"]:
    """The states of a sequence of controls, the first one included.

    Args:
        dynamics: The vehicle.
        state: Where it starts.
        controls: Each held for `duration_s`.
        duration_s: Of one control.
    """

    def body(current: Array, control: Array) -> tuple[Array, Array]:
        following = dynamics.step(current, control, duration_s)
        return following, following

    _, states = jax.lax.scan(body, state, controls)
    return jnp.concatenate([state[None], states])


def position_of(state: Float[Array, "*batch state"]) -> Float[Array, "*batch 3"]:
    """Position, metres: the first three numbers of every state."""
    return state[..., :3]


def _within_ball(vector: Float[Array, "3"], radius: float | Float[Array, ""]) -> Float[Array, "3"]:
    """The nearest vector no longer than a radius."""
    squared = jnp.sum(vector**2)
    outside = squared > radius**2
    # The root of what is inside would have no gradient at zero.
    return jnp.where(outside, vector * radius / jnp.sqrt(jnp.where(outside, squared, 1.0)), vector)


def _within_speed(velocity: Float[Array, "3"], speed: float, climb: float, descent: float) -> Float[Array, "3"]:
    """The nearest velocity in a ball cut by two planes."""
    up = jnp.clip(velocity[2], -descent, climb)
    cut = jnp.concatenate([velocity[:2], up[None]])
    in_ball = _within_ball(velocity, speed)
    # Where neither plane nor ball alone will do, the nearest point lies on the circle where they meet.
    rim = jnp.sqrt(jnp.maximum(speed**2 - up**2, 1e-12))
    on_rim = jnp.concatenate([_within_ball(jnp.append(velocity[:2], 0.0), rim)[:2], up[None]])
    ball_is_right = (in_ball[2] >= -descent) & (in_ball[2] <= climb)
    return jnp.where(jnp.sum(cut**2) <= speed**2, cut, jnp.where(ball_is_right, in_ball, on_rim))


def _positive(limits: Dynamics) -> None:
    """Refuse limits that are not positive."""
    for field in dataclasses.fields(limits):
        value = getattr(limits, field.name)
        if not (np.isfinite(value) and value > 0.0):
            raise ValueError(f"{field.name} must be positive and finite, got {value}")
