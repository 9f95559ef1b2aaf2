"""Abilities of the embedded planners, and recognition of texts in other languages."""

from __future__ import annotations

import re
import unicodedata
from typing import Final

from chauffeur.language.tokens import plain
from chauffeur.language.word_files import word_groups

CAN_DO: Final = (
    "I can drive faster or slower or at a speed you name, follow closer or further back, change lanes, overtake, turn "
    "or go straight at a junction, pull over, and drive in a hurry, relaxed, gently, carefully or economically."
)
ENGLISH_ONLY: Final = f"I understand English only. {CAN_DO}"
_FOREIGN_SHARE: Final = 0.3
_COURTESIES: Final = re.compile(
    r"\b(?:por favor|per favore|s il (?:vous|te) plait|bitte(?: schon)?|danke(?: schon)?|gracias|grazie|merci|prego|"
    r"lutfen|prosze|amigo|monsieur|madame|senor|senora|signore|mein freund|mon ami)\b"
)
"""Said in English sentences too."""
_FOREIGN_WORDS: Final = {
    group[0].strip("[]"): frozenset(" ".join(group[1:]).split())
    for group in word_groups("chauffeur.planners.onboard", "foreign.txt")
}


def foreign(text: str) -> bool:
    """True if a text is in another language than English, but for a word or two."""
    letters = [c for c in text if c.isalpha()]
    if not letters:
        return False
    latin = sum(1 for c in letters if "LATIN" in unicodedata.name(c, ""))
    if latin < 0.7 * len(letters):
        return True
    words = re.findall(r"[a-z]+", _COURTESIES.sub(" ", plain(text)))
    strong = any(w in _FOREIGN_WORDS["driving"] for w in words)
    known = sum(1 for w in words if any(w in each for each in _FOREIGN_WORDS.values()))
    return (strong or known > 1) and known >= _FOREIGN_SHARE * len(words)
