"""The policy process: it checks the plans that come, drives the one that passed, and says its set-points.

A program is run here, period by period. A policy of another kind is tried on this process's copy of the world, handed
on with every wish, and driven by control; its executor here goes along on the copy, and so knows when it has ended.
What a plan says nothing of goes on: the way of the parameters before it, where it names none. Waypoints are put to the
checks as they are seen from where the car is by then.

It sees what control shows, in a copy of the world that nobody steps. A plan that comes is judged by every check before
its program starts, on the instant it would start in; one that was made for another scene, or comes too late, is not
started. A new plan takes over between two periods, and only once it has passed: what was driven goes on until then.

After every period the plan that is driven is put down in shared memory, so that a process that dies is followed by one
that goes on where it stood. When the person takes the wheel, it ends.
"""

from __future__ import annotations

import json
import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import islice, takewhile
from typing import Final, Literal

from chauffeur.concept import (
    ActionMatrix,
    ChauffeurError,
    LaneId,
    Observation,
    Parameters,
    Plan,
    Program,
    ProgramState,
    RoadGraph,
    SandboxError,
    ScenarioError,
    Setpoints,
    Trajectory,
    Turn,
    Verdict,
)
from chauffeur.concept import Policy as AnyPolicy
from chauffeur.driving.events import DriveEvent, WishEventKind
from chauffeur.driving.live.messages import (
    LEAST_PERIOD_S,
    MOST_LOOK_AHEAD_M,
    MOST_LOOK_AHEAD_S,
    MOST_PERIOD_S,
    MOST_SPEED_MPS,
    MOST_WAYPOINTS,
    LiveSetpoints,
    MessageError,
    Steered,
)
from chauffeur.driving.live.mirror import Mirror
from chauffeur.driving.live.plan_messages import (
    MOST_SAID,
    TAKES_BACK,
    TOOK_OVER,
    PlanMessage,
    PlannedScene,
    encode,
    read_order,
)
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.driving.planning import START_WITHIN_S
from chauffeur.executors import Executor, executor_for
from chauffeur.executors.parameters import TownSetPoints, parameters_executor
from chauffeur.executors.pursuit import HEADWAY_S
from chauffeur.executors.trajectory import rebased
from chauffeur.geometry import Pose
from chauffeur.geometry.road_graph import TURNS
from chauffeur.programs import Budget, ProgramExecutor, Sandbox, starting_setpoints
from chauffeur.safety.base import Check
from chauffeur.safety.checks import drive_checks, run_checks
from chauffeur.safety.words import reasons_once
from chauffeur.worlds.base import EGO
from chauffeur.worlds.places import ParkingPlaces

LIVE_BUDGET: Final = Budget(turn_s=0.4, tick_s=0.2, grace_s=0.05, start_s=1.0)
"""Wider than a control period: a policy that is late once is what the first fallback levels are for. On a busy machine
a turn of a millisecond may take 100: its limit in wall time is below what has the whole process replaced (1 s)."""
MOST_RESUMPTIONS: Final = 3
"""A program that was running each time the process died is not trusted for ever."""
_FRESH_NS: Final = 150_000_000
_EVER_NS: Final = (1 << 63) - 1

_HEAD = struct.Struct("<I")
_TURNS: Final[dict[str, Turn]] = {turn: turn for turn in TURNS}


@dataclass(frozen=True, slots=True)
class PolicyRings:
    """What the policy process writes and reads, apart from observations."""

    orders: Ring
    setpoints: Ring
    events: Ring
    checkpoints: Ring


@dataclass(slots=True)
class _Along:
    """A policy that control drives, and its executor here, whose commands go nowhere; the path of parameters needs
    none."""

    steered: Steered
    executor: Executor | None = None

    @property
    def route(self) -> str | None:
        """Where parameters lead, or what is left of that; None for policies of other kinds."""
        policy, executor = self.steered.policy, self.executor
        if not isinstance(policy, Parameters):
            return None
        return executor.route if isinstance(executor, TownSetPoints) else policy.route


@dataclass(slots=True)
class _Driven:
    """The plan that is driven: a program that is run here, or a policy that control drives."""

    wish: str
    expires_ns: int
    by: ProgramExecutor | _Along
    before: Setpoints | None = None
    """What was wished before it, to which "never mind" goes back."""
    state: ProgramState = "running"
    resumed: int = 0
    grown: bool = False
    """Its state has once been too large to be put down: it ends with this process."""

    @property
    def steered(self) -> Steered | None:
        return self.by.steered if isinstance(self.by, _Along) else None

    def close(self) -> None:
        driving = self.by.executor if isinstance(self.by, _Along) else self.by
        if driving is not None:
            driving.close()


