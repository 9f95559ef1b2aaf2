"""The policy process: it checks the plans that come, runs the program of the one that is driven, and says its wishes.

It sees what control shows, in a copy of the world that nobody steps. A plan that comes is judged by every check before
its program starts, on the instant it would start in; one that was made for another scene, or comes too late, is not
started. A new plan takes over between two periods, and only once it has passed: what was driven goes on until then.

After every period the running program is put down in shared memory, so that a process that dies is followed by one
that goes on where it stood.
"""

from __future__ import annotations

import contextlib
import json
import struct
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Program, ProgramState, SandboxError, Wishes
from chauffeur.drive.live.messages import MessageError, Wish
from chauffeur.drive.live.mirror import Mirror
from chauffeur.drive.live.orders import MOST_SAID, START_WITHIN_S, Event, EventKind, Order, Scene, encode, read_order
from chauffeur.drive.live.ring import Reader, Ring
from chauffeur.programs import Budget, ProgramExecutor, Sandbox, starting_wishes
from chauffeur.safety.base import Check
from chauffeur.safety.checks import DRIVE_CHECKS, run_checks

LIVE_BUDGET: Final = Budget(turn_s=0.1, tick_s=0.2, grace_s=0.05, start_s=1.0)
"""Wider than a control period: a policy that is late once is what the ladder's first rungs are for."""
MOST_RESUMPTIONS: Final = 3
"""A program that was running each time the process died is not trusted for ever."""
_EVER_NS: Final = (1 << 63) - 1

_HEAD = struct.Struct("<I")


@dataclass(frozen=True, slots=True)
class PolicyRings:
    """What the policy process writes and reads, apart from observations."""

    orders: Ring
    wishes: Ring
    events: Ring
    checkpoints: Ring


@dataclass(slots=True)
class _Driven:
    """The plan that is driven."""

    wish: str
    expires_ns: int
    executor: ProgramExecutor
    state: ProgramState = "running"
    resumed: int = 0


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

    def close(self) -> None:
        """End the program."""
        self._drop()

    def tick(self) -> bool:
        """Follow, judge, run, wish; False where control has shown nothing new."""
        if not self._mirror.follow():
            return False
        if self._mirror.trip != self._trip:
            self._new_trip()
        self._take_orders()
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
            ).encode()
        )
        if driven is not None and state == "running":
            self._put_down(driven)
        return True

    def _new_trip(self) -> None:
        if self._driven is not None and self._driven.state == "running":
            self._tell("interrupted", self._driven.wish, "The trip has ended.")
        self._drop()
        self._trip = self._mirror.trip
        self._wishes = starting_wishes(self._mirror.world.perception())
        if self._first:
            self._first = False
            self._pick_up()

    def _drop(self) -> None:
        if self._driven is not None:
            self._driven.executor.close()
            self._driven = None

    # Orders -----------------------------------------------------------------------------------------------------------

    def _take_orders(self) -> None:
        messages, _ = self._orders.news()
        orders: list[Order] = []
        for message in messages:
            try:
                orders.append(read_order(message.payload))
            except MessageError as error:
                self._tell("garbage", "", f"A plan that is none: {error}.")
        for passed_over in orders[:-1]:
            self._tell("superseded", passed_over.wish, "Another plan came right after it.")
        if orders:
            self._consider(orders[-1])

    def _consider(self, order: Order) -> None:
        """Start a plan, or say why not."""
        snapshot = self._mirror.world.snapshot()
        late = self._too_late(order, Scene.of(self._trip, snapshot))
        if late:
            self._tell("stale", order.wish, late)
            return
        plan = order.plan
        if not isinstance(plan.policy, Program):
            self._tell("refused", order.wish, plan.refusal or "The plan is no program.")
            return
        verdicts = run_checks(plan, snapshot, self._mirror.limits, self._checks)
        failed = [verdict.reason for verdict in verdicts if verdict.stops]
        if failed:
            self._tell("refused", order.wish, " ".join(failed))
            return
        executor = ProgramExecutor(sandbox=self._sandbox, library=plan.policy.library)
        try:
            state = executor.start(plan.policy.source, self._mirror.world, wishes=self._wishes)
        except SandboxError as error:
            executor.close()
            self._tell("failed", order.wish, str(error))
            return
        if self._driven is not None and self._driven.state == "running":
            self._tell("superseded", self._driven.wish, "A new wish took over.")
        self._drop()
        self._driven = _Driven(order.wish, order.expires_ns, executor, state)
        self._tell("started", order.wish, plan.thoughts.text)

    def _too_late(self, order: Order, now: Scene) -> str:
        scene = order.scene
        if scene.trip != now.trip:
            return "The plan was made for another trip."
        if self._clock_ns() > min(order.start_by_ns, order.expires_ns):
            return "The plan came too late."
        if (now.tick - scene.tick) * self._mirror.world.dt_s > START_WITHIN_S:
            return "The plan was made for an instant that is long gone."
        if scene.lane != now.lane:
            return "The car is in another lane than the plan was made for."
        if scene.lead != now.lead:
            return "Another car is ahead than the plan was made for."
        return ""

    # The program ------------------------------------------------------------------------------------------------------

    def _run(self, driven: _Driven) -> tuple[ProgramState, int | None]:
        before = driven.state
        try:
            tick = driven.executor.tick()
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

    # Putting down and picking up --------------------------------------------------------------------------------------

    def _put_down(self, driven: _Driven) -> None:
        head = {
            "trip": self._trip, "wish": driven.wish, "expires_ns": driven.expires_ns, "resumed": driven.resumed,
        }  # fmt: skip
        text = json.dumps(head).encode()
        with contextlib.suppress(ValueError, SandboxError):  # too large to be put down: it ends with this process
            self._rings.checkpoints.write(_HEAD.pack(len(text)) + text + driven.executor.dump())

    def _pick_up(self) -> None:
        """Go on with the program of the process before this one, if there was one in this trip.

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
            resumed = head["resumed"] + 1
        except (struct.error, ValueError, KeyError, TypeError):  # it must not keep every later process from starting
            return
        if resumed > MOST_RESUMPTIONS:
            self._tell("interrupted", head["wish"], "The program was running whenever its process died.")
            return
        executor = ProgramExecutor(sandbox=self._sandbox)
        try:
            executor.load(message.payload[_HEAD.size + length :], self._mirror.world)
        except SandboxError as error:
            executor.close()
            self._tell("interrupted", head["wish"], str(error))
            return
        self._driven = _Driven(head["wish"], head["expires_ns"], executor, resumed=resumed)
        self._tell("resumed", head["wish"], "The process that ran the program was replaced; it goes on.")

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
