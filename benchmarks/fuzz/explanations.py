"""The reading of explanations: thoughts of a model held against a program."""

from __future__ import annotations

import time
import zlib
from functools import cache

from chauffeur.safety.faithfulness import FactSurroundings, Faithfulness, judge, read_facts
from chauffeur.safety.faithfulness.facts import Facts
from fuzz import programs
from fuzz.target import Target, bytes_of, expect, text_of
from fuzz.words import changed

MAX_CHARS = 600
"""Of the explanation; most thoughts are shorter."""
LONGEST_CHARS, WITHIN_S = 8000, 3.0
"""The longest thoughts that a planner hands on, and their share of a processor; one text in sixteen is stretched."""
_WHERE = FactSurroundings(25.0, 30.0, 40.0, 20.0, 100.0, crossing=True)
_TEXTS = (
    "The passenger is in a hurry. First I check whether the left lane is free, then I overtake at 30 m/s and go back.",
    "I slow down by 10 mph and keep a gap of two seconds to the car ahead; after five seconds I resume 100 km/h.",
    "I do not change lanes. If the car ahead is slower than 20 m/s I pass it on the right, otherwise I stay behind.",
    "I stop at the sign, wait 3 seconds until the crossing traffic has passed, and turn left at the intersection.",
    "1" * 500,
    "I pull over to the right and stay there. The headway goes up from 1.5 to 2.5 s, unless somebody is close behind.",
)


@cache
def _facts() -> tuple[Facts, ...]:
    return tuple(read_facts(*programs.split(data)) for data in programs.seeds()[:40])


@cache
def seeds() -> tuple[bytes, ...]:
    """Explanations."""
    return tuple(map(bytes_of, (*_TEXTS, *(" ".join(_TEXTS[i:]) for i in range(3)))))


def examine(data: bytes) -> str:
    """Judge an explanation of one of several programs, and read the facts of the text as if it were a program."""
    text = text_of(data)
    number = zlib.crc32(data)
    facts = _facts()[number % len(_facts())]
    found = judge(text[:MAX_CHARS], facts, _WHERE if number % 3 else None)
    _holds(found)
    if text and number % 16 == 0:
        before = time.thread_time()
        judge((text * (LONGEST_CHARS // len(text) + 1))[:LONGEST_CHARS], facts, _WHERE)
        expect(time.thread_time() - before < WITHIN_S, "a long text takes too long")
    read_facts(text)
    return f"{min(found.claims, 10)} claims, {'fits' if found.aligned else 'does not fit'}"


def _holds(found: Faithfulness) -> None:
    expect(found.aligned == (not found.mismatches), "aligned and mismatches differ")
    expect(0.0 <= found.score <= 1.0, "a score is not between 0 and 1")
    expect(found.aligned == (found.score == 1.0), "a score of 1 is not what aligned means")
    expect(all(one.instead for one in found.mismatches), "a mismatch does not say what the program does")


TARGET = Target(
    name="explanations",
    invariant=(
        "No explanation and no program makes the reading of either raise, or take seconds; a judgement's score, "
        "verdict and mismatches agree."
    ),
    reads=("chauffeur.safety.faithfulness", "chauffeur.language"),
    seeds=seeds,
    changed=changed,
    examine=examine,
)
