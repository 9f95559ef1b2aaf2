"""Reads what words mean, looks for what they refer to, and drives the acts: composed in a town, by skills elsewhere."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from chauffeur.concept import Plan, PlanRequest, Program
from chauffeur.concept.dialogue import wishes
from chauffeur.concept.utterance import Act, Reference, Utterance
from chauffeur.describe.answers import DONT_KNOW
from chauffeur.language.ground import ROAD_USERS
from chauffeur.language.meaning.reader import read
from chauffeur.language.meaning.words import act_words
from chauffeur.planners.arbitration import UNSURE_WORDS, Wish, asked, unanswered
from chauffeur.planners.base import NO_WISH, declined, no_argument, planned
from chauffeur.planners.meaning.compose import ComposedActs, Undoable, compose
from chauffeur.planners.meaning.highway import steps_before, steps_of
from chauffeur.planners.onboard.driven import ReadSteps, plan_of_steps
from chauffeur.programs.catalogue import vocabulary_of

VERSION: Final = "meaning-v1"
SURE: Final = 0.5
"""Below this a reading is more likely wrong than right, and is asked about."""
_NOT_HERE: Final = "I do not park yet. Use another planner here."
_BLIND: Final = "I am not told who is around, so I cannot look for what you mean."
_UNCLEAR: Final = "I hear that you want something, and do not know what. Please say it in other words."
FOR_OTHERS: Final = {
    "remark": "I hear a remark, and nothing for me to do.",
    "story": "I hear a story, and nothing for me to do.",
    "question": DONT_KNOW,
    "feedback": "Thank you for telling me. I change nothing now.",
    "other": "I think that was not said to me, and change nothing.",
}
WHY_NOT: Final = {
    "illegal": "The rules of the road do not allow that.",
    "dangerous": "That would put people in danger.",
}


_SEEN: Final = ROAD_USERS | {"light"}
_BY_NAME: Final = frozenset({"building", "landmark", "lot", "gate", "driveway"})
"""Places that a town's map knows by their names, and sight does not."""


class MeaningPlanner:
    """Drives acts: about things in sight in a town, by the skills of the dialect on highways and at crossings."""

    @classmethod
    def from_spec(cls, argument: str) -> MeaningPlanner:
        """The planner named `meaning`. Raises ConfigError for an argument: it has no variants."""
        no_argument("meaning", argument)
        return cls()

    @property
    def id(self) -> str:
        """Registry name."""
        return "meaning"

    @property
    def model(self) -> str:
        """Reader and composer with their version."""
        return VERSION

    async def plan(self, request: PlanRequest) -> Plan:
        """One plan: of a reading that is sure, whose references are clear, and of which everything can be done."""
        wish = Wish.of(self, request.instruction, time.perf_counter())
        if wish.declined is not None:
            return wish.declined
        asked_for = replace(request, instruction=wish.instruction)
        return self.plan_of(_read(asked_for), asked_for)

    def plan_of(self, utterance: Utterance, request: PlanRequest) -> Plan:
        """The plan for words that are read already."""
        begun = time.perf_counter()
        if utterance.emergency:
            return replace(declined(self, "I stop.", begun, intent="stop"), alarm="stop")
        if not wishes(utterance.acts):
            unclear = any(act.act in ("unclear", "again") for act in utterance.acts)
            nothing = _UNCLEAR if unclear else "I hear nothing in that for me to do, and change nothing."
            words = FOR_OTHERS.get(utterance.address, nothing)
            return declined(self, words, begun, intent=NO_WISH)
        forbidden = [act for act in utterance.acts if act.act == "refuse" and act.why in ("illegal", "dangerous")]
        if (refused := next(iter(forbidden), None)) is not None:
            return declined(self, WHY_NOT[refused.why or "dangerous"], begun, intent="refuse")
        if request.context.situation.world == "parking":
            return declined(self, _NOT_HERE, begun, intent="not there")
        if vocabulary_of(request.context.situation.world) != "town":
            return self._by_skills(utterance, request, begun)
        if request.observation is None:
            return declined(self, _BLIND, begun, intent="not there")
        if utterance.sure < SURE:
            words = f"I understand: {_listed(utterance.acts)}. Is that what you want?"
            if unanswered(request.instruction, words):
                return asked(self, words, begun, offer=request.instruction.text)
        made = compose(utterance, request.observation, request.context.situation, request.limits)
        if made.question:
            return asked(self, made.question, begun)
        if not made.done:
            words = left_out(made.undoable)
            return declined(self, words or "I see nothing to do in that.", begun, intent="not there")
        if missed := left_out(made.undoable):
            words = f"{missed} Shall I do the rest: {_listed(made.done)}?"
            if unanswered(request.instruction, words):
                return asked(self, words, begun, offer=request.instruction.text)
        return planned(
            self,
            _thoughts(utterance, made, missed),
            Program(made.source, library=made.library),
            begun,
            intent=made.intent,
            unused=unused_words(utterance, made.undoable),
            acts=made.done,
        )

    def _by_skills(self, utterance: Utterance, request: PlanRequest, begun: float) -> Plan:
        """The plan for acts where the driving language knows lanes and a vehicle ahead, and nothing else in sight."""
        found = steps_of(utterance.acts, request.context.situation, steps_before(request.history))
        if found.question:
            return declined(self, found.question, begun, intent="ask")
        missed = left_out(found.undoable)
        if not found.steps:
            return declined(self, missed or "I see nothing to do in that.", begun, intent="not there")
        unsure = missed or (UNSURE_WORDS if utterance.sure < SURE else "")
        unused = unused_words(utterance, found.undoable)
        reads = ReadSteps(utterance.text, found.steps, found.done, found.assumed, unused)
        return plan_of_steps(self, reads, request, begun, unsure=unsure)


