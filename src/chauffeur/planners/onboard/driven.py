"""From steps of the dialect to a plan that drives them on this road, declines them, or asks first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Final

from chauffeur.concept import Alarm, Plan, PlanRequest, Program, Usage
from chauffeur.concept.utterance import Act
from chauffeur.planners.arbitration import asked, slow_words, unanswered, wary_of
from chauffeur.planners.base import Planner, declined, planned
from chauffeur.planners.onboard.dialect import DialectStep, shall_i, write
from chauffeur.planners.onboard.link import Linked, link
from chauffeur.planners.onboard.options import Declined
from chauffeur.planners.onboard.personal import Leaning, corrections_of, leaning_of
from chauffeur.planners.onboard.thoughts import thoughts_of


@dataclass(frozen=True, slots=True)
class ReadSteps:
    """A reading as steps, and its provenance.

    Attributes:
        wish: The words.
        steps: What is to be driven.
        acts: The same as acts, where it was read as such.
        assumed: What was taken for granted, full sentences.
        unused: Words that nothing was read from.
        raw: What a model wrote.
        usage: What it cost.
    """

    wish: str
    steps: tuple[DialectStep, ...]
    acts: tuple[Act, ...] = ()
    assumed: tuple[str, ...] = ()
    unused: tuple[str, ...] | None = None
    raw: str = ""
    usage: Usage = field(default_factory=Usage)


_QUICKENS: Final = ("faster", "a_bit_faster", "much_faster", "hurry")
_FOLLOWING_S: Final = 3.0
"""Time headway up to which the vehicle ahead sets the ego's speed, when it is no faster."""
_SAME_SPEED_MPS: Final = 1.0


def past_the_lead(read: ReadSteps, request: PlanRequest) -> tuple[ReadSteps, Linked, tuple[Leaning, ...]] | None:
    """The same with an overtaking first, where the lead vehicle holds up an ego that is to be faster by no number.

    None where nothing holds it up, it cannot be overtaken, or the person said what is not to be done.
    """
    here = request.context.situation
    step, lead = read.steps[0], here.front
    alone = len(read.steps) == 1 and step.skill in _QUICKENS and step.condition is None
    if not alone or lead is None or any(act.negated for act in read.acts) or wary_of(read.wish, step.meaning.family):
        return None
    if lead.speed_mps > here.speed_mps + _SAME_SPEED_MPS or lead.distance_m > _FOLLOWING_S * here.speed_mps:
        return None
    passing = replace(read, steps=(DialectStep("overtake", manner=step.manner), step))
    linked, used = linked_here(passing.steps, passing.wish, request)
    return None if isinstance(linked, Declined) else (passing, linked, used)


def linked_here(
    steps: Sequence[DialectStep], wish: str, request: PlanRequest
) -> tuple[Linked | Declined, tuple[Leaning, ...]]:
    """Steps fitted to this road, these limits and this person, and what the person's history said about each."""
    leaning = partial(leaning_of, request.history, corrections=corrections_of(request.rounds))
    families = [step.meaning.family for step in steps]
    wary = wary_of(wish, "+".join(families))
    found = link(steps, request.context.situation, request.limits, leaning, wary=wary)
    return found, tuple(leaning(family) for family in families)


def drive_alike(some: Sequence[DialectStep], others: Sequence[DialectStep], wish: str, request: PlanRequest) -> bool:
    """True if two readings of a wish come to the same drive here: a lane change without a side, where there is one."""

    def waits(steps: Sequence[DialectStep]) -> list[object]:  # of which linking knows nothing
        return [(step.condition, step.wait_s) for step in steps]

    if not some or waits(some) != waits(others):
        return False
    one, other = (linked_here(steps, wish, request)[0] for steps in (some, others))
    return isinstance(one, Linked) and isinstance(other, Linked) and one.choice == other.choice


def plan_of_steps(planner: Planner, read: ReadSteps, request: PlanRequest, begun: float, *, unsure: str = "") -> Plan:
    """The plan that drives the steps; or that declines, or asks.

    Args:
        planner: Whose plan it is.
        read: What is to be driven.
        request: The words with what the person has answered already, where we are, and the limits.
        begun: When planning began, by `time.perf_counter`.
        unsure: Why the reading is to be asked about before it is driven; empty where it is sure.
    """
    linked, used = linked_here(read.steps, read.wish, request)
    if isinstance(linked, Declined):
        intent = "+".join(step.meaning.family for step in read.steps)
        return replace(declined(planner, linked.words, begun, intent=intent), alarm=alarm_of(read, sure=not unsure))
    if (passing := past_the_lead(read, request)) is not None:
        read, linked, used = passing
    why = unsure or slow_words(linked.choice.steps, request.context.situation, request.limits)
    if why and (question := unanswered(request.instruction, f"{why} {shall_i(read.steps)}")):
        return replace(asked(planner, question, begun, offer=read.wish), alarm=alarm_of(read, sure=not unsure))
    return plan_of_linked(planner, read, linked, used, request, begun)


def plan_of_linked(
    planner: Planner, read: ReadSteps, linked: Linked, used: Sequence[Leaning], request: PlanRequest, begun: float
) -> Plan:
    """The plan that drives linked steps."""
    thoughts = thoughts_of(linked.meanings, linked.choice, request.context.situation, used)
    return planned(
        planner,
        " ".join([thoughts, *read.assumed]),
        Program(write(read.steps), library=linked.library),
        begun,
        intent=linked.choice.intent,
        settings=linked.choice.settings(used),
        usage=read.usage,
        raw=read.raw,
        unused=read.unused,
        acts=read.acts,
    )


def alarm_of(read: ReadSteps, *, sure: bool) -> Alarm:
    """Alarm of a reading that is a stop at once, and nothing else: a call to stop, or distress to ask about.

    A stop at a place, at a time to come, or beside words that nothing was read from is a wish like others.
    """
    if [step.skill for step in read.steps] != ["stop_here"] or read.steps[0].numbers or read.steps[0].condition:
        return ""
    later = any((act.place is not None and act.place.rel != "here") or act.when is not None for act in read.acts)
    return "" if later or read.unused else "stop" if sure and read.acts else "distress"
