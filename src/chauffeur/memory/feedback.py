"""What a passenger's words about a drive mean, and which of several verdicts holds.

Phrases whose meaning is known are read with their negations and turns ("fine, but a bit slow"). People say most things
in words that no table holds ("my coffee ended up on the ceiling"); those are sorted by a small model (`remarks`), which
also decides where the phrases seem to say something else and it is sure.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Literal

from chauffeur.concept import Feedback
from chauffeur.language import measured
from chauffeur.memory.phrases import Topic, Want, read_wants, speaks_of_the_drive
from chauffeur.memory.plain_text import even
from chauffeur.memory.remarks import Sorted, sort_remark

_MILD, PLAIN, _STRONG = 0.35, 0.6, 1.0
"""Strength of mild, plain and strong words."""
_MILD_WORDS = re.compile(
    r"\b(?:(?:a|the) (?:tiny |little |wee |small )?(?:bit|little|touch|tad|smidge|hair|notch|shade)|slightly|somewhat"
    r"|little bit|kind of|kinda|sort of|marginally|just a)\b"
)
_STRONG_WORDS = re.compile(
    r"\b(?:way|far(?= too)|(?<!too )(?<!not )much|a lot|lots|really|very|extremely|super|terribly|awfully|incredibly"
    r"|significantly|considerably|drastically|dangerously)\b"
)
_OF_A_PART = re.compile(
    r"\b(?:speed|pace|gap|distance|brak\w+|steering|lanes?|turns?|corners?|curves?|bends?|acceleration|start|rest|other"
    r"|otherwise|apart|aside)\b"
)
"""Who praises one thing, or all but one, has not praised that one."""
_FULL = {"speed": 5.5, "distance": 20.0, "time": 1.5}
"""A change of this much is as strong as "much": about 20 km/h, four car lengths, or one and a half seconds."""

_LIKELY, _SURE, _CERTAIN = 0.3, 0.6, 0.9
"""Shares from which the sorter is believed where no phrase was known, against what phrases say, and where they take
back what they say ("it was not too fast")."""
_Sign = Literal[-1, 0, 1]
_SIGNS: dict[str, tuple[_Sign, _Sign, _Sign, _Sign]] = {
    "too_fast/bit": (-1, 0, 0, 0), "too_fast/plain": (-1, 0, 0, -1), "too_fast/much": (-1, 0, 0, -1),
    "too_slow/bit": (1, 0, 0, 0), "too_slow/plain": (1, 0, 0, -1), "too_slow/much": (1, 0, 0, -1),
    "too_close": (0, -1, 0, -1), "too_far": (0, 1, 0, -1),
    "harsh": (0, 0, -1, -1), "swerving": (0, 0, -1, -1), "timid": (0, 0, 1, -1), "close_call": (0, 0, -1, -1),
    "parked/faster": (1, 0, 0, -1), "parked/slower": (-1, 0, 0, -1), "fine": (0, 0, 0, 1),
    **dict.fromkeys(
        ("no_overtake", "passed", "not_right", "waited", "not_waited", "not_parked", "wrong_spot.nearest",
         "wrong_spot.stadium", "wrong_spot.exit"), (0, 0, 0, -1),
    ),
}  # fmt: skip
"""Speed, gap, comfort and approval of what a remark is sorted as."""
_STRENGTHS = {"bit": _MILD, "much": _STRONG}

TOPICS: tuple[Literal["speed", "gap", "comfort"], ...] = ("speed", "gap", "comfort")


def interpret_feedback(text: str) -> Feedback:
    """What is meant, by rule and offline; words that say nothing of the drive give a neutral feedback.

    Args:
        text: The passenger's words, kept as they are in the result.

    Returns:
        Signs as in `Feedback`: "too fast" and "slower, please" are both speed -1. Contradictory remarks on one topic
        cancel out. A plain complaint counts as dislike; a mild one, or a request, does not. What comes after a "but"
        decides: "fine, but a bit slow" complains, "a bit slow, but fine" does not.
    """
    wants = read_wants(text)
    return _sorted(text, wants, _by_phrases(text, wants))


def _sorted(text: str, wants: tuple[Want, ...], read: Feedback) -> Feedback:
    """What is meant, where the phrases say nothing, or something of another kind than what the sorter is sure of.

    Which way something was wrong, and what praise takes back, the phrases tell better: they know negations and turns.
    """
    found = sort_remark(text)
    meant = _of_kind(text, found)
    if not (read.speed or read.gap or read.comfort or read.approval):
        if wants:  # of which each takes back another
            return read
        return meant if found.share >= (_CERTAIN if speaks_of_the_drive(text) else _LIKELY) else read
    if read.approval < 0 and not (read.speed or read.gap or read.comfort):  # a dislike that need not have a reason
        return meant if found.share >= _CERTAIN else read
    return read if _tells(read, meant) or found.share < _SURE else meant


def _tells(read: Feedback, meant: Feedback) -> bool:
    """Whether phrases say something of what the sorter finds, if perhaps the opposite."""
    topics = [topic for topic in TOPICS if getattr(meant, topic)]
    if not topics:
        return read.approval == meant.approval
    praised = read.approval > 0 and meant.approval == 0
    return praised or any(getattr(read, topic) for topic in topics)


def _of_kind(text: str, found: Sorted) -> Feedback:
    speed, gap, comfort, approval = _SIGNS.get(found.kind, (0, 0, 0, 0))
    strength = _STRENGTHS.get(found.kind.partition("/")[2], PLAIN) if speed or gap or comfort or approval < 0 else 0.0
    return Feedback(text, speed, gap, comfort, approval, strength)


def _by_phrases(text: str, wants: tuple[Want, ...]) -> Feedback:
    """What the phrases say that the book holds."""
    opinions = [want for want in wants if want.topic == "approval"]
    deciding = _deciding(opinions)
    praised = any(want.sign > 0 for want in deciding)
    blamed = any(want.sign < 0 for want in deciding)
    about = [
        want
        for want in wants
        if want.topic != "approval"
        and not (want.manner in ("remark", "aside") and any(_covers(other, want) for other in wants))
    ]
    signs: dict[Topic, Literal[-1, 0, 1]] = {
        topic: _sign(want.sign for want in about if want.topic == topic) for topic in TOPICS
    }
    telling = [want for want in about if signs.get(want.topic, 0)]
    strength = max((_strength(want) for want in telling), default=0.0)
    complained = any(want.manner not in ("request", "plea") and _strength(want) >= PLAIN for want in telling)

    approval: Literal[-1, 0, 1] = 0
    if praised and not blamed and not telling:
        approval = 1
    elif (blamed and not praised) or (complained and not praised):
        approval = -1
    if approval < 0 and not telling:
        strength = PLAIN
    return Feedback(text, signs["speed"], signs["gap"], signs["comfort"], approval, strength)


def _deciding(opinions: list[Want]) -> list[Want]:
    """Of opinions, those after the last turn; praise of a part takes nothing back."""
    last = max((want.turn for want in opinions), default=0)
    said = [want for want in opinions if want.turn == last]
    praise = {want.clause for want in said if want.sign > 0}
    return opinions if any(_OF_A_PART.search(clause) for clause in praise) else said


def _covers(other: Want, remark: Want) -> bool:
    """Whether something else that is said makes a remark no complaint: a request for the opposite ("slower, really
    slow"), or praise, if said with it, or after it and of the whole."""
    if other.topic != "approval":
        return other.topic == remark.topic and other.sign != remark.sign and other.manner in ("request", "plea")
    if other.sign < 0 or other.turn < remark.turn:
        return False
    return other.turn == remark.turn or _OF_A_PART.search(other.clause) is None


def _sign(signs: Iterable[int]) -> Literal[-1, 0, 1]:
    found = set(signs)
    if len(found) != 1:
        return 0
    return 1 if 1 in found else -1


def _strength(want: Want) -> float:
    amounts = [value / _FULL[dimension] for dimension, value in measured(want.clause)]
    if amounts:
        return min(1.0, max(0.1, *amounts))
    words = even(want.clause)
    if _MILD_WORDS.search(words):
        return _MILD
    return _STRONG if _STRONG_WORDS.search(words) else PLAIN
