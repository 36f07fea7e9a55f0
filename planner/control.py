"""Receding-horizon control by Stein variational inference on controls (SVES Alg. 2).

At every step: remember where the vehicle is, shift all candidates by one control, part those that coincide, move them
by Stein steps on p(u|O) ∝ p(u) exp(−λL(u)) through the vehicle's dynamics, and apply the first control of the best.

| symbol  | identifier              | unit | shape                 |
|---------|-------------------------|------|-----------------------|
| u       | `particles`             | cube | particle time control |
| x       | `rollout(…)`            | m, … | time+1 state          |
| L       | `cost`                  | 1    | particle              |
| λ       | `inverse_temperature`   | 1    |                       |
| Σ F_k   | `basis_sum`             | 1    | k0 k1 k2              |

Controls live in a cube: 0 is the least and 1 the most of each control, so that all count alike in the kernel.

Departures from the paper:

1. Memory is the sum of F_k over the flown time; the horizon's sum is added and the whole divided once by the time.
   Every `ControlMetric` remembers so, in a basis of its own that does not grow with the flight: the spectral metric in
   its cosines, the kernel metric in the splines that its density is made of.
2. L = E/E_ref + penalties, E_ref the least E of the set before the step: with memory E falls with the time flown, and
   the likelihood would fade against the prior.
3. Attraction is each candidate's own score, at unit length; only the repulsion goes through the kernel, and fades
   (`Transport.OWN_SCORE`: the particle form of a Wasserstein gradient flow, which has the same fixed points in the
   limit). With the paper's φ candidates take each other's scores, and through dynamics the score of a candidate that
   hits an obstacle or turns the other way is no advice to its neighbour.
4. The control applied belongs to the candidate that stays clear of obstacles and inside the box for longest, and among
   those to the cheapest. A candidate that stays clear for less time after the Stein steps takes them back, so the
   present plan is always at hand.
"""

from __future__ import annotations

import enum
from typing import Protocol, Self

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from planner import stein
from planner.accelerator import with_exact_products
from planner.dynamics import Dynamics, position_of, rollout
from planner.kernels import kernel_terms
from planner.obstacles import ObstacleField
from planner.priors import Prior
from planner.problem import Kernel
from planner.single_precision import single
from planner.workspace import Workspace

PENALTY_YARD = 0.01
"""A violation of this share of the longest axis costs one, at each sample."""

REPULSION = 0.3
"""Of the most repelled candidate, against a score of one."""

# Of the cube of controls, in one step: a receding horizon has few steps before each control, and starts from an answer.
LONGEST_STEP = 0.2
SHORTEST_STEP = 0.002
LONGEST_STEIN_STEP = 0.02
SHORTEST_STEIN_STEP = 0.001

SMALLEST_METRIC = 1e-7


class Transport(enum.Enum):
    """How candidates move: along their own scores and apart, or by the paper's φ."""

    OWN_SCORE = "own score"
    STEIN = "stein"


class ControlMetric(Protocol):
    """What a control task needs of a metric; `SpectralMetric` and the `KernelMetric` of places have it.

    Attributes:
        covered_share: Share of the past in the whole time.
    """

    covered_share: Float[Array, ""]

    def __call__(self, position_unit: Float[Array, "time 3"], time_weight: Float[Array, "time"]) -> Float[Array, ""]:
        """E of a path, with what is remembered."""
        ...

    def basis(self, position_unit: Float[Array, "3"]) -> Float[Array, "k0 k1 k2"]:
        """F_k at a place: what a moment there adds to the memory."""
        ...

    def with_covered(self, mean_basis: Float[Array, "k0 k1 k2"], share: Float[Array, ""]) -> Self:
        """The metric that remembers: the mean of `basis` over the past, and the past's share of the whole time."""
        ...


