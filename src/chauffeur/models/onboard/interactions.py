"""Interactions a model is adapted to: what a passenger wished, and the program that was right for it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from chauffeur.concept import (
    DataError,
    HistoryItem,
    ProgramError,
    Situation,
)
from chauffeur.memory.records import item_of
from chauffeur.planners.onboard.dialect import DialectStep, read
from chauffeur.planners.onboard.prompt import (
    HISTORY_ITEMS,
    SPECIAL,
    feedback_words,
    program_reply,
    prompt,
    remembered,
)
from chauffeur.planners.onboard.served import situation_of

LEAST: Final = 4
"""Fewer different accepted interactions than this cannot be both learned and judged."""


@dataclass(frozen=True, slots=True)
class AcceptedInteraction:
    """A wish and the program that was right for it.

    Attributes:
        wish: The passenger's words.
        situation: Where it was; None when that is not known.
        history: Remembered trips that were shown, as `prompt.remembered` writes them.
        program: Text of the dialect.
        accepted: Whether the passenger was content; only then it is learned.
    """

    wish: str
    situation: Situation | None
    history: tuple[str, ...]
    program: str
    accepted: bool


@dataclass(frozen=True, slots=True)
class Pair:
    """What the model reads and what it is to write."""

    prompt: str
    reply: str


def load_interactions(path: Path) -> list[AcceptedInteraction]:
    """Interactions of a file of JSON lines with the fields of `Interaction`.

    Raises:
        DataError: The file cannot be read, or a line is no interaction or its program not of the dialect; says which.
    """
    from pydantic import TypeAdapter, ValidationError

    form = TypeAdapter(AcceptedInteraction)
    found: list[AcceptedInteraction] = []
    for number, line in numbered_lines(path):
        try:
            one = form.validate_json(line)
            _check_text(one)
        except ValidationError as error:
            fault = error.errors(include_url=False, include_input=False)[0]
            where = ".".join(str(part) for part in fault["loc"])
            raise DataError(f"{path}, line {number}: {where}: {fault['msg']}.".replace(": :", ":")) from None
        except (DataError, ProgramError) as error:
            raise DataError(
                f"{path}, line {number}: {str(error).rstrip('.')}.", hint="Correct the line or take it out."
            ) from None
        found.append(one)
    return found


def _check_text(one: AcceptedInteraction) -> None:
    if not one.wish.strip():
        raise DataError("the wish is empty")
    if any(mark in text for text in one.history for mark in SPECIAL):
        raise DataError("the history holds a mark of the prompt")
    read(one.program)


def interactions_of(items: Iterable[HistoryItem]) -> list[AcceptedInteraction]:
    """Accepted trips of memory, oldest first, whose program is of the dialect; others are passed over.

    A trip was accepted if it went well and the last thing said of it, if anything, asks for no change. What memory held
    at the time is not kept with a trip: the two accepted trips before it stand in for that.
    """
    found: list[AcceptedInteraction] = []
    earlier: list[str] = []
    for item in items:
        steps = _steps(item.policy)
        if not steps or not _accepted(item) or not item.instruction.strip():
            continue
        shown = tuple(reversed(earlier[-HISTORY_ITEMS:]))
        found.append(AcceptedInteraction(item.instruction, _situation(item.context), shown, item.policy, accepted=True))
        earlier.append(remembered(steps, feedback_words(item.feedback[-1]) if item.feedback else ""))
    return found


def exported_items(document: str) -> list[HistoryItem]:
    """The trips in what a memory exported of a person, oldest first.

    Raises:
        DataError: It is no such document.
    """
    try:
        return [
            item_of(
                trip["trip"],
                trip["when"],
                trip["world"],
                json.dumps(trip),
                tuple(json.dumps(said) for said in trip["feedback"]),
            )
            for trip in json.loads(document)["trips"]
        ]
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(f"That is no exported profile: {error!r}.") from None


def _steps(program: str) -> tuple[DialectStep, ...]:
    try:
        return read(program)
    except ProgramError:
        return ()


def _accepted(item: HistoryItem) -> bool:
    if item.outcome not in ("success", "ended"):
        return False
    if not item.feedback:
        return True
    last = item.feedback[-1]
    asks = bool(last.speed or last.gap or last.comfort)
    return last.approval > 0 or (last.approval == 0 and not asks)


def _situation(words: str) -> Situation | None:
    """C read back from its words; None where they do not say the two facts that every situation has."""
    return situation_of(words) if "driving at" in words and "speed limit of my lane" in words else None


def pair_of(one: AcceptedInteraction, *, history: bool = True) -> Pair:
    """The prompt and the reply of an interaction."""
    return Pair(prompt(one.situation, one.history if history else (), one.wish), program_reply(read(one.program)))


def parted(
    interactions: Iterable[AcceptedInteraction], share: float, seed: int
) -> tuple[list[AcceptedInteraction], list[AcceptedInteraction]]:
    """(to learn, held back): accepted interactions, each once; of the same prompt twice, the newer counts.

    The part an interaction falls into depends on itself and the seed, so that it mostly stays there as more come.

    Raises:
        DataError: There are too few.
    """
    newest = {pair_of(one).prompt: one for one in interactions if one.accepted}
    if len(newest) < LEAST:
        raise DataError(
            f"There are {len(newest)} different accepted interactions; {LEAST} are the fewest that can be learned.",
            hint="Drive more, or give more --interactions.",
        )
    ordered = sorted(newest, key=lambda text: hashlib.sha256(f"{seed}\n{text}".encode()).digest())
    held = min(len(ordered) - 1, max(1, round(share * len(ordered))))
    return [newest[text] for text in ordered[held:]], [newest[text] for text in ordered[:held]]


def numbered_lines(path: Path) -> Iterator[tuple[int, str]]:
    """(line number, line) of the lines that are not empty."""
    try:
        with path.open(encoding="utf-8") as file:
            for number, line in enumerate(file, 1):
                if line.strip():
                    yield number, line
    except (OSError, UnicodeDecodeError) as error:
        raise DataError(f"{path} cannot be read: {error}.") from error
