"""The table of phases, looked at as a whole."""

from mission.executive.phases import AIRBORNE, FINAL, TABLE, Phase, Trigger, next_phase


def test_every_flight_phase_has_a_way_out_for_the_operator_and_the_pilot():
    for phase in AIRBORNE:
        if phase in (Phase.LANDING, Phase.VEHICLE_RETURN):
            assert next_phase(phase, Trigger.LEAVE) is not None
        else:
            assert next_phase(phase, Trigger.LAND) is not None, phase
        assert next_phase(phase, Trigger.PILOT) is not None, phase


def test_every_phase_but_the_final_ones_can_be_left_and_every_one_is_reached():
    left = {phase for row in TABLE for phase in row.phases}
    reached = {row.goto for row in TABLE}
    assert left == set(Phase) - set(FINAL)
    assert set(Phase) - reached == {Phase.CONNECTING}


def test_no_phase_and_trigger_have_two_rows():
    pairs = [(phase, row.trigger) for row in TABLE for phase in row.phases]
    assert len(pairs) == len(set(pairs))
