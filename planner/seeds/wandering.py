"""Random paths: smooth ways through random places of the box."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from planner.workspace import Workspace

MOST_PLACES = 60
POINTS_A_PLACE = 16


def wander(
    workspace: Workspace,
    first_m: Float[np.ndarray, "3"],
    places_unit: Float[np.ndarray, "place 3"],
    last_m: Float[np.ndarray, "3"] | None,
) -> Float[np.ndarray, "point 3"]:
    """The cubic spline by chord length through places; where it swings out of the box it follows the wall.

    Args:
        workspace: The box.
        first_m: Where it begins.
        places_unit: What it passes, in the unit cube.
        last_m: Where it ends; None: at the last place.
    """
    places = workspace.enu_from_unit(places_unit)
    knots = np.concatenate([first_m[None], places] if last_m is None else [first_m[None], places, last_m[None]])
    chord = np.linalg.norm(np.diff(knots, axis=0), axis=1)
    # The square root of the chord keeps the swing of close places small (Lee, 1989).
    parameter = np.concatenate([[0.0], np.cumsum(np.sqrt(np.maximum(chord, 1e-6 * workspace.lengths_m.max())))])
    dense = np.interp(
        np.linspace(0.0, len(knots) - 1.0, (len(knots) - 1) * POINTS_A_PLACE + 1), np.arange(len(knots)), parameter
    )
    path = np.asarray(CubicSpline(parameter, knots, bc_type="natural")(dense))
    return np.clip(path, workspace.box_min_m, workspace.box_max_m)
