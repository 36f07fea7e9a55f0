"""What the vehicle says, turned into triggers: ready, climbed, taken over, in danger, heard again."""

from __future__ import annotations

from mission.executive import readings
from mission.executive.course_keeper import CourseKeeper
from mission.executive.energy import STALE_CHARGE_S, ProvenHome
from mission.executive.events import Assignment, FlightMethod
from mission.executive.known_vehicle import KnownVehicle
from mission.executive.link_watch import LINK_LOST_S, NOTICED_S, LinkWatch
from mission.executive.monitors import Alarm, Monitors
from mission.executive.pacing import Pacing
from mission.executive.phase_machine import PhaseMachine
from mission.executive.phases import AIRBORNE, HOMEWARD, ON_COURSE, STREAMING, Phase, Trigger, order_of
from mission.executive.standing_order import STREAM_FIRST_S, StandingOrder
from mission.executive.stay import MODE_GRACE_S
from sim_bridge.state import FlightMode, VehicleState

_ALARM_INTERVAL_S = 0.1
_TELLS_WITHIN_S = 10.0
_DOUBTED = 0.1
"""A charge that is told by so much higher than the endurance allows is said to be doubted."""
_BEHIND_SHARE = 0.2
_ALARM_TRIGGER = {
    Alarm.OUTSIDE: Trigger.OUTSIDE,
    Alarm.BATTERY_LOW: Trigger.BATTERY_LOW,
    Alarm.TOO_CLOSE: Trigger.TOO_CLOSE,
    Alarm.OFF_TRACK: Trigger.OFF_TRACK,
}


