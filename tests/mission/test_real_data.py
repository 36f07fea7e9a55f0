"""Plans over measured maps and measured ground, confirmed by the independent checker.

The data are not part of this project: they are looked for in the folder that MISSION_DATA names, or in `shared/data`
beside the checkout, and without them these tests are skipped.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mission.cli import app
from tests.planner.independent_checker import check

ROOT = Path(__file__).parents[2]
DATA = Path(os.environ.get("MISSION_DATA") or ROOT.parent / "shared" / "data")
MAPS = ("sarenv_1", "sarenv_2", "sarenv_3")
TILES = ("N17E073", "N43W080")
TIME_LIMIT = "planner.time_limit_s=240"
"""Compiling counts against the limit, and here it may have to happen first."""


def measured(*parts: str) -> Path:
    file = DATA.joinpath(*parts)
    if not file.exists():
        pytest.skip(f"{'/'.join(parts)} is not in {DATA}: name the folder of the data in MISSION_DATA")
    return file


def planned(mission: Path, out: Path, *changes: str) -> dict:
    """What `mission plan --json` says, its plan confirmed."""
    options = [part for change in (TIME_LIMIT, *changes) for part in ("--set", change)]
    result = CliRunner().invoke(app, ["plan", str(mission), "--out", str(out), "--json", *options])
    assert result.exit_code == 0, result.stderr
    assert check(json.loads((out / "plan.json").read_text(encoding="utf-8"))).faults == ()
    return json.loads(result.stdout)


@pytest.mark.slow
@pytest.mark.parametrize("name", MAPS)
def test_a_search_over_a_measured_map_beats_the_lawnmower(name, tmp_path):
    summary = planned(
        ROOT / "examples" / "search.toml", tmp_path, f"information.raster={measured('search', name + '.npz')}"
    )
    assert summary["ergodic_metric"] <= 0.8 * summary["lawnmower_ergodic_metric"]


@pytest.mark.slow
@pytest.mark.parametrize("name", TILES)
def test_measured_ground_is_followed_at_the_heights_that_are_asked_for(name, tmp_path):
    file = measured("terrain", name + ".npy")
    low, high = tile_heights(file)
    mission = tmp_path / "tile.toml"
    text = (ROOT / "examples" / "hill.toml").read_text(encoding="utf-8")
    head, _, rest = text.partition("[[obstacle]]                    # a mast")
    _, _, tail = rest.partition("[vehicle]")
    start = [30.0, 30.0, low["start"] + 45.0]
    for old, new in (
        ("20.0]\n", f"{low['all'] + 10.0}]\n"),
        ("140.0]", f"{high + 70.0}]"),
        ("8.4]", f"{low['start']}]"),
        ('"hill_heights.npz"', f'"{file}"'),
        ("cell_m = 10.0", "cell_m = 30.0"),
    ):
        assert old in head
        head = head.replace(old, new, 1)
    tail = tail.replace("[30.0, 30.0, 50.0]", str(start))
    mission.write_text(head + "[vehicle]" + tail, encoding="utf-8")
    summary = planned(mission, tmp_path / "out", "planner.candidates=8")
    # The baseline's lawnmower knows neither the ground nor turns nor the way home, which is a fifth of this flight.
    assert summary["ergodic_metric"] < 1.5 * summary["lawnmower_ergodic_metric"]


def tile_heights(file: Path) -> tuple[dict[str, float], float]:
    """Least height of the site and height of its start, and the greatest height: 30 m cells, centred on the example."""
    rows = np.load(file)[::-1]
    middle = (np.array(rows.shape) - 1) / 2.0
    half = np.array([250.0, 300.0]) / 30.0
    (south, west), (north, east) = (middle - half - 1.0).astype(int), (middle + half + 2.0).astype(int)
    site = rows[south : north + 1, west : east + 1]
    start = rows[tuple(np.round(middle - half + 1.0).astype(int))]
    return {"all": float(site.min()), "start": float(start)}, float(site.max())
