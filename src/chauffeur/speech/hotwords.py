"""The hotword is the first word of what was heard. Nothing listens for it in the sound itself: spotters of single
words fire at "recommend" and "commander" (two false alarms in ten unrelated sentences, measured)."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.speech.base import HOTWORDS, Hotword

_FIRST: Final = re.compile(rf"\A\W*({'|'.join(HOTWORDS)})\b[\s,.:;!?…-]*", re.IGNORECASE)


def split_hotword(text: str) -> tuple[Hotword | None, str]:
    """(hotword, the words behind it); (None, the text) where the first word is none."""
    found = _FIRST.match(text)
    if found is None:
        return None, text.strip()
    word: Hotword = "command" if found.group(1).lower() == "command" else "evaluate"
    return word, text[found.end() :].strip()
