"""The `[information]` section as a density over the box."""

from __future__ import annotations

import numpy as np

from mission.mission_file.information import Gaussians, Information, Raster, SampleSet, Uniform
from mission.mission_file.site import Site
from mission.site import rasters
from mission.site.position_table import read_positions
from mission.site.rasters import read_geotiff, read_raster
from planner import information as densities
from planner.information import DensityGrid
from planner.workspace import Workspace


def workspace_of(site: Site) -> Workspace:
    """The box of a site."""
    low, high = site.box_m
    return Workspace(np.array(low), np.array(high))


def density_of(information: Information, site: Site) -> DensityGrid:
    """Where time should be spent, before obstacles are cut out of it.

    Raises:
        ValueError: A file that cannot be used, or no information inside the box.
    """
    workspace = workspace_of(site)
    match information:
        case Uniform():
            return densities.uniform(workspace)
        case Gaussians(component=components):
            return densities.gaussians(
                workspace,
                np.array([component.mean_enu_m for component in components]),
                np.array([component.std_m for component in components]),
                np.array([component.weight for component in components]),
            )
        case Raster():
            return _density_of_raster(information, site, workspace)
        case SampleSet():
            table = read_positions(information.samples, site.origin.point())
            low, high = workspace.box_min_m, workspace.box_max_m
            inside = ((table.position_m >= low) & (table.position_m <= high)).all(axis=1)
            if not inside.any():
                raise ValueError(f"none of the {len(table.weight)} positions lies in the box")
            return densities.samples(workspace, table.position_m, table.weight)


def _density_of_raster(information: Raster, site: Site, workspace: Workspace) -> DensityGrid:
    low, high = workspace.box_min_m[:2], workspace.box_max_m[:2]
    if information.georeferenced:
        raster = read_geotiff(information.raster, site.origin.point(), low, high)
    else:
        raster = placed_raster(information).clipped(low, high)
    name = information.raster.name
    if np.isnan(raster.values).any():
        raise ValueError(f"{name} holds NaN inside the box: write 0 where nothing is known")
    if not np.isfinite(raster.values).all() or (raster.values < 0.0).any():
        raise ValueError(f"{name} holds negative or infinite values inside the box: a weight is at least 0")
    if not raster.values.any():
        raise ValueError(f"{name} is zero everywhere inside the box: is center_enu_m right?")
    return densities.raster(workspace, raster.values, raster.low_m, raster.cell_m)


def placed_raster(information: Raster) -> rasters.Raster:
    """All of a raster from a numpy file, where the mission puts it.

    Raises:
        ValueError: A file that cannot be used.
    """
    assert information.cell_m is not None
    return read_raster(
        information.raster,
        key=information.key,
        cell_m=information.cell_m,
        center_m=information.center_enu_m or (0.0, 0.0),
        north_first=information.rows == "north-to-south",
        anchor_at_peak=information.anchor == "peak",
    )
