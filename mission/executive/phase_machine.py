"""Runs the table of `phases`: a trigger in, the next phase, and what that phase begins with."""

from __future__ import annotations

from mission.executive.course_keeper import CourseKeeper
from mission.executive.events import Action, Entered, FindWay, Goal, RunChecks, Say, Stream, Withdraw
from mission.executive.interruption import Interruption
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.landing import Landing
from mission.executive.phases import FINAL, STREAMING, Phase, Trigger, next_phase
from mission.executive.standing_order import StandingOrder
from mission.executive.stay import Stay
from sim_bridge.state import FlightMode, Vector

GOAL = {
    Phase.ENTERING: Goal.EXPLORATION,
    Phase.TAKING_BACK: Goal.HOME,
    Phase.TURNING_BACK: Goal.HOME,
}
"""Where the way leads that is sought in a phase."""

_WHERE_STEERED = {
    Trigger.CHECKS_PASSED: Trigger.PILOT,
    Trigger.CHECKS_FAILED: Trigger.LEAVE,
    Trigger.TIMED_OUT: Trigger.LEAVE,
    Trigger.RETURN: Trigger.LEAVE,
    Trigger.LAND: Trigger.LEAVE,
}
"""What is done about a flying vehicle instead, before it was ever ours."""

_PAUSED_LATER = (Phase.CHECKING_ALOFT, Phase.TAKING_OFF, Phase.BLIND, *GOAL)
"""Phases that a pause waits for: the climb, a way that is sought, a link."""
_STANDS = (Phase.HOLDING, Phase.AUTO_HOLD, Phase.RETURN_PAUSED)
_KEEPS_PAUSE = (
    Trigger.CHECKS_PASSED,
    Trigger.AT_ALTITUDE,
    Trigger.AT_ALTITUDE_MISSION,
    Trigger.UNDER_CONTROL,
    Trigger.LINK_LOST,
    Trigger.LINK_BACK,
    Trigger.LINK_BACK_HOLDING,
    Trigger.LINK_BACK_HOMEWARD,
)
"""What does not end a pause: all else is a wish of the operator, somebody else's doing, or a danger."""


