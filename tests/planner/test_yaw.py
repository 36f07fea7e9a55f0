import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.yaw import headings

TIME = np.arange(0.0, 20.0, 0.05)


def circling(rate_radps, speed_mps=2.0):
    angle = rate_radps * TIME
    return np.stack([speed_mps * np.cos(angle), speed_mps * np.sin(angle), np.zeros_like(TIME)], axis=-1)


def test_the_nose_follows_a_slow_turn_exactly_and_counts_whole_turns():
    yaw = headings(TIME, circling(0.7), max_yaw_rate_radps=1.0)
    np.testing.assert_allclose(yaw, 0.7 * TIME, atol=1e-9)
    assert yaw[-1] > 4.0 * math.pi


def test_a_vehicle_that_circles_faster_than_it_turns_never_lags_by_more_than_half_a_turn():
    velocity = circling(2.0)
    yaw = headings(TIME, velocity, max_yaw_rate_radps=0.3)
    direction = np.arctan2(velocity[:, 1], velocity[:, 0])
    lag = (direction - yaw + math.pi) % (2.0 * math.pi) - math.pi
    assert np.abs(np.diff(yaw)).max() <= 0.3 * 0.05 + 1e-12
    assert np.abs(lag).max() <= math.pi + 1e-9
    assert np.abs(yaw).max() < 2.0 * math.pi


def test_the_heading_is_held_while_hovering_and_while_climbing():
    velocity = np.tile([0.0, 1.0, 0.0], (len(TIME), 1))
    velocity[200:] = [0.0, 0.0, 3.0]
    yaw = headings(TIME, velocity, max_yaw_rate_radps=1.0)
    np.testing.assert_allclose(yaw, math.pi / 2.0)


def test_a_vehicle_that_starts_hovering_already_looks_where_it_will_go():
    velocity = np.zeros((len(TIME), 3))
    velocity[50:] = [-1.0, 0.0, 0.0]
    np.testing.assert_allclose(headings(TIME, velocity, 0.5), math.pi)
    np.testing.assert_allclose(headings(TIME, np.zeros((len(TIME), 3)), 0.5), 0.0)


def test_a_given_heading_is_left_no_faster_than_the_limit_the_shorter_way():
    velocity = np.tile([-1.0, -1e-3, 0.0], (len(TIME), 1))
    yaw = headings(TIME, velocity, 0.5, start_yaw_rad=-3.0)
    assert yaw[0] == -3.0
    np.testing.assert_allclose(yaw[-1], math.atan2(-1e-3, -1.0), atol=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0.05, 5.0))
def test_no_velocity_makes_it_turn_faster_than_the_limit(seed, limit):
    velocity = np.random.default_rng(seed).normal(size=(60, 3))
    time = np.cumsum(np.random.default_rng(seed + 1).uniform(0.01, 0.2, 60))
    yaw = headings(time, velocity, limit)
    assert (np.abs(np.diff(yaw)) <= limit * np.diff(time) + 1e-12).all()


@pytest.mark.parametrize(("limit", "time"), [(0.0, [0.0, 1.0]), (math.nan, [0.0, 1.0]), (1.0, [0.0, 0.0])])
def test_a_limit_or_times_that_make_no_sense_are_refused(limit, time):
    with pytest.raises(ValueError, match=r"positive|increase"):
        headings(np.array(time), np.ones((2, 3)), limit)
