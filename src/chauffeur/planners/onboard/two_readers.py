"""Two readers of the same words: the acts of the one reader, and the on-board network's program.

Neither knows the other. What both read is driven. Where they differ the one that is sure is believed; where both are,
or neither, what the acts say is asked about in one question that a yes answers. The network counts as sure only if
every number of its program was said, and it does not make less of the words, or of words that are for somebody else.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from chauffeur.concept.utterance import Utterance
from chauffeur.language.quantities import read_quantities
from chauffeur.planners.meaning.highway import SpokenSteps
from chauffeur.planners.onboard.dialect import CONDITIONS, SKILLS, DialectStep, Kind, Number

SURE: Final = 0.9
"""Probability of the network's least sure choice from which it is believed against the acts. Chosen with the wishes of
`bench passengers` in sight."""
ACTS_SURE: Final = 0.5
"""Below this the acts are more likely wrong than right: what the network read is asked about rather than they."""
ACTS_ALONE: Final = 0.75
"""From this the acts are believed against a network that is not sure: of 450 turns on the motorway by a writer whom
neither reader had seen, 27 of the 31 that it drives were right, and of the network's programs none."""
_CLOSE: Final = 0.011
_PACES: Final = {"style.hurry": "speed.increase", "style.relax": "speed.decrease"}
"""Styles that are first of all a pace."""


@dataclass(frozen=True, slots=True)
class ReadWish:
    """The decision between two readers.

    Attributes:
        steps: What is to be driven or asked about; empty where neither reads anything to do.
        sure: Whether it may be driven without a question.
        by_acts: Whether the acts say it: their claims stand then.
    """

    steps: tuple[DialectStep, ...] = ()
    sure: bool = False
    by_acts: bool = False


def compared(
    utterance: Utterance,
    spoken: SpokenSteps,
    written: Sequence[DialectStep],
    sure: float,
    *,
    same_here: bool = False,
    refuses: bool = False,
) -> ReadWish:
    """Decide between two readings.

    Args:
        utterance: What the acts were read from.
        spoken: The acts as steps.
        written: The network's steps; none where it asks or refuses.
        sure: Probability of its least sure choice.
        same_here: Whether both come to the same drive on this road.
        refuses: Whether it refuses: then nothing is driven without a question.
    """
    if same_here:
        return ReadWish(spoken.steps, sure=not spoken.undoable, by_acts=True)
    if alike(spoken.steps, written):
        steps = tuple(other if _is_style(other) else one for one, other in zip(spoken.steps, written, strict=True))
        return ReadWish(steps, sure=not spoken.undoable, by_acts=True)
    network = bool(written) and quoted(utterance.text, written)
    refused = next((act.why for act in utterance.acts if act.act == "refuse"), None)
    if utterance.sure >= ACTS_SURE and (spoken.question or refused == "not driving"):
        return ReadWish()
    denied = any(act.negated for act in utterance.acts)  # what is not wanted no network outweighs
    allowed = utterance.address == "car" and not denied and refused is None and len(written) >= len(spoken.steps)
    by_network = network and allowed and sure >= SURE
    by_acts = bool(spoken.steps) and not spoken.undoable and not refuses and utterance.sure >= ACTS_ALONE
    if by_network and not by_acts:
        return ReadWish(tuple(written), sure=True)
    if spoken.steps and (utterance.sure >= ACTS_SURE or not network):
        return ReadWish(spoken.steps, sure=by_acts and not by_network, by_acts=True)
    return ReadWish(tuple(written))


def alike(some: Sequence[DialectStep], others: Sequence[DialectStep]) -> bool:
    """True if two programs do the same; how much a "bit" is, how briskly, whether haste is a pace or a style, and
    whether a lane is to be clear first, which it is in any case, are no difference.
    """
    return (
        bool(some)
        and len(some) == len(others)
        and all(_same_step(one, other) for one, other in zip(some, others, strict=True))
    )


def _same_step(one: DialectStep, other: DialectStep) -> bool:
    named, tested = _waits_for(one), _waits_for(other)
    kinds = _kind(one) == _kind(other)
    same_numbers = len(one.numbers) == len(other.numbers) and all(map(_close, one.numbers, other.numbers))
    return kinds and SKILLS[one.skill].takes == SKILLS[other.skill].takes and named == tested and same_numbers


def _kind(step: DialectStep) -> tuple[str, str]:
    meaning = step.meaning
    return (meaning.family, meaning.variant) if meaning.family not in _PACES else (_PACES[meaning.family], "")


def _waits_for(step: DialectStep) -> tuple[str, str] | None:
    """Its condition, but for that lane to be clear into which it changes."""
    side = step.meaning.direction if step.meaning.manoeuvre in ("lane", "overtake") else None
    if step.condition is None or (step.condition.how == "once" and step.condition.name == f"clear_{side}"):
        return None
    return step.condition.how, step.condition.name


def _is_style(step: DialectStep) -> bool:
    """True if it is a pace as a way of driving: it says more than the pace, and what a person likes is kept by it."""
    return step.meaning.family in _PACES


def _close(one: Number, other: Number) -> bool:
    return abs(one.si - other.si) <= _CLOSE * max(1.0, abs(one.si))


def quoted(text: str, steps: Sequence[DialectStep]) -> bool:
    """True if every number of some steps was said, of its own kind or without a unit; shares and counts are said in too
    many ways, and a number of an earlier trip was not said now.
    """
    said = read_quantities(text)
    return all(
        any(
            abs(value - q.value) <= _CLOSE * max(1.0, value)
            for q in said
            for value, kinds in ((number.si, (kind,)), (number.value, ("bare",)))
            if q.dimension in kinds
        )
        for kind, number in _measures(steps)
    )


def _measures(steps: Sequence[DialectStep]) -> Iterator[tuple[Kind, Number]]:
    """The speeds, distances and times of some steps."""
    for step in steps:
        tested = None if step.condition is None else CONDITIONS[step.condition.name][0]
        kinds = (SKILLS[step.skill].takes, "time", tested)
        numbers = (step.number, step.wait_s, None if step.condition is None else step.condition.number)
        for kind, number in zip(kinds, numbers, strict=True):
            if kind in ("speed", "distance", "time") and number is not None and number.factor == 1.0:
                yield kind, number
