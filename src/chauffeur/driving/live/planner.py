"""The planner process: from words to plans, however long that takes and whatever comes of it.

Models, network, memory and prompts live here. Nothing waits for this process: if it hangs, floods or dies, a wish goes
unanswered until the supervisor has started another one, and the car drives on with the plan it has.
"""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import (
    ANSWERED,
    CameraImage,
    ChauffeurError,
    Context,
    History,
    Instruction,
    Observation,
    PersonId,
    Plan,
    Program,
    Thoughts,
)
from chauffeur.describe.answers import with_doing, with_way
from chauffeur.describe.services.sources import Sources, SourceSettings
from chauffeur.driving.emergency import NO_SHOULDER, STOPPING, planned_for
from chauffeur.driving.events import DriveEvent, WishEventKind
from chauffeur.driving.live.messages import MessageError
from chauffeur.driving.live.mirror import Mirror
from chauffeur.driving.live.plan_messages import (
    MOST_SAID,
    TAKES_BACK,
    PlanMessage,
    PlannedScene,
    PlanningInputs,
    Request,
    encode,
    read_request,
)
from chauffeur.driving.live.ring import Reader, Ring
from chauffeur.driving.loop import LoopMemory
from chauffeur.driving.planning import PLAN_WITHIN_S, RECALLED, START_WITHIN_S, Judged, PlanSteps, plan_once
from chauffeur.driving.questions import NOT_MEANT, TAKEN_BACK, Conversing
from chauffeur.driving.seat import SeatCamera
from chauffeur.driving.session import informed, parse_wish
from chauffeur.driving.surroundings import describing, opened, weathered
from chauffeur.memory.tolerant import TolerantMemory
from chauffeur.planners.base import Planner, looks
from chauffeur.planners.prompts import Setting, build_system_message
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.safety.checks import drive_checks, run_checks
from chauffeur.safety.faithfulness import FAITHFULNESS_CHECK, check_faithfulness
from chauffeur.worlds.places import TownPlaces

FOLLOW_FOR_S: Final = 600.0
"""Vehicle time for which a plan may be followed."""
LOOK_EVERY_S: Final = 0.02
_NEWER: Final = {False: "A newer wish came.", True: "Something newer was said."}


@dataclass(frozen=True, slots=True)
class PlanningRings:
    """What the planner process reads and writes, apart from observations."""

    requests: Ring
    orders: Ring
    briefs: Ring
    events: Ring


