"""Paths to start from, and the splines that follow them."""

from planner.seeds.drawing import Pattern
from planner.seeds.seed_set import SeedPath, seed_paths
from planner.seeds.spline import spline_from_path

__all__ = ["Pattern", "SeedPath", "seed_paths", "spline_from_path"]
