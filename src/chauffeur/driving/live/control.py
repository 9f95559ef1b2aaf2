"""The control process: one period after the other, it alone commands the vehicle.

It knows the world, the driver, the shield and the fallback levels. It reads the policy's newest wish without ever
waiting for it, believes nothing of it that it cannot check, and goes on whatever has become of every other process.
Set-points of a program go through the world's own driver; every other kind of policy is driven by its executor.
While the person has the wheel, the policy is not listened to.
"""

from __future__ import annotations

import contextlib
import logging
import math
import time
from array import array
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import ActionMatrix, ChauffeurError, Command, Observation, Parameters, Setpoints, Trajectory
from chauffeur.driving.actuate import Actuated, actuate, set_points
from chauffeur.driving.fallback import MINIMAL_RISK_BRAKING_MPS2
from chauffeur.driving.live.fallback_levels import FallbackLevels
from chauffeur.driving.live.messages import FallbackLevel, LiveSetpoints, MessageError, MirroredInstant, Report, Steered
from chauffeur.driving.live.realtime import Ticker
from chauffeur.driving.live.ring import Ring
from chauffeur.driving.live.starts import Start
from chauffeur.driving.live.wheel import Wheel, pressed
from chauffeur.executors import Executor, executor_for
from chauffeur.safety.bounds import least_target_mps
from chauffeur.safety.shield import GroundShield, Shield, StreetShield, rollout, shield_for
from chauffeur.worlds.base import Driver, MirroredWorld
from chauffeur.worlds.places import TownPlaces

