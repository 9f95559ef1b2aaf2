"""Reading a text: the learned parser's acts, with numbers, names, emergencies and unused words filled in by rules."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

from chauffeur.concept.utterance import Act, ActPlace, Reference, Side, Span, Utterance
from chauffeur.language.emergency import read_emergency
from chauffeur.language.meaning.dialogue import is_elliptical, resolved
from chauffeur.language.meaning.parser import Parsed, Parser, shipped_parser, spans_of
from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.language.meaning.turns import closed_turn
from chauffeur.language.meaning.words import wish_words
from chauffeur.language.quantities import amount_said, read_quantities

MOST_CHARS: Final = 1_000
"""What stands behind them is not read, and is told as unused."""
_SENTENCE: Final = re.compile(r"[^.!?;\n]*[.!?;\n]*")
_LONG_CHARS: Final = 240
"""A longer text is read sentence by sentence: the parser was trained on texts up to 300 characters."""
SURE_BIAS, SURE_SLOPE = 1.58, 1.22
"""Logistic map from the string's log-probability to the share of right readings, fitted on 600 labelled commands that
no training saw; on each set of them left out of the fit, mean probability and share agree within 0.03
(`benchmarks/meaning.py`)."""
_WORD: Final = re.compile(r"\w[\w'’]*")
_COURTESY_WORDS: Final = (
    "please can could would will you your i we us me my want need like should to the a an and then so ok okay "
    "now hey hi hello car thanks thank just do it is for if mind yes no well oh lets let's kindly maybe be "
    "this that there here what how about go ahead make sure try was are of in on at with again too also right "
    "away"
)
_COURTESY: Final = frozenset(_COURTESY_WORDS.split())
"""Words whose being unused tells a person nothing."""


@dataclass(frozen=True, slots=True)
class Turn:
    """Words read in their conversation.

    Attributes:
        utterance: Resolved.
        whole: A whole sentence for it, where the words are none by themselves; empty where they are.
        lost: Whether the words surely mean something only beside others, and there are none.
    """

    utterance: Utterance
    whole: str = ""
    lost: bool = False

    @property
    def cancels(self) -> bool:
        """True if the words take something back, and ask for nothing instead."""
        verbs = {act.act for act in self.utterance.acts}
        return bool(verbs) and verbs <= {"no", "cancel"}


def turn_of(text: str, last: Utterance | None = None) -> Turn:
    """Read words after the turn before, with a whole sentence for them. Never raises."""
    alone, found = _read_after(text, last)
    if not is_elliptical(alone):
        return Turn(found)
    whole = wish_words(found.acts)
    lost = alone.sure == 1.0 and not whole and not any(act.act in ("again", "cancel") for act in found.acts)
    return Turn(found, whole, lost)


def read(text: str, last: Utterance | None = None, parser: Parser | None = None) -> Utterance:
    """Read a passenger's words. Never raises.

    Args:
        text: The words as they came; `MOST_CHARS` of them are read.
        last: What was said before, for words that mean something only beside it ("the other one"); None for nothing.
        parser: Reads; default the shipped one.
    """
    return _read_after(text, last, parser)[1]


def _read_after(text: str, last: Utterance | None, parser: Parser | None = None) -> tuple[Utterance, Utterance]:
    """Readings of words by themselves, and after the turn before."""
    if turns := closed_turn(text):
        alone = Utterance(text, turns, emergency=_stops(text))
        found = resolved(alone, last)
        if not any(act.value is not None for act in turns) or all(act.act != "unclear" for act in found.acts):
            return alone, found  # else it is a number of nothing that was said before
    alone = _parsed(text, parser)
    return alone, resolved(alone, last)


@lru_cache(maxsize=16)  # planner, checks and session ask for the words of one wish each
def _parsed(text: str, parser: Parser | None = None) -> Utterance:
    """The parser's reading of words by themselves."""
    emergency = _stops(text)
    reads = shipped_parser() if parser is None else parser
    acts: list[Act] = []
    opinion: list[Act] = []
    address, log_probability = "car", 0.0
    for low, begins, high in _stretches(text[:MOST_CHARS]):
        parsed = reads.parse(text[low:high])
        found = [_resolved(act, parsed, text[low:high], low) for act in parsed.acts]
        found = [act for act in found if act.span is None or act.span[1] > begins]
        if parsed.address == "car":
            acts = [act for act in acts if not any(_overlap(act, later) for later in found)] + found
        elif parsed.address == "feedback":
            opinion += found
        log_probability += parsed.log_probability
        address = parsed.address if parsed.address != "car" and not acts else address
    sure = 1.0 / (1.0 + math.exp(-(SURE_BIAS + SURE_SLOPE * max(log_probability, -20.0))))
    return Utterance(
        text,
        tuple(acts),
        tuple(opinion),
        "car" if acts else address,
        emergency,
        sure,
        tuple(_unused(text, (act.span for act in acts if act.span is not None))),
    )


def _stops(text: str) -> bool:
    """True if words call for help or for a stop; "don't stop" calls for none."""
    found = read_emergency(text)
    return found is not None and found.kind != "no_stop"


