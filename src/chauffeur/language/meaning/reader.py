"""Reading a text: the learned parser's acts, with numbers, names, emergencies and unused words filled in by rules."""

from __future__ import annotations

import math
import re
import unicodedata
from collections.abc import Iterable
from dataclasses import replace
from typing import Final

from chauffeur.concept.units import M_PER_CAR_LENGTH, M_PER_FOOT, M_PER_YARD, MPS_PER_KMH, MPS_PER_MPH
from chauffeur.concept.utterance import Act, ActPlace, Reference, Span, Utterance
from chauffeur.language.emergency import read_emergency
from chauffeur.language.meaning.parser import Parsed, Parser, shipped_parser, spans_of
from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.language.quantities import Quantity, read_quantities

MOST_CHARS: Final = 1_000
"""What stands behind them is not read, and is told as unused."""
_SENTENCE: Final = re.compile(r"[^.!?;\n]*[.!?;\n]*")
_LONG_CHARS: Final = 240
"""A longer text is read sentence by sentence: the parser was trained on texts up to 300 characters."""
_SURE_BIAS, _SURE_SLOPE = 1.58, 1.81
"""Logistic map from the string's log-probability to the share of right readings, fitted on real commands that no
training saw: 273 of 300 lie above -1, of which 73 % are right; of the rest half are (`benchmarks/meaning.py`)."""
_WORD: Final = re.compile(r"\w[\w'’]*")
_COURTESY_WORDS: Final = (
    "please can could would will you your i we us me my want need like should to the a an and then so ok okay "
    "now hey hi hello car thanks thank just do it is for if mind yes no well oh lets let's kindly maybe be "
    "this that there here what how about go ahead make sure try was are of in on at with again too also right "
    "away"
)
_COURTESY: Final = frozenset(_COURTESY_WORDS.split())
"""Words whose being unused tells a person nothing."""
_SPEED_UNITS: Final = (("mph", MPS_PER_MPH, ("mph", "mi")), ("km/h", MPS_PER_KMH, ("k",)), ("m/s", 1.0, ()))
_LENGTH_UNITS: Final = (
    ("lengths", M_PER_CAR_LENGTH, ("length",)), ("ft", M_PER_FOOT, ("ft", "foot", "feet")),
    ("yd", M_PER_YARD, ("yd", "yard")), ("km", 1000.0, ("km", "kilo")), ("m", 1.0, ()),
)  # fmt: skip


def read(text: str, parser: Parser | None = None) -> Utterance:
    """What a passenger's words mean. Never raises for any text.

    Args:
        text: The words as they came; `MOST_CHARS` of them are read.
        parser: Reads; default the shipped one.
    """
    reads = shipped_parser() if parser is None else parser
    acts: list[Act] = []
    opinion: list[Act] = []
    address, log_probability = "car", 0.0
    for low, high in _stretches(text[:MOST_CHARS]):
        parsed = reads.parse(text[low:high])
        read_here = [_resolved(act, parsed, text[low:high], low) for act in parsed.acts]
        if parsed.address == "car":
            acts += read_here
        elif parsed.address == "feedback":
            opinion += read_here
        log_probability += parsed.log_probability
        address = parsed.address if parsed.address != "car" and not acts else address
    sure = 1.0 / (1.0 + math.exp(-(_SURE_BIAS + _SURE_SLOPE * max(log_probability, -20.0))))
    return Utterance(
        text,
        tuple(acts),
        tuple(opinion),
        "car" if acts else address,
        read_emergency(text) is not None,
        sure,
        tuple(_unused(text, (act.span for act in acts if act.span is not None))),
    )


def _stretches(text: str) -> list[Span]:
    """The text in one piece, or a long one in its sentences."""
    if len(text) <= _LONG_CHARS:
        return [(0, len(text))] if _seen(text) else []
    found: list[Span] = []
    for sentence in _SENTENCE.finditer(text):
        low, high = sentence.span()
        if not _seen(sentence[0]):
            continue
        if found and high - found[-1][0] <= _LONG_CHARS:
            found[-1] = found[-1][0], high
        else:
            found.append((low, high))
    return found


def _seen(text: str) -> bool:
    """Whether a text holds anything that the parser's vocabulary does not drop."""
    return any(unicodedata.category(char)[0] in "LNPS" and char != "\ufffd" for char in text)


def _resolved(written: WrittenAct, parsed: Parsed, text: str, offset: int) -> Act:
    """An act whose pointers are words, numbers and names."""
    low, high = spans_of(parsed, written.span)
    act = replace(written.act, span=(offset + low, offset + high))
    if written.value is not None and (amount := _amount(written.value, parsed, text, high)) is not None:
        act = replace(act, value=amount[0], unit=amount[1])
    names = iter(written.names)
    place, when = act.place, act.when
    target = _named(act.target, names, parsed, text)
    if place is not None:
        place = ActPlace(place.rel, _named(place.ref, names, parsed, text))
    if when is not None:
        when = replace(when, ref=_named(when.ref, names, parsed, text))
        if written.event_value is not None and (amount := _amount(written.event_value, parsed, text, high)) is not None:
            when = replace(when, value=amount[0], unit=amount[1])
    return replace(act, target=target, place=place, when=when)


def _amount(token: int, parsed: Parsed, text: str, high: int) -> tuple[float, str] | None:
    """The quantity that begins at a token, in the unit in which it was said; None where the rules find none there."""
    start, _ = spans_of(parsed, (token,))
    found = read_quantities(text[start : max(high, start + 1)])
    return _said(found[0]) if found else None


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


def _said(quantity: Quantity) -> tuple[float, str]:
    """A quantity in the unit in which it was said."""
    if quantity.dimension == "speed":
        units = _SPEED_UNITS
    elif quantity.dimension == "distance":
        units = _LENGTH_UNITS
    else:
        return quantity.value, {"time": "s", "share": "share", "lanes": "lanes"}.get(quantity.dimension, "")
    words = quantity.said.lower().split()
    for unit, factor, marks in units:
        if not marks or any(word.startswith(mark) for word in words for mark in marks):
            return round(quantity.value / factor, 6), unit
    raise AssertionError("the last unit of each list has no marks")


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
