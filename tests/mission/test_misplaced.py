"""Files and heights that belong to another place or another zero are refused, and not silently passed over."""

import numpy as np
import pytest
import trimesh

from mission.findings import InputError
from mission.loading import load


def findings(sound, *overrides):
    with pytest.raises(InputError) as caught:
        load(sound, list(overrides))
    return {finding.path: finding.advice for finding in caught.value.findings}


@pytest.mark.parametrize("kind", ["points", "mesh", "voxels"])
def test_a_file_of_obstacles_that_lies_elsewhere_is_refused(kind, sound, tmp_path):
    path = tmp_path / {"points": "scan.npy", "mesh": "tower.stl", "voxels": "cells.npy"}[kind]
    match kind:
        case "points":
            np.save(path, [[9000.0, 250.0, 30.0], [9010.0, 250.0, 30.0]])
            rest = "radius_m=1.0"
        case "mesh":
            trimesh.creation.box(extents=(40.0, 30.0, 50.0)).export(path)
            rest = "position_enu_m=[9000.0, 250.0, 30.0]"
        case _:
            np.save(path, np.ones((3, 3, 3)))
            rest = "min_enu_m=[9000.0, 250.0, 30.0], cell_m=1.0"
    found = findings(sound, f"obstacle=[{{kind='{kind}', file='{path}', {rest}}}]")
    assert f"{path.name} lies 8 km from the mission" in found["obstacle.0.file"]


@pytest.fixture
def terrain(tmp_path):
    """An entry of a hillside that rises from 508 m above the sea by a metre in fifty."""
    rows = np.tile(508.0 + np.arange(60.0) * 0.2, (60, 1))
    np.save(tmp_path / "heights.npy", rows)
    return f"kind='terrain', file='{tmp_path / 'heights.npy'}', cell_m=10.0, center_enu_m=[250, 250]"


def test_home_that_is_not_as_high_as_the_ground_below_it_is_refused(sound, terrain):
    load(sound, [f"obstacle=[{{{terrain}}}]", "site.home_enu_m=[10, 10, 22]"])
    assert (
        "the ground at home is then at up = 21.1 m, and home is at up = 0 m, which is what its absence means"
        in (findings(sound, f"obstacle=[{{{terrain}}}]")["obstacle.0.heights"])
    )
    other_zero = f"obstacle=[{{{terrain}, heights='above-origin'}}]"
    assert (
        "measured from sea level" in findings(sound, other_zero, "site.home_enu_m=[10, 10, 22]")["obstacle.0.heights"]
    )


def test_home_on_a_cliff_may_be_as_high_as_either_side(sound, tmp_path):
    rows = np.full((60, 60), 488.0)
    rows[:, 8:] = 518.0
    np.save(tmp_path / "cliff.npy", rows)
    entry = f"kind='terrain', file='{tmp_path / 'cliff.npy'}', cell_m=10.0, center_enu_m=[250, 250]"
    for up in (0.0, 30.0):
        load(sound, [f"obstacle=[{{{entry}}}]", f"site.home_enu_m=[31, 100, {up}]", "planner.start_enu_m=[10, 10, 35]"])
    assert "obstacle.0.heights" in findings(sound, f"obstacle=[{{{entry}}}]", "site.home_enu_m=[31, 100, 70]")


@pytest.mark.parametrize(
    ("band", "up", "words"),
    [
        ("least_height_m=20", 30.0, "at least 20 m above it are kept: up must be at least 41.1"),
        ("greatest_height_m=20", 60.0, "at most 20 m above it are kept: up must be at most 41.1"),
        (
            "least_height_m=20, greatest_height_m=30",
            60.0,
            "20 … 30 m above it are kept: up must be at least 41.1 and at",
        ),
    ],
)
def test_a_start_outside_the_heights_that_are_kept_is_told_which_they_are(band, up, words, sound, terrain):
    end_free = "planner.closed_tour=true"
    found = findings(
        sound,
        f"obstacle=[{{{terrain}, {band}}}]",
        "site.home_enu_m=[10, 10, 21]",
        f"planner={{start_enu_m=[10, 10, {up}], duration_s=600, {end_free.removeprefix('planner.')}}}",
    )
    assert words in found["planner.start_enu_m"]
    assert "inside obstacle" not in found["planner.start_enu_m"]
