"""Wordings of one wish to choose from: drawn from the grammar, read back, and kept when they say exactly the wish."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from chauffeur.bench.lampilot.scenes.kinds import Kind, Slot
from chauffeur.bench.lampilot.scenes.unambiguous import MAX_WORDS, MIN_WORDS, fault_of, words_of
from chauffeur.bench.lampilot.scenes.wishes import UNITS, Named, SceneWish
from chauffeur.bench.lampilot.scenes.wording_choice import normal
from chauffeur.concept import InstructionError
from chauffeur.concept.data import data_folder
from chauffeur.language.grammar import Grammar, GrammarFrame, Manner, Wording
from chauffeur.language.quantities import ONES, TENS

FILES = ("pieces", "distance", "speed", "road", "steps", "hints", "refusals")

_TIMED = re.compile(r"\b(?:now|when|once|here|there|until|at the)\b")
"""Imperatives that end badly with "now" or "for me"."""
_OF_US = re.compile(r"\b(?:us|your)\b")
"""Imperatives that cannot follow "let's"."""
_MANNER = Manner(
    frames=(
        GrammarFrame("{body}"),
        GrammarFrame("{body}"),
        GrammarFrame("{body}"),
        GrammarFrame("please {body}"),
        GrammarFrame("{body}, please"),
        GrammarFrame("(could|can|would|will) you {body}"),
        GrammarFrame("(could|can|would) you please {body}"),
        GrammarFrame("I('d like| want| need) you to {body}"),
        GrammarFrame("(okay|alright|hey), {body}"),
        GrammarFrame("{body} (now|for me)", plain=_TIMED),
        GrammarFrame("let's {body}", unless=_OF_US),
    ),
    questions=("could you", "can you", "would you", "will you"),
)


@cache
def grammar() -> Grammar:
    """All templates of `data/scenes`. Raises DataError: they are not here, or damaged."""
    return Grammar(data_folder("scenes"), FILES, _MANNER)


KEPT = 12
"""Wordings kept for an item; the suite then picks one, so that lengths and repetition come out right."""
MAX_SAID = 400
"""Draws after which what was found must do."""
EXTRA_MAX_WORDS = 24
"""Longest wording of several steps; the original's kinds keep to its 14."""
_SPREAD_WORDS = 1.9
"""Spread of instruction lengths within a kind."""
_SPELLED = 0.12
"""Share of whole numbers that are said in words."""


@dataclass(frozen=True, slots=True)
class Candidates:
    """Wordings found for an item.

    Attributes:
        wordings: Distinct ones that say exactly the wish, most of about the wished length.
        length: Number of words wished for this item.
        said: Wordings of fitting length that were read back.
        misread: Why wordings were thrown away, with counts.
    """

    wordings: tuple[Wording, ...]
    length: int
    said: int
    misread: Counter[str] = field(default_factory=Counter[str])


def word(wish: SceneWish, kind: Kind, slot: Slot, rng: np.random.Generator) -> Candidates:
    """Wordings for a wish.

    Raises:
        InstructionError: The grammar has no wording that says exactly this wish.
    """
    longest = EXTRA_MAX_WORDS if kind.family in ("steps", "directness", "refusals") else MAX_WORDS
    wanted = int(np.clip(round(float(rng.normal(kind.words, _SPREAD_WORDS))), MIN_WORDS, longest))
    # Extras have no splits and hold nothing out.
    held = None if slot.split == "extras" else slot.held
    usable = [template for section in wish.sections for template in grammar().templates(section, held=held)]
    kept: dict[str, Wording] = {}
    misread: Counter[str] = Counter()
    said = 0
    for turn in range(MAX_SAID):
        if len(kept) >= KEPT:
            break
        template = usable[int(rng.integers(len(usable)))]
        said_slots = {name: value if isinstance(value, str) else spoken(value, rng) for name, value in wish.slots}
        wording = grammar().say(template, said_slots, rng)
        length = words_of(wording.text)
        # First those of about the wished length, later any: reading back is what costs time.
        near = abs(length - wanted) <= 1 + 4 * turn // MAX_SAID or turn > MAX_SAID // 2
        if not near or not MIN_WORDS <= length <= longest or normal(wording.text) in kept:
            continue
        said += 1
        fault = fault_of(wording.text, wish, longest)
        if fault:
            misread[fault] += 1
        else:
            kept[normal(wording.text)] = wording
    if not kept:
        raise InstructionError(f"No wording says the wish of item {slot.index} ({kind.name}): {dict(misread)}.")
    return Candidates(tuple(kept.values()), wanted, said, misread)


def spoken(named: Named, rng: np.random.Generator) -> str:
    """A quantity as a person says or writes it."""
    unit = UNITS[named.unit]
    usual = rng.random() < 0.8
    words = unit.words[: unit.usual] if usual else unit.words
    said = words[int(rng.integers(len(words)))]
    spelled = rng.random() < _SPELLED and named.count < 100
    number = in_words(named.count) if spelled and len(said) > 3 else str(named.count)
    if named.count == 1:
        said = _singular(said)
    return f"{number} {said}"


def in_words(count: int) -> str:
    """A whole number below 100 in words."""
    if count < 20:
        return ONES[count]
    tens, ones = divmod(count, 10)
    return TENS[tens - 2] + (f"-{ONES[ones]}" if ones else "")


def _singular(unit: str) -> str:
    if unit == "feet":
        return "foot"
    head, _, rest = unit.partition("s ")
    if rest:
        return f"{head} {rest}"
    return unit.removesuffix("s") if len(unit) > 2 and unit[-1] == "s" and unit not in ("m/s",) else unit
