"""The policy process: it checks the plans that come, drives the one that passed, and says its wishes.

A program is run here, period by period. Parameters have nothing to run: they are tried on this process's copy of the
world, handed on with every wish, and driven by control. What a plan says nothing of goes on: the way of the parameters
before it, where it names none.

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
from typing import Final

from chauffeur.concept import Parameters, Program, ProgramState, SandboxError, ScenarioError, Snapshot, Turn, Wishes
from chauffeur.drive.live.messages import (
    MOST_LOOK_AHEAD_M,
    MOST_LOOK_AHEAD_S,
    MOST_SPEED_MPS,
    MessageError,
    Steered,
    Wish,
)
from chauffeur.drive.live.mirror import Mirror
from chauffeur.drive.live.orders import (
    MOST_SAID,
    START_WITHIN_S,
    TOOK_OVER,
    Event,
    EventKind,
    Order,
    Scene,
    encode,
    read_order,
)
from chauffeur.drive.live.ring import Reader, Ring
from chauffeur.drive.parameters import HEADWAY_S, TURNS, ParametersDriver, ParkingPlaces
from chauffeur.programs import Budget, ProgramExecutor, Sandbox, starting_wishes
from chauffeur.safety.base import Check
from chauffeur.safety.checks import DRIVE_CHECKS, run_checks
from chauffeur.safety.words import reasons_once
from chauffeur.worlds.base import EGO

LIVE_BUDGET: Final = Budget(turn_s=0.1, tick_s=0.2, grace_s=0.05, start_s=1.0)
"""Wider than a control period: a policy that is late once is what the ladder's first rungs are for."""
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
    wishes: Ring
    events: Ring
    checkpoints: Ring


@dataclass(slots=True)
class _Driven:
    """The plan that is driven: a program that is run here, or parameters that control drives."""

    wish: str
    expires_ns: int
    by: ProgramExecutor | Steered
    state: ProgramState = "running"
    resumed: int = 0
    grown: bool = False
    """Its state has once been too large to be put down: it ends with this process."""

    @property
    def steered(self) -> Steered | None:
        return self.by if isinstance(self.by, Steered) else None

    def close(self) -> None:
        if isinstance(self.by, ProgramExecutor):
            self.by.close()


