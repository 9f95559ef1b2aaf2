"""Turns of dialogue of a few words: yes, no, never mind, more, the other one, a bare number. A closed class, and its
one reader: what it holds is certain, and everything else is the parser's."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import chain
from typing import Final, cast, get_args

from chauffeur.concept.utterance import Act, Colour, Degree, Direction, Reference, Side
from chauffeur.language.quantities import amount_said, mark_quantities
from chauffeur.language.tokens import tokens_of

_Phrase = tuple[tuple[str, ...], Act]
_SIGNS: Final = frozenset(".,;:!?")
_COURTESY_WORDS: Final = "please thanks thank you car chauffeur oh ah um er hm hmm well then just actually and so"
_COURTESY: Final = frozenset(_COURTESY_WORDS.split())
"""Said beside a turn, and no part of it."""
_OTHER: Final = Reference("other")
_YES: Final = (
    "yes", "yeah", "yep", "yup", "ok", "sure", "correct", "exactly", "absolutely", "of course", "certainly",
    "that is right", "that is correct", "right you are",
)  # fmt: skip
_NO: Final = ("no", "nope", "nah", "wrong", "that is wrong", "no not that", "not at all")
_YES_IF_ASKED: Final = ("do it", "do that", "do", "go ahead", "confirm", "confirmed", "that one is right")
_NO_IF_ASKED: Final = ("do not", "do not do it", "do not do that")
"""Answers where something was asked; else wishes, or about what the car does just now."""
_CANCEL: Final = (
    "cancel", "cancel that", "cancel it", "never mind", "nevermind", "never mind that", "forget it", "forget that",
    "forget about it", "forget about that", "forget what i said", "scrap that", "scrap it", "drop that", "drop it",
    "call it off", "never mind what i said",
)  # fmt: skip
_UNDO: Final = (
    "undo", "undo that", "undo it", "back as it was", "as it was", "as it was before", "back to how it was",
    "back to normal", "back to before", "put it back", "change it back", "take it back", "back again",
    "go back to how it was", "back to what it was",
)  # fmt: skip
_AGAIN: Final = (
    "again", "once more", "one more time", "once again", "do it again", "do that again", "same again",
    "the same again", "same as last time", "same as before", "the same as before", "as before", "like before",
    "like last time", "as last time", "as usual", "the usual",
)  # fmt: skip
_MORE: Final[Mapping[Degree | None, tuple[str, ...]]] = {
    None: (
        "more", "some more", "even more", "still more", "more than that", "more still", "not enough",
        "that is not enough",
    ),
    "bit": ("a bit more", "a little more", "a touch more", "a little bit more", "slightly more", "bit more"),
    "much": ("much more", "a lot more", "way more", "far more", "lots more"),
}  # fmt: skip
_LESS: Final[Mapping[Degree | None, tuple[str, ...]]] = {
    None: (
        "less", "even less", "less than that", "not that much", "not so much", "not as much", "not quite so much",
        "not quite that much", "too much", "that is too much", "not by that much",
    ),
    "bit": ("a bit less", "a little less", "a touch less", "a little bit less", "slightly less", "bit less"),
    "much": ("much less", "a lot less", "way less", "far less", "way too much"),
}  # fmt: skip
_THE_OTHER: Final = (
    "the other one", "other one", "the other", "the other way", "other way", "the other side", "other side",
    "not that one", "a different one", "not this one", "not him", "not that way",
)  # fmt: skip
_SIDES: Final = ("{}", "the {}", "on the {}", "to the {}", "{} side", "the {} side", "on the {} side", "go {} instead")
_ORDINALS: Final = {"first": 1, "second": 2, "third": 3, "fourth": 4, "fifth": 5, "last": -1}
_AROUND_A_NUMBER: Final = "make it that to at do say i said meant mean want is rather instead lets about"
_MAKE_IT: Final = frozenset(_AROUND_A_NUMBER.split())
"""Words around a number that changes the last one."""


def _each(phrases: tuple[str, ...], act: Act) -> Iterator[_Phrase]:
    return ((tuple(phrase.split()), act) for phrase in phrases)


def _sides() -> Iterator[_Phrase]:
    for side in get_args(Side):
        yield from _each(tuple(form.format(side) for form in _SIDES), Act("pick", side=cast("Side", side)))


def _ones() -> Iterator[_Phrase]:
    for colour in get_args(Colour):
        yield ("the", colour, "one"), Act("pick", target=Reference("other", colour=cast("Colour", colour)))
    for word, ordinal in _ORDINALS.items():
        yield from _each((f"the {word}", f"the {word} one"), Act("pick", target=Reference("other", ordinal=ordinal)))


def _amounts(direction: Direction, words: Mapping[Degree | None, tuple[str, ...]]) -> Iterator[_Phrase]:
    for degree, phrases in words.items():
        yield from _each(phrases, Act("pick", direction=direction, degree=degree))


_TURNS: Final[Mapping[tuple[str, ...], Act]] = dict(
    chain(
        _each(_YES, Act("yes")),
        _each(_NO, Act("no")),
        _each(_CANCEL, Act("cancel")),
        _each(_UNDO, Act("undo")),
        _each(_AGAIN, Act("again")),
        _amounts("more", _MORE),
        _amounts("less", _LESS),
        _each(_THE_OTHER, Act("pick", target=_OTHER)),
        _sides(),
        _ones(),
    )
)
_ANSWERS: Final[Mapping[tuple[str, ...], Act]] = {
    **_TURNS,
    **dict(chain(_each(_YES_IF_ASKED, Act("yes")), _each(_NO_IF_ASKED, Act("no")))),
}
_LONGEST: Final = max(len(words) for words in _ANSWERS)
_MOST_WORDS: Final = 9
"""Longer texts are sentences."""


def closed_turn(text: str) -> tuple[Act, ...]:
    """The acts of a text that is nothing but turns of the closed class; none for any other."""
    return _covered(text, _TURNS)


def answer_in(text: str) -> bool | None:
    """The answer in words: True for yes, False for no; None if they are something else."""
    said = {act.act for act in _covered(text, _ANSWERS)}
    if said == {"yes"}:
        return True
    return False if said and said <= {"no", "cancel"} else None


def takes_back(text: str) -> bool:
    """True if words say no to something and nothing else; "don't!" may be meant for what the car does."""
    return bool(said := closed_turn(text)) and all(act.act in ("no", "cancel") for act in said)


def cancels(text: str) -> bool:
    """True if words take back what was wished ("never mind"), and say nothing else."""
    return bool(said := closed_turn(text)) and all(act.act == "cancel" for act in said)


def _covered(text: str, phrases: Mapping[tuple[str, ...], Act]) -> tuple[Act, ...]:
    """Acts of the phrases that make up a text, longest first; none if something is left over."""
    words = [word for word in tokens_of(text) if word not in _SIGNS]
    while words and words[0] in _COURTESY:
        words = words[1:]
    while words and words[-1] in _COURTESY:
        words = words[:-1]
    if not 0 < len(words) <= _MOST_WORDS:
        return ()
    found: list[Act] = []
    at = 0
    while at < len(words):
        size = next((n for n in range(_LONGEST, 0, -1) if tuple(words[at : at + n]) in phrases), 0)
        if size:
            found.append(phrases[tuple(words[at : at + size])])
        elif words[at] in _COURTESY:
            size = 1
        elif (number := _number(words[at:])) is not None:
            found.append(number)
            size = len(words) - at
        else:
            return ()
        at += size
    return tuple(replace(act, span=(0, len(text))) for act in found)


def _number(words: list[str]) -> Act | None:
    """A choice of a number, with what is said around it."""
    marked, found = mark_quantities(words)
    if len(found) != 1 or found[0].dimension == "other":
        return None
    if not all(word == "#0" or word in _MAKE_IT for word in marked):
        return None
    value, unit = amount_said(found[0])
    return Act("pick", value=value, unit=unit)
