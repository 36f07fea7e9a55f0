"""Drag and wind of a flight, from what it told of its tilt."""

import dataclasses

import numpy as np
import pytest

from mission.executive.phases import Phase
from mission.flying.air import air_of, air_summary, drag_words, wind_words
from mission.flying.flight_log import FlightLog
from mission.flying.flight_rules import leaned_against_per_s
from mission.mission_file.vehicle import Vehicle

DRAG_PER_S, WIND_MPS = 0.35, np.array([3.0, -1.0])
RATE_HZ, NOISE_MPS2, NOISE_MPS = 30.0, 0.3, 0.05


def flight(turns: float = 6.0, lasts_s: float = 120.0, seed: int = 0) -> FlightLog:
    """A wavy circle at some 4 m/s, leaning as drag and wind have it, with noise."""
    time_s = np.arange(0.0, lasts_s, 1.0 / RATE_HZ)
    angle = 2.0 * np.pi * turns * time_s / lasts_s
    speed = 4.0 + np.sin(0.7 * time_s)
    velocity = speed[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    noise = np.random.default_rng(seed)
    tilt = np.gradient(velocity, time_s, axis=0) + DRAG_PER_S * (velocity - WIND_MPS)
    tilt += noise.normal(0.0, NOISE_MPS2, tilt.shape)
    velocity += noise.normal(0.0, NOISE_MPS, velocity.shape)
    count = len(time_s)
    place = np.column_stack([np.cumsum(velocity, axis=0) / RATE_HZ, np.full(count, 20.0)])
    return FlightLog(
        header={},
        time_s=time_s,
        position_m=place,
        velocity_mps=np.column_stack([velocity, np.zeros(count)]),
        yaw_rad=np.zeros(count),
        target_m=place,
        tilt_mps2=tilt,
        battery_fraction=np.full(count, np.nan),
        phase=(Phase.FOLLOWING.value,) * count,
        armed=np.ones(count, dtype=bool),
        setpoint_s=np.zeros(0),
        setpoint_curve_s=np.zeros(0),
        setpoint_m=np.zeros((0, 3)),
        events=(),
        courses=(),
    )


@pytest.mark.parametrize("seed", range(3))
def test_drag_and_wind_are_what_they_were(seed):
    air = air_of(flight(seed=seed))
    assert air is not None
    assert air.wind_enu_mps == pytest.approx(tuple(WIND_MPS), abs=0.15)
    assert abs(air.drag_per_s - DRAG_PER_S) < 3.0 * air.drag_error_per_s + 0.01
    assert air.drag_error_per_s < 0.02


def test_a_flight_all_one_way_cannot_tell_drag_from_wind():
    assert air_of(flight(turns=0.0, lasts_s=60.0)) is not None  # Its speed changed.
    log = flight(turns=0.0)
    steady = np.tile(log.velocity_mps[:1], (len(log.time_s), 1))
    assert air_of(dataclasses.replace(log, velocity_mps=steady)) is None


def test_hovering_and_short_flights_and_old_logs_show_nothing():
    log = flight()
    hovering = dataclasses.replace(
        log, velocity_mps=0.01 * log.velocity_mps, tilt_mps2=np.random.default_rng(0).normal(size=log.tilt_mps2.shape)
    )
    assert air_of(hovering) is None
    assert air_of(flight(lasts_s=20.0)) is None
    assert air_of(dataclasses.replace(log, tilt_mps2=np.full_like(log.tilt_mps2, np.nan))) is None
    assert air_of(dataclasses.replace(log, phase=(Phase.HOLDING.value,) * len(log.phase))) is None


def test_little_drag_tells_of_no_wind():
    log = flight()
    accelerated = np.gradient(log.velocity_mps[:, :2], log.time_s, axis=0)
    air = air_of(dataclasses.replace(log, tilt_mps2=accelerated))
    assert air is not None
    assert air.drag_per_s < 0.05
    assert air.wind_enu_mps is None


def test_a_summary_tells_where_the_wind_came_from_and_what_to_set():
    summary = {"air": air_summary(flight()), "drag_leaned_against_per_s": 0.0}
    # It blows to the east and a little south, so it comes from the west and a little north.
    assert summary["air"]["wind_from_deg"] == pytest.approx(np.degrees(np.arctan2(-3.0, 1.0)) % 360.0, abs=3.0)
    assert wind_words(summary).startswith("3.")
    assert "vehicle.drag_per_s = 0.3" in drag_words(summary)
    assert "vehicle" not in drag_words({**summary, "drag_leaned_against_per_s": 0.35})
    assert "vehicle" not in drag_words({**summary, "drag_leaned_against_per_s": None})
    assert drag_words({"air": None}) == wind_words({}) == "–"


def test_only_px4_is_told_to_lean():
    assert leaned_against_per_s(Vehicle.model_validate({"drag_per_s": 0.4})) == 0.4
    assert leaned_against_per_s(Vehicle.model_validate({"drag_per_s": 0.4, "autopilot": "ardupilot"})) is None
