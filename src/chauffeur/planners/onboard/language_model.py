"""The planner that asks the on-board language model: words to a program of the dialect, then linked to this road.

What the model writes is read by the dialect's reader, looked at by the guard and linked; it is never run as it comes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import Alarm, ConfigError, Plan, PlanRequest, Program, ProgramError, Situation, Usage
from chauffeur.planners.arbitration import (
    UNSURE_WORDS,
    Wish,
    agreed,
    alarm_in,
    asked,
    question_about,
    undenied,
    wary_of,
)
from chauffeur.planners.base import OnText, Planner, declined
from chauffeur.planners.meaning.planner import plan_by_sight
from chauffeur.planners.onboard.dialect import DialectStep, shall_i
from chauffeur.planners.onboard.dialect import write as program_of
from chauffeur.planners.onboard.doubts import ENGLISH_ONLY, foreign
from chauffeur.planners.onboard.engine import Engine, Written
from chauffeur.planners.onboard.guard import NOT_THE_NUMBER, doubt
from chauffeur.planners.onboard.link import Linked, link
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning, corrections_of, leaning_of
from chauffeur.planners.onboard.prompt import history_words, prompt
from chauffeur.planners.onboard.quoted_numbers import named, taken_over, unnamed
from chauffeur.planners.onboard.reply import OnboardReply, read_reply
from chauffeur.planners.onboard.thoughts import thoughts_of
from chauffeur.planners.onboard.town import asked_plainly, plan_in_town
from chauffeur.planners.onboard.understand import meanings_said
from chauffeur.planners.weather_doubts import never_faster
from chauffeur.safety.dangers import danger

SHIPPED: Final = Path(__file__).parent / "weights"
"""The model that comes with the package."""

UNSURE = 0.35
"""Below this probability of its least sure choice the model's program is asked about instead of driven."""


NOTHING: Final = Written("", 1.0, 0, 0, 0)
"""What the network wrote where it was not asked."""


def answer(
    engine: Engine,
    text: str,
    wish: str,
    history: Sequence[str],
    *,
    constrained: bool = True,
    guarded: bool = True,
    on_text: OnText | None = None,
    confirmed: str = "",
) -> tuple[OnboardReply, Written]:
    """What the model says to a wish after the guard has looked at it: steps, a question, or a refusal.

    Args:
        engine: The model.
        text: Its prompt.
        wish: The passenger's words.
        history: Remembered trips as the prompt has them.
        constrained: Whether decoding holds to the grammar.
        guarded: Whether the guard looks on.
        on_text: Gets each piece of text as the model writes it.
        confirmed: A question that was answered with yes, and is not asked again.

    Raises:
        ProgramError: What it wrote is no reply; only without the grammar.
    """
    if guarded and (reason := danger(wish)):
        return OnboardReply(refusal=reason), NOTHING
    attempts = count(1)

    def write(asked: str = text, **how: Any) -> tuple[OnboardReply, Written]:
        attempt = next(attempts)
        told = None if on_text is None else partial(_told, on_text, attempt)
        written = engine.write(asked, told=told, **how)
        reply = read_reply(written.text)
        return (_with_said_numbers(reply, wish, history) if guarded else reply), written

    reply, written = write(constrained=constrained)
    if reply.refusal in engine.about.get("checked", ()):
        # Whether the road and the limits allow it is for linking and the checks to say, not for the model. It is asked
        # as if nothing were known of the road: where it knows of no lane on the right, it would rather go left.
        text = prompt(None, history, wish)
        reply, written = write(text, only_program=True)
    if not guarded or not reply.steps:
        return reply, written
    if unnamed(wish, history, reply.steps) and (numbers := named(wish, history)):
        # Once more with the numbers that were said, and no others.
        reply, written = write(text, only_program=True, measures=numbers)
    question = doubt(wish, history, reply.steps)
    if not question and written.sure < UNSURE:
        question = f"{UNSURE_WORDS} {shall_i(reply.steps)}"
    if not question or question == confirmed:
        return reply, written
    return OnboardReply(question=question, meant="+".join(step.meaning.family for step in reply.steps)), written


