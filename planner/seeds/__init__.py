"""Paths to start from, and the splines that follow them."""

from planner.seeds.drawing import Pattern
from planner.seeds.facing import seed_headings
from planner.seeds.seed_set import LAST_RESORT, SeedPath, seed_paths
from planner.seeds.spline import heading_spline, spline_from_path

__all__ = ["LAST_RESORT", "Pattern", "SeedPath", "heading_spline", "seed_headings", "seed_paths", "spline_from_path"]
