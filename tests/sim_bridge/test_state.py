"""Values at the border between a mission and its vehicle."""

import math

import pytest

from sim_bridge.state import Setpoint


# The last are numbers to Python, and infinite in the four bytes that they would leave in.
@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, 1e39, -3.5e38])
@pytest.mark.parametrize("field", range(10))
def test_a_setpoint_that_is_not_all_numbers_cannot_be_made(field, bad):
    numbers = [1.0] * 10
    numbers[field] = bad
    with pytest.raises(ValueError, match="finite numbers"):
        Setpoint(tuple(numbers[:3]), tuple(numbers[3:6]), tuple(numbers[6:9]), numbers[9])


def test_holding_a_place_is_standing_still():
    held = Setpoint.hold((1.0, 2.0, 3.0), 0.5)
    assert held.velocity_enu_mps == held.acceleration_enu_mps2 == (0.0, 0.0, 0.0)
    assert held.position_enu_m == (1.0, 2.0, 3.0)
