"""Proven bounds over a whole spline, not over samples of it.

Each cubic piece lies in the hull of its Bézier points, and each coordinate polynomial below its largest Bernstein
coefficient; halving a piece brings hull and curve together. So a maximum or a least distance is enclosed by halving
only what could still hold it (Lipschitz bisection; Piyavskii, 1972).

| symbol | identifier      | unit | meaning                                              |
|--------|-----------------|------|------------------------------------------------------|
| b_i    | `bezier_m`      | m    | Bézier points of a piece, shape (piece, 4, axis)     |
| R      | `radius`        | m    | max_i ‖b_i − x‖: no point of the piece is further from its middle x |
| d      | `distance`      | m    | any 1-Lipschitz function: d ≥ d(x) − R over the piece |
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from planner.trajectory import Trajectory

# Rows: Bézier points; columns: the four control points of a segment.
_BEZIER = np.array([[1.0, 4.0, 1.0, 0.0], [0.0, 4.0, 2.0, 0.0], [0.0, 2.0, 4.0, 0.0], [0.0, 1.0, 4.0, 1.0]]) / 6.0
# Sixty halvings are past the last digit of a double.
_MOST_HALVINGS = 60
# Dinkelbach's steps converge faster than linearly: a handful is usual.
_MOST_RATIOS = 50
_ROUNDING = 1e-12
# Pieces smaller than this are not halved further.
SMALLEST_RADIUS_M = 1e-5
# Evaluations spent on a sharper figure, and on deciding whether the need is met.
REPORT_EVALUATIONS = 20_000
DECISION_EVALUATIONS = 1_000_000


@dataclasses.dataclass(frozen=True)
class Extremum:
    """Where a piecewise polynomial is greatest.

    Attributes:
        value: The maximum.
        parameter: Piece index plus the place in the piece, 0 … 1.
    """

    value: float
    parameter: float


@dataclasses.dataclass(frozen=True)
class Least:
    """The least of a distance over a curve, enclosed.

    Attributes:
        lower: Proven: no point of the curve is below it.
        upper: The lowest value that was seen.
        parameter: Where it was seen: piece index plus the place in the piece.
    """

    lower: float
    upper: float
    parameter: float


def bezier_points(trajectory: Trajectory) -> Float[np.ndarray, "piece 4 3"]:
    """The pieces of a spline by their Bézier points, metres."""
    return _bezier(trajectory.control_points_m)


def heading_bezier_points(trajectory: Trajectory) -> Float[np.ndarray, "piece 4 1"] | None:
    """The same of a heading that is planned with the path, radians; None: it is not."""
    heading = trajectory.heading_control_rad
    return None if heading is None else _bezier(heading[:, None])


def _bezier(control: Float[np.ndarray, "control axis"]) -> Float[np.ndarray, "piece 4 axis"]:
    windows = np.lib.stride_tricks.sliding_window_view(control, 4, axis=0)
    return np.einsum("bc,pdc->pbd", _BEZIER, windows)


def derivative(bernstein: Float[np.ndarray, "piece order axis"], interval_s: float) -> np.ndarray:
    """Bernstein coefficients of the time derivative, one fewer a piece."""
    degree = bernstein.shape[1] - 1
    return np.diff(bernstein, axis=1) * (degree / interval_s)


def squared_norm(bernstein: Float[np.ndarray, "piece order axis"]) -> np.ndarray:
    """Bernstein coefficients of ‖·‖², shape (piece, 2·order − 1)."""
    return inner_product(bernstein, bernstein)


def inner_product(
    first: Float[np.ndarray, "piece order axis"], second: Float[np.ndarray, "piece other axis"]
) -> np.ndarray:
    """Bernstein coefficients of ⟨·, ·⟩, shape (piece, order + other − 1)."""
    m, n = first.shape[1] - 1, second.shape[1] - 1
    products = np.einsum("pia,pja->pij", first, second)
    result = np.zeros((len(first), m + n + 1))
    for i in range(m + 1):
        for j in range(n + 1):
            share = math.comb(m, i) * math.comb(n, j) / math.comb(m + n, i + j)
            result[:, i + j] += share * products[:, i, j]
    return result


def greatest_ratio(
    numerator: Float[np.ndarray, "piece order"], denominator: Float[np.ndarray, "piece order"]
) -> Extremum:
    """The greatest |p|/q of polynomials over their pieces, to rounding (Dinkelbach, 1967).

    p/q ≤ r is p − r·q ≤ 0, a polynomial; r rises to the ratio where that is greatest, and stops at the maximum.

    Args:
        numerator: Coefficients of p.
        denominator: Coefficients of q > 0, of the same degree.
    """
    best = Extremum(0.0, 0.0)
    for _ in range(_MOST_RATIOS):
        risen = best
        for sign in (1.0, -1.0):
            found = maximum(sign * numerator - best.value * denominator)
            if found.value > 0.0:
                value = sign * _value(numerator, found.parameter) / _value(denominator, found.parameter)
                risen = max(risen, Extremum(value, found.parameter), key=lambda one: one.value)
        if risen.value <= best.value * (1.0 + _ROUNDING):
            break
        best = risen
    return best


def _value(bernstein: Float[np.ndarray, "piece order"], parameter: float) -> float:
    """A piecewise polynomial at one place."""
    piece = min(int(parameter), len(bernstein) - 1)
    u, degree = parameter - piece, bernstein.shape[1] - 1
    basis = [math.comb(degree, i) * u**i * (1.0 - u) ** (degree - i) for i in range(degree + 1)]
    return float(np.dot(bernstein[piece], basis))


def maximum(bernstein: Float[np.ndarray, "piece order"]) -> Extremum:
    """The greatest value of polynomials over their pieces, to rounding.

    Args:
        bernstein: Coefficients of each piece.

    Returns:
        The maximum and where it is taken.
    """
    left, right = _halving(bernstein.shape[1])
    slack = _ROUNDING * float(np.abs(bernstein).max())
    ends = bernstein[:, [0, -1]]
    piece, side = np.unravel_index(int(np.argmax(ends)), ends.shape)
    best, best_at = float(ends[piece, side]), float(piece + side)
    low, width, active = np.arange(len(bernstein), dtype=float), 1.0, bernstein
    for _ in range(_MOST_HALVINGS):
        possible = active.max(axis=1) > best + slack
        if not possible.any():
            break
        active, low, width = active[possible], low[possible], width / 2.0
        first, second = active @ left.T, active @ right.T
        middle = int(np.argmax(first[:, -1]))
        if first[middle, -1] > best:
            best, best_at = float(first[middle, -1]), float(low[middle] + width)
        active, low = np.concatenate([first, second]), np.concatenate([low, low + width])
    return Extremum(best, best_at)


def least_along(
    bezier_m: Float[np.ndarray, "piece 4 axis"],
    distance: Callable[[Float[np.ndarray, "point axis"]], Float[np.ndarray, "point"]],
    needed: float,
    resolution: float,
) -> Least:
    """The least of a 1-Lipschitz distance along a curve, and whether it is nowhere below what is needed.

    Pieces are halved until the whole curve is proven to keep the need, or a point that breaks it is found; beyond that
    until the least is known to the resolution, as far as `REPORT_EVALUATIONS` go.

    Args:
        bezier_m: The curve's pieces.
        distance: A lower bound of a 1-Lipschitz function, for points of shape (point, axis).
        needed: What the distance should not fall below.
        resolution: How closely the least should be enclosed, where the need is met or clearly broken.

    Returns:
        Enclosure of the least. `lower` is at least `needed` exactly where the curve is proven to keep it.
    """
    left, right = _halving(4)
    middle = np.array([1.0, 3.0, 3.0, 1.0]) / 8.0
    active, low, width = bezier_m, np.arange(len(bezier_m), dtype=float), 1.0
    inherited = np.full(len(active), -np.inf)
    proven, upper, parameter, evaluations = np.inf, np.inf, 0.0, 0
    while True:
        centers = np.einsum("b,pba->pa", middle, active)
        radius = np.sqrt(np.max(np.sum((active - centers[:, None]) ** 2, axis=2), axis=1))
        values = distance(centers)
        evaluations += len(values)
        lowest = int(np.argmin(values))
        if values[lowest] < upper:
            upper, parameter = float(values[lowest]), float(low[lowest] + width / 2.0)
        lower = np.maximum(values - radius, inherited)
        wanted = upper - resolution
        if upper >= needed:
            wanted = max(wanted, needed) if evaluations < REPORT_EVALUATIONS else needed
        elif evaluations > REPORT_EVALUATIONS:
            wanted = -np.inf
        open_still = (lower < wanted) & (radius > SMALLEST_RADIUS_M)
        if evaluations > DECISION_EVALUATIONS:
            open_still[:] = False
        proven = min(proven, float(lower[~open_still].min(initial=np.inf)))
        if not open_still.any():
            return Least(min(proven, upper), upper, parameter)
        active, low, inherited = active[open_still], low[open_still], lower[open_still]
        width /= 2.0
        active = np.concatenate([np.einsum("cb,pba->pca", half, active) for half in (left, right)])
        low, inherited = np.concatenate([low, low + width]), np.tile(inherited, 2)


def length_bound(bezier_m: Float[np.ndarray, "piece 4 axis"], resolution: float) -> float:
    """What no curve is longer than: the polygon of its Bézier points.

    Pieces are halved until polygon and chord, which no curve is shorter than, are together; also where the curve stands
    and turns back.

    Args:
        bezier_m: The curve's pieces.
        resolution: By what share of the length the bound may be too long.
    """
    left, right = _halving(4)
    # Pieces side by side: over a last axis of three, sums and products take ten times as long.
    active, width, settled_m = np.moveaxis(bezier_m, 0, -1), 1.0, 0.0
    allowed_m = resolution * float(_polygons(active).sum()) / len(bezier_m)
    # What rounding leaves between the two of a curve that stands does not get less by halving.
    rounding_m = 16.0 * float(np.finfo(float).eps * np.abs(bezier_m).max())
    for _ in range(_MOST_HALVINGS):
        polygon = _polygons(active)
        chord = np.linalg.norm(active[-1] - active[0], axis=0)
        open_still = polygon - chord > allowed_m * width + rounding_m
        settled_m += float(polygon[~open_still].sum())
        if not open_still.any():
            return settled_m
        active, width = active[..., open_still], width / 2.0
        active = np.concatenate([np.tensordot(half, active, axes=1) for half in (left, right)], axis=-1)
    return settled_m + float(_polygons(active).sum())


def _polygons(bezier_m: Float[np.ndarray, "4 axis piece"]) -> Float[np.ndarray, "piece"]:
    """Lengths of the polygons of Bézier points."""
    return np.linalg.norm(np.diff(bezier_m, axis=0), axis=1).sum(axis=0)


def _halving(order: int) -> tuple[np.ndarray, np.ndarray]:
    """Matrices from Bernstein coefficients to those of the left and the right half (de Casteljau)."""
    left = np.array([[math.comb(i, j) / 2.0**i for j in range(order)] for i in range(order)])
    return left, left[::-1, ::-1]
