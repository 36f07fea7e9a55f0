"""The multirotor against its limits and closed forms."""

import itertools
import math

import pytest

from sim_bridge.state import GRAVITY_MPS2
from sim_bridge.vehicle.airframes import AirframeKind, airframe
from sim_bridge.vehicle.kinematics import Airframe, Multirotor, Target, Wind

DT_S = 0.01
HOLD = Target(position_ned_m=(0.0, 0.0, -20.0), yaw_rad=0.0)


def airborne(wind: Wind | None = None, seed: int = 0, **airframe) -> Multirotor:
    rotor = Multirotor(Airframe(**airframe), wind or Wind(), seed)
    rotor.position_ned_m = (0.0, 0.0, -20.0)
    return rotor


def flown(rotor: Multirotor, target: Target, seconds: float) -> list[tuple]:
    """(position, velocity, acceleration) after each step."""
    rows = []
    for _ in range(round(seconds / DT_S)):
        rotor.fly(target, DT_S)
        rows.append((rotor.position_ned_m, rotor.velocity_ned_mps, rotor.acceleration_ned_mps2))
    return rows


FIERCE = Target(position_ned_m=(900.0, -500.0, -300.0), velocity_ned_mps=(50.0, 20.0, -30.0), yaw_rad=3.0)


def test_no_limit_is_passed_whatever_is_asked_for():
    rotor = airborne()
    frame = rotor.airframe
    rows = flown(rotor, FIERCE, 20.0)
    accelerations = [row[2] for row in rows]
    assert max(math.hypot(x, y) for x, y, _ in accelerations) <= frame.max_acceleration_mps2 + 1e-9
    assert max(abs(z) for *_, z in accelerations) <= frame.max_climb_acceleration_mps2 + 1e-9
    steps = itertools.pairwise([(0.0, 0.0, 0.0), *accelerations])
    jerks = [math.dist(before, after) / DT_S for before, after in steps]
    assert max(jerks) <= frame.max_jerk_mps3 * (1.0 + 1e-9)


def test_speeds_settle_at_the_limits():
    rotor = airborne()
    flown(rotor, FIERCE, 25.0)
    north, east, down = rotor.velocity_ned_mps
    assert math.hypot(north, east) == pytest.approx(12.0, abs=0.3)
    assert down == pytest.approx(-3.0, abs=0.1)


def test_it_turns_no_faster_than_its_yaw_rate_and_the_short_way_round():
    rotor = airborne()
    rotor.yaw_rad = math.radians(170.0)
    turn = Target(position_ned_m=(0.0, 0.0, -20.0), yaw_rad=math.radians(-170.0))
    before = rotor.yaw_rad
    total = 0.0
    for _ in range(100):
        rotor.fly(turn, DT_S)
        step = math.remainder(rotor.yaw_rad - before, 2.0 * math.pi)
        assert 0.0 <= step <= rotor.airframe.max_yaw_rate_radps * DT_S + 1e-12
        total, before = total + step, rotor.yaw_rad
    assert math.degrees(total) == pytest.approx(20.0)


def test_it_holds_its_place_in_a_steady_wind_without_a_lasting_error():
    rotor = airborne(Wind((6.0, -4.0, 0.0)))
    flown(rotor, HOLD, 40.0)
    assert math.dist(rotor.position_ned_m, (0.0, 0.0, -20.0)) < 0.05


def test_gusts_are_the_same_for_a_seed_and_differ_between_seeds():
    def ends(seed: int):
        rotor = airborne(Wind((3.0, 0.0, 0.0), gust_mps=2.0), seed)
        flown(rotor, HOLD, 10.0)
        return rotor.position_ned_m

    assert ends(1) == ends(1)
    assert ends(1) != ends(2)


def test_motors_off_it_falls_as_a_stone_does_and_stops_at_the_ground():
    rotor = airborne()
    for _ in range(100):
        rotor.rest(DT_S)
    assert 20.0 - rotor.height_m == pytest.approx(0.5 * GRAVITY_MPS2, rel=0.02)
    for _ in range(400):
        rotor.rest(DT_S)
    assert rotor.on_ground
    assert rotor.velocity_ned_mps == (0.0, 0.0, 0.0)


def test_it_never_sinks_into_the_ground():
    rotor = airborne()
    rows = flown(rotor, Target(position_ned_m=(0.0, 0.0, 50.0)), 40.0)
    assert max(position[2] for position, *_ in rows) == 0.0
    assert rotor.on_ground


def test_hovering_empties_the_battery_in_its_endurance_and_speed_and_climbing_sooner():
    def used(target: Target) -> float:
        rotor = airborne(endurance_s=1000.0)
        flown(rotor, target, 60.0)
        return 1.0 - rotor.battery

    hovering = used(HOLD)
    assert hovering == pytest.approx(0.06, rel=0.1)
    assert used(Target(velocity_ned_mps=(11.0, 0.0, 0.0))) > hovering
    assert used(Target(velocity_ned_mps=(0.0, 0.0, -3.0))) > hovering


def test_derated_motors_leave_less_acceleration():
    def distance(derating: float) -> float:
        rotor = airborne()
        rotor.derating = derating
        flown(rotor, Target(position_ned_m=(None, None, -20.0), velocity_ned_mps=(10.0, 0.0, 0.0)), 2.0)
        return rotor.position_ned_m[0]

    assert distance(0.51) < 0.7 * distance(1.0)


def test_a_smaller_step_flies_the_same_curve():
    def end(dt_s: float):
        rotor = airborne()
        target = Target(position_ned_m=(30.0, -12.0, -28.0), yaw_rad=1.0)
        for _ in range(round(6.0 / dt_s)):
            rotor.fly(target, dt_s)
        return rotor.position_ned_m

    fine = end(0.0005)
    coarse, medium = math.dist(end(0.01), fine), math.dist(end(0.005), fine)
    assert coarse < 0.2
    assert medium < 0.6 * coarse


def test_a_crazyflie_follows_in_a_room_at_its_limits_without_running_past_them():
    # A level figure of eight at up to 1 m/s and 2 m/s², a new setpoint each twentieth of a second.
    rotor = Multirotor(airframe(AirframeKind.CRAZYFLIE, 420.0), Wind())
    rotor.position_ned_m = (0.0, 0.0, -1.0)
    rate, a, b = 2.2, 0.32, 0.16

    def curve(time_s: float):
        s1, c1, s2, c2 = (f(k * rate * time_s) for k in (1.0, 2.0) for f in (math.sin, math.cos))
        place = (a * s1, b * s2, -1.0)
        velocity = (a * rate * c1, 2.0 * b * rate * c2, 0.0)
        return place, velocity, (-a * rate**2 * s1, -4.0 * b * rate**2 * s2, 0.0)

    fastest = max(math.hypot(*curve(0.01 * tick)[1]) for tick in range(1000))
    speeds, errors = [], []
    for tick in range(1000):
        if tick % 5 == 0:
            place, velocity, acceleration = curve(0.01 * tick + 0.025)
            target = Target(place, velocity, acceleration, 0.0)
        rotor.fly(target, DT_S)
        if tick > 200:
            speeds.append(math.hypot(*rotor.velocity_ned_mps))
            errors.append(math.dist(rotor.position_ned_m, curve(0.01 * (tick + 1))[0]))
    assert fastest == pytest.approx(1.0, abs=0.01)
    assert max(speeds) < 1.05 * fastest
    assert max(errors) < 0.05