def _with_said_numbers(reply: OnboardReply, wish: str, history: Sequence[str]) -> OnboardReply:
    steps = taken_over(wish, history, reply.steps)
    return reply if steps == reply.steps else OnboardReply(steps=steps, source=program_of(steps))


def _told(on_text: OnText, attempt: int, piece: str) -> None:
    on_text(piece, attempt)


@dataclass(frozen=True, slots=True)
class Settled:
    """A wish understood and fitted to the road, not yet a policy.

    Attributes:
        wish: The words, without those that were taken back.
        source: The model's program.
        steps: What it does, as written.
        linked: Its skills with their numbers.
        used: What the person's history said about each.
        situation: Where we are.
        written: What the network wrote.
    """

    wish: str
    source: str
    steps: tuple[DialectStep, ...]
    linked: Linked
    used: tuple[Leaning, ...]
    situation: Situation
    written: Written

    @property
    def witnessed(self) -> bool:
        """Whether the rules read the same, or the number comes from what was done for this person before."""
        remembered = unnamed(self.wish, (), self.steps) is not None
        return remembered or agreed(meanings_said(self.wish), self.linked.choice.intent)

    def question(self, request: PlanRequest) -> str:
        """What to ask before this is driven; empty where nothing is."""
        return question_about(
            request,
            shall_i(self.steps),
            witnessed=self.witnessed,
            choice=self.linked.choice,
            sure=self.written.sure,
        )