class ControlTask(eqx.Module):
    """What is to be explored, by which vehicle; all but the last four may change in flight without compiling anew.

    Attributes:
        metric: Of the information, without a memory of its own. One that takes its place in flight has as many basis
            functions: the same modes, or about the same variance.
        origin_m: Lower corner of the box.
        lengths_m: Its lengths.
        obstacles: What to stay away from.
        keep_out_m: Least distance from the vehicle's centre.
        prior: Of the controls, scaled to −1 … 1.
        inverse_temperature: λ.
        control_s: Time each control is held.
        dynamics: The vehicle.
        kernel: How candidates repel each other.
        iterations: Steps of the candidates in each control step.
        transport: What a step is.
    """

    metric: ControlMetric
    origin_m: Float[Array, "3"]
    lengths_m: Float[Array, "3"]
    obstacles: ObstacleField
    keep_out_m: Float[Array, ""]
    prior: Prior
    inverse_temperature: Float[Array, ""]
    control_s: Float[Array, ""]
    dynamics: Dynamics = eqx.field(static=True)
    kernel: Kernel = eqx.field(static=True)
    iterations: int = eqx.field(static=True)
    transport: Transport = eqx.field(static=True)

    @classmethod
    def of(
        cls,
        workspace: Workspace,
        metric: ControlMetric,
        dynamics: Dynamics,
        prior: Prior,
        *,
        obstacles: ObstacleField,
        keep_out_m: float = 0.0,
        control_s: float = 0.1,
        inverse_temperature: float = 100.0,
        kernel: Kernel = Kernel.RBF,
        iterations: int = 20,
        transport: Transport = Transport.OWN_SCORE,
    ) -> ControlTask:
        """The task as arrays.

        Raises:
            ValueError: A control that is held for no time, no step of the candidates, or a metric that remembers
                something already or cannot remember (one of poses).
        """
        if not control_s > 0.0 or iterations < 1:
            raise ValueError(f"control_s must be positive and iterations at least 1, got {control_s}, {iterations}")
        if float(metric.covered_share) > 0.0:
            raise ValueError("a control task remembers by itself: give the metric without what was covered")
        jax.eval_shape(metric.basis, jnp.zeros(3))
        arrays = (metric, workspace.box_min_m, workspace.lengths_m, obstacles, keep_out_m, prior)
        leaves = jax.tree.map(single, (*arrays, inverse_temperature, control_s))
        return cls(*leaves, dynamics=dynamics, kernel=kernel, iterations=iterations, transport=transport)

    def controls(self, cube: Float[Array, "time control"]) -> Float[Array, "time control"]:
        """From the cube to the vehicle's units."""
        low, high = self.dynamics.control_low, self.dynamics.control_high
        return jnp.asarray(low, cube.dtype) + cube * jnp.asarray(high - low, cube.dtype)

    def positions_m(
        self, vehicle: Float[Array, "state"], cube: Float[Array, "time control"]
    ) -> Float[Array, "time+1 3"]:
        """Where a sequence of controls leads, the present place first."""
        return position_of(rollout(self.dynamics, vehicle, self.controls(cube), self.control_s))


class ControlState(eqx.Module):
    """What the next control step needs.

    Attributes:
        particles: Candidates, in the cube.
        basis_sum: Σ F_k over the moments flown (`ControlMetric.basis`).
        moments: How many they are.
    """

    particles: Float[Array, "particle time control"]
    basis_sum: Float[Array, "k0 k1 k2"]
    moments: Int[Array, ""]


class Assessment(eqx.Module):
    """What a candidate is worth (in `ControlInfo` with a leading axis of candidates).

    Attributes:
        cost: L, without the prior.
        ergodic_metric: E of the flown path with its horizon.
        clear_moments: Moments from now until it comes too near to an obstacle or leaves the box; the horizon if never.
        positions_m: Where it leads, the present place first.
    """

    cost: Float[Array, ""]
    ergodic_metric: Float[Array, ""]
    clear_moments: Int[Array, ""]
    positions_m: Float[Array, "time+1 3"]


