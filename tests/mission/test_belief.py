"""What a flight remembers of where it was."""

import numpy as np
import pytest

from mission.flying.belief import INTERVAL_S, Belief, after, covered_by, together
from tests.mission.street import CURVE, MODES, PROBLEM


def test_memory_is_the_mean_over_everything_flown_however_it_was_put_together():
    places = CURVE.sampled_every(INTERVAL_S).position_m
    whole = covered_by(places, len(places) * INTERVAL_S, PROBLEM, MODES)
    half = len(places) // 2
    parts = [covered_by(part, len(part) * INTERVAL_S, PROBLEM, MODES) for part in (places[:half], places[half:])]
    both = together(*parts)
    assert both is not None
    np.testing.assert_array_equal(both.places, whole.places)
    assert both is not None
    assert both.duration_s == pytest.approx(whole.duration_s)
    assert both.mean_basis == pytest.approx(whole.mean_basis)
    assert together(None, whole) is whole


def test_a_belief_counts_a_position_for_each_tenth_of_a_second_and_none_for_pauses():
    belief = Belief(PROBLEM)
    for now in np.arange(0.0, 10.0, 0.033):
        belief.fly((1.0, 2.0, 10.0), float(now))
    for now in np.arange(60.0, 65.0, 0.033):
        belief.fly((3.0, 4.0, 10.0), float(now))
    assert len(belief.flown_m()) == pytest.approx(150, abs=2)


def test_what_was_flown_becomes_what_the_metric_remembers():
    places = CURVE.sampled_every(INTERVAL_S).position_m
    left = after(PROBLEM, places, MODES)
    assert left.covered is not None
    assert left.covered.duration_s == pytest.approx(len(places) * INTERVAL_S)
    assert after(PROBLEM, np.empty((0, 3)), MODES) is PROBLEM
