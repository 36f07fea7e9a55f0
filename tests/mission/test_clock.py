"""The flight clock against vehicles that live at another pace, with delays, pauses and reboots."""

import numpy as np
import pytest

from mission.flying.clock import FlightClock


def test_before_the_vehicle_is_heard_it_runs_with_the_host():
    clock = FlightClock(1000.0, 5.0)
    assert clock.now(1002.0) == pytest.approx(10.0)


def test_it_goes_on_where_it_was_when_the_vehicle_is_heard():
    clock = FlightClock(1000.0)
    clock.hear(77.0, 1003.0)
    assert clock.now(1003.0) == pytest.approx(3.0)
    assert clock.of(80.0) == pytest.approx(6.0)


def test_it_follows_a_steady_vehicle_to_the_millisecond():
    clock = FlightClock(0.0)
    for step in range(600):
        clock.hear(50.0 + step * 0.033, step * 0.033)
    assert clock.now(19.8) == pytest.approx(clock.of(50.0 + 19.8), abs=1e-3)


def test_jitter_of_the_link_is_smoothed():
    random = np.random.default_rng(0)
    clock, arrivals = FlightClock(0.0), []
    for step in range(2000):
        arrivals.append((step * 0.033 + 0.05 + 0.02 * random.standard_normal(), step * 0.033))
    errors = []
    for host, vehicle in sorted(arrivals):
        clock.hear(vehicle, host)
        errors.append(clock.now(host) - clock.of(vehicle))
    assert np.std(errors[500:]) < 0.02


def test_it_never_runs_backwards():
    random = np.random.default_rng(1)
    clock, last = FlightClock(0.0), -1.0
    for step in range(500):
        host = step * 0.033
        clock.hear(host + 0.3 * random.standard_normal(), host)
        now = clock.now(host)
        assert now >= last
        last = now


def test_a_vehicle_that_lives_ten_times_faster_carries_the_clock_with_it():
    clock = FlightClock(0.0, 1.0)
    for step in range(3000):
        host = step * 0.0033
        clock.hear(10.0 * host, host)
    assert clock.rate == pytest.approx(10.0, rel=0.1)
    assert clock.now(9.9) == pytest.approx(clock.of(99.0), abs=0.3)


def test_a_simulator_that_waits_is_waited_for():
    clock = FlightClock(0.0, 10.0)
    clock.hear(5.0, 1.0)
    heard = clock.of(5.0)
    assert clock.now(1.5) <= heard + 0.2
    # One that is silent for longer is gone, and time-outs must come.
    assert clock.now(4.0) > heard + 10.0


def test_in_real_time_silence_does_not_stop_the_clock():
    clock = FlightClock(0.0)
    clock.hear(5.0, 1.0)
    assert clock.now(3.0) == pytest.approx(clock.of(5.0) + 2.0)


def test_a_reboot_leaves_the_flights_time_as_it_was():
    clock = FlightClock(0.0)
    for step in range(100):
        clock.hear(500.0 + step * 0.033, step * 0.033)
    before = clock.now(3.3)
    clock.hear(0.1, 3.4)
    assert clock.now(3.4) == pytest.approx(before + 0.1, abs=0.05)
    assert clock.of(0.1) == pytest.approx(before + 0.1, abs=0.05)


@pytest.mark.parametrize("jump_s", [3600.0, -3600.0, 2.0**32 / 1000.0])
def test_a_vehicles_clock_that_jumps_moves_neither_the_flight_nor_its_course(jump_s):
    clock = FlightClock(0.0)
    for step in range(100):
        clock.hear(5000.0 + step * 0.033, step * 0.033)
    before = clock.now(3.3)
    for step in range(3):
        clock.hear(5003.3 + jump_s + step * 0.033, 3.3 + step * 0.033)
        assert clock.now(3.3 + step * 0.033) == pytest.approx(before + step * 0.033, abs=0.02)
        assert clock.of(5003.3 + jump_s + step * 0.033) == pytest.approx(before + step * 0.033, abs=0.02)


def test_this_computers_clock_may_be_set_in_the_air(monkeypatch):
    clock = FlightClock(0.0)
    clock.hear(5.0, 1.0)
    monkeypatch.setattr("time.time", lambda: 0.0)
    clock.hear(5.5, 1.5)
    assert clock.now(1.6) == pytest.approx(1.6, abs=0.05)
