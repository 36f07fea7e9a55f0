"""Planning the examples: cold (nothing compiled) and warm (compiled by an earlier run), as a user waits for it.

python -m benchmarks.planning
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.timing import machine

EXAMPLES = ("room", "forest", "search", "city")
WARM_RUNS = 3
FOLDER = Path(__file__).parent.parent / "examples"


def planned(example: str, cache: str, out: str) -> tuple[float, dict]:
    """Wall time of `mission plan` as a process, and its JSON."""
    command = [sys.executable, "-m", "mission", "plan", str(FOLDER / f"{example}.toml"), "--json", "--out", out]
    started_s = time.perf_counter()
    found = subprocess.run(
        command, capture_output=True, text=True, check=True, env={**os.environ, "XDG_CACHE_HOME": cache}
    )
    return time.perf_counter() - started_s, json.loads(found.stdout)


def main() -> None:
    """Print the table."""
    print(machine())
    print(
        f"{'example':>8} {'cold s':>7} {'warm s':>7} {'solver s':>9} {'E':>8} {'lawnmower':>10} {'ratio':>6} "
        f"{'passed':>7} {'plans':>6}"
    )
    for example in EXAMPLES:
        with tempfile.TemporaryDirectory() as cache, tempfile.TemporaryDirectory() as out:
            cold_s, _ = planned(example, cache, out)
            runs = [planned(example, cache, out) for _ in range(WARM_RUNS)]
        plan = runs[-1][1]
        passed = sum(candidate["feasible"] for candidate in plan["candidates"])
        metric, baseline = plan["ergodic_metric"], plan["lawnmower_ergodic_metric"]
        print(
            f"{example:>8} {cold_s:>7.1f} {np.median([wall for wall, _ in runs]):>7.1f} "
            f"{np.median([found['solve_s'] for _, found in runs]):>9.2f} {metric:>8.4f} {baseline:>10.4f} "
            f"{metric / baseline:>6.2f} {passed:>3}/{len(plan['candidates']):<3} "
            f"{plan['diversity']['effective_plans']:>6.1f}"
        )


if __name__ == "__main__":
    main()
