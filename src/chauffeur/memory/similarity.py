"""How near two wishes are: a small offline encoder of their text, and tags of what they mean.

Text alone cannot tell "drive faster" from "drive slower"; sentence encoders put them at a cosine of 0.9. The tags can:
direction of speed, gap and comfort, manoeuvre and side, and the numbers said.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from chauffeur.language import measured
from chauffeur.memory.phrases import wants_in
from chauffeur.memory.plain_text import clauses, even

ENCODER = "hashed-ngrams-v1"
"""Version of the vectors; others are encoded anew."""

DIMENSIONS = 384
Vector = npt.NDArray[np.float32]

_STOP = frozenset(
    re.findall(
        r"\w+",
        "a an the i you me my your we us it is am are be to of in on at do can could would will please just now this "
        "that and so there here have has",
    )
)
_WORD = re.compile(r"[^\W_]+(?:\.\d+)?")
_WEIGHT_WORD, _WEIGHT_STOP, _WEIGHT_PAIR, _WEIGHT_LETTERS = 1.0, 0.15, 0.6, 0.25

_MOVE_TAGS = ("lane.left", "lane.right", "turn.left", "turn.right", "turn.straight", "overtake", "stop")
TAGS = (
    *(f"{topic}{sign}" for topic in ("speed", "gap", "comfort") for sign in "+-"),
    *_MOVE_TAGS,
    *(f"not.{tag}" for tag in _MOVE_TAGS),
)
_BIT = {tag: 1 << index for index, tag in enumerate(TAGS)}
_OPPOSITES = (
    *((f"{topic}+", f"{topic}-") for topic in ("speed", "gap", "comfort")),
    *((tag, f"not.{tag}") for tag in _MOVE_TAGS),
    ("lane.left", "lane.right"),
    ("turn.left", "turn.right"),
    ("turn.left", "turn.straight"),
    ("turn.right", "turn.straight"),
)
_AGAINST = {tag: sum(_BIT[b if a == tag else a] for a, b in _OPPOSITES if tag in (a, b)) for tag in TAGS}

_SIDES = ("left", "right")
_PHRASES = (
    (
        r"(?:turn|take a|make a|go) (?:\w+ )?(?P<side>left|right)(?! lane)|(?P<side2>left|right) turn",
        "turn.",
        _SIDES,
    ),
    (
        r"(?:go |drive |keep |continue )?straight|(?:go|drive) (?:across|through)",
        "turn.straight",
        ("straight", "across", "through"),
    ),
    (r"(?P<side>left|right)(?: ?hand)?(?: ?most)? lane|lane (?:\w+ ){0,3}(?P<side2>left|right)", "lane.", _SIDES),
    (r"(?:move|merge|change|switch|shift|get|pull|steer) (?:\w+ ){0,4}(?P<side>left|right)", "lane.", _SIDES),
    (r"(?P<side>left|right)most", "lane.", _SIDES),
    (
        r"overtak\w+|pass (?:the|this|that|him|her|them|it)|get (?:past|ahead of|around|by)",
        "overtake",
        ("overtak", "pass ", "get "),
    ),
    (r"pull over|stop|park|halt", "stop", ("pull over", "stop", "park", "halt")),
)
_MOVES = tuple((re.compile(rf"\b(?:{phrase})\b"), tag, letters) for phrase, tag, letters in _PHRASES)
"""A pattern, what it means, and letters without any of which it matches nowhere."""
_NEGATED = re.compile(r"\b(?:not|never|no|without|avoid|instead of)\b(?: \w+){0,4} ?$")

CONFLICT = 0.15
"""What is left of the likeness of opposite wishes: less than what is ever recalled."""

TEXT_SHARE, MEANING_SHARE = 0.4, 0.6
"""Of the likeness, where either wish has tags."""

NUMBERS_SHARE, STEEPNESS = 0.15, 3.0
"""What numbers weigh where both wishes have some, and how fast they part as they differ."""


@dataclass(frozen=True, slots=True)
class Mark:
    """What retrieval keeps of a wish.

    Attributes:
        vector: Encoded text, of length 1 (or 0 for no words).
        tags: Bits of `TAGS`.
        quantities: Numbers said, as (dimension, SI value).
    """

    vector: Vector
    tags: int
    quantities: tuple[tuple[str, float], ...]


def mark(text: str) -> Mark:
    """Encode and tag a wish."""
    said = even(text)
    return Mark(_encoded(said), sum(_BIT[tag] for tag in _tags_in(said)), measured(text))


def encode(text: str) -> Vector:
    """Hashed words, word pairs and letter groups as a unit vector; the same text gives the same bits on any machine."""
    return _encoded(even(text))


def _encoded(said: str) -> Vector:
    vector = np.zeros(DIMENSIONS, dtype=np.float32)
    for feature, weight in _features(said):
        code = zlib.crc32(feature.encode("utf-8", "surrogatepass"))
        vector[code % DIMENSIONS] += weight if code & 0x8000_0000 else -weight
    norm = float(np.linalg.norm(vector))
    return vector if norm == 0.0 else (vector / norm).astype(np.float32)


def tags_of(text: str) -> frozenset[str]:
    """Tags of what a wish asks for."""
    return frozenset(_tags_in(even(text)))


def _tags_in(said: str) -> set[str]:
    found: set[str] = set()
    for want in wants_in(said):
        if want.topic != "approval":
            found.add(f"{want.topic}{'+' if want.sign > 0 else '-'}")
    for clause in clauses(said):
        found.update(_moves(clause))
    return found


def opposed_to(tags: int) -> int:
    """Bits of the tags that contradict any of some tags."""
    return sum(_AGAINST[tag] for tag in TAGS if tags & _BIT[tag])


def likeness(wish: Mark, texts: Vector, others: Iterable[Mark]) -> Iterator[float]:
    """0..1 for each remembered wish: by meaning where either has tags, by text otherwise.

    Args:
        wish: The present wish.
        texts: Cosine of each remembered wish's text with the present one's.
        others: The remembered wishes, in the same order.
    """
    against = opposed_to(wish.tags)
    for cosine, other in zip(texts.tolist(), others, strict=True):
        text = max(0.0, min(1.0, cosine))
        union = wish.tags | other.tags
        if union:
            same = (wish.tags & other.tags).bit_count() / union.bit_count()
            meaning = TEXT_SHARE * text + MEANING_SHARE * same
        else:
            meaning = text
        near = _numbers(wish.quantities, other.quantities)
        if near is not None:
            meaning = (1.0 - NUMBERS_SHARE) * meaning + NUMBERS_SHARE * near
        yield meaning * (CONFLICT if against & other.tags else 1.0)


def _features(text: str) -> Iterator[tuple[str, float]]:
    words = _WORD.findall(text)
    for word in words:
        yield f"w:{word}", _WEIGHT_STOP if word in _STOP else _WEIGHT_WORD
        if word not in _STOP and len(word) > 3:
            padded = f"<{word}>"
            for start in range(len(padded) - 3):
                yield f"l:{padded[start : start + 4]}", _WEIGHT_LETTERS
    telling = [word for word in words if word not in _STOP]
    for first, second in pairwise(telling):
        yield f"p:{first} {second}", _WEIGHT_PAIR


def _moves(clause: str) -> Iterator[str]:
    left = clause
    for pattern, tag, letters in _MOVES:
        match = pattern.search(left) if any(one in left for one in letters) else None
        if match is None:
            continue
        left = left[: match.start()] + "#" + left[match.end() :]
        sides = match.groupdict()
        side = sides.get("side") or sides.get("side2")
        full = f"{tag}{side}" if tag.endswith(".") else tag
        yield f"not.{full}" if _NEGATED.search(clause[: match.start()]) else full


def _numbers(a: tuple[tuple[str, float], ...], b: tuple[tuple[str, float], ...]) -> float | None:
    """How near two wishes' numbers are, 0..1; None where they do not speak of the same thing."""
    pairs = [(x, y) for of_a, x in a for of_b, y in b if of_a == of_b]
    if not pairs:
        return None
    return max(1.0 if x == y else math.exp(-STEEPNESS * abs(x - y) / max(abs(x), abs(y))) for x, y in pairs)