class Policy:
    """Follows the world, and wishes; a period at each `tick`."""

    def __init__(
        self,
        mirror: Mirror,
        rings: PolicyRings,
        sandbox: Sandbox,
        *,
        checks: Sequence[Check] | None = None,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._mirror, self._rings, self._sandbox = mirror, rings, sandbox
        self._checks, self._clock_ns = drive_checks() if checks is None else checks, clock_ns
        self._orders = Reader(rings.orders)
        self._trip = 0
        self._driven: _Driven | None = None
        self._setpoints: Setpoints | None = None
        self._first = True
        self._followed_ns = 0
        self._handovers = 0
        self._handover_tick = 0
        """Period in which the wheel was last seen in other hands."""

    def close(self) -> None:
        """End the program."""
        self._drop()

    def tick(self) -> bool:
        """Follow, judge, run, wish; False where control has shown nothing new and no plan began."""
        if not self._mirror.follow():
            # A plan need not wait for the next instant, as long as the last one is no older than instants come.
            if not self._trip or self._clock_ns() - self._followed_ns > _FRESH_NS or not self._take_orders():
                return False
            self._wish()
            return True
        self._followed_ns = self._clock_ns()
        if self._mirror.trip != self._trip:
            self._new_trip()
        if self._mirror.handovers != self._handovers:
            self._taken_over()
        self._take_orders()
        self._wish()
        return True

    def _wish(self) -> None:
        """Run what is driven for a period, and say its set-points."""
        state: ProgramState = "none"
        line = None
        driven = self._driven
        if driven is not None:
            state, line = self._run(driven)
        assert self._setpoints is not None
        self._rings.setpoints.write(
            LiveSetpoints(
                trip=self._trip,
                tick=self._mirror.tick,
                plan="" if driven is None else driven.wish,
                issued_ns=self._clock_ns(),
                expires_ns=_EVER_NS if driven is None else driven.expires_ns,
                state=state,
                line=line,
                setpoints=self._setpoints,
                steered=None if driven is None else driven.steered,
                handovers=self._handovers,
            ).encode()
        )
        if driven is not None and state == "running":
            self._put_down(driven)

    def _new_trip(self) -> None:
        if self._driven is not None and self._driven.state == "running":
            self._tell("interrupted", self._driven.wish, "The trip has ended.")
        self._drop()
        self._trip = self._mirror.trip
        self._handovers = self._mirror.handovers
        self._handover_tick = self._mirror.tick if self._handovers else 0
        self._setpoints = self._mirror.world.driver().initial_setpoints()
        if self._first:
            self._first = False
            self._pick_up()

    def _taken_over(self) -> None:
        """The wheel is in other hands: what was driven has ended, and nothing is wished but what is."""
        if self._driven is not None and self._driven.state == "running":
            self._tell("interrupted", self._driven.wish, TOOK_OVER)
        self._drop()
        self._handovers, self._handover_tick = self._mirror.handovers, self._mirror.tick
        self._setpoints = starting_setpoints(self._mirror.world.perception())

    def _drop(self) -> None:
        if self._driven is not None:
            self._driven.close()
            self._driven = None

    # Orders -----------------------------------------------------------------------------------------------------------

    def _take_orders(self) -> bool:
        """Judge the newest plan that came; whether it began."""
        messages, _ = self._orders.news()
        orders: list[PlanMessage] = []
        for message in messages:
            try:
                orders.append(read_order(message.payload))
            except MessageError as error:
                self._tell("garbage", "", f"Malformed plan: {error}.")
        for passed_over in orders[:-1]:
            self._tell("superseded", passed_over.wish, "Another plan came right after it.")
        before = self._driven
        if orders:
            self._consider(orders[-1])
        return self._driven is not before

    def _consider(self, order: PlanMessage) -> None:
        """Start a plan, or say why not."""
        if self._handovers % 2:
            self._tell("interrupted", order.wish, "You have the wheel.")
            return
        if order.plan.intent == TAKES_BACK:
            self._take_back(order)
            return
        observation = self._mirror.world.observe()
        late = self._too_late(order, PlannedScene.of(self._trip, observation))
        if late:
            self._tell("stale", order.wish, late)
            return
        try:
            plan = self._as_seen_now(order, observation)
        except ScenarioError as error:
            self._tell("stale", order.wish, str(error))
            return
        if plan.policy is None:
            self._tell("refused", order.wish, plan.refusal or "The plan has no policy.")
            return
        verdicts = run_checks(plan, observation, self._mirror.limits, self._checks)
        self._tell("verdicts", order.wish, "", verdicts)
        if failed := reasons_once(verdicts):
            self._tell("refused", order.wish, failed)
            return
        try:
            by = self._ready(plan.policy, observation)
        except SandboxError as error:
            self._tell("failed", order.wish, str(error))
            return
        except ChauffeurError as error:  # the road has no such way: known only when the policy meets the world
            self._tell("refused", order.wish, str(error))
            return
        if self._driven is not None and self._driven.state == "running":
            self._tell("superseded", self._driven.wish, "A new wish took over.")
        self._drop()
        self._driven = _Driven(order.wish, order.expires_ns, by, before=self._setpoints)
        self._tell("started", order.wish, plan.thoughts.text)

    def _take_back(self, order: PlanMessage) -> None:
        """End what is driven: the speed and distance before it are wished again, in the lane the car is in."""
        driven = self._driven
        if driven is not None:
            if driven.state == "running":
                self._tell("superseded", driven.wish, "You took it back.")
            self._drop()
            now = self._setpoints or Setpoints()
            lane = self._mirror.world.perception().lane_of(EGO)
            self._setpoints = replace(driven.before or now, target_lane=lane, served_stops=now.served_stops)
        self._tell("answered", order.wish, order.plan.thoughts.text)

    def _as_seen_now(self, order: PlanMessage, observation: Observation) -> Plan:
        """The plan, with waypoints that count from where the car is now. Raises ScenarioError: they are behind it."""
        plan, pose = order.plan, order.scene.pose
        if not isinstance(plan.policy, Trajectory) or pose is None:
            return plan
        ego = observation.ego
        there, here = Pose(*pose), Pose(ego.x_m, ego.y_m, ego.heading_rad)
        return replace(plan, policy=rebased(plan.policy, there, here))

    def _ready(self, policy: AnyPolicy, observation: Observation) -> ProgramExecutor | _Along:
        """Something that is ready to be driven. Raises SandboxError, or ScenarioError where no such way is."""
        if not isinstance(policy, Program):
            return self._tried(policy, observation)
        setpoints = self._setpoints
        if setpoints is not None and setpoints.target_lane is None:  # after parameters: control found the lane
            setpoints = replace(setpoints, target_lane=self._mirror.world.perception().lane_of(EGO))
        executor = ProgramExecutor(sandbox=self._sandbox, library=policy.library)
        try:
            executor.start(policy.source, self._mirror.world, setpoints=setpoints)
        except SandboxError:
            executor.close()
            raise
        return executor

    def _tried(self, policy: Parameters | ActionMatrix | Trajectory, observation: Observation) -> _Along:
        """A policy as control will drive it, from where the car is now. Raises ScenarioError."""
        ego = observation.ego
        if isinstance(policy, Parameters):
            return self._way_of(policy, observation)
        if isinstance(policy, Trajectory):
            if len(policy.waypoints_m) > MOST_WAYPOINTS or not LEAST_PERIOD_S <= policy.period_s <= MOST_PERIOD_S:
                raise ScenarioError(
                    f"The trajectory has {len(policy.waypoints_m)} waypoints, {policy.period_s:g} s apart.",
                    hint=f"Give up to {MOST_WAYPOINTS}, {LEAST_PERIOD_S:g} to {MOST_PERIOD_S:g} s apart.",
                )
            points = tuple((round(x, 3), round(y, 3)) for x, y in policy.waypoints_m)
            policy = Trajectory(points, policy.period_s)
        pose = (round(ego.x_m, 3), round(ego.y_m, 3), round(ego.heading_rad, 5), round(max(ego.speed_mps, 0.0), 3))
        return self._along(Steered(policy, ego.lane, pose), observation)

    def _way_of(self, policy: Parameters, observation: Observation) -> _Along:
        """Parameters, with the way that goes on where they name none. Raises ScenarioError."""
        before = None if self._driven is None or self._driven.state != "running" else self._driven.by
        was = before.route if isinstance(before, _Along) else None
        route = policy.route
        if not route:
            route = self._turn_wished(observation) if was is None else was
        executor = parameters_executor(self._mirror.world)
        goes_along = isinstance(executor, TownSetPoints)
        if route != was or goes_along:
            executor.start(replace(policy, route=route), observation, self._mirror.limits)
            route = executor.route
        bounded = replace(
            policy,
            target_speed_mps=min(policy.target_speed_mps, MOST_SPEED_MPS),
            look_ahead_m=min(policy.look_ahead_m, MOST_LOOK_AHEAD_M),
            look_ahead_ratio=min(policy.look_ahead_ratio, MOST_LOOK_AHEAD_S),
            route=route,
        )
        return _Along(Steered(bounded, observation.ego.lane), executor if goes_along else None)

    def _along(self, steered: Steered, observation: Observation) -> _Along:
        executor = executor_for(steered.policy, self._mirror.world)
        executor.start(steered.policy, observation, self._mirror.limits, steered.ego(observation.ego))
        return _Along(steered, executor)

    def _turn_wished(self, observation: Observation) -> str:
        """The turn that the program before asked for, where a crossing is ahead."""
        turn = None if self._setpoints is None else self._setpoints.turn
        return turn or "" if observation.road.junctions else ""

    def _too_late(self, order: PlanMessage, now: PlannedScene) -> str:
        scene = order.scene
        if scene.trip != now.trip:
            return "The plan was made for another trip."
        if self._clock_ns() > min(order.start_by_ns, order.expires_ns):
            return "The plan came too late."
        if (now.tick - scene.tick) * self._mirror.world.dt_s > START_WITHIN_S:
            return "The plan was made for an instant that is long gone."
        if self._handovers and scene.tick < self._handover_tick:
            return "The plan was made before the wheel changed hands."
        policy = order.plan.policy
        if isinstance(policy, ActionMatrix | Trajectory) or (isinstance(policy, Parameters) and policy.lane == 0):
            # Gains, a speed, and a way by its name rely neither on the lane nor on who is ahead; waypoints are checked
            # again as they are seen now.
            return ""
        if not _goes_on(self._mirror.world.observe().road, scene.lane, now.lane):
            return "The car is in another lane than the plan was made for."
        if scene.lead != now.lead:
            return "Another car is ahead than the plan was made for."
        return ""

    # The plan that is driven ------------------------------------------------------------------------------------------

    def _run(self, driven: _Driven) -> tuple[ProgramState, int | None]:
        if isinstance(driven.by, _Along):
            return self._look_on(driven, driven.by), None
        before = driven.state
        try:
            tick = driven.by.tick()
        except SandboxError as error:
            driven.state = "failed"
            if before != "failed":
                self._tell("failed", driven.wish, str(error))
            return "failed", None
        driven.state, self._setpoints = tick.state, tick.setpoints
        for text in tick.said:
            self._tell("said", driven.wish, text)
        if tick.state != before or (tick.state == "failed" and tick.error is not None and before != "failed"):
            self._tell(_ENDS[tick.state], driven.wish, "" if tick.error is None else str(tick.error))
        return tick.state, tick.line

    def _look_on(self, driven: _Driven, along: _Along) -> ProgramState:
        """What is wished with a policy that control drives, and whether it has ended: parameters where they lead to a
        spot and the car is parked in it, others where their executor says so."""
        policy, world = along.steered.policy, self._mirror.world
        ended = ""
        if isinstance(along.executor, TownSetPoints):
            self._setpoints = along.executor.tick().setpoints
            ended = "We are there." if along.executor.status == "finished" else ""
        elif isinstance(policy, Parameters):
            self._setpoints = Setpoints(policy.target_speed_mps, HEADWAY_S, None, _TURNS.get(policy.route))
            spot = world.parked() if isinstance(world, ParkingPlaces) else None
            ended = f"Parked in {spot}." if spot is not None and spot == policy.route else ""
        elif driven.state == "running" and along.executor is not None:
            try:
                along.executor.step(world.observe())
            except Exception as error:  # noqa: BLE001 - control drives by the same executor, and falls back as well
                driven.state = "failed"
                self._tell("failed", driven.wish, f"{type(error).__name__}: {error}")
                return driven.state
            self._setpoints = along.executor.setpoints
            ended = "It has been driven." if along.executor.status == "finished" else ""
        if driven.state == "running" and ended:
            driven.state = "finished"
            self._tell("finished", driven.wish, ended)
        return driven.state

    # Putting down and picking up --------------------------------------------------------------------------------------

    def _put_down(self, driven: _Driven) -> None:
        if driven.grown:  # putting it down again would take longer each period, and come to nothing
            return
        body = b""
        if isinstance(driven.by, ProgramExecutor):
            try:
                body = driven.by.dump()
            except SandboxError:
                return  # it failed of it, and the next period says so
        message = self._checkpoint(driven, body)
        if len(message) > self._rings.checkpoints.size:
            driven.grown = True
            message = self._checkpoint(driven, b"")  # an older state of it would be worse than none
        self._rings.checkpoints.write(message)

    def _checkpoint(self, driven: _Driven, body: bytes) -> bytes:
        head = {
            "trip": self._trip, "wish": driven.wish, "expires_ns": driven.expires_ns, "resumed": driven.resumed,
            "handovers": self._handovers, "steered": None if driven.steered is None else driven.steered.fields(),
            "grown": driven.grown,
        }  # fmt: skip
        text = json.dumps(head).encode()
        return _HEAD.pack(len(text)) + text + body

    def _pick_up(self) -> None:
        """Go on with the plan of the process before this one, if there was one in this trip.

        Checkpoints are written by policy processes alone; no other process is told where they lie.
        """
        message = self._rings.checkpoints.latest()
        if message is None:
            return
        try:
            length = _HEAD.unpack_from(message.payload)[0]
            head = json.loads(message.payload[_HEAD.size : _HEAD.size + length])
            if head["trip"] != self._trip or self._clock_ns() > head["expires_ns"] or self._ended_since(head["wish"]):
                return
            resumed, handovers, grown = int(head["resumed"]) + 1, int(head["handovers"]), bool(head["grown"])
            steered = None if head["steered"] is None else Steered.read(head["steered"])
        except (struct.error, ValueError, KeyError, TypeError):  # it must not keep every later process from starting
            return
        if handovers != self._handovers:
            self._tell("interrupted", head["wish"], TOOK_OVER)
            return
        if grown:
            self._tell("interrupted", head["wish"], "The plan kept too much to be put down; it ended with its process.")
            return
        if resumed > MOST_RESUMPTIONS:
            self._tell("interrupted", head["wish"], "The plan was driven whenever its process died.")
            return
        try:
            by = self._taken_up(steered, message.payload[_HEAD.size + length :])
        except ChauffeurError as error:
            self._tell("interrupted", head["wish"], str(error))
            return
        self._driven = _Driven(head["wish"], head["expires_ns"], by, resumed=resumed)
        self._tell("resumed", head["wish"], "The process that drove the plan was replaced; it goes on.")

    def _taken_up(self, steered: Steered | None, state: bytes) -> ProgramExecutor | _Along:
        """What is driven, as it was put down. Raises SandboxError or ScenarioError."""
        if steered is not None and isinstance(steered.policy, Parameters):
            executor = parameters_executor(self._mirror.world)
            if not isinstance(executor, TownSetPoints):
                return _Along(steered)  # not tried again: the way to a spot is none once the car is on it
        if steered is not None:
            return self._along(steered, self._mirror.world.observe())
        by = ProgramExecutor(sandbox=self._sandbox)
        try:
            by.load(state, self._mirror.world)
        except SandboxError:
            by.close()
            raise
        return by

    def _ended_since(self, wish: str) -> bool:
        """Whether the wish heard last was of another plan, or of one that ran no more."""
        message = self._rings.setpoints.latest()
        if message is None:
            return True
        try:
            last = LiveSetpoints.decode(message.payload)
        except MessageError:
            return True
        return last.plan != wish or last.state != "running"

    def _tell(
        self, kind: WishEventKind | Literal["verdicts"], wish: str, text: str, value: tuple[Verdict, ...] | None = None
    ) -> None:
        event = DriveEvent(kind, wish, text[:MOST_SAID], self._trip, self._mirror.tick, value=value)
        self._rings.events.write(encode(event))


def _goes_on(road: RoadGraph, before: LaneId | None, now: LaneId | None) -> bool:
    """Whether a lane is the one before, or the one that it leads into short of the next junction."""
    if before == now:
        return True
    onward = islice(road.ahead(before), 1, _SECTIONS + 1) if before is not None and before in road else ()
    return any(lane.id == now for lane in takewhile(lambda lane: not lane.junction, onward))


_SECTIONS: Final = 3
"""Sections of a lane that a car may have passed while it was planned for."""
_ENDS: Final[dict[ProgramState, WishEventKind]] = {"finished": "finished", "failed": "failed"}