class ControlInfo(eqx.Module):
    """What the caller may look at.

    Attributes:
        control: To apply now, vehicle's units.
        selected: Index of the candidate it belongs to.
        safe: Whether that candidate is clear over its whole horizon.
        candidates: All of them.
    """

    control: Float[Array, "control"]
    selected: Int[Array, ""]
    safe: Bool[Array, ""]
    candidates: Assessment


def init(task: ControlTask, key: Array, particles: int, horizon: int) -> ControlState:
    """Start with candidates drawn from the prior and nothing covered.

    Args:
        task: The task.
        key: Of the random numbers.
        particles: How many candidates.
        horizon: How many controls each has.
    """
    shape = (horizon, len(task.dynamics.control_low))
    drawn = jax.vmap(lambda one: task.prior.sample(one, shape))(jax.random.split(key, particles))
    cube = jnp.clip(0.5 + 0.5 * drawn, 0.0, 1.0).astype(jnp.float32)
    nothing = jnp.zeros_like(task.metric.basis(jnp.zeros(3)))
    return ControlState(cube, nothing, jnp.zeros((), jnp.int32))


@eqx.filter_jit
@with_exact_products
def step(
    task: ControlTask, state: ControlState, vehicle: Float[Array, "state"], key: Array
) -> tuple[ControlState, ControlInfo]:
    """One control step.

    Args:
        task: What to explore now.
        state: From the last step, or `init`.
        vehicle: The vehicle's state as measured.
        key: Of the random numbers; another at each step.

    Returns:
        The state for the next step, and what to apply.

    Raises:
        ValueError: A metric with another number of basis functions than the flight so far.
    """
    horizon = state.particles.shape[1]
    here = task.metric.basis(_unit(task, position_of(vehicle)))
    if here.shape != state.basis_sum.shape:
        raise ValueError(
            f"the flight remembers {state.basis_sum.shape} basis functions and the metric has {here.shape}: keep the "
            "modes of a spectral metric in flight, and the variance of a kernel metric"
        )
    flown, moments = state.basis_sum + here, state.moments + 1
    metric = with_memory(task.metric, flown, moments, horizon)
    started = jnp.where(state.moments > 0, shifted(state.particles), state.particles)
    before = jnp.clip(stein.separated(started, key), 0.0, 1.0)
    reference = jnp.maximum(jnp.min(_metrics(task, metric, vehicle, before)), SMALLEST_METRIC)

    def log_posterior(cube: Float[Array, "time control"]) -> Float[Array, ""]:
        cost = _assess(task, metric, vehicle, reference, cube).cost
        return task.prior.log_density(2.0 * cube - 1.0) - task.inverse_temperature * cost

    smooth = jnp.asarray(stein.smoother(horizon))
    annealing = stein.Annealing(task.iterations, LONGEST_STEIN_STEP, SHORTEST_STEIN_STEP)

    def body(inner: stein.State, _: None) -> tuple[stein.State, None]:
        score = jax.vmap(jax.grad(log_posterior))(inner.particles)
        match task.transport:
            case Transport.STEIN:
                return stein.step(inner, score, task.kernel, smooth, annealing), None
            case Transport.OWN_SCORE:
                return own_score_step(inner, score, task.kernel, smooth, task.iterations), None

    inner, _ = jax.lax.scan(body, stein.init(before), None, length=task.iterations)

    def assess(cubes: Array) -> Assessment:
        return jax.vmap(lambda cube: _assess(task, metric, vehicle, reference, cube))(cubes)

    known, fresh = assess(before), assess(inner.particles)
    taken_back = fresh.clear_moments < known.clear_moments
    particles = jnp.where(taken_back[:, None, None], before, inner.particles)
    final: Assessment = jax.tree.map(
        lambda old, new: jnp.where(taken_back.reshape(-1, *[1] * (new.ndim - 1)), old, new), known, fresh
    )
    longest = jnp.max(final.clear_moments)
    ranked = (final.clear_moments == longest) & jnp.isfinite(final.cost)
    selected = jnp.argmin(jnp.where(ranked, final.cost, jnp.inf))
    info = ControlInfo(
        control=task.controls(particles[selected])[0], selected=selected, safe=longest == horizon, candidates=final
    )
    return ControlState(particles, flown, moments), info


