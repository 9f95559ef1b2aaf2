"""From words to a checked plan: `plan_once` is the only way from I to V, for every drive.

What really differs between drives is handed in as `PlanSteps`; the order, and what no drive may leave out, stands here:

    I C H S   gathered, and screened: words are data, whoever wrote them
    I         of a command in German, Spanish, French or Chinese that is read: the English sentence of its act; of words
              that mean something only beside the last turn ("the other one"): the whole sentence of what they mean
    R P       the car's own answer to emergency words; nothing for a wish that is unsafe whoever plans; an answer from C
              to a question; to "never mind", what the drive does about it; else the planner's, of which an alarm goes
              back to the car's own answer. A planner that hangs or breaks ends in an error with words
    ?         a question of the car is asked only where a yes to it could be driven
    V         the checks, and what the person forbade in words

A simulated drive checks at once, as its world waits. A live drive checks in another process, at the instant the plan
begins. A vehicle looks again, because it has driven on. A benchmark plans and drives in different processes, its stored
answers again and again: what it asks is a `screened_request` as well, and `checked` files what came of it.
"""

from __future__ import annotations

import asyncio
import math
import re
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final

from chauffeur.concept import (
    ANSWERED,
    ASKS,
    CameraImage,
    ChauffeurError,
    Context,
    History,
    Instruction,
    Limits,
    Observation,
    Plan,
    PlannerError,
    PlanRequest,
    Round,
    SystemMessage,
    Thoughts,
    Verdict,
)
from chauffeur.describe.answers import DONT_KNOW, answer_to
from chauffeur.driving.emergency import ALARM_WORDS, alarm_of, check_told_not_to, is_bare_stop, raised
from chauffeur.driving.events import DriveEvent, Listener, nobody_listens
from chauffeur.driving.judge import account
from chauffeur.language.emergency import read_emergency
from chauffeur.language.inquiries import asks_to_know
from chauffeur.language.languages.reader import OtherWish, read_other
from chauffeur.language.meaning.reader import Turn, turn_of
from chauffeur.language.questions import is_question
from chauffeur.planners.base import NO_WISH, Planner
from chauffeur.planners.base import declined as declined_by
from chauffeur.safety.base import Check
from chauffeur.safety.checks import DEFAULT_CHECKS, run_checks
from chauffeur.safety.dangers import check_wish
from chauffeur.safety.screening import screen_request
from chauffeur.safety.words import reasons_once


async def plan_or_answer(planner: Planner, request: PlanRequest) -> Plan:
    """The planner's plan; of a question, the answer, with nothing to drive.

    Raises:
        ChauffeurError: No plan can be had.
    """
    begun = time.perf_counter()
    words = request.instruction.text
    said = answer_to(words, request.context.situation, request.context.text)
    if said:
        return declined_by(planner, said, begun, intent=ANSWERED)
    plan = await planner.plan(request)
    open_ = not plan.offer and plan.intent != NO_WISH
    if (plan.policy is not None or open_) and not request.instruction.confirmed and asks_to_know(words):
        return replace(plan, policy=None, thoughts=Thoughts(DONT_KNOW), refusal=DONT_KNOW, intent=ANSWERED)
    return plan


UNRESOLVED: Final = "I do not know what that refers to. Please say it in a whole sentence."
"""To words that mean something only beside others, where there are none."""
NOTHING_TO_TAKE_BACK: Final = "Nothing waits or is driven that I could take back. I go on as we are."
RECALLED: Final = 3
"""Remembered trips that H holds at most."""
PLAN_WITHIN_S: Final = 60.0
"""Time of the clock after which a planner is given up on, where a car waits."""
START_WITHIN_S: Final = 10.0
"""A plan that begins later than this was made for a place that the car has left."""

_NO_HISTORY: Final = History()
_USUAL_LIMITS: Final = Limits()

Judged = tuple[tuple[Verdict, ...], Observation]
"""V, and the instant it was found at."""


def no_pictures(observation: Observation) -> tuple[CameraImage, ...]:
    """What a planner without eyes is shown."""
    del observation
    return ()


def _unseen() -> None:
    return None


def _nothing() -> Plan | None:
    return None


def _as_it_is(plan: Plan) -> Plan:
    return plan


