"""Slips of fingers, ears and learners in composed sentences, with the pointers kept in place.

Words that turn a meaning round (left, right, not, until ...) are never misspelt into another word.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from chauffeur.language.meaning.symbols import WrittenAct
from chauffeur.models.meaning.composer import Composed

_KEPT_WORDS: Final = (
    "left right not don't dont never no until till before after once while unless if faster slower more less "
    "red green leftmost rightmost middle behind first second third last"
)
_KEPT: Final = frozenset(_KEPT_WORDS.split())
_ARTICLES: Final = frozenset({"the", "a", "an"})
_NEAR: Final = {
    "a": "sq", "b": "vn", "c": "xv", "d": "sf", "e": "wr", "f": "dg", "g": "fh", "h": "gj", "i": "uo", "k": "jl",
    "l": "k", "m": "n", "n": "bm", "o": "ip", "p": "o", "r": "et", "s": "ad", "t": "ry", "u": "yi", "v": "cb",
    "w": "qe", "y": "tu",
}  # fmt: skip
"""Keys beside a key."""
_HEARD: Final = {
    "brake": "break", "their": "there", "there": "their", "you're": "your", "its": "it's", "it's": "its",
    "lane": "line",
    "to": "too", "too": "to", "right": "write", "straight": "strait", "pull": "pool", "gap": "cap", "buy": "by",
    "by": "buy", "turn": "tern", "park": "bark", "car": "cart", "the": "da", "for": "four", "wait": "weight",
    "past": "passed", "passed": "past", "road": "rode", "merge": "marge", "curb": "curve", "cone": "corn",
}  # fmt: skip
"""What a recogniser, or a writer who goes by ear, makes of a word."""


def with_noise(sentence: Composed, rng: np.random.Generator) -> Composed:
    """The sentence as it might be typed or recognised; about half of all stay as they are."""
    words, acts = list(sentence.words), sentence.acts
    style = rng.random()
    if style < 0.12:  # a recogniser writes no signs and no capitals, and hears some words wrong
        words = [word.strip(".,;:!?") or word for word in words]
        words = [_HEARD.get(word, word) if rng.random() < 0.04 else word for word in words]
        if rng.random() < 0.15:
            words, acts = _inserted(words, acts, ("uh", "um", "er", "like", "you know")[int(rng.integers(5))], rng)
    elif style < 0.2:  # a learner or a hurried writer leaves articles out
        words, acts = _without_articles(words, acts, 0.8, rng)
    elif style < 0.28:
        words, acts = _without_articles(words, acts, 0.3, rng)
    if rng.random() < 0.16:
        for _ in range(1 + int(rng.random() < 0.3)):
            at = int(rng.integers(len(words)))
            words[at] = _misspelt(words[at], rng)
    if rng.random() < 0.2:
        words = [word.rstrip(",") if word != "," else word for word in words]
    if rng.random() < 0.45 and words[-1][-1] not in ".!?":
        words[-1] += ".!"[int(rng.random() < 0.15)]
    if rng.random() < 0.04:
        words, acts = _inserted(words, acts, words[int(rng.integers(len(words)))], rng)
    return replace(sentence, words=tuple(words), acts=acts)


def _misspelt(word: str, rng: np.random.Generator) -> str:
    if len(word) < 4 or not word.isalpha() or word in _KEPT:
        return word
    at = 1 + int(rng.integers(len(word) - 2))
    way = rng.random()
    if way < 0.3:
        return word[:at] + word[at + 1 :]
    if way < 0.55:
        return word[:at] + word[at + 1] + word[at] + word[at + 2 :]
    if way < 0.75:
        return word[:at] + word[at] + word[at:]
    near = _NEAR.get(word[at], "e")
    return word[:at] + near[int(rng.integers(len(near)))] + word[at + 1 :]


def _without_articles(
    words: Sequence[str], acts: tuple[WrittenAct, ...], share: float, rng: np.random.Generator
) -> tuple[list[str], tuple[WrittenAct, ...]]:
    held = {act.span[0] for act in acts} | {act.span[1] for act in acts}
    held |= {at for act in acts for name in act.names for at in name} | {
        at for act in acts for at in (act.value, act.event_value) if at is not None
    }
    gone = [i for i, word in enumerate(words) if word in _ARTICLES and i not in held and rng.random() < share]
    moved = np.arange(len(words)) - np.searchsorted(gone, np.arange(len(words)))
    kept = [word for i, word in enumerate(words) if i not in set(gone)]
    return kept, tuple(_moved(act, moved) for act in acts)


def _inserted(
    words: Sequence[str], acts: tuple[WrittenAct, ...], what: str, rng: np.random.Generator
) -> tuple[list[str], tuple[WrittenAct, ...]]:
    at = int(rng.integers(len(words) + 1))
    more = len(what.split())
    moved = np.arange(len(words)) + more * (np.arange(len(words)) >= at)
    return [*words[:at], *what.split(), *words[at:]], tuple(_moved(act, moved) for act in acts)


def _moved(act: WrittenAct, to: np.ndarray) -> WrittenAct:
    return WrittenAct(
        act.act,
        (int(to[act.span[0]]), int(to[act.span[1]])),
        None if act.value is None else int(to[act.value]),
        tuple((int(to[low]), int(to[high])) for low, high in act.names),
        None if act.event_value is None else int(to[act.event_value]),
    )
