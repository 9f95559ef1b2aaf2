"""The on-board planner: the acts of the words and the network's program, linked to this road where they agree.

What the model writes is read by the dialect's reader and linked; it is never run as it comes.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

from chauffeur.concept import ConfigError, Plan, PlanRequest, ProgramError, Situation, Usage
from chauffeur.language.meaning.reader import read
from chauffeur.planners.arbitration import UNSURE_WORDS, Wish, asked, slow_words, unanswered
from chauffeur.planners.base import NO_WISH, OnText, Planner, declined
from chauffeur.planners.meaning.highway import steps_before, steps_of
from chauffeur.planners.meaning.planner import FOR_OTHERS, WHY_NOT, left_out, plan_by_sight, unused_words
from chauffeur.planners.onboard.dialect import DialectStep, shall_i
from chauffeur.planners.onboard.doubts import CAN_DO, ENGLISH_ONLY, foreign
from chauffeur.planners.onboard.driven import (
    ReadSteps,
    alarm_of,
    drive_alike,
    linked_here,
    past_the_lead,
    plan_of_linked,
)
from chauffeur.planners.onboard.engine import Engine, Written
from chauffeur.planners.onboard.link import Linked
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.planners.onboard.prompt import history_words, prompt
from chauffeur.planners.onboard.reply import OnboardReply, read_reply
from chauffeur.planners.onboard.town import asked_plainly, plan_in_town
from chauffeur.planners.onboard.two_readers import compared
from chauffeur.planners.weather_doubts import never_faster

SHIPPED: Final = Path(__file__).parent / "weights"
"""The model that comes with the package."""


def answer(
    engine: Engine,
    situation: Situation | None,
    history: Sequence[str],
    wish: str,
    *,
    on_text: OnText | None = None,
) -> tuple[OnboardReply, Written]:
    """The model's answer to a wish: steps, a question, or a refusal.

    Args:
        engine: The model.
        situation: Where we are.
        history: Remembered trips as the prompt has them.
        wish: The passenger's words.
        on_text: Gets each piece of text as the model writes it.

    Raises:
        ProgramError: What it wrote is no reply: it came to no end in time.
    """

    def write(attempt: int, text: str, **how: Any) -> tuple[OnboardReply, Written]:
        told = None if on_text is None else partial(_told, on_text, attempt)
        written = engine.write(text, told=told, **how)
        return read_reply(written.text), written

    reply, written = write(1, prompt(situation, history, wish))
    if reply.refusal in engine.about.get("checked", ()):
        # Whether the road and the limits allow it is for linking and the checks to say, not for the model. It is asked
        # as if nothing were known of the road: where it knows of no lane on the right, it would rather go left.
        return write(2, prompt(None, history, wish), only_program=True)
    return reply, written


def _told(on_text: OnText, attempt: int, piece: str) -> None:
    on_text(piece, attempt)


@dataclass(frozen=True, slots=True)
class Settled:
    """A wish understood and fitted to the road, not yet a policy.

    Attributes:
        read: What is to be driven.
        linked: Its skills with their numbers.
        used: What the person's history said about each.
        situation: Where we are.
        written: What the network wrote.
        witnessed: Whether it may be driven without a question about the reading.
        left_out: What of the wish is not done, in words.
    """

    read: ReadSteps
    linked: Linked
    used: tuple[Leaning, ...]
    situation: Situation
    written: Written
    witnessed: bool
    left_out: str = ""

    @property
    def wish(self) -> str:
        """The words, without those that were taken back."""
        return self.read.wish

    @property
    def steps(self) -> tuple[DialectStep, ...]:
        """The steps to be driven."""
        return self.read.steps

    def question(self, request: PlanRequest) -> str:
        """The question before this is driven; empty for none, or if no passenger can answer."""
        unsure = self.left_out or ("" if self.witnessed else UNSURE_WORDS)
        why = unsure or slow_words(self.linked.choice.steps, self.situation, request.limits)
        return unanswered(request.instruction, f"{why} {shall_i(self.steps)}") if why else ""


class LanguageModelPlanner:
    """Plans with the on-board language model and the acts of the words, in this process."""

    def __init__(self, folder: Path, *, on_text: OnText | None = None) -> None:
        """Load a model.

        Args:
            folder: Of the exported model.
            on_text: Gets each piece of text as the model writes it.

        Raises:
            DataError: The folder holds no model.
        """
        self._engine = Engine(folder)
        self._on_text = on_text
        self._read: dict[str, tuple[DialectStep, ...]] = {}

    @classmethod
    def from_spec(cls, argument: str, *, on_text: OnText | None = None) -> Planner:
        """The planner named `onboard`: the model of the package; `onboard/FOLDER` is the model of a folder.

        Raises:
            ConfigError: The argument is no folder.
            DataError: The folder holds no model.
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

            return replace(await EmbeddedParameters(self).plan(request), planner=self.id)
        if (told := plan_by_sight(request)) is not None:
            return replace(told, planner=self.id)
        if (told := plan_in_town(self, request)) is not None:
            return told
        plan = self._in_words(request, begun)
        if (plainly := asked_plainly(request, plan)) is not None:
            return self._in_words(plainly, begun)
        return plan

    def _in_words(self, request: PlanRequest, begun: float) -> Plan:
        """The plan that drives what the words were read as."""
        settled = self.settle(request, begun)
        if isinstance(settled, Plan):
            return settled
        if (passing := past_the_lead(settled.read, request)) is not None:
            read, linked, used = passing
            settled = replace(settled, read=read, linked=linked, used=used)
        if asks := settled.question(request):
            plan = asked(self, asks, begun, offer=settled.wish, raw=settled.written.text)
            return replace(plan, usage=usage_of(settled.written), alarm=alarm_of(settled.read, sure=settled.witnessed))
        return plan_of_linked(self, settled.read, settled.linked, settled.used, request, begun)

    def settle(self, request: PlanRequest, begun: float, *, shown: bool = True) -> Settled | Plan:
        """The wish fitted to the road, before it is a policy of some kind; or the plan that declines.

        Args:
            request: What is asked.
            begun: When planning began, by `time.perf_counter`.
            shown: Whether the history is looked at; not where it is plain what is meant. How the person likes it counts
                either way.
        """
        situation = request.context.situation
        if foreign(request.instruction.text):  # the model would make something of it
            return declined(self, ENGLISH_ONLY, begun, intent="ask")
        ready = Wish.of(self, request.instruction, begun)
        if ready.declined is not None:
            return ready.declined
        wish = ready.instruction.text
        utterance = read(wish)
        before = steps_before(request.history) if shown else ()
        spoken = steps_of(utterance.acts, situation, before)
        history = history_words(request.history, self._steps_of) if shown else ()
        try:
            reply, written = answer(self._engine, situation, history, wish, on_text=self._on_text)
        except ProgramError as error:
            return declined(self, "I did not understand that.", begun, intent="ask", raw=str(error))
        same = drive_alike(spoken.steps, reply.steps, wish, request)
        found = compared(utterance, spoken, reply.steps, written.sure, same_here=same, refuses=bool(reply.refusal))
        if not found.steps:
            forbidden = (WHY_NOT[act.why] for act in utterance.acts if act.act == "refuse" and act.why in WHY_NOT)
            words = next(forbidden, "") or spoken.question or left_out(spoken.undoable)
            words = words or reply.question or reply.refusal
            if not utterance.acts and utterance.address in FOR_OTHERS:
                return declined(self, FOR_OTHERS[utterance.address], begun, intent=NO_WISH, usage=usage_of(written))
            intent = "ask" if spoken.question or reply.question else "refuse"
            words = words or f"I did not understand what you want me to drive. {CAN_DO}"
            return declined(self, words, begun, intent=intent, usage=usage_of(written), raw=written.text)
        acts, assumed = (spoken.done, spoken.assumed) if found.by_acts else ((), ())
        unused = unused_words(utterance, spoken.undoable) if found.by_acts else None
        reads = ReadSteps(wish, found.steps, acts, assumed, unused, written.text, usage_of(written))
        linked, used = linked_here(found.steps, wish, request)
        if isinstance(linked, Declined):
            intent = "+".join(step.meaning.family for step in found.steps)
            plan = declined(self, linked.words, begun, intent=intent, usage=reads.usage, raw=written.text)
            return replace(plan, alarm=alarm_of(reads, sure=found.sure))
        words = left_out(spoken.undoable) if found.by_acts else ""
        return Settled(reads, linked, used, situation, written, found.sure, words)

    def _steps_of(self, wish: str) -> tuple[DialectStep, ...]:
        """Steps of an earlier wish, for trips driven by another planner; empty if they are unclear."""
        if wish not in self._read:
            try:
                self._read[wish] = read_reply(self._engine.write(prompt(None, (), wish), only_program=True).text).steps
            except ProgramError:
                self._read[wish] = ()
        return self._read[wish]


def usage_of(written: Written) -> Usage:
    """Tokens of the prompt and the reply."""
    return Usage(prompt_tokens=written.prompt_tokens, completion_tokens=written.tokens)
