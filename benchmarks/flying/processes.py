"""The program's verbs and its vehicles as processes of their own, as a user starts them."""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mission.flying.flight_log import FlightLog

EXAMPLES = Path(__file__).parent.parent.parent / "examples"


def start_mission(arguments: Sequence[str]) -> subprocess.Popen[str]:
    """Start `mission …`; what it says goes nowhere."""
    command = [sys.executable, "-m", "mission", *arguments]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


def run_mission(arguments: Sequence[str]) -> dict[str, Any]:
    """Run `mission … --json` to its end.

    Returns:
        What it printed.

    Raises:
        RuntimeError: It printed nothing.
    """
    found = subprocess.run(
        [sys.executable, "-m", "mission", *arguments, "--json"], capture_output=True, text=True, check=False
    )
    if not found.stdout.strip():
        raise RuntimeError(f"mission {' '.join(arguments)} ended with {found.returncode}: {found.stderr[-800:]}")
    return json.loads(found.stdout)


def overrides(changes: Sequence[str]) -> list[str]:
    """`--set` for each change."""
    return [part for change in changes for part in ("--set", change)]


def airborne_s(log: FlightLog) -> tuple[float, float]:
    """Flight clock of the first and the last sample with running motors."""
    moments = log.time_s[np.asarray(log.armed, dtype=bool)]
    return float(moments[0]), float(moments[-1])
