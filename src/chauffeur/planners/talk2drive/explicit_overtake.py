"""Outright wishes to overtake the lead vehicle, or not to.

Plain words are not left to likelihoods: who says "don't pass him" is not overtaken with, whatever a sorter thinks of
the rest of the sentence. All that is not surely a wish (remarks, questions why, conditions) is left to the sorter.
"""

from __future__ import annotations

import re
from typing import Final, Literal

from chauffeur.language.tokens import words_of

Told = Literal["pass", "stay", ""]


def _any(*patterns: str) -> str:
    return f"(?:{'|'.join(patterns)})"


_END: Final = r" ?(?:$|[.,;!?])"
_THE: Final = r"(?:the|that|this|your|my|our|some|an?)"
_THINGS: Final = _any(
    rf"{_THE} (?:\w+ )?(?:salt|sugar|water|bottle|phone|time|exit|junction|turn|ramp|napkins?|tissues?|bag|map|tests?|"
    r"exams?|bridge|border|note|remote|charger|snacks?|word|message|ball|bill|law|town|city|village|services|petrol|"
    r"gas|signs?|hat|parcel|buck)",
    r"(?:me|us|through|away|out|up|over|judgement|unnoticed)",
)
"""Things passed in another sense."""
_THEM: Final = r"(?:him|her|it|them|this|that|these|those|the|an?|each|all|any\w*|every\w*|some\w*|grand\w+|mr|mister)"
_PAST: Final = r"(?:past|by|around|round|ahead of|in front of)"
_PLACES: Final = r"(?:the|that|this|a) (?:corner|bend|block|roundabout|curve|town|back)"
_OVERTAKE: Final = _any(
    r"overtake\b",
    rf"pass\b(?! {_THINGS}\b)(?={_END}| (?:{_THEM}|please|now|already|on the left)\b)",
    r"(?:get|go|move|drive|squeeze|nip|slip|zip|swing|pull|push) (?:right |on |straight |safely |quickly )?"
    rf"{_PAST}(?! {_PLACES})(?={_END}| {_THEM}\b)",
    rf"leave {_THEM} (?:\w+ ){{0,3}}behind\b",
)
_OVERTAKING: Final = _any(r"overtaking\b", rf"passing\b(?={_END}| {_THEM}\b)", rf"(?:getting|going) {_PAST} {_THEM}\b")
_STAY: Final = _any(
    r"(?:stay|keep|remain|hang|sit|wait|drop|hold|tuck|settle|fall)"
    r"(?: (?!not\b|no\b|further|farther|closer|nearer|more\b|tight)\w+){0,3}? (?:behind|back of)\b",
    rf"(?:hang|stay|keep) (?:well |right )?back\b(?={_END}| (?:and|here|please|a bit|from|behind)\b)",
    rf"follow {_THEM}\b",
    r"keep following\b",
    rf"(?:stick|stay|remain) with {_THEM}\b",
)

_FILLERS: Final = (
    r"(?:(?:please|ok|okay|hey|so|just|now|then|come on|go on|go ahead|and|well|yes|yeah|right|alright|computer|car|"
    r"driver|buddy|dear|sir|mate|pal|chief|boss|hurry up|speed up|step on it|quick|quickly|um|uh|kindly|simply|really|"
    r"actually|also|maybe|perhaps|better|be patient|relax|easy|go go go|do|carefully|let us|lets) ?,? ?){0,8}"
)
_POLITE: Final = r"(?:please |just |kindly |maybe |perhaps |want to )*"
_ASKS: Final = _any(
    rf"(?:^|[.,;!?] ?){_FILLERS}",
    rf"\b(?:can|could|would|will) (?:you|we) {_POLITE}",
    rf"\b(?:can|could|would|will|do|shall|should) not (?:you|we) {_POLITE}",
    r"\bwhy (?:do |did )?not (?:you |we )?(?:just )?",
    rf"\b(?:want|like|love|need|prefer|ask|asking|tell|telling|appreciate) (?:you|it|us|the car|this car) to {_POLITE}",
    r"\b(?:want|wish|ask|prefer|rather) (?:that )?(?:you|we) (?:should |would )?",
    r"\b(?:mind|if you could|if you would|time to) ",
    r"\bi (?:want|need|would like|would love|would prefer) to ",
    r"\bi would rather ",
    r"\b(?:speed up|accelerate|faster|on it|on|over|out|left|signal|indicate|slow down|down|slower|ease off|brake|"
    r"patient)(?: a (?:little|bit|touch|tad))? and (?:then )?(?:please |just )?",
)
_NOT: Final = (
    _any(
        r"(?:(?<=^)|(?<=[.,;!?] ))(?:not|no|quit)",
        r"\b(?<!why )(?:do|must|should|need|better|rather|possible|prefer|please|to|you) not",
        r"(?<!can )we not",
        r"\bnot(?= to )",
        r"do not want that (?:you|we)",
        r"\b(?:never|without|stop|avoid|refrain from|no need(?: for \w+)?|no point in|no reason)",
    )
    + r" (?:(?:you dare|even|ever|try|trying|to|go and|just|bother|dare|think|of|about|be|start|want to|want you to|"
    r"want us to|please|attempt|need|have|any|under any circumstances) )*"
)
_ASKED: Final = {kind: re.compile(_ASKS + verb) for kind, verb in (("pass", _OVERTAKE), ("stay", _STAY))}
_FORBIDDEN: Final = {
    "pass": re.compile(_NOT + _any(_OVERTAKE, _OVERTAKING)),
    "stay": re.compile(_NOT + _STAY),
}
_MIND_PASSING: Final = re.compile(rf"\b(?:mind|about|consider|suggest|try) {_OVERTAKING}")
_EITHER: Final[tuple[tuple[Told, Told], ...]] = (("pass", "stay"), ("stay", "pass"))
"""What may be told, and what it means that it must not be."""
_LATER: Final = re.compile(
    r"\b(?:if|when|whenever|once|after|until|till|unless|before|soon|later|first|wait\b.*\bthen|"
    r"in (?:\w+ ){1,3}(?:seconds?|minutes?|kilomet\w+|miles?))\b"
)
"""Who says when has said more than a choice of lane holds."""
_UNSURE: Final = re.compile(
    r"\b(?:why|how long|how come|what for)\b(?! not\b| do not\b| did not\b)|\blet (?:him|her|them|it)\b|"
    r"\b(?:nobody|no one|can we not|could we not)\b"
)
"""Questions that may mean either, and what others are to do."""


def told(wish: str) -> Told:
    """The outright wish about the lead vehicle; empty if there is none, or both."""
    words = words_of(wish)
    if _LATER.search(words) or _UNSURE.search(words):
        return ""
    found: set[Told] = set()
    for kind, other in _EITHER:
        if _FORBIDDEN[kind].search(words):
            found.add(other)
        allowed = _FORBIDDEN[kind].sub(" ", words)
        if _ASKED[kind].search(allowed) or (kind == "pass" and _MIND_PASSING.search(allowed)):
            found.add(kind)
    return found.pop() if len(found) == 1 else ""