@dataclass(frozen=True, slots=True)
class PlanSteps:
    """What differs between drives on the way from words to a checked plan.

    Attributes:
        planner: Who plans.
        limits: Of the person and the operator.
        describe: C.
        recall: H.
        system: S.
        own: The car's own plan for emergency words, which no planner decides; None where they are a planner's business.
        check: V, at the latest instant there is. Its second argument tells that the plan is the car's own.
        check_yes: V of what a yes would drive, where `check` leaves that to another process.
        see: V of the paper: pictures, for planners that look.
        observe: The instant that C describes, for planners that look for what words point at.
        fit: What the vehicle takes of a plan, whose maker knows no vehicle.
        tell: Hears each letter as it comes.
        within_s: Time of the clock after which the planner is given up on.
        runs: Whether an earlier wish is driven, or on its way: what was said beside it (a question, feedback, words to
            others) does not end it without a yes.
        turn: Reads words after those before them.
        take_back: The car's plan for "never mind"; None where there is nothing to take back.
    """

    planner: Planner
    limits: Limits
    describe: Callable[[], Awaitable[Context]]
    recall: Callable[[Instruction, Context], Awaitable[History]]
    system: Callable[[], SystemMessage]
    own: Callable[[str], Plan | None]
    check: Callable[[Plan, bool], Awaitable[Judged]]
    check_yes: Callable[[Plan, bool], Awaitable[Judged]] | None = None
    see: Callable[[], tuple[CameraImage, ...]] = tuple
    observe: Callable[[], Observation | None] = _unseen
    fit: Callable[[Plan], Plan] = _as_it_is
    tell: Listener = nobody_listens
    within_s: float = math.inf
    runs: bool = False
    turn: Callable[[str], Turn] = turn_of
    take_back: Callable[[], Plan | None] = _nothing


@dataclass(frozen=True)
class Checked:
    """A plan and what stands between it and the vehicle, driven or not.

    Attributes:
        plan: R and P.
        verdicts: V.
    """

    plan: Plan
    verdicts: tuple[Verdict, ...]

    @property
    def refusal(self) -> str:
        """Why it is not driven, in words; empty when it may be."""
        return declined(self.plan, self.verdicts)

    @property
    def unusable(self) -> bool:
        """Whether it failed as a policy (no program, or not of the language), not as a wish."""
        return unusable(self.plan, self.verdicts)


@dataclass(frozen=True)
class Planned(Checked):
    """What words came to.

    Attributes:
        request: What the planner was given, or would have been.
    """

    request: PlanRequest


async def plan_once(instruction: Instruction, steps: PlanSteps) -> Planned:
    """The way of one wish from I to V.

    Raises:
        ChauffeurError: No plan could be had.
    """
    other = read_other(instruction.text)
    raw = instruction.text
    turn = None if read_emergency(raw) is not None else steps.turn((other and other.english) or raw)
    if turn is not None and turn.whole:
        instruction = replace(instruction, text=turn.whole, said=raw)
    request = replace(await request_once(instruction, steps), utterance=turn and turn.utterance)
    if other is not None and other.english and not instruction.said and read_emergency(raw) is None:
        instruction = replace(instruction, text=other.english)
        request = replace(request, instruction=instruction)
    wish = check_wish(raw)
    wish = wish if wish.stops else check_wish(instruction.text)
    own, plan = await _answered(request, wish, steps, other, turn)
    if other is not None and other.english and not own:
        plan = replace(plan, thoughts=Thoughts(f"{other.words} {plan.thoughts.text}"))
    steps.tell(DriveEvent("plan", text=plan.thoughts.text, value=plan))
    verdicts, now = await steps.check(plan, own)
    if wish.stops and not own:
        verdicts = (*verdicts, wish)
    elif not own:
        told = check_told_not_to(instruction.text, plan, now) or account.check_told_not_to(instruction.text, plan)
        verdicts = (*verdicts, *told)
    steps.tell(DriveEvent("verdicts", value=verdicts))
    return Planned(plan, verdicts, request)


async def request_once(instruction: Instruction, steps: PlanSteps) -> PlanRequest:
    """Everything the planner is given for a wish in a situation. Nobody is asked yet."""
    context = await steps.describe()
    history = await steps.recall(instruction, context)
    system = steps.system()
    steps.tell(DriveEvent("wish", text=instruction.said or instruction.text, value=instruction))
    steps.tell(DriveEvent("context", text=context.text, value=context))
    steps.tell(DriveEvent("history", text=f"{len(history.items)} remembered", value=history))
    steps.tell(DriveEvent("system", value=system))
    images = steps.see()
    if images:
        steps.tell(DriveEvent("view", value=images))
    seen = steps.observe()
    return screened_request(instruction, context, system, history, limits=steps.limits, images=images, observation=seen)


def screened_request(
    instruction: Instruction,
    context: Context,
    system: SystemMessage,
    history: History = _NO_HISTORY,
    rounds: tuple[Round, ...] = (),
    limits: Limits = _USUAL_LIMITS,
    images: tuple[CameraImage, ...] = (),
    observation: Observation | None = None,
) -> PlanRequest:
    """What a planner is given, in a drive or a benchmark: put together here alone, and screened.

    The arguments are those of `PlanRequest`.
    """
    return screen_request(PlanRequest(instruction, context, system, history, rounds, limits, images, observation))[0]


