"""At which altitude to fly over a place: where the information there is, in layers where it is spread."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.ndimage import gaussian_filter, map_coordinates

from planner.problem import Problem

MOST_COLUMNS = 32
# A box this flat against its sides has no layers worth flying.
FLAT_SHARE = 0.08


class Altitudes:
    """Quantiles of the information above each place.

    Attributes:
        layered: Whether the information changes with altitude, in a box that has room for layers.
    """

    def __init__(self, problem: Problem) -> None:
        workspace = problem.workspace
        self._low, self._lengths = workspace.box_min_m, workspace.lengths_m
        mass = problem.information.mass
        self.layered = mass.shape[2] > 1 and bool(self._lengths[2] > FLAT_SHARE * self._lengths[:2].min())
        for axis in (0, 1):
            width = -(-mass.shape[axis] // MOST_COLUMNS)
            starts = np.arange(0, mass.shape[axis], width)
            mass = np.add.reduceat(mass, starts, axis=axis)
        whole = mass.sum(axis=(0, 1))
        # Neighbouring places are flown at like altitudes, and places without information at the altitude of the rest.
        smooth = gaussian_filter(mass, (1.5, 1.5, 0.0), mode="nearest")
        cumulative = np.cumsum(smooth + 1e-3 * smooth.mean() * whole / whole.mean(), axis=2)
        self._cumulative = np.pad(cumulative / cumulative[:, :, -1:], ((0, 0), (0, 0), (1, 0)))
        self._whole = np.concatenate([[0.0], np.cumsum(whole) / whole.sum()])

    def at(self, place_m: Float[np.ndarray, "point 2"], quantile: Float[np.ndarray, "point"]) -> np.ndarray:
        """Altitude below which a share of the information above each place lies, shape (point,)."""
        columns = self._cumulative.shape[:2]
        place = (place_m - self._low[:2]) / self._lengths[:2] * columns - 0.5
        layers = self._cumulative.shape[2]
        shares = np.stack(
            [
                map_coordinates(self._cumulative[:, :, layer], place.T, order=1, mode="nearest")
                for layer in range(layers)
            ],
            axis=1,
        )
        edges = np.linspace(0.0, 1.0, layers)
        heights = [np.interp(q, share, edges) for q, share in zip(quantile, shares, strict=True)]
        return self._low[2] + self._lengths[2] * np.array(heights)

    def lifted(self, place_m: Float[np.ndarray, "point 2"], quantile: float) -> Float[np.ndarray, "point 3"]:
        """A flat path at one quantile of the information under and over it."""
        return np.column_stack([place_m, self.at(place_m, np.full(len(place_m), quantile))])

    def levels(self, layers: int) -> list[float]:
        """Altitudes of level layers, each the middle of an equal share of all information."""
        edges = np.linspace(0.0, 1.0, len(self._whole))
        shares = (np.arange(layers) + 0.5) / layers
        return [float(self._low[2] + self._lengths[2] * np.interp(share, self._whole, edges)) for share in shares]
