"""The multirotor under anything that can be asked of it: no limit is ever passed."""

import math

from hypothesis import given, settings
from hypothesis import strategies as st

from sim_bridge.vehicle.kinematics import Airframe, Multirotor, SpeedLimits, Target, Wind

DT_S = 0.01
SLACK = 1e-6

numbers = st.floats(-1e6, 1e6) | st.floats(-20.0, 20.0)
vectors = st.tuples(numbers, numbers, numbers)
targets = st.builds(
    Target,
    position_ned_m=st.tuples(*(st.none() | numbers,) * 3),
    velocity_ned_mps=vectors,
    acceleration_ned_mps2=vectors,
    yaw_rad=st.none() | st.floats(-1e3, 1e3),
    yaw_rate_radps=st.floats(-10.0, 10.0),
)
airframes = st.builds(
    Airframe,
    max_acceleration_mps2=st.floats(0.5, 8.0),
    max_climb_acceleration_mps2=st.floats(0.5, 6.0),
    max_jerk_mps3=st.floats(2.0, 100.0),
    max_yaw_rate_radps=st.floats(0.1, 4.0),
    lag_s=st.floats(0.02, 0.5),
)
winds = st.builds(Wind, mean_ned_mps=st.tuples(*(st.floats(-12.0, 12.0),) * 3), gust_mps=st.floats(0.0, 4.0))


@settings(max_examples=60, deadline=None)
@given(airframes, winds, st.lists(targets, min_size=1, max_size=6), st.integers(0, 99))
def test_acceleration_jerk_and_yaw_rate_stay_within_their_limits_and_nothing_runs_away(airframe, wind, asked, seed):
    rotor = Multirotor(airframe, wind, seed)
    rotor.position_ned_m = (0.0, 0.0, -50.0)
    charge = rotor.battery
    for target in asked:
        for _ in range(60):
            before, heading = rotor.acceleration_ned_mps2, rotor.yaw_rad
            rotor.fly(target, DT_S)
            ax, ay, az = rotor.acceleration_ned_mps2
            assert math.hypot(ax, ay) <= airframe.max_acceleration_mps2 + SLACK
            assert abs(az) <= airframe.max_climb_acceleration_mps2 + SLACK
            assert math.dist(rotor.acceleration_ned_mps2, before) <= airframe.max_jerk_mps3 * DT_S + SLACK
            turned = abs(math.remainder(rotor.yaw_rad - heading, 2.0 * math.pi))
            assert turned <= airframe.max_yaw_rate_radps * DT_S + SLACK
            assert all(map(math.isfinite, (*rotor.position_ned_m, *rotor.velocity_ned_mps)))
            assert rotor.position_ned_m[2] <= rotor.ground_down_m
            assert rotor.battery <= charge
            charge = rotor.battery


@settings(max_examples=40, deadline=None)
@given(targets, st.floats(2.0, 15.0), st.floats(0.5, 4.0), st.floats(0.5, 3.0))
def test_whatever_is_asked_the_speed_settles_within_the_limits(target, horizontal_mps, climb_mps, descent_mps):
    rotor = Multirotor(Airframe(), Wind())
    rotor.limits = SpeedLimits(horizontal_mps, climb_mps, descent_mps)
    rotor.position_ned_m = (0.0, 0.0, -5000.0)
    # Without a feed-forward that pushes on for ever; that alone may pass a speed, as on the real ones.
    steady = Target(target.position_ned_m, target.velocity_ned_mps, yaw_rad=target.yaw_rad)
    for _ in range(3000):
        rotor.fly(steady, DT_S)
    vx, vy, vz = rotor.velocity_ned_mps
    assert math.hypot(vx, vy) <= 1.02 * horizontal_mps
    assert -1.02 * climb_mps <= vz <= 1.02 * descent_mps
