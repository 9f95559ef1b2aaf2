"""Ordinals of junctions: "the third street on the left", "two more sets of lights, then right"."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.quantities import ONES
from chauffeur.language.tokens import tokens_of

JUNCTION_WORDS: Final = frozenset(
    ("junction", "intersection", "crossing", "crossroads", "corner", "light", "lights", "signal", "signals")
)
"""Names of a junction."""

_NUMBERS: Final = {**{word: number for number, word in enumerate(ONES[:7]) if number}, "couple": 2}
_NAMES: Final = ("first", "second", "third", "fourth", "fifth", "sixth")
_ORDINALS: Final = {name: number for number, name in enumerate(_NAMES, start=1)}
_DIGITS: Final = re.compile(r"\b([1-6])(?:st|nd|rd|th)\b")
_WAYS: Final = (
    r"(?:(?:sets? of )?(?:traffic )?(?:lights?|signals?)|streets?|roads?|turn(?:ing|ings|off|s)?|junctions?|"
    r"intersections?|crossings?|crossroads?|corners?|exits?|lefts?|rights?|side streets?)"
)
_NTH: Final = re.compile(rf"\b(?P<nth>{'|'.join(_ORDINALS)}) (?:one )?(?:on (?:the|your|my) )?{_WAYS}\b")
_NTH_ONE: Final = re.compile(rf"\b(?P<nth>{'|'.join(_NAMES[1:])})\b")
_COUNTED: Final = re.compile(
    rf"(?P<passed>\b(?:after|past|pass|skip|ignore|miss|through)\b[^,;.]{{0,20}}?)?"
    rf"\b(?P<count>\d|{'|'.join(_NUMBERS)})(?: of)? (?P<more>(?:more|other) )?{_WAYS}\b"
)
_SKIPPED: Final = re.compile(
    rf"\b(?:not|skip|miss|ignore|pass|forget|leave out|don't take|after|past) (?:the|this|that)? ?"
    rf"(?P<nth>{'|'.join(_ORDINALS)}|next) (?:one )?(?:{_WAYS}|one)\b"
)
_ONE_AFTER: Final = re.compile(
    r"\b(?:the )?(?:one|lights?|turn(?:ing)?|street|junction) after (?:that|it|these|this)\b"
)
_MOST: Final = 9


def nth_of(words: str) -> int:
    """Number of the way that is meant, 1 for the next: 3 for "the third street" and for "after two more junctions".

    An ordinal counts where it stands with a way or a side, and not "the third house".
    """
    said = " ".join(tokens_of(_DIGITS.sub(lambda one: _NAMES[int(one[1]) - 1], words)))
    if skipped := _SKIPPED.search(said):
        rest = said[: skipped.start()] + said[skipped.end() :]
        later = _NTH.search(rest) or _NTH_ONE.search(rest)
        return max(_ORDINALS[later["nth"]] if later else 0, _ORDINALS.get(skipped["nth"], 1) + 1)
    after = int(_ONE_AFTER.search(said) is not None)
    if found := _NTH.search(said):
        return _ORDINALS[found["nth"]] + after
    if (found := _COUNTED.search(said)) and (found["passed"] or found["more"]):
        count = _NUMBERS.get(found["count"]) or int(found["count"])
        return max(1, min(count, _MOST)) + int(found["passed"] is not None)
    return 1 + after