def plan_by_sight(request: PlanRequest) -> Plan | None:
    """The plan for words about road users or lights in sight of a car in a town; None for all other words: a plain
    turn, a speed, a place by its name.
    """
    if vocabulary_of(request.context.situation.world) != "town" or request.observation is None:
        return None
    utterance = _read(request)
    kinds = {one.kind for act in utterance.acts for one in _references(act)}
    if not kinds & _SEEN or kinds & _BY_NAME or any(act.act == "goto" for act in utterance.acts):
        return None
    return MeaningPlanner().plan_of(utterance, request)


def _read(request: PlanRequest) -> Utterance:
    """The meaning of the words in their conversation, else by themselves."""
    instruction, found = request.instruction, request.utterance
    if found is None or found.text not in (instruction.text, instruction.said):
        return read(instruction.text)
    return found


def _references(act: Act) -> Iterator[Reference]:
    """References of an act, and those that they belong to."""
    places = act.place and act.place.ref, act.when and act.when.ref
    for named in (act.target, *places):
        one = named
        while one is not None:
            yield one
            one = one.of


def unused_words(utterance: Utterance, undoable: Sequence[Undoable]) -> tuple[str, ...]:
    """The words of acts that are not done, and those that no act was read from."""
    spans = [one.act.span for one in undoable if one.act.span is not None]
    return tuple(utterance.text[low:high] for low, high in (*spans, *utterance.unused))


def left_out(undoable: Sequence[Undoable]) -> str:
    """The acts that are not done, in words."""
    return " ".join(f"I cannot {act_words(one.act)}: {one.reason}." for one in undoable)


def _listed(acts: tuple[Act, ...]) -> str:
    return "; then ".join(act_words(act).replace(" — ", ", ") for act in acts)


def _thoughts(utterance: Utterance, made: ComposedActs, left_out: str) -> str:
    parts = [f"{sentence}." for sentence in made.told]
    parts += [left_out] if left_out else []
    parts += [f"I do not use “{utterance.text[low:high]}”." for low, high in utterance.unused]
    return " ".join(parts)
