"""Whether somebody says outright that the vehicle ahead is, or is not, to be overtaken.

Plain words are not left to likelihoods: who says "don't pass him" is not overtaken with, whatever a sorter thinks of
the rest of the sentence. All that is not surely a wish (remarks, questions why, conditions) is left to the sorter.
"""

from __future__ import annotations

import re
from typing import Final, Literal

from chauffeur.language.tokens import plain

Told = Literal["pass", "stay", ""]

_LATER: Final = re.compile(r"\b(?:if|when|whenever|once|after|until|till|unless|before|soon|later|first|"
    r"wait\b.*\bthen|in (?:\w+ ){1,3}(?:seconds?|minutes?|kilomet\w+|miles?))\b"
)
"""Who says when has said more than these parameters can hold."""
_THINGS: Final = (
    r"(?:(?:the|that|this|your|my|our|some|a|an) (?:\w+ )?"
    r"(?:salt|sugar|water|bottle|phone|time|exit|junction|turn|ramp|napkins?|tissues?|bag|map|test|exam|bridge|border|"
    r"note|remote|charger|snacks?|word|message|ball|bill|law|town|city|village|services|petrol|gas|sign|hat|parcel|time|buck)|"
    r"me|us|through|away|out|up|over|judgement|unnoticed)\b"
)
_OTHERS: Final = r"(?:him|her|it|them|this|that|these|those|the|a|an|each|all|any\w*|every\w*|every|some\w*|grand\w+|mr|mister)"
_PAST: Final = r"(?:past|by|around|round|ahead of|in front of)"
_OVERTAKE: Final = (
    rf"(?:overtake\b|pass\b(?! {_THINGS})(?= (?:{_OTHERS}|please|now|already|on the left)\b| ?$| ?[.,;!?])|"
    rf"(?:get|go|move|drive|squeeze|nip|slip|zip|swing|pull|push) (?:right |on |straight |safely |quickly )?{_PAST}"
    rf"(?! (?:the|that|this|a) (?:corner|bend|block|roundabout|curve|town|back))(?= {_OTHERS}\b| ?$| ?[.,;!?])|"
    rf"leave (?:{_OTHERS} )(?:\w+ ){{0,3}}behind\b)"
)
_OVERTAKING: Final = rf"(?:overtaking\b|passing\b(?= {_OTHERS}\b| ?$| ?[.,;!?])|(?:getting|going) {_PAST} {_OTHERS}\b)"
_STAY: Final = (
    r"(?:(?:stay|keep|remain|hang|sit|wait|drop|hold|tuck|settle|fall)(?: (?!not|no)\w+){0,3}? (?:behind|back of)\b|"
    r"(?:hang|stay|keep) (?:well |right )?back\b(?= ?$| ?[.,;!?]| (?:and|here|please|a bit|from|behind))|"
    rf"follow (?:{_OTHERS})\b|keep following\b|(?:stick|stay|remain) with (?:{_OTHERS})\b)"
)
_FILLERS: Final = (
    r"(?:(?:please|ok|okay|hey|so|just|now|then|come on|go on|go ahead|and|well|yes|yeah|right|alright|computer|car|"
    r"driver|buddy|dear|sir|mate|pal|chief|boss|hurry up|speed up|step on it|quick|quickly|um|uh|kindly|simply|really|"
    r"actually|also|maybe|perhaps|better|be patient|relax|easy|go go go|do|carefully|let us|lets) ?,? ?)*"
)
_START: Final = rf"(?:^|[.,;!?] ?){_FILLERS}"
_ASKS: Final = (
    rf"(?:{_START}|\b(?:(?:can|could|would|will) (?:you|we) (?:please |just |kindly |maybe |perhaps )*|"
    r"(?:can|could|would|will|do|shall|should) not (?:you|we) (?:please |just |want to )*|"
    r"why (?:do |did )?not (?:you |we )?(?:just )?|"
    r"(?:want|like|love|need|prefer|ask|asking|tell|telling|appreciate) (?:you|it|us|the car|this car) to (?:please |just )*|"
    r"(?:want|wish|ask|prefer|rather) (?:that )?(?:you|we) (?:should |would )?|(?:mind|if you could|if you would|time) to |"
    r"\bi (?:want|need|would like|would love|would prefer) to |i would rather |"
    r"(?:speed up|accelerate|faster|on it|on|over|out|left|signal|indicate|slow down|down|slower|ease off|brake|patient) "
    r"and (?:then )?(?:please |just )?))"
)
_NOT: Final = (
    r"(?:(?<!why )(?<!\w )\b(?:do not|never|not|no|without|stop|quit|avoid|refrain from|rather not|better not)|"
    r"(?<!why )\b(?:do not|must not|should not|need not|better not|rather not|possible not|prefer not|to not|you not|"
    r"(?<!can )we not|please not|(?:can|could|would) you not|do not want that (?:you|we)|never|without|stop|avoid|refrain from|no need (?:for \w+ )?|no point in|no reason|not necessary)|"
    r"\bnot(?= to )) "
    r"(?:(?:you dare|even|ever|try|trying|to|go and|just|bother|dare|think|of|about|be|start|want to|want you to|want us "
    r"to|please|attempt|need|have|any|under any circumstances) )*"
)
_ASKED: Final = {kind: re.compile(rf"{_ASKS}{verb}") for kind, verb in (("pass", _OVERTAKE), ("stay", _STAY))}
_MIND_PASSING: Final = re.compile(rf"\b(?:mind|about|consider|suggest|try) {_OVERTAKING}")
_FORBIDDEN: Final = {
    "pass": re.compile(rf"{_NOT}(?:{_OVERTAKE}|{_OVERTAKING})"),
    "stay": re.compile(rf"{_NOT}{_STAY}"),
}
_WHY: Final = re.compile(r"\b(?:why|how long|how come|what for)\b(?! not\b| do not\b| did not\b)|\blet (?:him|her|them|it)\b|"
    r"\b(?:nobody|no one|can we not|could we not)\b"
)
"""Questions that may mean either, and what others are to do."""


def told(wish: str) -> Told:
    """What a wish says outright about the vehicle ahead; empty where it says nothing, or both."""
    words = re.sub(r"\s+", " ", re.sub(r"[^a-z0-9 .,;!?]", " ", plain(wish))).strip()
    if _LATER.search(words) or _WHY.search(words):
        return ""
    found: set[Told] = set()
    without: dict[str, str] = {}
    for kind, other in (("pass", "stay"), ("stay", "pass")):
        if _FORBIDDEN[kind].search(words):
            found.add(other)
        without[kind] = _FORBIDDEN[kind].sub(" ", words)
        if _ASKED[kind].search(without[kind]):
            found.add(kind)
    if _MIND_PASSING.search(without["pass"]):
        found.add("pass")
    return found.pop() if len(found) == 1 else ""