async def _planned(request: PlanRequest, steps: PlanSteps) -> Plan:
    """R and P of a planner, which may be anybody's code: not waited for beyond its time, even where it hangs."""
    task = asyncio.ensure_future(plan_or_answer(steps.planner, request))
    try:
        done, _ = await asyncio.wait({task}, timeout=None if math.isinf(steps.within_s) else steps.within_s)
    finally:
        task.cancel()
    if not done:
        raise PlannerError(f"No plan within {steps.within_s:.0f} s.", retryable=True)
    if task.cancelled():
        raise PlannerError("The planner gave up.", retryable=True)
    error = task.exception()
    if error is None:
        return task.result()
    if isinstance(error, ChauffeurError) or not isinstance(error, Exception):
        raise error
    raise PlannerError(f"The planner failed: {type(error).__name__}: {error}", retryable=True) from error


async def _answered(
    request: PlanRequest, wish: Verdict, steps: PlanSteps, other: OtherWish | None, turn: Turn | None
) -> tuple[bool, Plan]:
    """(whether it is the car's own answer, R and P): an unsafe wish reaches no planner, nor does one in another
    language that could not be read, and a planner that understands an alarm is not left to answer it."""
    text = request.instruction.text
    own = steps.own(text)
    if own is not None:
        return True, steps.fit(own)
    if wish.stops:
        return False, declined_by(steps.planner, wish.reason, time.perf_counter(), intent="refuse")
    if other is not None and not other.english:
        return False, declined_by(steps.planner, other.words, time.perf_counter(), intent=ASKS)
    if turn is not None and turn.lost:
        return False, declined_by(steps.planner, UNRESOLVED, time.perf_counter(), intent=ASKS)
    if turn is not None and turn.cancels:
        back = steps.take_back()
        if back is not None:
            return True, steps.fit(back)
        return False, declined_by(steps.planner, NOTHING_TO_TAKE_BACK, time.perf_counter(), intent=ANSWERED)
    plan = steps.fit(await _planned(request, steps))
    plan = await _worth_asking(_meant(plan, request) if steps.runs else plan, request, steps)
    alarm = alarm_of(plan, text)
    if not alarm and is_bare_stop(plan, text):
        verdicts, _ = await (steps.check if steps.check_yes is None else steps.check_yes)(plan, False)
        alarm = "stop" if any(one.stops for one in verdicts) else ""
    answer = steps.own(ALARM_WORDS[alarm]) if alarm else None
    return (False, plan) if answer is None else (True, steps.fit(raised(alarm, answer, text)))


def _meant(plan: Plan, request: PlanRequest) -> Plan:
    """The plan; of a question, feedback, or words to others, the question whether it is to be driven."""
    instruction, said = request.instruction, request.utterance
    beside = "question" if is_question(instruction.text) else said.address if said is not None and not said.acts else ""
    if plan.policy is None or instruction.confirmed or beside not in _BESIDE:
        return plan
    does = _FIRST_SENTENCE.match(plan.thoughts.text)
    as_read = "" if does is None or instruction.text in does[0] else f" As I read it: {does[0]}"
    words = f"I take that for {_BESIDE[beside]}, and go on as we are. Shall I act on it?{as_read}"
    return replace(plan, policy=None, thoughts=Thoughts(words), refusal=words, offer=instruction.text, intent="ask")


_BESIDE: Final = {
    "question": "a question", "feedback": "feedback", "story": "a story", "other": "words to others",
}  # fmt: skip
"""Words that are said beside the driving, by their address."""
_FIRST_SENTENCE: Final = re.compile(r"[^.:!?]{0,200}(?:[:] [^.!?]{0,200})?[.!?]?")


async def _worth_asking(plan: Plan, request: PlanRequest, steps: PlanSteps) -> Plan:
    """The plan; of a question to which a yes would be refused, that refusal, with nothing left to ask."""
    if not plan.offer or plan.policy is not None:
        return plan
    confirmed = replace(request.instruction, text=plan.offer, confirmed=plan.refusal)
    try:
        meant = steps.fit(await _planned(replace(request, instruction=confirmed), steps))
    except ChauffeurError:
        return plan
    if meant.policy is None:
        return plan
    verdicts, _ = await (steps.check if steps.check_yes is None else steps.check_yes)(meant, False)
    why = reasons_once(verdicts, remedies=True)
    return replace(plan, thoughts=Thoughts(why), refusal=why, offer="", intent=meant.intent) if why else plan


def checked(plan: Plan, observation: Observation, limits: Limits, checks: Sequence[Check] = DEFAULT_CHECKS) -> Checked:
    """V of a plan that was made elsewhere: a benchmark's, whose answers are stored and driven by other processes."""
    return Checked(plan, run_checks(plan, observation, limits, checks))


def declined(plan: Plan, verdicts: tuple[Verdict, ...]) -> str:
    """Why a plan is not driven, in words; empty when it may be."""
    return plan.refusal or reasons_once(verdicts)


def unusable(plan: Plan, verdicts: tuple[Verdict, ...]) -> bool:
    """Whether a plan that is not driven failed as a policy (no program, or not of the language), not as a wish."""
    if plan.refusal:
        return plan.intent == "unusable"
    return bool(verdicts) and verdicts[0].stops
