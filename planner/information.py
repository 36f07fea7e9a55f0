"""Where time should be spent: a density over the workspace, as cells.

Whatever the source (uniform, Gaussians, a raster, samples), it becomes one grid of cells, so that free space can be cut
out of it, beliefs can update it, and its coefficients are exact for the piecewise constant density (no end-point grids:
fifty end-point samples give even a perfect path E ≈ 1.7e-4).

| symbol | identifier            | unit | shape         |
|--------|-----------------------|------|---------------|
| μ      | `DensityGrid.mass`    | 1    | nx ny nz      |
| φ_k    | `coefficients()`      | 1    | k0 k1 k2      |
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from planner.workspace import Workspace

MOST_FINE_CELLS = 512


@dataclasses.dataclass(frozen=True)
class DensityGrid:
    """A probability mass per cell of a regular grid that fills the workspace.

    Attributes:
        workspace: The box.
        mass: Shape (nx, ny, nz), non-negative, sums to one; axes east, north, up.

    Raises:
        ValueError: Negative or non-finite mass, or none at all.
    """

    workspace: Workspace
    mass: Float[np.ndarray, "nx ny nz"]

    def __post_init__(self) -> None:
        mass = np.asarray(self.mass, dtype=float)
        if mass.ndim != 3:
            raise ValueError(f"information needs cells along three axes, got an array of shape {mass.shape}")
        if not np.isfinite(mass).all() or (mass < 0.0).any():
            raise ValueError("information must be finite and not negative everywhere")
        total = mass.sum()
        if total <= 0.0:
            raise ValueError("there is no information in the box: every cell is zero")
        object.__setattr__(self, "mass", mass / total)

    @property
    def cell_m(self) -> Float[np.ndarray, "3"]:
        """Edge lengths of a cell, metres."""
        return self.workspace.lengths_m / np.array(self.mass.shape)

    @functools.cached_property
    def cumulative_mass(self) -> Float[np.ndarray, "cell"]:
        """Mass of each cell and all before it, the last axis running fastest."""
        return np.cumsum(self.mass)

    @functools.cached_property
    def map_mass(self) -> Float[np.ndarray, "nx ny"]:
        """Mass of each column of cells: the information seen from above."""
        return self.mass.sum(axis=2)

    def map_centers_m(self) -> Float[np.ndarray, "nx ny 2"]:
        """Centres of the columns of cells, local ENU metres."""
        return cell_centers_m(self.workspace, (*self.mass.shape[:2], 1))[:, :, 0, :2]

    def centers_m(self) -> Float[np.ndarray, "nx ny nz 3"]:
        """Centres of the cells, local ENU metres."""
        return cell_centers_m(self.workspace, self.mass.shape)

    def where(self, keep: Callable[[Float[np.ndarray, "n 3"]], np.ndarray]) -> DensityGrid:
        """The same information with only the cells whose centre is kept.

        Args:
            keep: From positions (n, 3) in metres to booleans (n,).

        Raises:
            ValueError: Nothing is left.
        """
        centers = self.centers_m()
        kept = np.asarray(keep(centers.reshape(-1, 3))).reshape(self.mass.shape)
        if not (self.mass * kept).any():
            raise ValueError("no information is left in the free space: obstacles or the fence cover all of it")
        return dataclasses.replace(self, mass=self.mass * kept)

    def finer_on_the_map(self, largest_m: float) -> DensityGrid:
        """The same density in cells that are no longer than this east and north, as far as `MOST_FINE_CELLS` go."""
        parts = np.ceil(self.cell_m[:2] / largest_m - 1e-9).astype(int)
        parts = np.maximum(1, np.minimum(parts, MOST_FINE_CELLS // np.array(self.mass.shape[:2])))
        return dataclasses.replace(self, mass=np.repeat(np.repeat(self.mass, parts[0], axis=0), parts[1], axis=1))

    def coefficients(self, modes: tuple[int, int, int]) -> Float[np.ndarray, "k0 k1 k2"]:
        """φ_k = ∫ F_k dμ, exact for the piecewise constant density (SVES eq. 2)."""
        means = [cell_mean_basis(cells, count) for cells, count in zip(self.mass.shape, modes, strict=True)]
        return np.einsum("xyz,xa,yb,zc->abc", self.mass, *means, optimize=True)


def cell_centers_m(workspace: Workspace, shape: tuple[int, ...]) -> Float[np.ndarray, "nx ny nz 3"]:
    """Centres of the cells of a regular grid that fills the workspace."""
    axes = [(np.arange(count) + 0.5) / count for count in shape]
    return workspace.enu_from_unit(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1))


def cell_mean_basis(cells: int, modes: int) -> Float[np.ndarray, "cell k"]:
    """Mean of cos(πkw)/h_k over each of `cells` equal cells of [0, 1], for k below `modes`."""
    edges = np.linspace(0.0, 1.0, cells + 1)[:, None]
    k = np.arange(modes)[None, :]
    integral = np.where(k == 0, edges, np.sin(np.pi * k * edges) / (np.pi * np.maximum(k, 1)))
    return np.diff(integral, axis=0) * cells * np.where(k == 0, 1.0, np.sqrt(2.0))


def uniform(workspace: Workspace, shape: tuple[int, int, int] = (64, 64, 16)) -> DensityGrid:
    """The same everywhere."""
    return DensityGrid(workspace, np.ones(shape))


def gaussians(
    workspace: Workspace,
    mean_m: Float[np.ndarray, "component 3"],
    std_m: Float[np.ndarray, "component 3"],
    weight: Float[np.ndarray, "component"],
    shape: tuple[int, int, int] = (128, 128, 32),
) -> DensityGrid:
    """A mixture of axis-aligned normal densities, cut to the box.

    Each cell takes the mixture's exact mass, so a component narrower than a cell is not lost between centres.

    Raises:
        ValueError: Standard deviations or weights that are not positive, or no mass in the box.
    """
    from scipy.special import ndtr

    mean, std = np.atleast_2d(mean_m), np.atleast_2d(std_m)
    share = np.asarray(weight, dtype=float)
    if (std <= 0.0).any() or (share < 0.0).any() or not (share > 0.0).any():
        raise ValueError("a mixture needs positive standard deviations and weights that are not all zero")
    mass = np.zeros(shape)
    for center, spread, part in zip(mean, std, share, strict=True):
        per_axis = []
        for axis, count in enumerate(shape):
            low, high = workspace.box_min_m[axis], workspace.box_max_m[axis]
            per_axis.append(np.diff(ndtr((np.linspace(low, high, count + 1) - center[axis]) / spread[axis])))
        mass += part * np.einsum("x,y,z->xyz", *per_axis)
    return DensityGrid(workspace, mass)


def raster(
    workspace: Workspace,
    values: Float[np.ndarray, "rx ry"] | Float[np.ndarray, "rx ry rz"],
    low_m: Float[np.ndarray, "axes"],
    cell_m: Float[np.ndarray, "axes"],
    max_cells: tuple[int, int, int] = (256, 256, 32),
) -> DensityGrid:
    """A map of cells, cut to the box by area; a flat map is spread evenly over the altitudes.

    Args:
        workspace: The box.
        values: Probability (or any weight) per cell, axes east, north (, up).
        low_m: Corner of the first cell, metres.
        cell_m: Edge lengths of a cell, metres.
        max_cells: Most cells per axis of the result.

    Raises:
        ValueError: Negative or non-finite values, or no mass inside the box.
    """
    cells = np.asarray(values, dtype=float)
    if not np.isfinite(cells).all() or (cells < 0.0).any():
        raise ValueError("a raster must be finite and not negative everywhere")
    low = np.asarray(low_m, dtype=float)
    edge = np.asarray(cell_m, dtype=float)
    overlaps = []
    for axis in range(3):
        if axis >= cells.ndim:
            overlaps.append(np.ones((1, 1)))
            continue
        extent = workspace.lengths_m[axis]
        count = int(np.clip(np.ceil(extent / edge[axis]), 1, max_cells[axis]))
        target = np.linspace(workspace.box_min_m[axis], workspace.box_max_m[axis], count + 1)
        source = low[axis] + np.arange(cells.shape[axis] + 1) * edge[axis]
        shared = np.minimum(target[1:, None], source[None, 1:]) - np.maximum(target[:-1, None], source[None, :-1])
        overlaps.append(np.maximum(shared, 0.0) / edge[axis])
    if cells.ndim == 2:
        cells = cells[:, :, None]
    return DensityGrid(workspace, np.einsum("xyz,ax,by,cz->abc", cells, *overlaps, optimize=True))


def samples(
    workspace: Workspace,
    position_m: Float[np.ndarray, "sample 3"],
    weight: Float[np.ndarray, "sample"],
    shape: tuple[int, int, int] = (128, 128, 32),
) -> DensityGrid:
    """The empirical measure of weighted points; those outside the box do not count.

    Raises:
        ValueError: No sample with weight lies in the box.
    """
    edges = [
        np.linspace(low, high, count + 1)
        for low, high, count in zip(workspace.box_min_m, workspace.box_max_m, shape, strict=True)
    ]
    mass, _ = np.histogramdd(position_m, bins=edges, weights=weight)
    return DensityGrid(workspace, mass)
