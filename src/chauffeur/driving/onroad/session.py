"""A session on a real vehicle: each wish is planned, checked, written down, asked of the vehicle, and confirmed.

    async with VehicleSession(vehicle, settings, planner, tell=show) as road:
        answer = await road.ask("Drive a bit slower.")
        answer = await road.feedback("Too slow now.")

`ask` answers when it is known what became of the wish. While one is being planned, a newer one takes its place. The way
to the vehicle is watched all the time and told of in events. Whoever uses a session asks for nothing twice: interfaces
tell nothing by themselves, so their state is looked at in here.

What was asked for stays in force when the session ends or the way is lost: a program that ends is no reason to drive
faster (docs/ros.md). Nothing in here can engage a vehicle, and nothing can overrule its planner.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING, Final, Literal, Self, TypeVar

from chauffeur.concept import (
    NOBODY,
    ChauffeurError,
    ConfigError,
    Context,
    History,
    Instruction,
    InstructionError,
    Limits,
    Parameters,
    PersonId,
    Plan,
    PlanRequest,
    Scenario,
    SystemMessage,
    Thoughts,
    Trip,
    Verdict,
)
from chauffeur.describe.services.sources import Sources
from chauffeur.driving.drive_session import DriveSession, Entrance
from chauffeur.driving.events import DriveEvent, EventKind, Listener, nobody_listens
from chauffeur.driving.onroad.answers import OnRoadAnswer, Opinion, SetpointRequest, SetpointResult, Status
from chauffeur.driving.onroad.checks import (
    ENGAGING_WORDS,
    answered_at_once,
    check_all,
    fitted,
    is_about_engaging,
    is_stop,
)
from chauffeur.driving.onroad.thoughts import refused_in_own_words, speed_text
from chauffeur.driving.onroad.vehicle_observation import WORLD, VehicleObservation, counted_from, describe_vehicle
from chauffeur.driving.planning import (
    PLAN_WITHIN_S,
    RECALLED,
    START_WITHIN_S,
    Judged,
    Planned,
    PlanSteps,
    plan_once,
)
from chauffeur.driving.questions import NOT_MEANT, TAKEN_BACK, Conversing
from chauffeur.driving.recorder import FLUSH_TIMEOUT_S, DriveRecorder
from chauffeur.driving.session import MAX_WISH_CHARACTERS
from chauffeur.driving.trips import vehicle_trip
from chauffeur.language.emergency import Emergency, read_emergency
from chauffeur.language.questions import said_aside
from chauffeur.memory.base import Memory
from chauffeur.memory.feedback import interpret_feedback
from chauffeur.memory.personal_limits import personal_limits
from chauffeur.planners.base import Planner
from chauffeur.planners.talk2drive.planner import system_text
from chauffeur.planners.talk2drive.style import LOOK_AHEAD
from chauffeur.safety.audit.writer import utc_now
from chauffeur.safety.words import reasons_once
from chauffeur.worlds.ros import Published, RosVehicleState, VehicleError, VehicleInterface
from chauffeur.worlds.ros.autoware_ai import AutowareAi, PlannedSpeed
from chauffeur.worlds.ros.settings import VehicleSettings

if TYPE_CHECKING:
    from chauffeur.driving.events import EventValue

CONFIRM_WITHIN_S: Final = 2.0
"""How long an answer waits for every receiver to have what was published."""

WATCH_EVERY_S: Final = 0.2
"""Period of looking at the way to the vehicle."""

BRIEFLY_S: Final = 0.25
"""How long a wish that slows the vehicle waits for the audit log; it is handed over before, and asked for after."""

MEMORY_WITHIN_S: Final = 5.0
"""How long memory may take; a wish is driven without it then."""

_FASTEST_LOOK_S: Final = 0.0005
_SLOWEST_LOOK_S: Final = 0.02
_USABLE: Final = ("up", "dry-run")
_SLACK_MPS: Final = 1e-6

T = TypeVar("T")

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Made:
    """What a wish came to before the vehicle was asked: `status` and `words` where it ended there."""

    request: PlanRequest | None = None
    plan: Plan | None = None
    verdicts: tuple[Verdict, ...] = ()
    status: Status | None = None
    words: str = ""


_CANCEL: Final = "cancel"
"""Intent of the plan that takes the newest wish back."""
_SUPERSEDED: Final = _Made(status="superseded", words="A newer wish came.")


class VehicleSession(DriveSession):
    """Takes a person's wishes to a vehicle. Used in one event loop; `async with` begins and ends it."""

    def __init__(
        self,
        vehicle: VehicleInterface,
        settings: VehicleSettings,
        planner: Planner,
        *,
        person: PersonId = NOBODY,
        memory: Memory | None = None,
        sources: Sources | None = None,
        books: DriveRecorder | None = None,
        tell: Listener = nobody_listens,
        confirm_within_s: float = CONFIRM_WITHIN_S,
        clock: Callable[[], datetime] = utc_now,
    ) -> None:
        """Set up; nothing is published.

        Args:
            vehicle: Open interface; whoever opened it closes it, after the session.
            settings: The vehicle's file.
            planner: Gives `Parameters`.
            person: Whose wishes they are.
            memory: Recalls and remembers; None for neither.
            sources: What is known of the place; None where nobody says where the vehicle is.
            books: Audit log; None for none. The session does not close it.
            tell: Gets every event, in the session's event loop; it must not block.
            confirm_within_s: How long an answer waits for the vehicle.
            clock: Present time, with a time zone.

        Raises:
            ConfigError: The person's limits cannot be read, or the vehicle's file sets a constant speed: nothing that a
                model says is to drive a vehicle that ignores planned stops.
        """
        stack = settings.stack
        if isinstance(stack, AutowareAi) and not isinstance(stack.source, PlannedSpeed):
            raise ConfigError(
                "This vehicle's file sets a constant speed, under which planned stops are ignored; wishes in words are "
                "not taken.",
                hint="Remove [constant_speed] from the file, or use: chauffeur vehicle apply",
            )
        self._vehicle, self._settings, self._planner = vehicle, settings, planner
        super().__init__(person, books)
        self.subscribe(tell)
        self._memory, self._sources, self._confirm_within_s = memory, sources, confirm_within_s
        most_mps = stack.limits.max_speed_mps
        self.limits: Final = personal_limits(person, Limits("vehicle", max_over_limit_mps=0.0, max_speed_mps=most_mps))
        self.dry_run: Final = vehicle.state().link == "dry-run"
        began = clock().isoformat(timespec="milliseconds")  # two sessions' trips are never the same
        about = {"interface": settings.interface, "dry_run": self.dry_run, "began": began}
        self._scenario = Scenario(f"{WORLD}:{settings.interface}", WORLD, about, 0)
        self._turn = asyncio.Lock()
        self._count = self._newest = 0
        self._making: asyncio.Task[_Made] | None = None
        self._talk = Conversing()
        self._asked: Parameters | None = None
        self._before: Parameters | None = None
        """What was in force before the newest wish, to which "never mind" goes back; None once it has."""
        self._handed: tuple[int, Published] | None = None
        self._unconfirmed: tuple[int, Published] | None = None
        self._last_trip = ""
        self._watcher: asyncio.Task[None] | None = None
        self._known: RosVehicleState | None = None
        self._over = False

    @property
    def asked(self) -> Parameters | None:
        """What is in force of ours in the vehicle; None before the first."""
        return self._asked

    async def __aenter__(self) -> Self:
        self._watcher = asyncio.get_running_loop().create_task(self._watch())
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.close()

    async def reached(self, within_s: float) -> RosVehicleState:
        """The vehicle's state as soon as there is a way to it, or after so long."""
        end = time.perf_counter() + within_s
        while (state := self._vehicle.state()).link not in _USABLE and time.perf_counter() < end:
            await asyncio.sleep(_SLOWEST_LOOK_S)
        return state

    async def close(self) -> str:
        """End the session; what was asked for stays in force. Returns what stays, in words."""
        if self._making is not None:
            self._making.cancel()
        if self._watcher is not None:
            self._watcher.cancel()
            await asyncio.gather(self._watcher, return_exceptions=True)
            self._watcher = None
        words = self._closing_words()
        if not self._over:
            self._over = True
            self._say("over", words, value=self._asked)
        return words

    def take_over(self, on: bool) -> None:
        """Refuse: the wheel of a vehicle is the person's, and no program gives it back."""
        del on
        raise ConfigError(ENGAGING_WORDS)

    async def ask(self, text: str, *, source: Literal["text", "speech"] = "text") -> OnRoadAnswer:
        """Answer one wish. A newer call takes the place of an older one that has not reached the vehicle; a question
        waits for it, and takes the place of none.

        Args:
            text: The words.
            source: How they came in.

        Returns:
            What became of it; only cancelling raises.
        """
        begun = time.perf_counter()
        self._count += 1
        number = self._count
        aside = said_aside(text) and not self._talk.open
        if not aside:
            self._newest = number
        if self._over:
            return OnRoadAnswer(number, text[:MAX_WISH_CHARACTERS], "failed", "The session is over.")
        if self._making is not None and not aside:
            self._making.cancel()
        request: PlanRequest | None = None
        try:
            async with self._turn:
                answer, request = await self._answer(number, text, source)
        except asyncio.CancelledError:
            self._say_answer(self._broken_off(number, text, "It was broken off.", "superseded"))
            raise
        except Exception as error:  # noqa: BLE001 - a fault of ours ends one wish, not the session
            _log.exception("a wish could not be answered")
            answer = self._broken_off(number, text, f"Chauffeur itself failed: {type(error).__name__}.", "failed")
        answer = replace(answer, took_s=time.perf_counter() - begun)
        if request is not None and answer.plan is not None:
            answer = await self._remember(request, answer)
        self._say_answer(answer)
        return answer

    def _broken_off(self, number: int, text: str, why: str, status: Status) -> OnRoadAnswer:
        """The answer to a wish that came to no end of its own: it may be with the vehicle."""
        if self._handed is None or self._handed[0] != number:
            return OnRoadAnswer(number, text[:MAX_WISH_CHARACTERS], status, f"{why} Nothing was published.")
        published = self._handed[1]
        words = f"{why} It had been published: {published.words}"
        return OnRoadAnswer(number, text[:MAX_WISH_CHARACTERS], "unconfirmed", words, published=published)

    async def feedback(self, text: str) -> OnRoadAnswer:
        """Keep what the person says of the drive with their last trip."""
        if is_stop(text):
            return await self.ask(text)
        self._count += 1
        number, words = self._count, " ".join(text.split())
        if not words:
            return OnRoadAnswer(number, text, "declined", "The feedback is empty; say how it was.")
        if await self._keep_feedback(number, words):
            return OnRoadAnswer(number, words, "taken", "Kept with your last wish.", trip=self._last_trip)
        why = "Nobody's profile is open" if self._person == NOBODY else "No drive of yours is kept that it is about"
        return OnRoadAnswer(number, words, "declined", f"{why}; the feedback is not kept.")

    async def _keep_feedback(self, number: int, words: str) -> bool:
        """Keep an opinion with the last trip; whether there was one, and a memory to keep it."""
        memory, meant = self._memory, interpret_feedback(words)
        kept: bool | None = False
        if memory is not None and self._person != NOBODY:
            kept = await self._from_memory(
                number, lambda: memory.attach_feedback(self._person, meant, self._last_trip or None)
            )
        self._say("feedback", words, number, Opinion(meant, str(self._person), bool(kept)))
        return bool(kept)

    # One wish ---------------------------------------------------------------------------------------------------------

    async def _answer(
        self, number: int, text: str, source: Literal["text", "speech"]
    ) -> tuple[OnRoadAnswer, PlanRequest | None]:
        """The answer, and what was planned for, if anything was."""
        entrance = self.enter(text)
        at_once = OnRoadAnswer(number, text[:MAX_WISH_CHARACTERS], "answered", entrance.words)
        if entrance.way in ("nothing", "leave"):
            return at_once, None
        try:
            meant = self._talk.settle(text, self._person)
        except InstructionError as error:
            return replace(at_once, status="declined", words=str(error)), None
        if meant is None:
            return replace(at_once, status="declined", words=NOT_MEANT), None
        instruction = replace(meant, source=source)
        entrance = self.enter(instruction.text) if entrance.way == "yes" else entrance
        answer = OnRoadAnswer(number, instruction.text, "declined", ENGAGING_WORDS)
        self._say("wish", instruction.text, number, instruction)
        if is_about_engaging(instruction.text) and entrance.way != "stop":
            return answer, None
        if entrance.way in ("distress", "go_on"):
            return replace(answer, words=entrance.words), None
        state = self._observed()
        if state.link not in _USABLE:
            return replace(answer, status="unreachable", words=_unreachable(state)), None
        if entrance.way == "opinion":
            await self._keep_feedback(number, instruction.text)  # and planned: it may ask for something else now
        begun = time.perf_counter()
        made = await self._made(number, instruction)
        answer = replace(
            answer,
            status=made.status or "failed",
            words=made.words,
            plan=made.plan,
            verdicts=made.verdicts,
            plan_s=time.perf_counter() - begun,
        )
        if made.status is None:
            answer = await self._apply(number, answer)
        return answer, made.request

    async def _made(self, number: int, instruction: Instruction) -> _Made:
        """What the wish comes to, unless a newer one comes first. A stop gives way to nothing."""
        stopping = is_stop(instruction.text)
        if number < self._newest and not stopping:
            return _SUPERSEDED
        task = asyncio.get_running_loop().create_task(self._make(number, instruction, stopping=stopping))
        self._making = None if stopping else task
        try:
            await asyncio.wait({task})
        finally:
            task.cancel()
            self._making = None
        if task.cancelled() or (number < self._newest and not stopping):
            return _SUPERSEDED
        return task.result()

    async def _make(self, number: int, instruction: Instruction, *, stopping: bool) -> _Made:
        """I, C, H and S to R, P and V; a stop waits for no service, no memory and no planner."""
        begun, before = time.perf_counter(), await self._look(0.0 if stopping else None)
        seen = before

        def tell(event: DriveEvent) -> None:
            if event.kind not in ("wish", "plan", "verdicts"):  # told before, and after, with what is done about them
                self._say(event.kind, event.text, number, event.value)

        async def describe() -> Context:
            return describe_vehicle(before)

        async def recall(instruction: Instruction, context: Context) -> History:
            return History() if stopping else await self._recall(number, instruction, context)

        async def check(plan: Plan, own: bool) -> Judged:
            nonlocal seen
            del own  # a vehicle is asked for nothing unchecked, not even by its own session
            seen = await self._look(0.0)  # the vehicle has gone on while it was planned
            return check_all(plan, seen, before), seen.bounds(before)

        steps = PlanSteps(
            planner=self._planner,
            limits=self.limits,
            describe=describe,
            recall=recall,
            system=lambda: SystemMessage(system_text(self.limits)),
            own=self._own,
            check=check,
            fit=lambda plan: fitted(plan, self._settings.stack.limits, before.cap_mps),
            tell=tell,
            within_s=PLAN_WITHIN_S,
            runs=self._asked is not None,
            turn=self._talk.turn,
            take_back=self._taken_back,
        )
        try:
            planned = await plan_once(instruction, steps)
        except ChauffeurError as error:
            return _Made(status="failed", words=str(error))
        return self._judged(number, planned, seen, took_s=time.perf_counter() - begun)

    def _judged(self, number: int, planned: Planned, seen: VehicleObservation, *, took_s: float) -> _Made:
        """What is told of a plan, and whether the vehicle is asked for it."""
        request, plan, verdicts = planned.request, planned.plan, planned.verdicts
        if plan.refusal and verdicts[0].stops:
            plan = refused_in_own_words(plan, verdicts[0])
        self._say("plan", plan.thoughts.text, number, plan)
        self._say("verdicts", " ".join(one.reason for one in verdicts), number, verdicts)
        made = _Made(request, plan, verdicts)
        self._talk.ask(plan.refusal, plan.offer)
        if plan.policy is None and not verdicts[0].stops:
            words = plan.refusal or "The planner gave no parameters."
            status = "answered" if said_aside(request.instruction.text) and not plan.offer else "declined"
            return replace(made, status=status, words=f"{words} {counted_from(seen)}".rstrip())
        if reasons := _reasons(verdicts):
            return replace(made, status="refused", words=reasons)
        if took_s > START_WITHIN_S:
            words = f"Planning took more than {START_WITHIN_S:.0f} s; the vehicle is elsewhere by now. Ask again."
            return replace(made, status="failed", words=words)
        return made

    def _urgent(self, found: Emergency) -> Entrance | None:
        """Where to stop is chosen by the vehicle; what it can be asked for at once is a speed of 0."""
        if found.kind == "stop":
            return Entrance("stop")
        words = answered_at_once(found)
        return Entrance("go_on" if found.kind == "no_stop" else "distress", words) if words else None

    @property
    def _question_is_open(self) -> bool:
        return self._talk.open

    @property
    def _was_driven(self) -> bool:
        return bool(self._last_trip)

    def _takes_back(self, cancelled: bool) -> bool:
        return cancelled and self._before is not None

    def _own(self, text: str) -> Plan | None:
        """The session's own plan: a speed of 0 for a stop, and words for distress."""
        if is_stop(text):
            return self._stop_plan()
        found = read_emergency(text)
        words = "" if found is None else answered_at_once(found)
        return Plan(Thoughts(words), None, words, intent="ask", planner="onroad") if words else None

    def _taken_back(self) -> Plan | None:
        """What was in force before the newest wish, as a plan."""
        if (before := self._before) is None:
            return None
        self._talk.cancel()
        settings = (("target_speed_mps", before.target_speed_mps),)
        return Plan(Thoughts(TAKEN_BACK), before, intent=_CANCEL, settings=settings, planner="onroad")

    def _stop_plan(self) -> Plan:
        """A stop needs no model: the word is enough."""
        usual = LOOK_AHEAD["usual"]
        here = self._asked or Parameters(0.0, usual.distance_m, usual.ratio_s)
        policy = replace(here, target_speed_mps=0.0)
        thoughts = Thoughts("You said stop. I ask the vehicle's planner for a speed of 0.")
        return Plan(thoughts, policy, intent="stop", settings=(("target_speed_mps", 0.0),), planner="onroad")

    async def _look(self, budget_s: float | None = None) -> VehicleObservation:
        place, words = None, ""
        if self._sources is not None:
            place, words = await self._sources.look(budget_s), self._sources.place_words()
        most_mps = self._settings.stack.limits.max_speed_mps
        return VehicleObservation(self._vehicle.state(), self._asked, self.limits, most_mps, place, words)

    # The vehicle ------------------------------------------------------------------------------------------------------

    async def _apply(self, number: int, answer: OnRoadAnswer) -> OnRoadAnswer:
        """Write it down, publish it, and wait until every receiver has it."""
        assert answer.plan is not None
        assert isinstance(answer.plan.policy, Parameters)
        parameters, before = answer.plan.policy, self._asked
        state = self._observed()
        if state.link not in _USABLE:
            return replace(answer, status="unreachable", words=_unreachable(state))
        self._say("asking", "", number, SetpointRequest(parameters, before, state))
        if self._books is not None:
            slows = parameters.target_speed_mps <= (0.0 if before is None else before.target_speed_mps)
            within_s = BRIEFLY_S if slows else FLUSH_TIMEOUT_S
            if not await asyncio.wrap_future(self._books.kept(within_s)):
                why = f"The audit log could not be written in time. {self._books.log.trouble}".rstrip()
                if not slows:
                    return replace(answer, status="failed", words=f"{why} Nothing was published.")
                self._say("trouble", f"{why} A lower speed is asked for all the same.", number)
        if number < self._newest and not is_stop(answer.text) and answer.plan.alarm != "stop":
            return replace(answer, status="superseded", words=_SUPERSEDED.words)
        try:
            published = self._vehicle.apply(parameters)
        except VehicleError as error:
            answer = replace(answer, status="refused", words=str(error))
        else:
            self._before = None if answer.plan.intent == _CANCEL else before
            answer = await self._confirm(number, replace(answer, published=published), parameters, before)
        self._say("applied", answer.words, number, SetpointResult(answer, self._vehicle.state()))
        return answer

    async def _confirm(
        self, number: int, answer: OnRoadAnswer, parameters: Parameters, before: Parameters | None
    ) -> OnRoadAnswer:
        published = answer.published
        assert published is not None
        self._asked, self._handed, self._unconfirmed = parameters, (number, published), None
        self._say("asked", published.words, number, published)
        if self.dry_run:
            return replace(answer, status="dry-run", words=f"{published.words} Dry run: nothing was published.")
        handed = time.perf_counter()
        if await self._delivered(number):
            confirmed_s = time.perf_counter() - handed
            words = f"{published.words} {self._taken_words()}"
            return replace(answer, status="delivered", words=words, confirmed_s=confirmed_s)
        state = self._vehicle.state()
        if number < self._newest:
            self._unconfirmed = (number, published)
            words = f"{published.words} A newer wish came before it was known who took it."
            return replace(answer, status="unconfirmed", words=words)
        words = f"{published.words} Not all of it was taken within {self._confirm_within_s:g} s. {state.words}"
        if before is not None and parameters.target_speed_mps > before.target_speed_mps + _SLACK_MPS:
            self._say("asking", "", number, SetpointRequest(before, parameters, state))
            with contextlib.suppress(VehicleError):  # the interface ended meanwhile, and what it held with it
                self._vehicle.apply(before)
                self._asked = before
                words += f" It was taken back to {speed_text(before.target_speed_mps)}."
        else:
            self._unconfirmed = (number, published)
            words += " It stays the newest: whoever connects next gets it, and you are told."
        return replace(answer, status="unconfirmed", words=words)

    async def _delivered(self, number: int) -> bool:
        """Whether every receiver was handed the newest, in time and before a newer wish came. Looked at closely first:
        most often it takes a millisecond."""
        end, pause = time.perf_counter() + self._confirm_within_s, _FASTEST_LOOK_S
        while not self._vehicle.state().delivered:
            if time.perf_counter() > end or number < self._newest:
                return False
            await asyncio.sleep(pause)
            pause = min(2.0 * pause, _SLOWEST_LOOK_S)
        return True

    async def _watch(self) -> None:
        """Tell of the way to the vehicle when it changes, and of what was taken late."""
        while True:
            state = self._observed()
            if self._unconfirmed is not None and state.delivered:
                (number, published), self._unconfirmed = self._unconfirmed, None
                self._say("late", f"{published.words} {self._taken_words()}", number, state)
            await asyncio.sleep(WATCH_EVERY_S)

    def _observed(self) -> RosVehicleState:
        """The vehicle's state; told if the way to it changed."""
        state, known = self._vehicle.state(), self._known
        if known is None or (state.link, state.words) != (known.link, known.words):
            self._known = state
            self._told_link(state)
        return state

    def _told_link(self, state: RosVehicleState) -> None:
        words = state.words
        if state.link == "up" and self._asked is not None:
            words += f" In force: at most {speed_text(self._asked.target_speed_mps)}."
        elif state.link not in _USABLE and self._asked is not None:
            words += f" What was asked for stays in force: at most {speed_text(self._asked.target_speed_mps)}."
        self._say("link", words, value=state)

    # Memory -----------------------------------------------------------------------------------------------------------

    async def _recall(self, number: int, instruction: Instruction, context: Context) -> History:
        memory = self._memory
        if memory is None or self._person == NOBODY:
            return History()
        found = await self._from_memory(
            number, lambda: memory.recall(instruction.person, instruction, context, RECALLED)
        )
        return found or History()

    async def _remember(self, request: PlanRequest, answer: OnRoadAnswer) -> OnRoadAnswer:
        assert answer.plan is not None
        trip = vehicle_trip(request, answer.plan, answer, self._scenario)
        await self._keep(answer.wish, trip)
        return replace(answer, trip=trip.id)

    async def _keep(self, number: int, trip: Trip) -> None:
        memory = self._memory
        if memory is None or self._person == NOBODY:
            return

        def remember() -> bool:
            memory.remember(trip, None)
            return True

        if await self._from_memory(number, remember):
            self._last_trip = trip.id

    async def _from_memory(self, number: int, work: Callable[[], T]) -> T | None:
        """What memory gives, off the event loop and within its time; None, and a word, where it cannot."""
        try:
            return await asyncio.wait_for(asyncio.to_thread(work), MEMORY_WITHIN_S)
        except TimeoutError:
            self._say("trouble", f"Memory did not answer within {MEMORY_WITHIN_S:g} s.", number)
        except ChauffeurError as error:
            self._say("trouble", f"Memory: {error}", number)
        except Exception as error:  # noqa: BLE001 - a memory may be anybody's code; the wish goes on without it
            _log.exception("memory failed")
            self._say("trouble", f"Memory failed: {type(error).__name__}.", number)
        return None

    # Words ------------------------------------------------------------------------------------------------------------

    def _say(self, kind: EventKind, text: str, wish: int = 0, value: EventValue | None = None) -> None:
        self._tell(DriveEvent(kind, str(wish) if wish else "", text, value=value))

    def _say_answer(self, answer: OnRoadAnswer) -> None:
        self._say("answer", answer.words, answer.wish, answer)

    def _taken_words(self) -> str:
        if self._settings.interface == "rosbridge":
            return "The bridge has it; who listens behind it is not known."
        return "The vehicle's nodes have it."

    def _closing_words(self) -> str:
        if self.dry_run:
            return "The session is over. It was a dry run: nothing was published."
        if self._asked is None:
            return "The session is over. Nothing was asked of the vehicle."
        return (
            f"The session is over. The vehicle goes on with at most {speed_text(self._asked.target_speed_mps)}: a "
            "program that ends is no reason to drive faster. To take it back: chauffeur vehicle release FILE."
        )


def _unreachable(state: RosVehicleState) -> str:
    return f"Not delivered: there is no way to the vehicle. {state.words} Nothing was published."


def _reasons(verdicts: tuple[Verdict, ...]) -> str:
    """Why a plan must not be driven, with what would help; empty when it may."""
    return reasons_once(verdicts, remedies=True)
