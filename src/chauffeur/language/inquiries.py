"""Questions that want to know something, and what they are about; nothing is to be driven for them."""

from __future__ import annotations

import re
from typing import Final, Literal

from chauffeur.language.questions import ADDRESS
from chauffeur.language.tokens import words_of

Topic = Literal[
    "doing", "standing", "way", "weather", "traffic", "road", "limit", "front", "speed", "stop sign", "lane", "turns"
]
"""`doing`: what the car does or did; `standing`: why it stands or brakes; `way`: how far it is to the destination;
`front`: the vehicle ahead; `turns`: ways at the next junction."""

_US: Final = r"(?:i|we|you|it|he|the car)"
_WHY_STANDING: Final = re.compile(
    rf"{ADDRESS}why (?:(?:are|did|do|have|is|has) {_US} (?:just |now |still |all )?"
    r"(?:stand\w*|stop\w*|wait\w*|brak\w*|slow(?:ed|ing)|still)|"
    rf"(?:are|is) (?:not {_US}|{_US} (?:still )?not) (?:moving|driving|going))"
    r"(?: (?:here|now|there|down|still|for|at all|anywhere))*$"
)
"""Asks why the car stands or brakes; not a complaint that it is slow, which is a wish."""
_MAY: Final = r"(?:may|can|could|should|must)"
_WE: Final = r"(?:i|we|you|one)"
_ASKS: Final = re.compile(
    rf"{ADDRESS}"
    r"(?:(?:can|could|would|will) you (?:please )?tell (?:me|us) |(?:do|did) you (?:happen to )?know |"
    r"tell (?:me|us) |i wonder )?"
    r"(?:whats?|which|how (?:fast|far|many|much|long|old|big|tall|close|late)|where|when|who|whose|"
    r"is there|are there|is it|are we (?:nearly |almost |soon |about )?there|will we (?:arrive|be there) soon)\b"
)
"""Openings of a question that wants to know something; not one that asks for something, complains or proposes."""
_PROPOSES: Final = re.compile(
    r"^what (?:about|if|are you (?:doing|waiting)|the|a|do you think you)\b|\bhow about\b|"
    r"\bwhat is (?:taking|the (?:hold|matter|point|rush))\b|^when (?:you|we|he|she|it|there|the)\b"
)
_THEIRS: Final = (
    r"(?:he|she|they|him|her|it|"
    r"(?:the|that|this) (?:\w+ )?(?:car|vehicle|truck|van|lorry|bus|one|guy|driver|front|lead)\b.*)"
)
_AHEAD: Final = r"(?:ahead|in front|before us|front|lead)"
_ABOUT_DOING: Final = re.compile(
    rf"{ADDRESS}(?:what (?:are|were) {_US} doing(?: now| here| there| right now)?$|"
    rf"what (?:did|have) {_US} (?:just )?(?:do|done)(?: now| there| just now)?$|"
    rf"did {_US} (?:do|finish) (?:it|that)(?: already| yet)?$|"
    rf"are {_US} (?:doing|still doing) (?:it|that)(?: now| yet)?$|"
    rf"why (?:are|were|did|do|have|has|is) {_US} (?:just |now |still |all )?"
    r"(?:chang|overtak|pass|turn|follow|accelerat|speed(?:ing)? up|mov|cross|merg|leav|pull)\w*\b)"
)
"""Asks about what the car does or did; answered by its execution."""

_PATTERNS: Final[tuple[tuple[Topic, tuple[str, ...]], ...]] = (
    (
        "way",
        (
            r"\b(?:are|were) we (?:\w+ )?there\b|\bwhen (?:do|will|are) we (?:arrive|get there|be there|there)\b",
            r"\bhow (?:far|long(?! (?:ha|is|was|did))|much longer|many minutes|soon)\b"
            r"(?!.*\b(?:ahead|front|away|behind)\b)",
            r"\bwhere (?:are we (?:going|heading)|are you taking)\b|\bwill we (?:arrive|be there) soon\b",
        ),
    ),
    ("weather", (r"\b(?:weather|raining|rain|snowing|foggy|forecast)\b(?! tomorrow)",)),
    ("traffic", (r"\btraffic (?:like|ahead|rules?)\b|\btraffic$",)),
    (
        "road",
        (
            r"\b(?:which|what) (?:road|street|highway|motorway) (?:is this|are we|am i)\b",
            r"^where are we\b",
            r"\b(?:whats?|what is) (?:this|the name of (?:this|the)) (?:road|street)\b",
            r"\b(?:road|street) (?:name|called)\b|\bhow (?:it is|is it|is this (?:road|street)) called\b",
        ),
    ),
    (
        "limit",
        (
            rf"\blimit\b|\bmaximum speed\b|\bhow fast (?:{_MAY}|{_WE} {_MAY})\b",
            rf"\bhow fast (?:am|are|is) {_WE} allowed\b",
        ),
    ),
    ("front", (rf"\bhow fast (?:is|are|was|does|do) {_THEIRS}", rf"\bspeed of (?:the|that) \w+ {_AHEAD}\b")),
    (
        "speed",
        (
            r"\bhow fast (?:am|are|is|do) (?:i|we|you|it|this)\b",
            r"\b(?:our|my|your|current) speed\b|\bspeed (?:are|am|is) (?:we|i|it|this)\b|\bthe speed$",
        ),
    ),
    ("stop sign", (r"\bstop sign\b",)),
    ("lane", (r"\b(?:which|what) lane\b|\bhow many lanes\b",)),
    ("turns", (rf"\b(?:which way|where) {_MAY} {_WE} (?:turn|go)\b", r"\b(?:junction|crossing|intersection)\b")),
    (
        "front",
        (
            rf"\bhow (?:far|close|much (?:room|space|distance))\b.*\b{_AHEAD}\b|\b(?:distance|gap|headway)\b",
            rf"\b(?:any(?:one|body)|some(?:one|body)|nobody|who|what|car|vehicle)\b.*\b{_AHEAD}\b",
            r"^how (?:far|close) (?:away )?(?:is|are) (?:he|she|they|it)\b",
        ),
    ),
)
"""Topics of a question's words, the first that fits first."""
_TOPICS: Final[tuple[tuple[Topic, re.Pattern[str]], ...]] = tuple(
    (topic, re.compile("|".join(patterns))) for topic, patterns in _PATTERNS
)


def asks_to_know(text: str) -> bool:
    """True if words ask for knowledge and for nothing to be done."""
    words = _even(text)
    return _ASKS.match(words) is not None and _PROPOSES.search(words) is None and not re.search(r"[.,;!?]", words)


def topics_of(text: str) -> tuple[Topic, ...]:
    """Possible topics of a question, the likeliest first; empty where the words ask for no knowledge."""
    words = _even(text)
    found: list[Topic] = []
    if _ABOUT_DOING.match(words):
        found.append("doing")
    if _WHY_STANDING.match(words):
        found.append("standing")
    elif asks_to_know(text):
        found.extend(topic for topic, pattern in _TOPICS if pattern.search(words))
    return tuple(found)


def _even(text: str) -> str:
    return words_of(text).rstrip(" ?.!")
