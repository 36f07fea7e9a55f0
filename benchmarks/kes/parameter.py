"""The kernel's width by eq. (30): what it becomes with more samples, and whether the metric can be trusted then.

Taken: a mixture of three normal densities on the unit square (that of the authors' public tutorial), N samples drawn
from it, medians over seeds. Bias is what blurring p by the kernel changes, ‖p ∗ g − p‖/‖p‖. Consistency asks that width
and bias go to zero, and that E does for other samples of p and not for samples of something else.

python -m benchmarks.kes.parameter
"""

from __future__ import annotations

import dataclasses

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.claims import print_claims
from benchmarks.kes.report import save
from planner.kernel_metric import PARAMETER_SAMPLES
from planner.kernel_variance import select_variance

COUNTS = (32, 64, 128, 256, 512, 1024)
SEEDS = 5


@dataclasses.dataclass(frozen=True)
class Mixture:
    """Normal densities.

    Attributes:
        weight: Shape (part,), sums to one.
        mean: Shape (part, axis).
        covariance: Shape (part, axis, axis).
    """

    weight: np.ndarray
    mean: np.ndarray
    covariance: np.ndarray

    def blurred(self, variance: np.ndarray) -> Mixture:
        """Convolved with a normal density."""
        return dataclasses.replace(self, covariance=self.covariance + np.diag(variance))

    def density(self, points: np.ndarray) -> np.ndarray:
        """Shape (point,)."""
        return self._parts(points).sum(axis=1)

    def slope(self, points: np.ndarray) -> np.ndarray:
        """Gradient of the density, shape (point, axis)."""
        toward = np.einsum("pij,npj->npi", np.linalg.inv(self.covariance), self.mean - points[:, None])
        return np.einsum("np,npi->ni", self._parts(points), toward)

    def overlap(self, other: Mixture) -> float:
        """Integral of the product with another mixture."""
        pairs = zip(self.weight, self.mean, self.covariance, strict=True)
        return float(
            sum(
                weight * dataclasses.replace(other, covariance=other.covariance + own).density(mean[None])[0]
                for weight, mean, own in pairs
            )
        )

    def drawn(self, count: int, generator: np.random.Generator) -> np.ndarray:
        """Samples, shape (sample, axis)."""
        parts = generator.choice(len(self.weight), size=count, p=self.weight)
        return np.stack([generator.multivariate_normal(self.mean[part], self.covariance[part]) for part in parts])

    def _parts(self, points: np.ndarray) -> np.ndarray:
        away = points[:, None] - self.mean
        squared = np.einsum("npi,pij,npj->np", away, np.linalg.inv(self.covariance), away)
        return self.weight * np.exp(-0.5 * squared) / np.sqrt(np.linalg.det(2.0 * np.pi * self.covariance))


TARGET = Mixture(
    np.array([0.5, 0.2, 0.3]),
    np.array([[0.35, 0.38], [0.68, 0.25], [0.56, 0.64]]),
    np.array([[[0.01, 0.004], [0.004, 0.01]], [[0.005, -0.003], [-0.003, 0.005]], [[0.008, 0.0], [0.0, 0.004]]]),
)


def metric(samples: np.ndarray, variance: np.ndarray) -> float:
    """E of samples as they are."""
    blurred = TARGET.blurred(variance)
    squared = np.sum((samples[:, None] - samples) ** 2 / variance, axis=-1)
    own = np.mean(np.exp(-0.5 * squared)) / np.sqrt(np.prod(2.0 * np.pi * variance))
    return TARGET.overlap(blurred) - 2.0 * float(np.mean(blurred.density(samples))) + float(own)


def figures(count: int, seed: int) -> tuple[float, float, float, float]:
    """Width (geometric mean of the axes), bias, E of other samples of p, E of samples of a uniform density."""
    generator = np.random.default_rng(seed)
    samples = TARGET.drawn(count, generator)
    variance = select_variance(samples, TARGET.slope(samples), wraps=False)
    blurred, norm = TARGET.blurred(variance), TARGET.overlap(TARGET)
    bias = np.sqrt((blurred.overlap(blurred) - 2.0 * TARGET.overlap(blurred) + norm) / norm)
    others, level = TARGET.drawn(count, generator), generator.uniform(size=(count, 2))
    return float(np.prod(variance) ** 0.25), float(bias), metric(others, variance), metric(level, variance)


def main() -> None:
    """Print and draw."""
    found = np.array([np.median([figures(count, seed) for seed in range(SEEDS)], axis=0) for count in COUNTS])
    width, bias, fair, level = found.T
    rate = float(np.polyfit(np.log(COUNTS), np.log(width), 1)[0])
    print_claims(
        "KES: the kernel's parameter by eq. (30)",
        [
            (
                "chosen so that samples of p are an optimum, the metric is asymptotically consistent",
                "\n         ".join(
                    f"N = {count}: width {one:.4f}, bias {off:.3f}, E of other samples of p {ours:.3f}, of uniform "
                    f"ones {theirs:.3f}"
                    for count, one, off, ours, theirs in zip(COUNTS, width, bias, fair, level, strict=True)
                ),
                f"{'holds' if (np.diff(width) < 0.0).all() and fair[-1] < 0.1 * level[-1] else 'does not hold'}: the "
                f"width falls like N^{rate:.2f} (a density estimate's falls like N^-0.17), slowly: at N = {COUNTS[-1]} "
                f"blurring still changes {bias[-1]:.0%} of p. The product takes N = {PARAMETER_SAMPLES}, however long "
                "the path is",
            )
        ],
    )
    figure, plots = plt.subplots(1, 2, figsize=(7.5, 3.0))
    plots[0].loglog(COUNTS, width, marker="o", label="width")
    plots[0].loglog(COUNTS, bias, marker="o", label="bias")
    plots[1].loglog(COUNTS, fair, marker="o", label="E, samples of p")
    plots[1].loglog(COUNTS, level, marker="o", label="E, uniform samples")
    for plot in plots:
        plot.set(xlabel="samples N")
        plot.legend(fontsize=8)
    save(figure, "parameter")


if __name__ == "__main__":
    main()
