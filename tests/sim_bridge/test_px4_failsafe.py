"""PX4's failsafe state machine by itself: who wins, what ends by itself, and who may take over."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim_bridge.px4.failsafe import (
    MODES,
    Action,
    Cause,
    Failsafes,
    Response,
    on_battery,
    on_fence,
    on_ground_station_loss,
    on_stream_loss,
)
from sim_bridge.px4.modes import Mode

DELAY_S = 5.0


class Flight:
    """A machine with a clock."""

    def __init__(self, intended: Mode = Mode.OFFBOARD, impossible: tuple[Mode, ...] = ()) -> None:
        self.machine = Failsafes()
        self.intended = intended
        self.impossible = impossible
        self.now_s = 0.0

    def step(self, causes: dict[Cause, Response], changed: bool = False, after_s: float = 0.1) -> list[str]:
        self.now_s += after_s
        return self.machine.update(
            causes,
            self.intended,
            mode_changed=changed,
            can_fly=lambda mode: mode not in self.impossible,
            delay_s=DELAY_S,
            now_s=self.now_s,
        )


def test_an_action_that_ends_with_its_cause_gives_the_wanted_mode_back():
    flight = Flight()
    assert flight.step({Cause.MODE: Response(Action.HOLD)}) == ["Failsafe activated"]
    assert flight.machine.action is Action.HOLD
    assert flight.step({Cause.MODE: Response(Action.HOLD)}) == []
    flight.step({})
    assert flight.machine.action is Action.NONE


def test_a_fence_breach_outlasts_the_breach_until_another_mode_is_chosen():
    flight = Flight()
    flight.step({Cause.FENCE: on_fence(2)})
    flight.step({})
    assert flight.machine.action is Action.HOLD
    flight.intended = Mode.RETURN
    flight.step({}, changed=True)
    assert flight.machine.action is Action.NONE


def test_outside_the_fence_a_chosen_mode_takes_over_so_that_one_can_escape():
    flight = Flight()
    flight.step({Cause.FENCE: on_fence(2)})
    flight.step({Cause.FENCE: on_fence(2)}, changed=True)
    assert flight.machine.action is Action.WARN
    flight.step({Cause.FENCE: on_fence(2)})
    assert flight.machine.action is Action.WARN


def test_a_worse_cause_ends_a_take_over():
    flight = Flight()
    flight.step({Cause.FENCE: on_fence(2)})
    flight.step({Cause.FENCE: on_fence(2)}, changed=True)
    flight.step({Cause.FENCE: on_fence(2), Cause.BATTERY: on_battery(2, 2)})
    assert flight.machine.action is Action.HOLD
    flight.step({Cause.FENCE: on_fence(2), Cause.BATTERY: on_battery(2, 2)}, after_s=DELAY_S)
    assert flight.machine.action is Action.LAND


def test_delayed_actions_hold_first_and_say_for_how_long():
    flight = Flight()
    assert flight.step({Cause.BATTERY: on_battery(3, 2)}) == ["Failsafe activated: entering Hold for 5 seconds"]
    assert flight.machine.action is Action.HOLD
    flight.step({Cause.BATTERY: on_battery(3, 2)}, after_s=DELAY_S)
    assert flight.machine.action is Action.RETURN


def test_a_low_battery_only_warns_once():
    flight = Flight()
    assert flight.step({Cause.BATTERY: on_battery(3, 1)}) == ["Failsafe activated"]
    assert flight.step({Cause.BATTERY: on_battery(3, 1)}) == []
    assert not flight.machine.acts


def test_a_vehicle_that_lands_already_does_not_return():
    flight = Flight(intended=Mode.LAND)
    flight.step({Cause.GROUND_STATION: on_ground_station_loss(2)})
    flight.step({Cause.GROUND_STATION: on_ground_station_loss(2)}, after_s=DELAY_S)
    assert flight.machine.action is Action.WARN


def test_without_a_position_every_action_ends_in_a_descent():
    impossible = tuple(mode for mode in Mode if mode.needs_position)
    for wanted in (Action.HOLD, Action.RETURN, Action.LAND):
        flight = Flight(impossible=impossible)
        flight.step({Cause.MODE: Response(wanted)})
        assert flight.machine.action is Action.DESCEND


@pytest.mark.parametrize(
    ("value", "action"),
    [
        (0, Action.POSITION),
        (1, Action.ALTITUDE),
        (3, Action.RETURN),
        (4, Action.LAND),
        (5, Action.HOLD),
        (7, Action.DISARM),
    ],
)
def test_com_obl_rc_act_means(value, action):
    assert on_stream_loss(value) is action


@given(
    st.lists(
        st.dictionaries(
            st.sampled_from(Cause),
            st.builds(
                Response,
                st.sampled_from([Action.WARN, Action.HOLD, Action.RETURN, Action.LAND]),
                st.booleans(),
                st.booleans(),
            ),
        ),
        max_size=12,
    ),
    st.lists(st.sampled_from(Mode), max_size=4),
    st.booleans(),
)
def test_what_is_chosen_can_always_be_flown_or_needs_no_mode(history, impossible, changes):
    # Straight down is always possible: it needs nothing.
    flight = Flight(impossible=tuple(mode for mode in impossible if mode is not Mode.DESCEND))
    for causes in history:
        flight.step(causes, changed=changes)
        mode = MODES.get(flight.machine.action)
        assert mode is None or mode not in flight.impossible
    flight.machine.clear()
    assert flight.machine.action is Action.NONE
