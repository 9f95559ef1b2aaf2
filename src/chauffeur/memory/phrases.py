"""What people say of a drive, as a table: phrase -> topic and direction.

Signs are those of `Feedback`: speed -1 is "too fast", gap -1 "too close", comfort -1 "too harsh". A request carries the
sign of the complaint it answers: "slower, please" is -1 like "too fast". So a sign is also the direction of a wish, and
opposite wishes have opposite signs.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

from chauffeur.memory.words import clauses, even

Topic = Literal["speed", "gap", "comfort", "approval"]
Manner = Literal["complaint", "request", "remark", "opinion", "fixed", "plea", "nothing"]
"""How a phrase takes a negation, and what it weighs.

complaint: "not too fast" is none, but "do not drive too fast" asks for less.
request: "do not go faster" asks for the opposite.
remark: "really fast" is a complaint only if the drive was not praised.
opinion: "not good" is the opposite.
fixed: a complaint or opinion with the negation inside: "not fast enough".
plea: a request with the negation inside: "not so fast".
nothing: looks like one of the others and says nothing.
"""

_FAST = r"(?:fast|quick(?:ly)?|speedy|rapid(?:ly)?|hasty|hastily)"
_SLOW = r"(?:slow(?:ly)?|sluggish(?:ly)?)"
_CLOSE = r"(?:close(?:ly)?|near|tight)"
_GAP = r"(?:gap|distance|space|room|headway|clearance)"
_SO = r"(?:so|that|this|as|quite so)"
_VERY = (
    r"(?:so|this|that|very|really|pretty|quite|rather|awfully|uncomfortably|dangerously|a bit|a little|little bit|bit)"
)
_BE = r"(?:was|were|is|are|felt|been|seemed)"
_MID = r"(?:[\w']+ ){0,3}"
_ROUGH = (
    r"(?:harsh(?:ly)?|hard|rough(?:ly)?|jerky|abrupt(?:ly)?|sudden(?:ly)?|aggressive(?:ly)?|sharp(?:ly)?|sporty|wild)"
)
_TIMID = r"(?:timid|cautious(?:ly)?|careful(?:ly)?|hesitant|gentl[ey]|soft|conservative(?:ly)?|passive|tame|defensive(?:ly)?)"

_TABLE: tuple[tuple[str, Topic, Literal[-1, 1], Manner], ...] = (
    # Negations that are part of the phrase, and look-alikes, come first: what they match is used up.
    (rf"{_BE} not (?:\w+ )?(?:so|that|very|really|particularly|all that) (?:{_FAST}|{_SLOW}|{_CLOSE})", "speed", 1, "nothing"),
    (r"could not (?:be|have been) (?:better|happier|nicer|smoother)", "approval", 1, "fixed"),
    (rf"not {_MID}{_FAST} enough", "speed", 1, "fixed"),
    (rf"not {_MID}slow(?:ly)? enough", "speed", -1, "fixed"),
    (rf"not (?:[\w']+ ){{0,6}}{_SO} {_FAST}", "speed", -1, "plea"),
    (rf"not (?:[\w']+ ){{0,6}}{_SO} {_SLOW}", "speed", 1, "plea"),
    (rf"not (?:[\w']+ ){{0,6}}{_SO} {_CLOSE}", "gap", -1, "plea"),
    (rf"not {_MID}close enough", "gap", 1, "fixed"),
    (rf"not {_MID}far enough", "gap", -1, "fixed"),
    (rf"not {_MID}enough {_GAP}", "gap", -1, "fixed"),
    (r"did not slow down|did not brake", "speed", -1, "fixed"),
    (r"did not speed up|did not accelerate", "speed", 1, "fixed"),
    (rf"(?:no|not in a|not any|not a) {_MID}(?:hurry|rush)", "speed", -1, "plea"),
    (rf"not {_MID}(?:smooth|comfortable|comfortably|gentle|safe)", "comfort", -1, "fixed"),
    (r"(?:not (?:only|just))", "speed", 1, "nothing"),
    # Gap.
    (rf"{_GAP}(?: [\w']+){{0,4}} too (?:small|short|tight|little|narrow|close)", "gap", -1, "complaint"),
    (rf"{_GAP}(?: [\w']+){{0,4}} too (?:big|large|wide|long|much|great|far)", "gap", 1, "complaint"),
    (rf"too (?:little|small|short|narrow|tight) (?:of )?(?:a )?{_GAP}", "gap", -1, "complaint"),
    (rf"too (?:much|big|large|long|wide|great) (?:of )?(?:a )?(?:\w+ )?{_GAP}", "gap", 1, "complaint"),
    (rf"too (?:\w+ly )?{_CLOSE}", "gap", -1, "complaint"),
    (r"too far(?: behind| back| away| from)?", "gap", 1, "complaint"),
    (r"tailgat\w*|on (?:his|her|their|the|its) (?:bumper|tail)|bumper to bumper|breathing down", "gap", -1, "complaint"),
    (r"closer (?:\w+ ){0,4}than (?:i|we|my)", "gap", -1, "complaint"),
    (r"(?:further|farther) (?:\w+ ){0,4}than (?:i|we|my)", "gap", 1, "complaint"),
    (rf"more (?:\w+ )?{_GAP}|(?:bigger|larger|longer|wider|greater) (?:\w+ )?{_GAP}", "gap", -1, "request"),
    (r"(?:further|farther) (?:back|away|behind|from)|keep (?:your|a|some|the|my) distance|back off|stay back|hang back",
     "gap", -1, "request"),
    (rf"(?:increase|widen|extend|enlarge) (?:the |your |my |our )?(?:\w+ )?{_GAP}|(?:drop|fall) back", "gap", -1, "request"),
    (rf"leave (?:him |her |them |us |me )?(?:some|a bit of|plenty of|a lot of|a little) {_GAP}", "gap", -1, "request"),
    (rf"less (?:\w+ )?{_GAP}|(?:smaller|shorter|tighter) (?:\w+ )?{_GAP}", "gap", 1, "request"),
    (rf"(?:reduce|decrease|shorten|close|narrow) (?:the |your |my |our )?(?:\w+ )?{_GAP}", "gap", 1, "request"),
    (r"close up|catch up|closer", "gap", 1, "request"),
    (rf"{_VERY} {_CLOSE}", "gap", -1, "remark"),
    # Speed.
    (rf"too (?:\w+ly )?{_FAST}|too much speed|(?:over|above) the (?:speed )?limit|speeding|racing", "speed", -1, "complaint"),
    (rf"too (?:\w+ly )?{_SLOW}|crawl(?:ed|ing)?|snail(?:'s)?|dawdl\w+|sluggish", "speed", 1, "complaint"),
    (r"(?:faster|quicker) (?:\w+ ){0,3}than (?:i|we|my)", "speed", -1, "complaint"),
    (r"(?:slower|more slowly) (?:\w+ ){0,3}than (?:i|we|my)", "speed", 1, "complaint"),
    (rf"{_BE} (?:\w+ ){{0,2}}(?:faster|quicker|slower|closer|smoother)", "speed", 1, "nothing"),
    (r"slower|slow (?:\w+ )?down|more slowly|less (?:speed|fast)|take it easy|take your time|ease off|decelerate",
     "speed", -1, "request"),
    (r"(?:reduce|decrease|lower|drop) (?:the |your |my |our )?(?:\w+ )?speed", "speed", -1, "request"),
    (r"faster|quicker|more quickly|speed (?:\w+ )?up|more speed|hurry|rush|step on it|pick up the pace|accelerate|floor it",
     "speed", 1, "request"),
    (r"(?:increase|raise) (?:the |your |my |our )?(?:\w+ )?speed|as (?:fast|quick(?:ly)?) as|(?:be|am|are|running|run) late",
     "speed", 1, "request"),
    (rf"{_VERY} {_FAST}", "speed", -1, "remark"),
    (rf"{_VERY} {_SLOW}", "speed", 1, "remark"),
    # Comfort.
    (rf"less {_ROUGH}|smoother|more smoothly|gentler|more gently|gently|softer|more softly|calmer", "comfort", -1, "request"),
    (r"more (?:comfortabl[ey]|careful(?:ly)?|relaxed|cautious(?:ly)?|defensive(?:ly)?|conservative(?:ly)?)|be careful",
     "comfort", -1, "request"),
    (r"drive carefully|brake (?:\w+ )?(?:earlier|sooner|softer)", "comfort", -1, "request"),
    (r"more (?:aggressive(?:ly)?|assertive(?:ly)?|confident(?:ly)?|decisive(?:ly)?|dynamic(?:ally)?|sporty|spirited)",
     "comfort", 1, "request"),
    (rf"less {_TIMID}|sportier|bolder|brake (?:\w+ )?later", "comfort", 1, "request"),
    (rf"too (?:\w+ly )?{_ROUGH}|brak\w+ (?:\w+ )?(?:hard|late|suddenly|sharply)", "comfort", -1, "complaint"),
    (rf"too (?:\w+ly )?{_TIMID}|hesitat\w+|hesitant|timid|overcautious|like (?:a |my )?grand(?:ma|mother|pa|father)",
     "comfort", 1, "complaint"),
    (r"jerk(?:y|ed|ing|s)?|abrupt(?:ly)?|harsh(?:ly)?|rough|bumpy|lurch\w*|slam\w*|reckless\w*|aggressive(?:ly)?",
     "comfort", -1, "complaint"),
    (r"(?:motion |car)?sick\w*|nause\w+|queasy|dizzy|scar(?:ed|y|ing)|afraid|frighten\w*|nervous|unsafe|dangerous(?:ly)?",
     "comfort", -1, "complaint"),
    (r"uncomfortabl[ey]|terrif\w+|stressful|stressed|uneasy|panic\w*", "comfort", -1, "complaint"),
    # Approval.
    (r"(?:would|might|may) (?:be (?:\w+ )?(?:nice|good|great|better|perfect|fine|happy)|like|love)", "approval", 1, "nothing"),
    (r"just right|spot on|perfect(?:ly)?|flawless(?:ly)?|excellent|great|awesome|amazing|wonderful|fantastic|brilliant",
     "approval", 1, "opinion"),
    (r"superb|lovely|nice(?:ly)?|good|well done|loved?|liked|enjoy(?:ed)?|happy|pleased|satisfied|comfortabl[ey]|ideal",
     "approval", 1, "opinion"),
    (r"fine|okay|ok|relaxing|smooth(?:ly)?|keep it up|same again|(?:was|is|felt|much|even) better", "approval", 1, "opinion"),
    (r"i (?:really |do |did )?like (?:it|that|this|how|the)|exactly (?:right|how|what|as|like)|as it was", "approval", 1, "opinion"),
    (r"hated?|terribl[ey]|horribl[ey]|awful|bad(?:ly)?|worse|worst|disliked?|annoy(?:ed|ing)|disappoint(?:ed|ing)",
     "approval", -1, "opinion"),
    (r"never again|unacceptable|poor(?:ly)?|ridiculous|not like (?:it|that|this|how|the)", "approval", -1, "fixed"),
)  # fmt: skip

_PATTERNS = tuple((re.compile(rf"\b(?:{phrase})\b"), topic, sign, manner) for phrase, topic, sign, manner in _TABLE)
_NEGATED = re.compile(r"\b(?<!why )(?:not|never|no|nothing|hardly|without|neither|nor)\b(?: [\w']+){0,4} ?$")
_ORDERED = re.compile(
    r"^(?:(?:please|just|so|next time|ok|okay) )*(?:do not|never|avoid|stop)(?! (?:think|find|feel|believe|mind|know))\b"
    r"|\b(?:should|must|may|ought|try|rather|prefer) not\b"
)


@dataclass(frozen=True, slots=True)
class Want:
    """One thing said.

    Attributes:
        topic: What it is about.
        sign: Direction, as in `Feedback`.
        manner: How it was said; a negated complaint that orders something is a `request`.
        clause: The words it was said in.
    """

    topic: Topic
    sign: Literal[-1, 1]
    manner: Manner
    clause: str


def read_wants(text: str) -> tuple[Want, ...]:
    """Everything a text says about speed, gap, comfort and approval, in the order it is said."""
    found: list[Want] = []
    for clause in clauses(even(text)):
        left = clause
        here: list[tuple[int, Want]] = []
        for pattern, topic, sign, manner in _PATTERNS:
            while (match := pattern.search(left)) is not None:
                left = left[: match.start()] + "#" * (match.end() - match.start()) + left[match.end() :]
                want = _negate(Want(topic, sign, manner, clause), clause[: match.start()])
                if want is not None:
                    here.append((match.start(), want))
        found += [want for _, want in sorted(here, key=lambda item: item[0])]
    return tuple(found)


def _negate(want: Want, before: str) -> Want | None:
    if want.manner == "nothing":
        return None
    if want.manner in ("fixed", "plea") or _NEGATED.search(before) is None:
        return want
    if want.manner in ("complaint", "remark"):
        ordered = "please" in want.clause or _ORDERED.search(before) is not None
        return Want(want.topic, want.sign, "request", want.clause) if ordered else None
    return Want(want.topic, 1 if want.sign < 0 else -1, want.manner, want.clause)
