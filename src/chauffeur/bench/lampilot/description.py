"""A model's description of a program, made fit to be kept: plain sentences, five at most."""

from __future__ import annotations

import re

from chauffeur.memory.policies_entry import MAX_DESCRIPTION_CHARS
from chauffeur.planners.prompts import DESCRIPTION_SENTENCES

FALLBACK_WORDS = "A program that did well when the wish was: {command}"
"""Where a model gave nothing usable; such an entry is marked `described_by = fallback`."""

_SENTENCE = re.compile(r"(?<=[.!?])\s+(?=[^\s])")
_LABEL = re.compile(r"\A[\s*_#]*(?:Description|Entry)[*_ \t]*:[*_ \t]*", re.IGNORECASE)
_CODE = re.compile(r"`{3,}|^[ \t]*(?:def |import |from |while |for .*:$|REFUSE\b)|\byield\b", re.MULTILINE)
_LEAST_CHARS = 12


def usable_description(text: str) -> str:
    """The first sentences of a model's description on one line; empty when it is none.

    Args:
        text: What the model wrote.
    """
    if _CODE.search(text):
        return ""
    words = "".join(char for char in " ".join(_LABEL.sub("", text).split()) if char.isprintable()).strip(" \"'")
    kept = ""
    for sentence in _SENTENCE.split(words)[:DESCRIPTION_SENTENCES]:
        longer = f"{kept} {sentence}".strip()
        if len(longer) > MAX_DESCRIPTION_CHARS:
            break
        kept = longer
    return kept if len(kept) >= _LEAST_CHARS else ""
