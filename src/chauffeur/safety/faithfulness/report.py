"""A comparison of thoughts with their program in words, for the person."""

from __future__ import annotations

from typing import Final

from chauffeur.concept import Faithfulness, Mismatch, MismatchKind

KINDS: Final[dict[MismatchKind, str]] = {
    "wrong-side": "wrong side",
    "wrong-number": "wrong number",
    "wrong-sign": "wrong direction",
    "wrong-order": "wrong order",
    "missing-condition": "missing condition",
    "not-done": "claimed but not done",
    "not-claimed": "done but not claimed",
}
"""The kinds of mismatches in a few words."""


def mismatch_words(mismatch: Mismatch) -> str:
    """Describe a mismatch in a sentence that begins with its kind."""
    where = "" if mismatch.line is None else f" (line {mismatch.line})"
    said = f"“{mismatch.sentence}”, but " if mismatch.sentence else "not mentioned, but "
    return f"{KINDS[mismatch.kind]}: {said}{mismatch.instead}{where}"


def score_words(alignment: Faithfulness) -> str:
    """The score with what it counts."""
    return f"score {alignment.score:.2f} of 1, {claims_words(alignment)}"


def claims_words(alignment: Faithfulness) -> str:
    """The number of claims compared, in words."""
    return "1 claim compared" if alignment.claims == 1 else f"{alignment.claims} claims compared"
