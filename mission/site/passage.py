"""Whether there is a way at all: places that obstacles or the fence close off from the start, for certain.

A cell is closed where its middle lacks more than the cell reaches: nothing in it is free then. What no chain of other
cells joins to the start cannot be flown to. Thin walls of a large site may not close their cells: no proof, then.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float
from scipy import ndimage

from mission.site.reachable import Spare, roomy
from planner.information import DensityGrid
from planner.workspace import Workspace

CELLS = 60_000
LEAST_SHARE = 0.01
"""Of the information: where less can be reached, there is nothing to explore."""


class Passage:
    """What may be reached from a place.

    Args:
        box: What is flown in.
        spare_m: How much farther than they must points are from everything.
        start_m: The place, free itself.
    """

    def __init__(self, box: Workspace, spare_m: Spare, start_m: Float[np.ndarray, "3"]) -> None:
        edge_m = float((box.lengths_m.prod() / CELLS) ** (1.0 / 3.0))
        counts = np.maximum(np.ceil(box.lengths_m / edge_m).astype(int), 1)
        self._low_m, self._cell_m = box.box_min_m, box.lengths_m / counts
        axes = [
            low + (np.arange(n) + 0.5) * cell for low, n, cell in zip(self._low_m, counts, self._cell_m, strict=True)
        ]
        reach_m = 0.5 * float(np.linalg.norm(self._cell_m))
        ajar = roomy(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1), lambda points_m: spare_m(points_m) + reach_m)
        self._part = np.zeros(ajar.shape, dtype=np.int32)
        ndimage.label(ajar, structure=np.ones((3, 3, 3)), output=self._part)
        self._here = int(self._part[self._cell_of(start_m[None])][0])

    def leads_to(self, places_m: Float[np.ndarray, "place 3"]) -> Bool[np.ndarray, "place"]:
        """Whether there may be a way to places; where not, there is none."""
        return self._part[self._cell_of(places_m)] == self._here

    def share_of(self, density: DensityGrid) -> float:
        """How much of the information may be reached, of 1."""
        held = density.mass > 0.0
        mass, centers_m = density.mass[held], density.centers_m()[held]
        return float(mass[self.leads_to(centers_m)].sum() / mass.sum())

    def _cell_of(self, places_m: Float[np.ndarray, "place 3"]) -> tuple[np.ndarray, ...]:
        index = np.floor((places_m - self._low_m) / self._cell_m).astype(int)
        return tuple(np.clip(index, 0, np.array(self._part.shape) - 1).T)
