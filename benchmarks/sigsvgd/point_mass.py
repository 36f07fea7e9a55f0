"""A point mass among a grid of pillars, and its receding-horizon controllers: Stein steps on controls, and MPPI.

| symbol | identifier     | unit     | shape                  |
|--------|----------------|----------|------------------------|
| u      | `policies`     | N        | particle time axis     |
| x      | `state`        | m, m/s   | 6                      |
| C      | `costs()`      | 1        |                        |
| Σ      | `SIGMA_N`²     | N²       |                        |

The score needs no gradient of the cost: ∇log p(u) ≈ Σ_s w_s (u_s − u)/Σ over samples u_s ~ N(u, Σ) with
w = softmax(−C), and the gradient of the prior, the mixture of N(u_j, Σ) around the policies of the last control step.
"""

from __future__ import annotations

import dataclasses
import functools

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Bool, Float

from benchmarks.sigsvgd.transport import Contender, PathOf, direction
from planner import control
from planner.dynamics import DoubleIntegrator, position_of, rollout

START, TARGET = np.array([-1.8, -1.8, 0.0]), np.array([1.8, 1.8, 0.0])
BEGIN, GOAL = np.append(START, np.zeros(3)), np.append(TARGET, np.zeros(3))
"""States at rest."""
EDGE_M, WALL_M = 4.0, 0.02
CENTERS_M, WIDTH_M = (-1.5, -0.5, 0.5, 1.5), 0.6
"""Of the pillars along either axis: a grid of 4 × 4 with gaps of 0.4 m."""
TOUCHES_M = 1e-4
"""The start is a corner of an obstacle: rounding must not make it a collision."""

MASS_KG, CONTROL_S, HORIZON, STEPS = 2.0, 0.015, 30, 300
SIGMA_N, POLICIES, SAMPLES, ITERATIONS, RATE_N = 5.0, 30, 10, 2, 1.0
FIRST_POLICIES_N = 10.0
COLLISION = 1e6
PLACE, SPEED, CONTROL, LAST_PLACE, LAST_SPEED = 0.5, 0.25, 0.2, 1e3, 0.1
REACHED = 1.0
SEEN_EVERY = 3
"""A kernel between paths sees every third place of the horizon."""
BANDWIDTH_M2 = float(np.sqrt(32.0))
"""h of the paper's static kernel exp(−‖·‖²/h)."""
# Far above what is asked for: places stay linear in the controls.
VEHICLE = DoubleIntegrator(1e4)


def hit(positions_m: Float[Array, "*batch 3"]) -> Bool[Array, "*batch"]:
    """Whether a place is in a pillar or in the wall around."""
    horizontal = positions_m[..., :2, None]
    among = jnp.any(jnp.abs(horizontal - jnp.asarray(CENTERS_M)) < 0.5 * WIDTH_M - TOUCHES_M, axis=-1)
    outside = jnp.any(jnp.abs(positions_m[..., :2]) > 0.5 * EDGE_M - WALL_M, axis=-1)
    return jnp.all(among, axis=-1) | outside


def states_of(state: Float[Array, "6"], controls_n: Float[Array, "time 2"]) -> Float[Array, "time+1 6"]:
    """Where controls lead."""
    return rollout(VEHICLE, state, jnp.pad(controls_n, ((0, 0), (0, 1))) / MASS_KG, CONTROL_S)


def running_cost(states: Float[Array, "*batch 6"]) -> Float[Array, "*batch"]:
    """Distance, speed and collision, without the control's part."""
    away = states - jnp.asarray(GOAL, states.dtype)
    place, speed = jnp.sum(away[..., :3] ** 2, axis=-1), jnp.sum(away[..., 3:] ** 2, axis=-1)
    return PLACE * place + SPEED * speed + COLLISION * hit(position_of(states))


def cost(state: Float[Array, "6"], controls_n: Float[Array, "time 2"]) -> Float[Array, ""]:
    """C of a sequence of controls."""
    states = states_of(state, controls_n)
    away = states[-1] - jnp.asarray(GOAL, states.dtype)
    last = LAST_PLACE * jnp.sum(away[:3] ** 2) + LAST_SPEED * jnp.sum(away[3:] ** 2)
    collided = COLLISION * hit(position_of(states[-1:]))[0]
    return jnp.sum(running_cost(states[:-1])) + CONTROL * jnp.sum(controls_n**2) + last + collided


def to_path() -> Float[Array, "seen time"]:
    """The places (in edges) that a kernel sees, as a matrix on the controls."""
    one_axis = jax.jacobian(lambda u: position_of(states_of(jnp.zeros(6), u))[::SEEN_EVERY, 0])(jnp.zeros((HORIZON, 2)))
    return one_axis[..., 0] / EDGE_M


