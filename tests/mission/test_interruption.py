"""What keeps happening ends the exploration; what happened long ago does not."""

from mission.executive.interruption import RECOVERED_S, RECOVERIES, REMEMBERED_S, Interruption
from mission.executive.phases import Trigger


def recovered(interruption: Interruption, now_s: float) -> Trigger | None:
    interruption.stand()
    assert interruption.observe(True, now_s) is None
    return interruption.observe(True, now_s + RECOVERED_S)


def test_what_keeps_happening_is_given_up():
    interruption = Interruption()
    moments = [10.0 * count for count in range(RECOVERIES + 1)]
    assert [recovered(interruption, now_s) for now_s in moments] == [Trigger.RECOVERED] * RECOVERIES + [
        Trigger.GIVEN_UP
    ]


def test_what_happens_now_and_then_in_a_long_flight_is_recovered_from_each_time():
    interruption = Interruption()
    between_s = REMEMBERED_S / RECOVERIES + 1.0
    assert {recovered(interruption, between_s * count) for count in range(20)} == {Trigger.RECOVERED}
