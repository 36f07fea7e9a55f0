"""How different the candidates of a set are.

| symbol  | identifier                 | unit | shape             |
|---------|----------------------------|------|-------------------|
| d_ij    | `rms_distances()`          | unit | particle particle |
| F_ij    | `frechet_distances()`      | unit | particle particle |
| h       | `TIME_BANDWIDTH_UNIT2`     | unit²|                   |
| h_F     | `FRECHET_BANDWIDTH_UNIT2`  | unit²|                   |
| K, K_F  | exp(−d²/h), exp(−F²/h_F)   | 1    | particle particle |

All distances are taken in the unit cube. d compares two paths moment by moment, F (the discrete Fréchet distance) place
by place in order of travel, so that the same route at another pace counts as the same plan. Bandwidths are fixed, or
sets could not be compared with each other.
"""

from __future__ import annotations

import dataclasses

import numpy as np
from jaxtyping import Float

TIME_BANDWIDTH_UNIT2 = 0.05
"""h: paths that cover a square independently of each other (d² = 1/3) are alike to a thousandth, and det K of twenty of
them is 0.999. With 0.1 no twenty paths that cover it evenly could exceed 0.88, however different."""

FRECHET_BANDWIDTH_UNIT2 = 0.1
"""h_F: at a distance of 0.32 of the cube's edge two paths are alike to 1/e."""

MOST_FRECHET_SAMPLES = 128
"""Paths are thinned to this many samples for the Fréchet distance, whose cost is quadratic in them."""

MANY_PATHS = 64
"""With more paths than this, pairs are many: half of the samples have to do."""

PAIRS_AT_ONCE = 256
"""So many tables stay in the processor's cache: a tenth of the time of all pairs at once."""


@dataclasses.dataclass(frozen=True)
class Diversity:
    """How different the paths of a set are; a set of one has none (zeros, and one distinct plan).

    Attributes:
        determinant: det K, 0 (two paths coincide) … 1 (all far apart); SVES fig. 3. Saturates at either end.
        mean_pair_distance: Mean over the pairs of the root mean square over time of their distance, unit cube.
        frechet: −log(1 − det K_F), 0 … 36: what of det K_F the saturation at one hides.
        effective_plans: exp(−Σ λ_i log λ_i) over the eigenvalues λ_i of K_F/N, 1 … N: how many wholly different plans
            the set is worth (the Vendi score of Friedman & Dieng, 2023).
    """

    determinant: float
    mean_pair_distance: float
    frechet: float
    effective_plans: float


def diversity(paths_unit: Float[np.ndarray, "particle time 3"]) -> Diversity:
    """Measure a set of paths.

    Args:
        paths_unit: Shape (particle, time, 3): the paths at the same moments, unit cube.

    Returns:
        The measures; all finite.

    Raises:
        ValueError: Not an array of paths, or one that is not finite.
    """
    paths = np.asarray(paths_unit, dtype=float)
    if paths.ndim != 3 or 0 in paths.shape:
        raise ValueError(f"diversity needs paths of shape (particle, time, 3), got {paths.shape}")
    if not np.isfinite(paths).all():
        raise ValueError("diversity needs finite paths: leave out the candidates that diverged")
    count = len(paths)
    if count == 1:
        return Diversity(determinant=0.0, mean_pair_distance=0.0, frechet=0.0, effective_plans=1.0)
    distances = rms_distances(paths)
    in_time = eigenvalues(distances, TIME_BANDWIDTH_UNIT2)
    in_place = eigenvalues(frechet_distances(paths), FRECHET_BANDWIDTH_UNIT2)
    # 1 − det without the cancellation near one; det = 1 to the last digit gives −log ε.
    missing = -np.expm1(np.log(in_place).sum()) if (in_place > 0.0).all() else 1.0
    share = in_place[in_place > 0.0] / in_place.sum()
    return Diversity(
        determinant=float(in_time.prod()),
        mean_pair_distance=float(distances.sum() / (count * (count - 1))),
        frechet=float(max(0.0, -np.log(max(missing, np.finfo(float).eps)))),
        effective_plans=float(np.exp(-(share * np.log(share)).sum())),
    )


def rms_distances(paths_unit: Float[np.ndarray, "particle time 3"]) -> Float[np.ndarray, "particle particle"]:
    """Root mean square over time of the distance of every two paths."""
    return np.stack([np.sqrt(np.mean(np.sum((paths_unit - path) ** 2, axis=-1), axis=-1)) for path in paths_unit])


def frechet_distances(paths_unit: Float[np.ndarray, "particle time 3"]) -> Float[np.ndarray, "particle particle"]:
    """Discrete Fréchet distance of every two paths (Eiter & Mannila, 1994), by anti-diagonals for all pairs at once."""
    most = MOST_FRECHET_SAMPLES if len(paths_unit) <= MANY_PATHS else MOST_FRECHET_SAMPLES // 2
    samples = min(paths_unit.shape[1], most)
    thinned = paths_unit[:, np.round(np.linspace(0, paths_unit.shape[1] - 1, samples)).astype(int)]
    by_axis = np.ascontiguousarray(thinned.transpose(2, 1, 0))
    count = len(paths_unit)
    firsts, seconds = np.triu_indices(count, k=1)
    distances = np.zeros((count, count))
    for begin in range(0, len(firsts), PAIRS_AT_ONCE):
        first, second = firsts[begin : begin + PAIRS_AT_ONCE], seconds[begin : begin + PAIRS_AT_ONCE]
        found = _frechet(by_axis[:, :, first], by_axis[:, :, second])
        distances[first, second] = distances[second, first] = found
    return distances


def eigenvalues(
    distances: Float[np.ndarray, "particle particle"], bandwidth_unit2: float
) -> Float[np.ndarray, "particle"]:
    """Eigenvalues of exp(−d²/h), at least zero: on the Fréchet distance the kernel need not be positive definite.

    Args:
        distances: d_ij, unit cube.
        bandwidth_unit2: h.
    """
    return np.maximum(np.linalg.eigvalsh(np.exp(-(distances**2) / bandwidth_unit2)), 0.0)


def _frechet(
    first: Float[np.ndarray, "3 sample pair"], second: Float[np.ndarray, "3 sample pair"]
) -> Float[np.ndarray, "pair"]:
    """Fréchet distance of each pair."""
    samples, pairs = first.shape[1:]
    # Diagonal s holds the cells (i, s − i), so one of the two runs backwards along it.
    backwards = second[:, ::-1]
    # A border of infinities stands for what lies outside the table.
    before_last = np.full((samples + 1, pairs), np.inf)
    last = before_last.copy()
    last[1] = np.sum((first[:, 0] - second[:, 0]) ** 2, axis=0)
    for diagonal in range(1, 2 * samples - 1):
        low, high = max(0, diagonal - samples + 1), min(diagonal, samples - 1) + 1
        shift = samples - 1 - diagonal
        gap2 = np.sum((first[:, low:high] - backwards[:, low + shift : high + shift]) ** 2, axis=0)
        reached = np.minimum(np.minimum(last[low:high], last[low + 1 : high + 1]), before_last[low:high])
        current = np.full_like(last, np.inf)
        current[low + 1 : high + 1] = np.maximum(gap2, reached)
        before_last, last = last, current
    return np.sqrt(last[samples])
