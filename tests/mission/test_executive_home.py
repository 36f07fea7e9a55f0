"""What sends a flight home: charge and fence."""

from mission.phases import Phase
from tests.mission.rehearsed_flight import Flight


def test_the_way_home_is_flown_when_the_charge_is_what_it_needs():
    flight = Flight()
    flight.vehicle.battery = 0.2
    flight.run()
    assert flight.phase is Phase.LANDED
    assert not flight.executive.explored
    assert Phase.RETURNING in flight.phases
    # The reserve is still there, and was not wasted either.
    assert 0.15 <= flight.vehicle.battery <= 0.18


def test_a_hungry_vehicle_turns_back_earlier():
    lazy, hungry = Flight(), Flight()
    lazy.vehicle.battery = hungry.vehicle.battery = 0.5
    hungry.vehicle.drain_per_s = 3.0 / 1200.0
    charges = []
    for flight in (lazy, hungry):
        flight.run(lambda f: f.phase is Phase.TURNING_BACK)
        charges.append(flight.vehicle.battery)
        assert flight.run().phase is Phase.LANDED
        assert flight.vehicle.battery >= 0.14
    assert charges[1] < charges[0] or not hungry.executive.explored


def test_outside_the_fence_it_turns_back():
    flight = Flight().exploring()
    flight.fence_east_m = float(flight.vehicle.position[0]) - 2.0
    flight.run_for(0.1)
    assert flight.phase is Phase.TURNING_BACK
    assert flight.run().phase is Phase.LANDED