class Hearing:
    """Listens to one vehicle.

    Args:
        assignment: What to fly.
        monitors: What telemetry is held against.
        vehicle: The vehicle as far as it was heard.
        link: Watches the link.
        keeper: Keeps the course.
        order: What the vehicle is asked for.
        machine: Takes the triggers.
        now_s: Flight clock at the beginning.
        patience: Flight seconds a host second.

    Attributes:
        monitors: What telemetry is held against.
        offboard_lost: How often setpoints were not followed any more.
        proven_home: The proven way home; None: not sought yet.
    """

    def __init__(
        self,
        assignment: Assignment,
        monitors: Monitors,
        vehicle: KnownVehicle,
        link: LinkWatch,
        keeper: CourseKeeper,
        order: StandingOrder,
        machine: PhaseMachine,
        now_s: float,
        patience: float,
    ) -> None:
        self.monitors = monitors
        self.offboard_lost = 0
        self.proven_home: ProvenHome | None = None
        self._assignment = assignment
        self._vehicle = vehicle
        self._link = link
        self._keeper = keeper
        self._order = order
        self._machine = machine
        self._patience = patience
        self._alarmed_s = now_s
        self._charge_told = False
        self._charge_doubted = False
        self._pacing = Pacing(keeper, machine)
        self._waiting_for: tuple[str, ...] = ()

    @property
    def _phase(self) -> Phase:
        return self._machine.phase

    def _fire(self, trigger: Trigger, now_s: float) -> bool:
        return self._machine.fire(trigger, now_s)

    def hear(self, state: VehicleState, now_s: float) -> None:
        """Take in what it tells.

        Args:
            state: What the vehicle tells.
            now_s: Flight clock.
        """
        silent_s = now_s - (self._vehicle.heard_s or now_s)
        if silent_s > LINK_LOST_S * self._patience:
            self._machine.say(f"heard again after {silent_s:.1f} s of silence", warning=True)
        self._link.stated(now_s)
        self._vehicle.hear(state, self._phase, now_s)
        match self._phase:
            case Phase.CONNECTING | Phase.WAITING_READY:
                self._fire(Trigger.CONNECTED, now_s)
                self.waits(state.waiting_for)
                if state.aloft and not self._assignment.resumed:
                    self._fire(Trigger.FLIES_ALREADY, now_s)
                elif (state.aloft or state.ready) and self._everything_told(state, now_s):
                    self._fire(Trigger.READY_ALOFT if state.aloft else Trigger.READY, now_s)
            case Phase.CHECKING | Phase.ARMING | Phase.DISARMING if state.aloft:
                # Somebody else took off with it.
                self._fire(Trigger.FLIES_ALREADY, now_s)
            case Phase.DISARMING:
                # The answer counts: before it, the order to arm may still be on its way.
                if not state.armed and self._order.taken_s is not None:
                    self._fire(Trigger.DISARMED, now_s)
            case Phase.BLIND:
                self._heard_again(state, silent_s, now_s)
            case _:
                self._catch_up(state, silent_s, now_s)
                if (trigger := readings.motors(self._machine.stay, state, now_s)) is not None:
                    self._fire(trigger, now_s)
                self._watch_mode(state, now_s)
                self._watch_alarms(state, now_s)

    def waits(self, waiting_for: tuple[str, ...]) -> None:
        """Tell the operator what the vehicle waits for, where that has changed."""
        if waiting_for and waiting_for != self._waiting_for and self._phase is Phase.WAITING_READY:
            self._machine.say("waiting for " + ", ".join(waiting_for))
            self._waiting_for = waiting_for

    def _everything_told(self, state: VehicleState, now_s: float) -> bool:
        """Whether the vehicle tells what the checks look at, or has had the time to."""
        told = None not in (state.battery_fraction, state.home_enu_m)
        return told or self._machine.stay.lasted_s(now_s) > _TELLS_WITHIN_S * self._patience

    def _heard_again(self, state: VehicleState, silent_s: float, now_s: float) -> None:
        """Go on with a vehicle that was not heard: along the course, or by a new way where it is not on it."""
        trigger = self._link.heard_again(state)
        phase = self._machine.interruption.interrupted_by(Phase.BLIND) if self._phase is Phase.BLIND else self._phase
        self.offboard_lost += trigger is not Trigger.LINK_BACK
        if trigger is Trigger.LINK_BACK and (phase in ON_COURSE or phase is Phase.HOLDING):
            apart_m = self._keeper.fall_back(state, silent_s, now_s)
            if apart_m > self.monitors.max_track_error_m:
                trigger = Trigger.LINK_BACK_HOLDING
        if trigger is Trigger.LINK_BACK_HOLDING and phase in HOMEWARD:
            trigger = Trigger.LINK_BACK_HOMEWARD
        self._fire(trigger, now_s)

    def _catch_up(self, state: VehicleState, silent_s: float, now_s: float) -> None:
        """After a silence too short to be noticed, do not have the vehicle run after a course that went on."""
        if self._phase not in ON_COURSE or silent_s < NOTICED_S:
            return
        if self._keeper.lag_m(state, now_s) > _BEHIND_SHARE * self.monitors.max_track_error_m:
            self._keeper.fall_back(state, silent_s, now_s)
            self._keeper.resume(now_s)
            self._machine.stream()

    def _climbed(self, state: VehicleState, now_s: float) -> bool:
        """Go on from the take-off, if it is done; PX4 then holds, which anywhere else is somebody else's doing."""
        if self._phase is not Phase.TAKING_OFF or self._machine.stay.lasted_s(now_s) <= STREAM_FIRST_S:
            return False
        # From where it stood, as it was asked for: PX4 moves home as it arms and again as it leaves the ground.
        ground_up_m, height_m = self._vehicle.stood_up_m, self._assignment.takeoff_altitude_m
        if not readings.at_altitude(state, self._vehicle.mode_before, ground_up_m, height_m):
            return False
        by_mission = self._assignment.method is FlightMethod.MISSION
        return self._fire(Trigger.AT_ALTITUDE_MISSION if by_mission else Trigger.AT_ALTITUDE, now_s)

    def _watch_mode(self, state: VehicleState, now_s: float) -> None:
        if self._climbed(state, now_s):
            return
        stay, command = self._machine.stay, order_of(self._phase)
        if command is not None:
            self._order.seen(command, state, now_s)
        # An order that was not taken yet leaves the mode as it was.
        due_s = self._order.taken_s if command is not None else stay.since_s
        settled = due_s is not None and now_s - due_s > MODE_GRACE_S
        if not readings.mode_is_ours(stay, settled, state):
            if self._phase in STREAMING and state.failsafe and self._link.lately_silent(now_s):
                self._heard_again(state, 0.0, now_s)
                return
            self.offboard_lost += readings.counts_as_lost_stream(self._phase)
            self._machine.say(f"the mode is {state.mode_name}, which was not asked for here", warning=True)
            self._fire(readings.taken_over_by(state), now_s)
            return
        if (
            self._phase not in STREAMING
            and self._keeper.course is not None
            and command
            and readings.obeyed(command, state)
        ):
            # Setpoints go on until the vehicle has taken the mode that does without them.
            self._machine.stop_stream()
        before_block = self._phase is Phase.AUTO_HOLD and self._machine.interruption.waits_for_way
        if before_block and not (stay.settled(now_s) and readings.stands(state)):
            return
        if (before_block or self._phase is Phase.HANDING_OVER) and state.mode is FlightMode.HOLD:
            self._fire(Trigger.MODE_TAKEN, now_s)

    def _watch_alarms(self, state: VehicleState, now_s: float) -> None:
        if self._phase not in AIRBORNE or self._phase is Phase.LANDING or now_s - self._alarmed_s < _ALARM_INTERVAL_S:
            return
        self._alarmed_s = now_s
        vehicle, interruption = self._vehicle, self._machine.interruption
        point = self._keeper.course.at(now_s) if self._keeper.course is not None and self._phase in STREAMING else None
        alarms = self.monitors.alarms(
            state, vehicle.home_m, vehicle.consumption, point, self._keeper.least_rate, self.proven_home
        )
        for alarm in alarms:
            if self._fire(_ALARM_TRIGGER[alarm], now_s):
                return
        if self._phase in ON_COURSE and self._machine.stay.settled(now_s):
            self._pacing.hear(state, self.monitors, now_s)
        self._doubt_charge(state)
        if Alarm.BATTERY_LOW in alarms and not self._charge_told:
            self._charge_told = True
            self._machine.say(f"the charge left is less than the way home needs{self._alone(state)}", warning=True)
        if self._phase is Phase.HOLDING and interruption.passes:
            near = Alarm.TOO_CLOSE in alarms or Alarm.OFF_TRACK in alarms
            trigger = interruption.observe(not near and self._keeper.stands(now_s), now_s)
            if trigger is not None:
                self._fire(trigger, now_s)

    def _alone(self, state: VehicleState) -> str:
        """How long the vehicle's own return takes, as words; empty: not known."""
        energy, home_m = self.monitors.energy, self._vehicle.home_m
        if energy.own_return is None or home_m is None:
            return ""
        takes_s = energy.alone_s(state.position_enu_m, home_m)
        return f" (the vehicle's own return takes {takes_s:.0f} s from here: {energy.own_return.named})"

    def _doubt_charge(self, state: VehicleState) -> None:
        """Say once that another charge is reckoned with than the one that is told."""
        told, consumption = state.battery_fraction, self._vehicle.consumption
        if self._charge_doubted or told is None or consumption is None:
            return
        left = f"reckoned with what vehicle.endurance_s leaves, now {consumption.left_fraction:.0%}"
        if state.battery_age_s > STALE_CHARGE_S:
            self._machine.say(f"the charge has not been told for {state.battery_age_s:.0f} s: {left}", warning=True)
        elif told - consumption.left_fraction >= _DOUBTED:
            self._machine.say(f"the charge is told to be {told:.0%}, too much to be believed: {left}", warning=True)
        else:
            return
        self._charge_doubted = True