class Policy:
    """Follows the world, and wishes; a period at each `tick`."""

    def __init__(
        self,
        mirror: Mirror,
        rings: PolicyRings,
        sandbox: Sandbox,
        *,
        checks: Sequence[Check] = DRIVE_CHECKS,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._mirror, self._rings, self._sandbox = mirror, rings, sandbox
        self._checks, self._clock_ns = checks, clock_ns
        self._orders = Reader(rings.orders)
        self._trip = 0
        self._driven: _Driven | None = None
        self._wishes: Wishes | None = None
        self._first = True
        self._followed_ns = 0
        self._hands = 0
        self._hands_tick = 0
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
        if self._mirror.hands != self._hands:
            self._taken_over()
        self._take_orders()
        self._wish()
        return True

    def _wish(self) -> None:
        """Run what is driven for a period, and say its wishes."""
        state: ProgramState = "none"
        line = None
        driven = self._driven
        if driven is not None:
            state, line = self._run(driven)
        assert self._wishes is not None
        self._rings.wishes.write(
            Wish(
                trip=self._trip,
                tick=self._mirror.tick,
                plan="" if driven is None else driven.wish,
                issued_ns=self._clock_ns(),
                expires_ns=_EVER_NS if driven is None else driven.expires_ns,
                state=state,
                line=line,
                wishes=self._wishes,
                steered=None if driven is None else driven.steered,
                hands=self._hands,
            ).encode()
        )
        if driven is not None and state == "running":
            self._put_down(driven)

    def _new_trip(self) -> None:
        if self._driven is not None and self._driven.state == "running":
            self._tell("interrupted", self._driven.wish, "The trip has ended.")
        self._drop()
        self._trip = self._mirror.trip
        self._hands = self._mirror.hands
        self._hands_tick = self._mirror.tick if self._hands else 0
        self._wishes = starting_wishes(self._mirror.world.perception())
        if self._first:
            self._first = False
            self._pick_up()

    def _taken_over(self) -> None:
        """The wheel is in other hands: what was driven has ended, and nothing is wished but what is."""
        if self._driven is not None and self._driven.state == "running":
            self._tell("interrupted", self._driven.wish, TOOK_OVER)
        self._drop()
        self._hands, self._hands_tick = self._mirror.hands, self._mirror.tick
        self._wishes = starting_wishes(self._mirror.world.perception())

    def _drop(self) -> None:
        if self._driven is not None:
            self._driven.close()
            self._driven = None

    # Orders -----------------------------------------------------------------------------------------------------------

    def _take_orders(self) -> bool:
        """Judge the newest plan that came; whether it began."""
        messages, _ = self._orders.news()
        orders: list[Order] = []
        for message in messages:
            try:
                orders.append(read_order(message.payload))
            except MessageError as error:
                self._tell("garbage", "", f"A plan that is none: {error}.")
        for passed_over in orders[:-1]:
            self._tell("superseded", passed_over.wish, "Another plan came right after it.")
        before = self._driven
        if orders:
            self._consider(orders[-1])
        return self._driven is not before

    def _consider(self, order: Order) -> None:
        """Start a plan, or say why not."""
        if self._hands % 2:
            self._tell("interrupted", order.wish, "You have the wheel.")
            return
        snapshot = self._mirror.world.snapshot()
        late = self._too_late(order, Scene.of(self._trip, snapshot))
        if late:
            self._tell("stale", order.wish, late)
            return
        plan = order.plan
        if not isinstance(plan.policy, Program | Parameters):
            self._tell("refused", order.wish, plan.refusal or "The plan is neither a program nor parameters.")
            return
        verdicts = run_checks(plan, snapshot, self._mirror.limits, self._checks)
        if failed := reasons_once(verdicts):
            self._tell("refused", order.wish, failed)
            return
        try:
            by = self._ready(plan.policy, snapshot)
        except SandboxError as error:
            self._tell("failed", order.wish, str(error))
            return
        except ScenarioError as error:  # the road has no such way: known only when the parameters meet the world
            self._tell("refused", order.wish, str(error))
            return
        if self._driven is not None and self._driven.state == "running":
            self._tell("superseded", self._driven.wish, "A new wish took over.")
        self._drop()
        self._driven = _Driven(order.wish, order.expires_ns, by)
        self._tell("started", order.wish, plan.thoughts.text)

    def _ready(self, policy: Program | Parameters, snapshot: Snapshot) -> ProgramExecutor | Steered:
        """Something that is ready to be driven. Raises SandboxError, or ScenarioError where no such way is."""
        if isinstance(policy, Parameters):
            return self._tried(policy, snapshot)
        wishes = self._wishes
        if wishes is not None and wishes.target_lane is None:  # after parameters: control found the lane
            wishes = replace(wishes, target_lane=self._mirror.world.perception().lane_of(EGO))
        executor = ProgramExecutor(sandbox=self._sandbox, library=policy.library)
        try:
            executor.start(policy.source, self._mirror.world, wishes=wishes)
        except SandboxError:
            executor.close()
            raise
        return executor

    def _tried(self, policy: Parameters, snapshot: Snapshot) -> Steered:
        """Parameters as control will drive them, from the lane the car is in now. Raises ScenarioError."""
        before = None if self._driven is None or self._driven.state != "running" else self._driven.steered
        route = policy.route
        if not route:
            route = self._turn_wished(snapshot) if before is None else before.policy.route
        if before is None or route != before.policy.route:
            asked = replace(policy, route=route)
            spot = ParametersDriver(self._mirror.world, asked, limits=self._mirror.limits).spot
            route = route if spot is None else spot.name
        bounded = replace(
            policy,
            target_speed_mps=min(policy.target_speed_mps, MOST_SPEED_MPS),
            look_ahead_m=min(policy.look_ahead_m, MOST_LOOK_AHEAD_M),
            look_ahead_ratio=min(policy.look_ahead_ratio, MOST_LOOK_AHEAD_S),
            route=route,
        )
        return Steered(bounded, snapshot.ego.lane)

    def _turn_wished(self, snapshot: Snapshot) -> str:
        """The turn that the program before asked for, where a crossing is ahead."""
        turn = None if self._wishes is None else self._wishes.turn
        return turn or "" if snapshot.kind == "intersection" else ""

    def _too_late(self, order: Order, now: Scene) -> str:
        scene = order.scene
        if scene.trip != now.trip:
            return "The plan was made for another trip."
        if self._clock_ns() > min(order.start_by_ns, order.expires_ns):
            return "The plan came too late."
        if (now.tick - scene.tick) * self._mirror.world.dt_s > START_WITHIN_S:
            return "The plan was made for an instant that is long gone."
        if self._hands and scene.tick < self._hands_tick:
            return "The plan was made before the wheel changed hands."
        if isinstance(order.plan.policy, Parameters) and order.plan.policy.lane == 0:
            return ""  # a speed, and a way by its name: neither relies on the lane or on who is ahead
        if scene.lane != now.lane:
            return "The car is in another lane than the plan was made for."
        if scene.lead != now.lead:
            return "Another car is ahead than the plan was made for."
        return ""

    # The plan that is driven ------------------------------------------------------------------------------------------

    def _run(self, driven: _Driven) -> tuple[ProgramState, int | None]:
        if isinstance(driven.by, Steered):
            return self._look_on(driven, driven.by), None
        before = driven.state
        try:
            tick = driven.by.tick()
        except SandboxError as error:
            driven.state = "failed"
            if before != "failed":
                self._tell("failed", driven.wish, str(error))
            return "failed", None
        driven.state, self._wishes = tick.state, tick.wishes
        for text in tick.said:
            self._tell("said", driven.wish, text)
        if tick.state != before or (tick.state == "failed" and tick.error is not None and before != "failed"):
            self._tell(_ENDS[tick.state], driven.wish, "" if tick.error is None else str(tick.error))
        return tick.state, tick.line

    def _look_on(self, driven: _Driven, steered: Steered) -> ProgramState:
        """What is wished with parameters; they end where they lead to a spot and the car is parked in it."""
        policy, world = steered.policy, self._mirror.world
        self._wishes = Wishes(policy.target_speed_mps, HEADWAY_S, None, _TURNS.get(policy.route))
        if driven.state == "running" and isinstance(world, ParkingPlaces):
            spot = world.parked()
            if spot is not None and spot == policy.route:
                driven.state = "finished"
                self._tell("finished", driven.wish, f"Parked in {spot}.")
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
            "hands": self._hands, "parameters": None if driven.steered is None else driven.steered.fields(),
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
            resumed, hands, grown = int(head["resumed"]) + 1, int(head["hands"]), bool(head["grown"])
            steered = None if head["parameters"] is None else Steered.read(head["parameters"])
        except (struct.error, ValueError, KeyError, TypeError):  # it must not keep every later process from starting
            return
        if hands != self._hands:
            self._tell("interrupted", head["wish"], TOOK_OVER)
            return
        if grown:
            self._tell("interrupted", head["wish"], "The plan kept too much to be put down; it ended with its process.")
            return
        if resumed > MOST_RESUMPTIONS:
            self._tell("interrupted", head["wish"], "The plan was driven whenever its process died.")
            return
        by: ProgramExecutor | Steered
        if steered is not None:
            by = steered  # not tried again: control drives them, and the way to a spot is none once the car is on it
        else:
            by = ProgramExecutor(sandbox=self._sandbox)
            try:
                by.load(message.payload[_HEAD.size + length :], self._mirror.world)
            except SandboxError as error:
                by.close()
                self._tell("interrupted", head["wish"], str(error))
                return
        self._driven = _Driven(head["wish"], head["expires_ns"], by, resumed=resumed)
        self._tell("resumed", head["wish"], "The process that drove the plan was replaced; it goes on.")

    def _ended_since(self, wish: str) -> bool:
        """Whether the wish heard last was of another plan, or of one that ran no more."""
        message = self._rings.wishes.latest()
        if message is None:
            return True
        try:
            last = Wish.decode(message.payload)
        except MessageError:
            return True
        return last.plan != wish or last.state != "running"

    def _tell(self, kind: EventKind, wish: str, text: str) -> None:
        self._rings.events.write(encode(Event(kind, wish, text[:MOST_SAID], self._trip, self._mirror.tick)))


_ENDS: Final[dict[ProgramState, EventKind]] = {"finished": "finished", "failed": "failed"}