AHEAD_NS: Final = 50_000_000
"""How far in the future a wish may claim to be issued: clocks of one machine agree far better."""
FAULT_BRAKING_MPS2: Final = 3.0
"""What answers an error inside the control period itself."""
WARM_UP_PERIODS: Final = 30
STANDING_MPS: Final = 0.1
_ANY: Final = (
    Parameters(0.0, 10.0, 1.0),
    Trajectory(((1.0, 0.0), (2.0, 0.0)), 0.5),
    ActionMatrix((0.6, 0.02, 0.05), (10.0, 20.0, 100.0)),
)
"""One of each kind that control drives by its executor, to warm up with."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class Rings:
    """What control reads and writes."""

    setpoints: Ring
    observations: Ring
    reports: Ring
    hand: Ring


class Control:
    """Drives trips one after the other, a period at each `tick`."""

    def __init__(
        self,
        world: MirroredWorld,
        starts: Sequence[Start],
        rings: Rings,
        *,
        speed: float = 1.0,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        """Set up.

        Args:
            world: Where to drive.
            starts: The trips; the last one is the last.
            rings: Shared memory.
            speed: Vehicle time per time of the clock: 2 drives 0.1 s in every 50 ms.
            clock_ns: The clock all processes share.
        """
        self._world, self._starts, self._rings = world, starts, rings
        self._speed, self._clock_ns = speed, clock_ns
        self._trip = 0
        self._tick = 0
        self._heard = 0
        self._wish: LiveSetpoints | None = None
        self._alone_since = 0
        """Period from which nobody has wished anything."""
        self._wheel = Wheel(rings.hand, clock_ns)
        self._executor: Executor | None = None
        """Of the policy that is driven; None where set-points are, or nothing."""
        self._bound: tuple[str, Steered] | None = None
        self._unbound: tuple[str, Steered] | None = None
        """A policy that cannot be driven here: tried once."""
        self._noted = 0
        self._fallback_levels = FallbackLevels()
        self._shield: Shield | None = None
        self._driver: Driver | None = None
        self._held = Setpoints()
        self._steering = 0.0
        """Angle of the wheel as the vehicle has it."""
        self._now: Observation | None = None
        self._places = world if isinstance(world, TownPlaces) else None
        self._there: str | None = None
        """The place where the car stands, as it was told."""
        self._refused: Counter[str] = Counter()
        self._faults = 0
        self._stopping = False

    @property
    def dt_s(self) -> float:
        """Control period in vehicle time."""
        return self._world.dt_s

    @property
    def over(self) -> bool:
        """Whether every trip is over."""
        return self._trip > len(self._starts)

    def stop(self) -> None:
        """Come to a stand, then let the trip end; no further one begins."""
        self._stopping = True

    def warm_up(self) -> None:
        """Drive the first start for a moment in a world of its own kind, so that no code is met for the first time
        while driving; then forget it. What only an emergency at a crossing would call is loaded as well."""
        if any(self._world.reset(one.scenario, one.seed).road.junctions for one in self._starts):
            rollout.warm_up()
        start = self._starts[0]
        self._world.reset(start.scenario, start.seed)
        driver, shield = self._world.driver(), shield_for(self._world, start.limits)
        kinds = [None, *(one for one in _ANY if one.kind in self._world.capabilities.policies)]
        each = WARM_UP_PERIODS // len(kinds)
        executor: Executor | None = None
        for period in range(each * len(kinds)):
            if self._world.ended:
                break
            observation = self._world.observe()
            fallback = self._fallback_levels.choose(float(period), None, math.inf, observation)[1]
            setpoints, _ = set_points(self._world, observation, fallback, start.limits)
            policy = kinds[period // each]
            if policy is not None and period % each == 0:
                with contextlib.suppress(ChauffeurError):  # what its kind needs is not installed: none is driven
                    begun = executor_for(policy, self._world)
                    begun.start(policy, observation, start.limits)
                    executor = begun
            if executor is None:
                setpoints = driver.settle(setpoints)
                command = driver.command(setpoints)
            else:
                executor.tick()
                command = executor.step(observation, setpoints)
            actuate(self._world, observation, command, setpoints.target_lane, shield)
            self._world.mirrored()

    def begin_trip(self) -> bool:
        """Set up the next trip and show its first instant; False if there is none."""
        self._trip += 1
        if self.over or self._stopping:
            self._trip = len(self._starts) + 1
            return False
        start = self._starts[self._trip - 1]
        self._world.reset(start.scenario, start.seed)
        self._driver = self._world.driver()
        self._held = self._driver.initial_setpoints()
        self._shield = shield_for(self._world, start.limits)
        self._tick, self._steering = 0, 0.0
        self._let_go()
        self._there = None
        self._now = self._world.observe()
        self._show()
        return True

    def tick(self, late_ns: int = 0, missed: int = 0) -> Report:
        """One control period: hear, choose, command, show. Nothing another process does makes it raise."""
        at_s = self._tick * self.dt_s
        start = self._starts[self._trip - 1]
        level: FallbackLevel = "keep"
        clipped: tuple[str, ...] = ()
        said: tuple[str, ...] = ()
        age_s = 0.0
        observation, setpoints = self._now, self._held
        assert observation is not None, "no trip was begun"
        try:
            said = self._hear_hand(observation)
            if not self._wheel.taken:
                age_s = self._hear(start)
            level, setpoints = self._choose(at_s, age_s, observation)
            least = least_target_mps(observation, setpoints, start.limits) if level in ("follow", "hold") else 0.0
            setpoints, clipped = set_points(self._world, observation, setpoints, start.limits, least)
            if self._executor is None:
                done, settled = self._follow(observation, setpoints)
            else:
                done, settled, told = self._execute(self._executor, level, observation, setpoints, start)
                setpoints, said = settled, said + told
            self._held = settled if level == "hand" else setpoints
        except Exception:  # noqa: BLE001 - whatever it is, the car is braked in this period and control goes on
            _log.exception("a control period failed")
            self._faults += 1
            done = self._brake(observation)
        self._tick += 1
        self._steering = done.applied.steering_rad
        self._now = self._world.observe()
        said += self._arrival()
        outcome = self._outcome(observation, self._now, start)
        wish = self._wish
        report = Report(
            trip=self._trip,
            tick=self._tick - 1,
            late_ns=late_ns,
            level=level,
            plan="" if wish is None else wish.plan,
            state="none" if wish is None else wish.state,
            line=None if wish is None else wish.line,
            age_s=round(age_s, 4),
            setpoints=setpoints,
            requested=done.requested,
            applied=done.applied,
            interventions=done.interventions,
            clipped=clipped,
            refused=dict(self._refused),
            missed=missed,
            faults=self._faults,
            speed_mps=observation.ego.speed_mps,
            lane=observation.ego.lane,
            ended=bool(outcome),
            outcome=outcome,
            taken_over=self._wheel.taken,
            said=said,
        )
        self._show()
        self._report(report)
        return report

    def _report(self, report: Report) -> None:
        """Show the report; one that is too long for its place without its details."""
        try:
            self._rings.reports.write(report.encode())
        except ValueError:
            self._rings.reports.write(replace(report, interventions=(), refused={}).encode())

    def _let_go(self) -> None:
        """Nobody wishes anything any more."""
        self._wish = None
        self._executor = self._bound = self._unbound = None
        self._fallback_levels = FallbackLevels()
        self._alone_since = self._tick

    def _hear_hand(self, observation: Observation) -> tuple[str, ...]:
        """Who has the wheel, and what the person at it wishes; returns what there is to tell them."""
        assert self._driver is not None
        handovers = self._wheel.handovers
        keys = self._wheel.hear(self._refused)
        if self._wheel.handovers != handovers:
            self._leave()
            # What is, is kept: speed and lane; and the way, where a crossing is ahead.
            held, self._held = self._held, self._driver.initial_setpoints()
            self._held = replace(
                self._held, target_lane=observation.ego.lane, turn=held.turn, served_stops=held.served_stops
            )
            self._let_go()
        said: list[str] = []
        for key in keys:
            self._held, text = pressed(key, self._held, observation, self._world.perception())
            said += [text] if text else []
        return tuple(said)

    def _hear(self, start: Start) -> float:
        """Take in the policy's newest wish, if it is one; returns the age of what is followed, in vehicle time."""
        message = self._rings.setpoints.latest()
        if message is not None and message.number != self._heard:
            self._heard = message.number
            try:
                wish = self._believed(LiveSetpoints.decode(message.payload))
                if wish is not None:
                    if self._wish is not None and wish.plan != self._wish.plan:
                        self._leave()
                    self._bind(wish, start)
                    self._wish = wish
            except MessageError as error:
                self._refused[str(error)] += 1
        if self._wish is None:
            return (self._tick - self._alone_since) * self.dt_s
        # What was wished for an old instant is old, however lately it was written: the policy may see a frozen picture.
        since_issue_s = (self._clock_ns() - self._wish.issued_ns) * 1e-9 * self._speed
        return max(0.0, since_issue_s, (self._tick - self._wish.tick) * self.dt_s)

    def _believed(self, wish: LiveSetpoints) -> LiveSetpoints | None:
        """The wish, if it can be meant for now; None if it was made before the wheel last changed hands.

        Raises:
            MessageError: It cannot be meant for now.
        """
        if wish.trip != self._trip:
            raise MessageError("another trip")
        if wish.tick > self._tick:
            raise MessageError("an instant to come")
        if wish.issued_ns > self._clock_ns() + AHEAD_NS:
            raise MessageError("issued in the future")
        if self._wish is not None and wish.issued_ns < self._wish.issued_ns:
            raise MessageError("older than the one before")
        if wish.handovers > self._wheel.handovers:
            raise MessageError("of handovers to come")
        if wish.handovers < self._wheel.handovers:
            return None
        lane = wish.setpoints.target_lane
        if lane is not None and not self._world.perception().has_lane(lane):
            raise MessageError("no such lane")
        return wish

    def _bind(self, wish: LiveSetpoints, start: Start) -> None:
        """Have the policy of a wish driven from now on; nothing where it is already, or where it has none.

        Raises:
            MessageError: It cannot be driven here. What was driven goes on.
        """
        if wish.steered is None:
            self._executor = self._bound = None
            return
        bound = wish.plan, wish.steered
        if bound == self._bound:
            return
        if bound == self._unbound:
            raise MessageError("no way for this policy")
        policy, before = wish.steered.policy, self._bound
        same = before is not None and before[1].policy.kind == policy.kind
        try:
            executor = self._executor if same and self._executor is not None else executor_for(policy, self._world)
            observation = self._world.observe()
            executor.start(policy, observation, start.limits, wish.steered.ego(observation.ego))
        except Exception as error:
            # The policy has tried it on its own copy of the world; whatever this is, it must not come up again.
            self._unbound = bound
            raise MessageError("no way for this policy") from error
        self._noted = len(executor.notes) if executor is self._executor else 0
        self._executor, self._bound = executor, bound

    def _leave(self) -> None:
        """Whoever stands at the place they wanted to go to is held there until something else is wished."""
        if self._places is not None and self._there is not None:
            self._places.leave()

    def _arrival(self) -> tuple[str, ...]:
        """What there is to tell once the car stands at the place that was wished."""
        before, self._there = self._there, None if self._places is None else self._places.reached()
        return () if self._there is None or before is not None else (f"Here we are: {self._there}.",)

    def _choose(self, at_s: float, age_s: float, observation: Observation) -> tuple[FallbackLevel, Setpoints]:
        if self._stopping:
            return "stop", replace(self._held, target_speed_mps=0.0, target_lane=observation.ego.lane)
        if self._wheel.taken:
            return "hand", self._held
        wish = self._wish
        if wish is None and age_s <= self._fallback_levels.patience_s:
            return "hold", self._held  # nobody has wished anything yet
        expired = wish is not None and self._clock_ns() > wish.expires_ns
        return self._fallback_levels.choose(at_s, wish, age_s, observation, expired=expired)

    def _follow(self, observation: Observation, setpoints: Setpoints) -> tuple[Actuated, Setpoints]:
        """Drive a period by the world's own driver; returns what was done, and the set-points as they were driven."""
        assert self._driver is not None
        settled = self._driver.settle(setpoints)
        command = self._driver.command(settled)
        if settled.target_speed_mps is not None and settled.target_speed_mps <= STANDING_MPS:
            # LaMPilot's IDM has no standing still: it would start off again every other period.
            command = replace(command, acceleration_mps2=min(command.acceleration_mps2, 0.0))
        return self._actuated(observation, self._risk_least(command, observation, settled), settled), settled

    def _execute(
        self, executor: Executor, level: FallbackLevel, observation: Observation, setpoints: Setpoints, start: Start
    ) -> tuple[Actuated, Setpoints, tuple[str, ...]]:
        """Drive a period by an executor; returns what was done, what was aimed for, and what there is to tell.

        Args:
            executor: Of the policy.
            level: `follow` and `hold` ask the policy; the others hold it to their set-points.
            observation: The instant.
            setpoints: Of the level, within the limits.
            start: Of the trip.
        """
        if level in ("follow", "hold"):
            setpoints, _ = set_points(self._world, observation, executor.tick().setpoints, start.limits)
        command = executor.step(observation, setpoints)
        notes, self._noted = executor.notes[self._noted :], len(executor.notes)
        settled = executor.setpoints
        done = self._actuated(observation, self._risk_least(command, observation, None), settled)
        return done, settled, tuple(text for _, text in notes)

    def _risk_least(self, command: Command, observation: Observation, settled: Setpoints | None) -> Command:
        """Once asked to stop: the minimal-risk manoeuvre's even braking, or more for a slower lead vehicle."""
        if not self._stopping or isinstance(self._shield, GroundShield):
            return command
        speed = max(0.0, observation.ego.speed_mps)
        braking = min(MINIMAL_RISK_BRAKING_MPS2, speed / self.dt_s)
        if observation.front is not None and observation.front.speed_mps < speed:
            needed = command
            if settled is not None and self._driver is not None:  # its law brakes for a set-point of 0 with all it has
                needed = self._driver.command(replace(settled, target_speed_mps=max(speed, 1.0)))
            braking = max(braking, -needed.acceleration_mps2)
        return replace(command, acceleration_mps2=-braking)

    def _actuated(self, observation: Observation, command: Command, settled: Setpoints) -> Actuated:
        return actuate(self._world, observation, command, settled.target_lane, self._shield)

    def _brake(self, observation: Observation) -> Actuated:
        """Brake, past driver and shield, which may be what failed: wheel straight, on streets and in lots held."""
        braking = min(FAULT_BRAKING_MPS2, max(0.0, observation.ego.speed_mps) / self.dt_s)
        steering = self._steering if isinstance(self._shield, GroundShield | StreetShield) else 0.0
        return actuate(self._world, observation, Command(-braking, steering), None, None)

    def _outcome(self, before: Observation, now: Observation, start: Start) -> str:
        if now.ego.crashed:
            return "collision"
        if now.off_road:
            return "off_road"
        if self._world.ended:
            return "ended"
        if self._stopping and before.ego.speed_mps <= STANDING_MPS:
            return "stopped"
        return "ended" if self._tick * self.dt_s >= start.most_s else ""

    def _show(self) -> None:
        payload = MirroredInstant(self._trip, self._tick, self._world.mirrored(), self._wheel.handovers).encode()
        self._rings.observations.write(payload)


def run(control: Control, ticker: Ticker, asked_to_end: Callable[[], bool]) -> array[int]:
    """Drive all trips at the ticker's rate; returns how late the periods began, ns."""
    told = False
    while control.begin_trip():
        ticker.restart()
        ended = False
        while not ended:
            late = ticker.wait()
            if not told and asked_to_end():
                control.stop()
                told = True
            ended = control.tick(late, ticker.missed).ended
    return ticker.lateness_ns