def own_score_step(
    state: stein.State,
    score: Float[Array, "particle time control"],
    kernel: Kernel,
    smooth: Float[Array, "time time"],
    steps: int,
) -> stein.State:
    """One annealed step of `steps`: own scores at unit length, repulsion that fades, momentum as in `planner.stein`."""
    annealing = stein.Annealing(steps, LONGEST_STEP, SHORTEST_STEP)
    _, repulsion = kernel_terms(kernel, state.particles)
    pull = score / jnp.maximum(_norms(score), 1e-20)
    away = repulsion / jnp.maximum(jnp.max(_norms(repulsion)), 1e-12)
    along = pull + REPULSION * stein.fading(annealing.progress(state.index)) * away
    return stein.moved(state, along, smooth, annealing)


def with_memory(
    metric: ControlMetric, basis_sum: Float[Array, "k0 k1 k2"], moments: Int[Array, ""], horizon: int
) -> ControlMetric:
    """The metric of what was flown, the present moment included, and a horizon: one sum, divided once."""
    count = moments.astype(basis_sum.dtype)
    return metric.with_covered(basis_sum / count, count / (count + horizon))


def shifted(particles: Float[Array, "particle time control"]) -> Float[Array, "particle time control"]:
    """All candidates one control later; the last control is repeated."""
    return jnp.concatenate([particles[:, 1:], particles[:, -1:]], axis=1)


def _unit(task: ControlTask, position_m: Float[Array, "*batch 3"]) -> Float[Array, "*batch 3"]:
    return (position_m - task.origin_m) / task.lengths_m


def _energy(task: ControlTask, metric: ControlMetric, positions_m: Float[Array, "time+1 3"]) -> Float[Array, ""]:
    """E of the flown path with a horizon (the present place belongs to what was flown)."""
    ahead = positions_m[1:]
    return metric(_unit(task, ahead), jnp.full(ahead.shape[0], 1.0 / ahead.shape[0], ahead.dtype))


def _metrics(
    task: ControlTask,
    metric: ControlMetric,
    vehicle: Float[Array, "state"],
    cubes: Float[Array, "particle time control"],
) -> Float[Array, "particle"]:
    return jax.vmap(lambda cube: _energy(task, metric, task.positions_m(vehicle, cube)))(cubes)


def _assess(
    task: ControlTask,
    metric: ControlMetric,
    vehicle: Float[Array, "state"],
    reference: Float[Array, ""],
    cube: Float[Array, "time control"],
) -> Assessment:
    positions = task.positions_m(vehicle, cube)
    ahead = positions[1:]
    energy = _energy(task, metric, positions)
    near = jnp.maximum(0.0, task.keep_out_m - task.obstacles.distance(ahead))
    beyond = jnp.maximum(0.0, jnp.maximum(task.origin_m - ahead, ahead - task.origin_m - task.lengths_m))
    yard = PENALTY_YARD * jnp.max(task.lengths_m)
    penalty = (jnp.sum(near**2) + jnp.sum(beyond**2)) / yard**2
    clear = (near <= 0.0) & (jnp.max(beyond, axis=-1) <= 0.0)
    return Assessment(
        cost=energy / reference + penalty,
        ergodic_metric=energy,
        clear_moments=jnp.sum(jnp.cumprod(clear.astype(jnp.int32))),
        positions_m=positions,
    )


def _norms(vectors: Float[Array, "particle time control"]) -> Float[Array, "particle 1 1"]:
    return jnp.sqrt(jnp.sum(vectors**2, axis=(1, 2), keepdims=True))