def _stretches(text: str) -> list[tuple[int, int, int]]:
    """The text in one piece, or a long one sentence by sentence: where what is read begins, where that which was not
    read before begins, and where both end. The sentence before is read along: an act may be said in two breaths."""
    if len(text) <= _LONG_CHARS:
        return [(0, 0, len(text))] if _seen(text) else []
    found: list[tuple[int, int, int]] = []
    before = 0
    for sentence in _SENTENCE.finditer(text):
        low, high = sentence.span()
        if not _seen(sentence[0]):
            continue
        if found and high - found[-1][0] <= _LONG_CHARS:
            found[-1] = *found[-1][:2], high
        else:
            found.append((before if found and high - before <= _LONG_CHARS else low, low, high))
        before = low
    return found


def _seen(text: str) -> bool:
    """True if a text holds anything that the parser's vocabulary does not drop."""
    return any(unicodedata.category(char)[0] in "LNPS" and char != "\ufffd" for char in text)


def _overlap(act: Act, later: Act) -> bool:
    """True if an act was read again with more of its words."""
    return act.span is not None and later.span is not None and act.span[1] > later.span[0]


def _resolved(written: WrittenAct, parsed: Parsed, text: str, offset: int) -> Act:
    """An act whose pointers are words, numbers and names."""
    low, high = spans_of(parsed, written.span)
    act = replace(written.act, span=(offset + low, offset + high))
    if written.value is not None and (amount := _amount(written.value, parsed, text, high)) is not None:
        act = _measured(replace(act, value=amount[0], unit=amount[1]), parsed, text, written.value)
    names = iter(written.names)
    place, when = act.place, act.when
    target = _named(act.target, names, parsed, text)
    if place is not None:
        place = ActPlace(place.rel, _named(place.ref, names, parsed, text))
    if when is not None:
        when = replace(when, ref=_named(when.ref, names, parsed, text))
        if written.event_value is not None and (amount := _amount(written.event_value, parsed, text, high)) is not None:
            when = replace(when, value=amount[0], unit=amount[1])
    act = _sided(replace(act, target=target, place=place, when=when), text[low:high])
    return act if act.place or act.when else replace(act, span=(offset + low, offset + _before_clause(text, low, high)))


_CLAUSES: Final = frozenset({"after", "before", "until", "till", "unless", "when", "once", "if", "while"})
"""Words that begin a place or a condition: an act that has neither did not use what they begin."""


def _before_clause(text: str, low: int, high: int) -> int:
    """End of an act's own words, before a clause that nothing was read from."""
    words = list(_WORD.finditer(text, low, high))
    begins = next((word.start() for word in words[1:] if word[0].lower() in _CLAUSES), high)
    return low + len(text[low:begins].rstrip())


_SIDES: Final[tuple[Side, ...]] = ("left", "right")


def _sided(act: Act, words: str) -> Act:
    """A turn or lane change whose one side stands in its own words ("turn right here"), where the parser has none."""
    places = (act.target, act.place and act.place.ref, act.when and act.when.ref)
    if act.act not in ("turn", "lane") or act.side or act.to or any(one is not None for one in places):
        return act
    said = {word.strip(" .,;:!?").lower() for word in words.split()}
    found = [side for side in _SIDES if side in said]
    return replace(act, side=found[0]) if len(found) == 1 else act


_COMPARED: Final = frozenset(
    {"less", "more", "fewer", "extra", "closer", "nearer", "further", "farther", "slower", "faster", "shorter",
     "longer", "larger", "smaller"}
)  # fmt: skip
"""Words behind an amount that make it a change, whatever stands before it."""


def _measured(act: Act, parsed: Parsed, text: str, token: int) -> Act:
    """An amount counts as the word right before it says: "to 65 metres" is the value itself, "by 65" the change."""
    before = text[: spans_of(parsed, (token,))[0]].split()
    word = before[-1].lower() if before else ""
    after = {one.strip(".,;:!?").lower() for one in text[spans_of(parsed, (token,))[0] :].split()[:5]}
    if word == "to" and act.measure == "by" and not after & _COMPARED:
        return replace(act, measure=None)
    return replace(act, measure="by") if word == "by" and act.measure is None and act.direction else act


def _amount(token: int, parsed: Parsed, text: str, high: int) -> tuple[float, str] | None:
    """The quantity that begins at a token, in the unit in which it was said; None where the rules find none there."""
    start, _ = spans_of(parsed, (token,))
    found = read_quantities(text[start : max(high, start + 1)])
    return amount_said(found[0]) if found else None


def _named(
    reference: Reference | None, names: Iterable[tuple[int, int]], parsed: Parsed, text: str
) -> Reference | None:
    """A reference with its names as they were said."""
    if reference is None:
        return None
    name = ""
    if reference.name and (tokens := next(iter(names), None)) is not None:
        low, high = spans_of(parsed, tokens)
        name = text[low:high].strip(" .,;:!?\"'").lower()
    return replace(reference, name=name, of=_named(reference.of, names, parsed, text))


def _unused(text: str, spans: Iterable[Span]) -> Iterable[Span]:
    """Stretches of words outside of all acts that hold more than courtesy."""
    covered = sorted(spans)
    at = 0
    for low, high in [*covered, (len(text), len(text))]:
        if low > at:
            words = list(_WORD.finditer(text, at, low))
            if any(word[0].lower() not in _COURTESY for word in words):
                yield words[0].start(), words[-1].end()
        at = max(at, high)
