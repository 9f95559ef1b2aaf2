"""Text as a line of plain words with the signs that part it: what the readers of emergency words look at.

Every pattern that is built on it is linear in the length of the line.
"""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.letters import clean
from chauffeur.language.tokens import plain

MOST_CHARACTERS: Final = 2_000
"""As many as a wish may have; more are not read."""

COURTESY: Final = (
    r"(?:please|kindly|just|oh|ah|aah|argh|hey|hi|hello|ok|now|no|yes|yeah|car|chauffeur|computer|driver|sir|mate|man"
    r"|dude|buddy|bro|quick|quickly|hurry|god|my god|jesus|christ|hell|shit|fuck|damn|damn it|fucking|bloody hell"
    r"|(?:for )?(?:gods?|heavens?|christs?|goodness|petes?)(?: s)? sake|for the love of god|listen|look|look out"
    r"|watch out|careful|help|help me|wait|hold on|emergency|danger|attention|alert|i am begging you|i beg you|i said"
    r"|i say|i repeat|really|simply|immediately|at once|right now|right away|everybody|excuse me|whoa|woah|ouch|uh|um"
    r"|er)"
)
"""Words around an urgent word that ask for nothing."""

_TITLE: Final = re.compile(
    r"[.!?]{1,3}(?= {1,3}(?:was|is|were|by)\b[^.!?]{0,60}\b(?:film|movie|song|book|band|album|game|show|series|"
    r"favou?rite)\b)"
)
"""The sign at the end of a title that a sentence goes on behind: "Freeze! is a good film"."""
_SENTENCE_END: Final = re.compile(r"[.!?;:\n]+")
_OTHER_SIGNS: Final = re.compile(r"[^a-z0-9.,! ]+")
_DRAWN_OUT: Final = re.compile(r"([a-z])\1{2,}")
_TORN: Final = re.compile(r"\b(do|does|did|ca|wo|should|would|could|must|need) ?n ?t\b")
_SLIPS: Final = re.compile(r"\b(?:stopp|stpo|sotp|sstop|stio|stoip)\b")
_GAPS: Final = re.compile(r"\s+")
_PIECE: Final = re.compile(r"[^.,!]+")
_SENTENCE: Final = re.compile(r"[^.!]+")


def line_of(text: str) -> str:
    """Plain words with `.` or `!` between sentences and `,` within them, one space around everything."""
    line = plain(clean(_TITLE.sub("", text[:MOST_CHARACTERS])))
    line = _SENTENCE_END.sub(_end_of, line).replace(",", " , ")
    line = _DRAWN_OUT.sub(r"\1", _OTHER_SIGNS.sub(" ", line))
    line = _TORN.sub(r"\1 not", _GAPS.sub(" ", line)).replace("ca not", "can not").replace("wo not", "will not")
    return f" {_SLIPS.sub('stop', line).strip()} "


def _end_of(signs: re.Match[str]) -> str:
    return " ! " if "!" in signs[0] else " . "


def sentences_of(line: str) -> list[tuple[str, int]]:
    """Sentences of a line, each with where it begins."""
    return [(found[0], found.start()) for found in _SENTENCE.finditer(line)]


def pieces_of(line: str) -> list[tuple[str, int]]:
    """Stretches between signs, each with where it begins."""
    return [(found[0], found.start()) for found in _PIECE.finditer(line)]