class PhaseMachine:
    """The phase a flight is in, and everything that entering one sets off.

    Args:
        vehicle: The vehicle as far as it was heard.
        keeper: Keeps the course.
        order: What the vehicle is asked for.
        landing: Chooses where to land.
        now_s: Flight clock at the beginning.
    """

    def __init__(
        self,
        vehicle: KnownVehicle,
        keeper: CourseKeeper,
        order: StandingOrder,
        landing: Landing,
        now_s: float,
    ) -> None:
        self._vehicle = vehicle
        self._keeper = keeper
        self._order = order
        self._landing = landing
        self._actions: list[Action] = []
        self._asked = 0
        self.interruption = Interruption()
        self.wanted: FindWay | None = None
        """The way that is sought; None: none."""
        self.landing_m: Vector | None = None
        """Where the way home leads, on the ground; None: none was sought yet."""
        self.stay = Stay(Phase.CONNECTING, now_s)
        self.why = "started"

    @property
    def phase(self) -> Phase:
        """What the flight is doing."""
        return self.stay.phase

    def fire(self, trigger: Trigger, now_s: float) -> bool:
        """Take the row for a trigger.

        Returns:
            Whether there is one for the present phase.
        """
        phase, trigger = self.phase, self._sparing(trigger)
        row = next_phase(phase, trigger)
        if row is None:
            return False
        if trigger is Trigger.BATTERY_LOW and self.interruption.nowhere_to_land:
            # It is home already.
            return False
        goto = self.interruption.interrupted_by(phase) if row.goto is None else row.goto
        if row.goto is not None:
            self.interruption.begin(phase, goto, trigger)
        if goto is Phase.HOLDING and trigger in (Trigger.TOO_CLOSE, Trigger.OFF_TRACK):
            self.slow_down(now_s)
        if phase is Phase.FOLLOWING:
            self._keeper.leave_exploration(now_s, self._vehicle.heard_s if trigger is Trigger.LINK_LOST else None)
        self.stay = Stay(goto, now_s, phase, self._vehicle.mode)
        self.why = row.why
        self._order.begin()
        self.act(Entered(goto, row.why))
        if goto not in FINAL or trigger is Trigger.FLIES_ALREADY:
            # What was ordered in a phase must not come after its end; a flight that ends has its last order given.
            self.act(Withdraw())
        self.interruption.paused = trigger is Trigger.PAUSE or (self.interruption.paused and trigger in _KEEPS_PAUSE)
        self._enter(goto, now_s)
        if self.interruption.paused and trigger is not Trigger.PAUSE:
            self.fire(Trigger.PAUSE, now_s)
        return True

    def pause(self, now_s: float) -> bool:
        """Have the vehicle stand, now or as soon as it can, until the operator wants otherwise.

        Returns:
            Whether there is anything to stand still from.
        """
        if self.phase in _PAUSED_LATER:
            self.say("paused by the operator: it stands as soon as this is done")
        elif self.phase in _STANDS:
            self.say("paused by the operator: it stands until it is resumed")
        else:
            return not self._vehicle.down and self.fire(Trigger.PAUSE, now_s)
        self.interruption.paused = True
        return True

    def resume(self, now_s: float) -> bool:
        """Have it go on, or drop a pause that has not come into effect yet.

        Returns:
            Whether there is anything to go on with.
        """
        interruption, phase = self.interruption, self.phase
        if phase is Phase.HOLDING and interruption.by_block:
            interruption.paused = False
            self.say("the course is blocked: it goes on when a new one is proven", warning=True)
        elif interruption.paused and phase in _PAUSED_LATER and phase is not Phase.BLIND:
            interruption.paused = False
            self.say("resumed by the operator: it does not stand")
        else:
            return self.fire(Trigger.RESUME, now_s)
        return True

    def _sparing(self, trigger: Trigger) -> Trigger:
        """What a trigger comes to where somebody else steers the vehicle: nothing that would take it from them."""
        vehicle = self._vehicle
        if self.phase is Phase.CHECKING_ALOFT and not vehicle.unsteered:
            return _WHERE_STEERED.get(trigger, trigger)
        if self.phase in (Phase.ENTERING, Phase.TAKING_BACK) and vehicle.mode is FlightMode.PILOT:
            return Trigger.PILOT if trigger in (Trigger.NO_WAY, Trigger.TIMED_OUT) else trigger
        return trigger

    def slow_down(self, now_s: float, share: float | None = None) -> bool:
        """Ask less of a vehicle that does not keep to its course; false: it is asked for little already.

        One that was taken over in motion needs a moment to come to its course: that is no reason.

        Args:
            now_s: Flight clock.
            share: Of its pace that it is thought to manage past what is near; None: it is slowed down for good.
        """
        if slower := self.stay.settled(now_s) and self._keeper.slow_down(share):
            where = "past what is near" if self._keeper.slowed_here else "from here on"
            self.say(f"it does not keep to the course: {where} at {self._keeper.rate:.0%} of the pace", warning=True)
        return slower

    def speed_up(self) -> None:
        """Ask again for all that a vehicle was not slowed down from for good."""
        self._keeper.speed_up()
        self.say(f"nothing is near for a while: at {self._keeper.rate:.0%} of the pace again")

    def act(self, action: Action) -> None:
        """Have something done."""
        self._actions.append(action)

    def say(self, text: str, warning: bool = False) -> None:
        """Tell the operator."""
        self.act(Say(text, warning))

    def stream(self) -> None:
        """Have the course followed as it is now."""
        self.act(Stream(self._keeper.course))

    def stop_stream(self) -> None:
        """Have not one setpoint more sent."""
        self._keeper.drop()
        self.stream()

    def drain(self) -> list[Action]:
        """What is to be done, in order; each is handed out once."""
        actions, self._actions = self._actions, []
        return actions

    # What a phase begins with.

    def _enter(self, phase: Phase, now_s: float) -> None:
        match phase:
            case Phase.CHECKING | Phase.CHECKING_ALOFT:
                self.act(RunChecks())
            case Phase.ENTERING | Phase.TAKING_BACK | Phase.TURNING_BACK:
                self.seek_way(now_s)
            case Phase.TRANSIT | Phase.FOLLOWING | Phase.RETURNING:
                self._go(now_s)
            case Phase.HOLDING | Phase.BLIND:
                self.interruption.stand()
                self._brake(now_s)
            case Phase.LANDING | Phase.VEHICLE_RETURN | Phase.HANDING_OVER:
                self._brake(now_s)
            case Phase.OVERRIDDEN | Phase.ABORTED | Phase.LANDED | Phase.HANDED_OVER:
                self.stop_stream()
            case _:
                pass

    def seek_way(self, now_s: float) -> None:
        """Stand, and ask for a way from there to where the phase leads."""
        keeper, goal = self._keeper, GOAL[self.phase]
        keeper.way = self.wanted = None
        if keeper.course is not None and self.stay.before in STREAMING:
            self._brake(now_s)
        elif self._vehicle.state is not None:
            keeper.stand(self._vehicle.state, now_s)
            self.stream()
        assert keeper.course is not None, "a way is only sought where the vehicle has been heard"
        if goal is Goal.EXPLORATION:
            end = keeper.rejoin_m()
        elif (home_m := self._vehicle.home_m) is not None:
            # Where nowhere is clear it is home that it stands above.
            self.landing_m = self._landing.place(home_m, keeper.course.stop_position()) or home_m
            end = self._landing.above(self.landing_m)
        else:
            self.say("the vehicle has not told where its home is", warning=True)
            self.fire(Trigger.NO_WAY, now_s)
            return
        self._asked += 1
        self.wanted = FindWay(goal, keeper.course.stop_position(), end, self._asked)
        self.act(self.wanted)

    def _go(self, now_s: float) -> None:
        """Follow the way that was found, begin the exploration, or take up what was interrupted."""
        keeper, before = self._keeper, self.stay.before
        if self.phase is Phase.FOLLOWING and before is Phase.TRANSIT:
            keeper.begin_exploration(now_s)
        elif before in GOAL and keeper.way is not None:
            keeper.begin_way(keeper.way, now_s)
        elif not self.interruption.by_block:
            keeper.resume(now_s)
        self.interruption.over()
        self.stream()

    def _brake(self, now_s: float) -> None:
        if self._keeper.course is not None:
            self._keeper.brake(now_s)
            self.stream()