class Planning:
    """Answers wishes, one at a time; a newer one ends the work on an older one. A question is answered beside it."""

    def __init__(
        self,
        mirror: Mirror,
        rings: PlanningRings,
        planner: Planner,
        memory: LoopMemory,
        *,
        sources: SourceSettings | None = None,
        setting: Setting = "few-shot",
        speed: float = 1.0,
        clock_ns: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._mirror, self._rings, self._planner = mirror, rings, planner
        self._memory = TolerantMemory(memory, self._say)
        self._where = sources
        self._sources: Sources | None = None
        self._setting: Setting = setting
        self._speed, self._clock_ns = speed, clock_ns
        self._asked = Reader(rings.requests)
        self._talk = Conversing()
        self._ended_for = ""
        """Wish for which the work on an older one ended."""
        self._at_work: dict[bool, tuple[asyncio.Task[None], Request]] = {}
        """The wish (False), and what was said aside (True), that were taken up last."""

    async def run(self, over: Callable[[], bool]) -> None:
        """Answer wishes until it is over."""
        async with opened(self._where) as self._sources:
            while not over():
                await self.look()
                await asyncio.sleep(LOOK_EVERY_S)
            for aside in (False, True):
                await self._give_up(aside, "The drive is over.")

    async def look(self) -> None:
        """Take up the newest wish, and the newest thing said aside; older work of the same kind ends."""
        messages, _ = self._asked.news()
        requests: list[Request] = []
        for message in messages:
            try:
                requests.append(read_request(message.payload))
            except MessageError as error:
                self._tell("garbage", "", f"Malformed wish: {error}.")
        for aside in (False, True):
            *passed_over, newest = [None, *(one for one in requests if one.aside == aside)]
            if newest is None:
                continue
            ended = await self._give_up(aside, _NEWER[aside]) or bool(passed_over[1:])
            self._ended_for = newest.wish if ended else ""
            for request in filter(None, passed_over):
                self._tell("superseded", request.wish, _NEWER[aside])
            self._at_work[aside] = asyncio.create_task(self._answer(newest)), newest

    async def finish(self) -> None:
        """Wait for the work at hand."""
        await asyncio.gather(*(task for task, _ in self._at_work.values()))

    async def _give_up(self, aside: bool, why: str) -> bool:
        task, request = self._at_work.pop(aside, (None, None))
        if task is None or request is None or task.done():
            return False
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
        self._tell("superseded", request.wish, why)
        return True

    async def _answer(self, request: Request) -> None:
        self._tell("planning", request.wish, "")
        try:
            order = await self._plan(request)
        except ChauffeurError as error:
            self._tell("unplanned", request.wish, str(error), again=error.retryable)
            return
        except Exception as error:  # noqa: BLE001 - services and memories are others' code, too; the wish is answered
            self._tell("unplanned", request.wish, f"The planner failed: {type(error).__name__}: {error}")
            return
        if order.plan.alarm == "stop":
            self._tell("halt", request.wish, STOPPING)  # to stand in a lane is control's
            return
        if order.plan.refusal or (order.plan.policy is None and order.plan.intent != TAKES_BACK):
            words = order.plan.refusal or "The planner gave no program."
            answered = (request.aside or order.plan.intent == ANSWERED) and not order.plan.offer
            self._tell("answered" if answered else "declined", request.wish, words, offer=order.plan.offer)
            return
        try:
            self._rings.orders.write(encode(order))
        except ValueError as error:
            self._tell("unplanned", request.wish, str(error), again=False)
            return
        self._tell("planned", request.wish, order.plan.thoughts.text)
        if isinstance(order.plan.policy, Program):
            seen, limits = self._mirror.world.observe(), self._mirror.limits
            fits = informed(FAITHFULNESS_CHECK, order.plan, seen, limits, check_faithfulness)
            self._rings.events.write(
                encode(DriveEvent("verdicts", request.wish, "", self._mirror.trip, self._mirror.tick, value=fits))
            )
        if order.plan.policy is not None and (pending := self._talk.dialogue.pending):
            self._tell("waits", request.wish, pending)

    async def _plan(self, request: Request) -> PlanMessage:
        issued_ns = self._clock_ns()  # before the look: what is seen may already be old when it has been taken in
        self._mirror.follow()
        observation, limits = self._mirror.world.observe(), self._mirror.limits
        scene = PlannedScene.of(self._mirror.trip, observation)
        world = self._mirror.world
        there = world.destination() if isinstance(world, TownPlaces) else None
        instruction = replace(parse_wish(request.text, PersonId(request.person)), confirmed=request.confirmed)

        async def describe() -> Context:
            described = weathered(self._mirror.world, await describing(self._sources))(observation)
            return with_doing(with_way(described, there), request.doing)

        async def recall(instruction: Instruction, context: Context) -> History:
            return self._memory.recall(instruction.person, instruction, context, RECALLED)

        async def later(plan: Plan, own: bool) -> Judged:
            """The policy process checks, at the instant a plan begins."""
            del plan, own
            return (), observation

        async def now(plan: Plan, own: bool) -> Judged:
            del own
            return run_checks(plan, observation, limits, drive_checks()), observation

        steps = PlanSteps(
            planner=self._planner,
            limits=limits,
            describe=describe,
            recall=recall,
            system=lambda: build_system_message(
                self._setting, limits=limits, vocabulary=vocabulary_of(observation.kind)
            ),
            own=lambda text: _own(text, observation),
            check=later,
            check_yes=now,
            see=lambda: self._see(observation),
            observe=lambda: observation,
            within_s=PLAN_WITHIN_S,
            runs=request.runs,
            turn=self._talk.turn,
            take_back=lambda: self._taken_back(request),
        )
        planned = await plan_once(instruction, steps)
        context, history, plan = planned.request.context, planned.request.history, planned.plan
        if planned.refusal:
            plan = replace(plan, policy=None, refusal=planned.refusal)
        self._brief(
            PlanningInputs(
                request.wish,
                planned.request.instruction,
                context,
                history,
                plan,
                self._mirror.trip,
                observation.tick,
            )
        )
        return PlanMessage(
            wish=request.wish,
            plan=plan,
            scene=scene,
            issued_ns=issued_ns,
            start_by_ns=issued_ns + round(START_WITHIN_S / self._speed * 1e9),
            expires_ns=issued_ns + round(FOLLOW_FOR_S / self._speed * 1e9),
        )

    def _taken_back(self, request: Request) -> Plan | None:
        """The order that ends what is driven; none where work on a wish has just ended for it, or nothing is driven."""
        self._talk.cancel()
        if self._ended_for == request.wish:
            return Plan(Thoughts(NOT_MEANT), None, NOT_MEANT, intent=ANSWERED, planner="live")
        return Plan(Thoughts(TAKEN_BACK), None, intent=TAKES_BACK, planner="live") if request.runs else None

    def _see(self, observation: Observation) -> tuple[CameraImage, ...]:
        """The view from the seat, rendered here: control never waits for a picture."""
        if not looks(self._planner):
            return ()
        return SeatCamera(self._mirror.world, self._mirror.start.seed).take(observation)

    def _brief(self, brief: PlanningInputs) -> None:
        """Leave word of what the plan was made of; one that is too long without the history, or else not at all."""
        for each in (brief, replace(brief, history=History())):
            with contextlib.suppress(ValueError):
                self._rings.briefs.write(encode(each))
                return

    def _say(self, text: str) -> None:
        _, request = self._at_work.get(False, (None, None))
        self._tell("said", "" if request is None else request.wish, text)

    def _tell(self, kind: WishEventKind, wish: str, text: str, *, again: bool = True, offer: str = "") -> None:
        offer = offer if len(text) + len(offer) <= MOST_SAID else ""  # half a wish is none
        event = DriveEvent(kind, wish, text[:MOST_SAID], self._mirror.trip, self._mirror.tick, again, offer)
        self._rings.events.write(encode(event))


def _own(text: str, observation: Observation) -> Plan | None:
    """The car's own plan for emergency words. Only control may stand in a lane, and it was not told to."""
    plan = planned_for(text, observation)
    if plan is None or plan.intent != "stop":
        return plan
    return replace(plan, policy=None, refusal=NO_SHOULDER)