@dataclasses.dataclass(frozen=True)
class Episode:
    """How an episode went; it is over with the first collision, or near the target.

    Attributes:
        states: After each control, shape (step, 6).
        costs: Running cost of each, shape (step,).
    """

    states: Float[np.ndarray, "step 6"]
    costs: Float[np.ndarray, "step"]

    @property
    def collided_at(self) -> int:
        """Index of the first state in a pillar or wall; `STEPS`: none."""
        return _first(self.costs >= COLLISION)

    @property
    def reached_at(self) -> int:
        """Index of the first state (place and speed) within `REACHED` of the target; `STEPS`: none."""
        return _first(np.linalg.norm(self.states - GOAL, axis=-1) <= REACHED)

    @property
    def succeeded(self) -> bool:
        """Whether the target was reached without a collision."""
        return self.reached_at < self.collided_at

    @property
    def steps(self) -> int:
        """Controls until it was over."""
        return min(self.reached_at + 1, self.collided_at + 1, STEPS)

    @property
    def total_cost(self) -> float:
        """Running costs until it was over."""
        return float(self.costs[: self.steps].sum())


def _first(happened: Bool[np.ndarray, "step"]) -> int:
    return int(np.argmax(happened)) if happened.any() else STEPS


Flown = tuple[Float[Array, "step 6"], Float[Array, "step"]]


def stein_episode(contender: Contender, key: Array) -> Flown:
    """States and running costs of an episode of Stein control."""
    adam = optax.adam(RATE_N)
    path_of = PathOf(to_path(), BANDWIDTH_M2 / EDGE_M**2)
    first, key = jax.random.split(key)
    policies = jax.random.uniform(first, (POLICIES, HORIZON, 2), minval=-FIRST_POLICIES_N, maxval=FIRST_POLICIES_N)

    def log_prior(middles: Array, policy: Array) -> Array:
        return jax.nn.logsumexp(-0.5 * jnp.sum((policy - middles) ** 2, axis=(1, 2)) / SIGMA_N**2)

    def control_step(carry: tuple, key: Array) -> tuple[tuple, Flown]:
        state, before, memory = carry
        drift = position_of(states_of(state, jnp.zeros((HORIZON, 2))))[::SEEN_EVERY, :2] / EDGE_M
        prior_score = jax.vmap(jax.grad(functools.partial(log_prior, before)))

        def iterate(inner: tuple, key: Array) -> tuple[tuple, Array]:
            policies, memory = inner
            noise = SIGMA_N * jax.random.normal(key, (SAMPLES, *policies.shape))
            costs = jax.vmap(jax.vmap(functools.partial(cost, state)))(policies + noise)
            likelihood_score = jnp.einsum("sn,snta->nta", jax.nn.softmax(-costs, axis=0), noise) / SIGMA_N**2
            score = likelihood_score + prior_score(policies)
            phi = direction(contender, policies, score, 1.0, path_of, drift)
            updates, memory = adam.update(-phi, memory)
            return (policies + updates, memory), jnp.mean(costs, axis=0)

        (policies, memory), costs = jax.lax.scan(iterate, (before, memory), jax.random.split(key, ITERATIONS))
        after = states_of(state, policies[jnp.argmin(costs[-1]), :1])[1]
        return (after, control.shifted(policies), memory), (after, running_cost(after))

    carry = (jnp.asarray(BEGIN, jnp.float32), policies, adam.init(policies))
    return jax.lax.scan(control_step, carry, jax.random.split(key, STEPS))[1]


def mppi_episode(key: Array) -> Flown:
    """States and running costs of an episode of plain MPPI with as many rollouts."""

    def control_step(carry: tuple, key: Array) -> tuple[tuple, Flown]:
        state, policy = carry

        def iterate(policy: Array, key: Array) -> tuple[Array, None]:
            noise = SIGMA_N * jax.random.normal(key, (POLICIES * SAMPLES, *policy.shape))
            costs = jax.vmap(functools.partial(cost, state))(policy + noise)
            return policy + jnp.einsum("s,sta->ta", jax.nn.softmax(-costs), noise), None

        policy, _ = jax.lax.scan(iterate, policy, jax.random.split(key, ITERATIONS))
        after = states_of(state, policy[:1])[1]
        return (after, control.shifted(policy[None])[0]), (after, running_cost(after))

    carry = (jnp.asarray(BEGIN, jnp.float32), jnp.zeros((HORIZON, 2)))
    return jax.lax.scan(control_step, carry, jax.random.split(key, STEPS))[1]
