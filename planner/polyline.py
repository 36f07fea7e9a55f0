"""Polylines: points in a row, straight between them."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float


def densified(points_m: Float[np.ndarray, "point axis"], spacing_m: float) -> Float[np.ndarray, "dense axis"]:
    """The same polyline with points no further apart than a spacing, its corners kept."""
    lengths = np.linalg.norm(np.diff(points_m, axis=0), axis=1)
    parts = np.maximum(1, np.ceil(lengths / spacing_m)).astype(int)
    leg = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(leg)) - np.repeat(np.cumsum(parts) - parts, parts)
    return at_places(points_m, np.append(leg + within / parts[leg], len(parts)))


def at_places(points_m: Float[np.ndarray, "point axis"], place: Float[np.ndarray, "sample"]) -> np.ndarray:
    """Points of a polyline at fractional indices."""
    index = np.arange(len(points_m))
    return np.stack([np.interp(place, index, axis) for axis in points_m.T], axis=1)


def at_lengths(
    points_m: Float[np.ndarray, "point axis"], leg_m: Float[np.ndarray, "leg"], length_m: Float[np.ndarray, "sample"]
) -> np.ndarray:
    """Points of a polyline at lengths along it, by a measure of its legs that need not be the plain one."""
    along = np.concatenate([[0.0], np.cumsum(leg_m)])
    return np.stack([np.interp(length_m, along, axis) for axis in points_m.T], axis=1)


def cut_at(
    points_m: Float[np.ndarray, "point axis"], leg_m: Float[np.ndarray, "leg"], length_m: float
) -> Float[np.ndarray, "kept axis"]:
    """The beginning of a polyline, as far as a length along it by such a measure."""
    along = np.concatenate([[0.0], np.cumsum(leg_m)])
    if length_m >= along[-1]:
        return points_m
    whole = max(1, int(np.searchsorted(along, length_m)))
    return np.concatenate([points_m[:whole], at_lengths(points_m, leg_m, np.array([length_m]))])


def length_of(points_m: Float[np.ndarray, "point axis"]) -> float:
    """Length of a polyline."""
    return float(np.linalg.norm(np.diff(points_m, axis=0), axis=1).sum())


def without_repeats(points_m: Float[np.ndarray, "point axis"]) -> Float[np.ndarray, "point axis"]:
    """A polyline without legs of no length; at least two points are kept."""
    moved = np.linalg.norm(np.diff(points_m, axis=0), axis=1) > 1e-9
    kept = points_m[np.concatenate([[True], moved])]
    return kept if len(kept) > 1 else points_m[[0, -1]]
