"""Words that a denial reaches: "don't turn left", "anything but right"."""

from __future__ import annotations

import re
from typing import Final

from chauffeur.language.text_classifier import negated
from chauffeur.language.tokens import tokens_of

_ANYTHING_BUT: Final = re.compile(r"\b(?:any|every)(?:thing|where) (?:but|except)\b")
_NO_DENIAL: Final = re.compile(
    r"\brather\b(?! (?:than|not)\b)|\bnot (?:mind|hesitate|be afraid|forget|fail)\b|\bwhy (?:do )?not\b"
    r"|\b(?:can|could|do|will|would) not (?:you|we)\b"
)
"""Negations that ask for what they negate."""


def denied_words(text: str) -> frozenset[str]:
    """Words of a text that a denial reaches; not those of a negation that asks ("why don't we overtake?")."""
    return negated(_NO_DENIAL.sub("", _ANYTHING_BUT.sub("not", " ".join(tokens_of(text)))))