class LanguageModelPlanner:
    """Plans with the on-board language model, in this process."""

    def __init__(
        self,
        folder: Path,
        *,
        constrained: bool = True,
        history: bool = True,
        guarded: bool = True,
        on_text: OnText | None = None,
    ) -> None:
        """Load a model.

        Args:
            folder: Of the exported model.
            constrained, history, guarded: Whether decoding holds to the grammar, H is shown, and the guard looks on;
                turned off for ablations only.
            on_text: Gets each piece of text as the model writes it.

        Raises:
            DataError: The folder holds no model.
            MissingExtraError: A library is missing.
        """
        self._engine = Engine(folder)
        self._constrained = constrained
        self._history = history
        self._guarded = guarded
        self._on_text = on_text
        self._read: dict[str, tuple[DialectStep, ...]] = {}

    @classmethod
    def from_spec(cls, argument: str, *, on_text: OnText | None = None) -> Planner:
        """The planner named `onboard`: the model of the package; `onboard/FOLDER` is the model of a folder.

        Raises:
            ConfigError: The argument is no folder.
            DataError: The folder holds no model.
            MissingExtraError: A library is missing.
        """
        if not argument:
            return cls(SHIPPED, on_text=on_text)
        folder = Path(argument)
        if not folder.is_dir():
            raise ConfigError(
                f"The onboard planner has no variant {argument!r}.",
                hint="Write just: onboard; or onboard/FOLDER for the language model of a folder.",
            )
        return cls(folder, on_text=on_text)

    @property
    def id(self) -> str:
        """Registry name."""
        return "onboard"

    @property
    def model(self) -> str:
        """Version of the model."""
        return str(self._engine.about.get("version", "unnamed"))

    @never_faster
    async def plan(self, request: PlanRequest) -> Plan:
        """One plan; what is not understood, not possible or not to be done is declined in words."""
        begun = time.perf_counter()
        if request.context.situation.world == "parking":  # a program has no way into a spot; parameters have
            from chauffeur.planners.talk2drive.embedded import EmbeddedParameters

            return await EmbeddedParameters(self).plan(request)
        if (told := plan_by_sight(request)) is not None:
            return replace(told, planner=self.id)
        if (told := plan_in_town(self, request)) is not None:
            return told
        plan = self._in_words(request, begun)
        if (plainly := asked_plainly(request, plan)) is not None:
            return self._in_words(plainly, begun)
        return plan

    def _in_words(self, request: PlanRequest, begun: float) -> Plan:
        """The plan that the network writes."""
        settled = self.settle(request, begun)
        if isinstance(settled, Plan):
            return settled
        linked, used, wish = settled.linked, settled.used, settled.wish
        if asks := settled.question(request):
            plan = asked(self, asks, begun, offer=wish, raw=settled.written.text)
            plan = replace(plan, usage=usage_of(settled.written), alarm=_alarm(settled.steps, wish, settled.written))
            return undenied(self, plan, request, begun, meant=linked.choice.intent)
        plan = Plan(
            thoughts=thoughts_of(linked.reading, linked.choice, settled.situation, used),
            policy=Program(settled.source, library=linked.library),
            intent=linked.choice.intent,
            settings=linked.choice.settings(used),
            planner=self.id,
            model=self.model,
            latency_s=time.perf_counter() - begun,
            usage=usage_of(settled.written),
            raw=settled.written.text,
        )
        return undenied(self, plan, request, begun)

    def settle(self, request: PlanRequest, begun: float, *, shown: bool = True) -> Settled | Plan:
        """What is to be done here, before it is a policy of some kind; or the plan that declines.

        Args:
            request: What is asked.
            begun: When planning began, by `time.perf_counter`.
            shown: Whether the model is shown the history; not where it is plain what is meant. How the person likes it
                counts either way.
        """
        situation = request.context.situation
        if foreign(request.instruction.text):  # the model would make something of it
            return declined(self, ENGLISH_ONLY, begun, intent="ask")
        if self._guarded and (reason := danger(request.instruction.text)):  # whatever of it was taken back
            return declined(self, reason, begun, intent="refuse")
        ready = Wish.of(self, request.instruction, begun)
        if ready.declined is not None:
            return ready.declined
        wish, confirmed = ready.instruction.text, ready.instruction.confirmed
        history = history_words(request.history, self._steps_of) if self._history and shown else ()
        text = prompt(situation, history, wish)
        try:
            reply, written = answer(
                self._engine,
                text,
                wish,
                history,
                constrained=self._constrained,
                guarded=self._guarded,
                on_text=self._on_text,
                confirmed=confirmed,
            )
        except ProgramError as error:
            return declined(self, "I did not understand that.", begun, intent="ask", raw=str(error))
        if not reply.steps:
            words = reply.question or reply.refusal
            intent = "ask" if reply.question else "refuse"
            plan = declined(self, words, begun, intent=intent, usage=usage_of(written), raw=written.text)
            if reply.question.startswith((UNSURE_WORDS, NOT_THE_NUMBER)):
                return undenied(self, replace(plan, offer=wish), request, begun, meant=reply.meant)
            return plan
        leaning = partial(leaning_of, request.history, corrections=corrections_of(request.rounds))
        wary = wary_of(wish, "+".join(step.meaning.family for step in reply.steps))
        linked = link(reply.steps, situation, request.limits, leaning, wary=wary)
        if isinstance(linked, Declined):
            intent = "+".join(step.meaning.family for step in reply.steps)
            plan = declined(self, linked.words, begun, intent=intent, usage=usage_of(written), raw=written.text)
            return replace(plan, alarm=_alarm(reply.steps, wish, written))
        used = tuple(leaning(step.meaning.family) for step in reply.steps)
        return Settled(wish, reply.source, reply.steps, linked, used, situation, written)

    def _steps_of(self, wish: str) -> tuple[DialectStep, ...]:
        """What an earlier wish asked for, for trips that were driven by another planner; empty when that is unclear."""
        if wish not in self._read:
            try:
                self._read[wish] = read_reply(self._engine.write(prompt(None, (), wish), only_program=True).text).steps
            except ProgramError:
                self._read[wish] = ()
        return self._read[wish]


def _alarm(steps: Sequence[DialectStep], wish: str, written: Written) -> Alarm:
    """What a wish that is not driven was read as, where that is a stop at once."""
    if any(step.wait_s is not None or step.condition is not None for step in steps):
        return ""
    return alarm_in(wish, [step.meaning.family for step in steps], meanings_said(wish), written.sure)


def usage_of(written: Written) -> Usage:
    """What it cost."""
    return Usage(prompt_tokens=written.prompt_tokens, completion_tokens=written.tokens)
