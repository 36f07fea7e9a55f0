"""Every fault once in a whole flight in virtual time, the phase and the autopilot taking turns.

`python -m benchmarks.faults` flies all of them in every phase on both.
"""

import itertools

import pytest

from benchmarks.faults.matrix import FAULTS, MOMENTS, Cell, cells, fly_cell
from sim_bridge.dialects import Autopilot

EVERY = set(cells(1))
TURNS = itertools.cycle(itertools.product(MOMENTS[1:], Autopilot))
CELLS = [
    cell if (cell := Cell(fault, *turn, seed=0)) in EVERY else Cell(fault, MOMENTS[0], turn[1], seed=0)
    for fault, turn in zip(FAULTS, TURNS, strict=False)
]


@pytest.mark.parametrize("cell", CELLS, ids=lambda cell: f"{cell.fault}, {cell.moment}, {cell.autopilot.name.lower()}")
def test_a_fault_in_flight_breaks_nothing(cell):
    _, _, broken = fly_cell(cell)
    assert broken == ()


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("fault", ["obstacle pushed", "obstacle pushed while paused"])
def test_an_obstacle_that_is_pushed_onto_what_is_flown_next_is_kept_clear_of(fault, moment):
    _, _, broken = fly_cell(Cell(fault, moment, Autopilot.PX4, seed=2))
    assert broken == ()


def test_every_fault_is_flown():
    assert {cell.fault for cell in CELLS} == set(FAULTS)
