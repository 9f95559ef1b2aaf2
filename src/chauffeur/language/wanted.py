"""The things a wish asks for, part by part, read by rules that see no plan: acts in order, conditions, places.

A judge holds a drive and a plan against these. So the reading errs on one side: what it is not sure of is no act, and a
remark ("I have a meeting") asks for nothing. Every part keeps its words as they were said.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

from chauffeur.language.corrections import last_said
from chauffeur.language.ordinals import nth_of
from chauffeur.language.quantities import Quantity, read_quantities

ActKind = Literal[
    "turn", "lane", "return", "overtake", "pull_over", "stop", "park", "go_to", "speed", "gap", "follow", "yield",
    "wait", "style", "keep", "other",
]  # fmt: skip
"""`return` is to the lane where it began; `yield` lets another vehicle in; `style` is a mood; `other` is an imperative
that is no driving this module knows."""
PartKind = Literal["act", "condition", "place", "exclusion"]
WantedSide = Literal["left", "right", "straight", ""]

MAX_CHARS: Final = 1000
"""Of a wish that is read; spoken ones are a tenth of it."""


@dataclass(frozen=True, slots=True)
class WantedPart:
    """One part of a wish.

    Attributes:
        kind: An act; when it is to be done; where; what is to be kept out of it.
        words: As said.
        act: Of an act, its kind; of the other kinds, that of the act they belong to.
        side: Left, right or straight, where the act names one.
        sign: +1 for faster or a larger gap, -1 for the opposite, 0 where none is said.
        amount: Speed or distance that is named as the new value; None where none is.
        denied: An act that is not to be done.
        nth: At which of the junctions with such a way, 1 for the next.
        content: Words by which a place or condition is known, lower case.
    """

    kind: PartKind
    words: str
    act: ActKind = "other"
    side: WantedSide = ""
    sign: int = 0
    amount: Quantity | None = None
    denied: bool = False
    nth: int = 1
    content: tuple[str, ...] = ()


_CONDITION: Final = (
    r"after|before|when|whenever|if|unless|until|till|once|while|as soon as|as long as|provided|in case|the moment|"
    r"by the time|except|every time|each time"
)
_REASON: Final = r"because|since|so that|so (?:i|we)|as (?:i|we|it|my)|for (?:i|we)|although|though|otherwise|or else"
_BREAK: Final = re.compile(
    r"[.;!?:,](?=\s|$)\s{0,3}|\s[-\u2013\u2014]\s|"
    r"(?:^|(?<=\s))(?:and|but|or|plus|then|also|afterwards|after that)(?=\s)|"
    rf"\s(?=(?:{_CONDITION}|{_REASON}|without|instead of|rather than)\b)",
    re.IGNORECASE,
)
_POLITE: Final = re.compile(
    r"^(?:(?:please|now|just|ok(?:ay)?|hey|hi|hello|well|so|oh|and|then|also|kindly|first|next|maybe|perhaps|chauffeur|"
    r"(?:can|could|would|will|might|may) (?:you|we)(?: (?:please|mind|kindly|maybe|just))?|"
    r"(?:i|we)(?: would|'d) (?:like|love|prefer|rather)(?: (?:you|it))?(?: to| if you(?: could| would)?)?|"
    r"(?:i|we) (?:want|need|wish|have)(?: you)? to|(?:i|we)(?:'d| would) rather(?: you)?|"
    r"(?:you|we) (?:should|can|could|may|must|might|need to|have to|ought to)|do me a favou?r|"
    r"let(?:'s| us)|lets|go ahead|feel free to|try to|make sure(?: to| that you| you)?|be sure to|remember to|"
    r"i(?:'d| would) appreciate it if you(?: could| would)?|it would be nice if you(?: could| would)?|"
    r"immediately|quickly|slowly|gently|carefully|directly|straight away|right away|at once)[\s,]+)+",
    re.IGNORECASE,
)
_NEGATED: Final = re.compile(
    r"^(?:\w+\s){0,2}?(?:do not|don'?t|never|no|not|without|avoid|refrain from|rather than|instead of|anything but|"
    r"skip|neither|nor)\b",
    re.IGNORECASE,
)
_NO_DENIAL: Final = re.compile(
    r"\b(?:(?:not|never|don'?t) (?:mind|hesitate|forget|worry)|no (?:problem|worries|rush|hurry|thanks)|"
    r"(?:do not|don'?t) (?:you|we)|not too)\b",
    re.IGNORECASE,
)
"""Negations that forbid nothing."""
_REMARK: Final = re.compile(
    r"^(?:(?:i|we|he|she|it|they|there|this|that|these|those|you)(?:'\w+)?|i'm|my|our|his|her|their|everyone|everybody|"
    r"nobody|somebody|someone|what|who|which|why|how|the (?:\w+ ){1,3}(?:is|are|was|has|have|looks?|goes|drives?))\b",
    re.IGNORECASE,
)
"""Beginnings of a clause that tells and asks for nothing, once polite frames are off."""
_ALWAYS: Final = re.compile(
    r"\b(?:safe(?:ly)?|possible|clear|free|empty|can|could|able|chance|opportunity|ready|allowed|like|want|mind|necessary|"
    r"needed|must|room|space|gap|convenient|suits|please|further notice|legal|okay|ok)\b",
    re.IGNORECASE,
)
"""In a condition: what the checks and the safety filter see to anyway, or leaves it to the driver."""

_SIDES: Final = r"(?:left|right)"
_USER: Final = r"(?:it|him|her|them|car|truck|van|bus|lorry|vehicle|guy|one|driver|tractor|bike|cyclist|slowpoke|snail)"
_ROOM: Final = r"(?:\w+ )?(?:room|space|distance|gap|headway)"
_LANE_VERB: Final = (
    r"(?:chang|switch|mov|merg|get|go|shift|swap|pull|slid|hop|come|return|back|div|us|tak|cross)\w{0,4}"
)
_PATTERNS: Final[tuple[tuple[ActKind, int, tuple[str, ...]], ...]] = (
    (
        "yield",
        0,
        (
            r"let(?:ting)?\b(?! (?:me|us)\b).{1,40}"
            r"\b(?:in|merge|pass|by|through|first|squeeze|cut|ahead|join|go|over)\b",
            r"(?:make|leave) (?:room|way|space) for",
            r"give way|yield",
            r"allow\w*\b.{1,40}\b(?:merge|in|pass|cut|squeeze|join)\b",
            r"open(?:ing)? (?:up )?(?:a|the) gap",
        ),
    ),
    ("keep", 0, (r"(?:stay|keep|remain|stick|hold)\w{0,3}\b(?! behind).{0,25}\blane",)),
    (
        "overtake",
        0,
        (
            r"over ?tak\w{1,4}|leapfrog",
            r"(?:pass|get past|go past|get around|go around|get by)(?:ing)? "
            rf"(?:the|this|that|it|him|her|them|these|those|a)\b(?=.{{0,25}}\b{_USER}\b)",
            r"pass(?:ing)? (?:it|him|her|them)\b",
        ),
    ),
    (
        "pull_over",
        0,
        (r"pull(?:ing)? (?:over|up|aside|in(?! (?:front|behind|after)))", r"(?:hard )?shoulder|emergency lane"),
    ),
    ("park", 0, (r"park(?:ing)?\b",)),
    (
        "turn",
        0,
        (
            r"u[- ]?turn|turn(?:ing)? (?:a)?round",
            rf"(?:turn\w{{0,3}}|bear|veer|hang|swing)\b.{{0,25}}\b{_SIDES}",
            rf"(?:take|make|do|catch)\b.{{0,25}}\b{_SIDES}(?! lane|[- ]hand lane| side)",
            r"turn(?:ing)? (?:off|in|at|into|here)",
            rf"(?:go|drive|head|continue|keep|straight) (?:straight|{_SIDES})(?! (?:away|behind|to the)\b)",
        ),
    ),
    (
        "return",
        0,
        (
            r"(?:com|go|get|pull|mov|merg|slid|cut|chang|switch)\w{0,4} back\b"
            r"(?! to (?!(?:the|our|my|this|your) (?:\w+ )?lane))",
            r"return(?:ing)?\b(?! (?:the|my|this|it|him|her|them)\b)",
            r"back (?:in|into|to) (?:the|our|my|this|your) (?:\w+ )?lane",
        ),
    ),
    (
        "lane",
        0,
        (
            rf"{_LANE_VERB}\b.{{0,30}}\blanes?\b",
            r"(?:left|right|other|next|fast|slow|inside|outside|middle)(?:most|[- ]hand)? lane",
            r"(?:move|come|go|get) (?:over|back (?:in|over))\b",
        ),
    ),
    (
        "stop",
        0,
        (
            r"stop(?:ping)?\b(?! (?:sign|light|line))(?! \w+ing\b)|halt|come to (?:a|rest)",
            r"(?:let|drop|leave|set) (?:me|us|him|her|them) (?:out|off|down|here|there|at|by)|(?:get|hop|step) out",
        ),
    ),
    (
        "go_to",
        0,
        (
            r"(?:take|drive|bring|get|go|head|carry|run|deliver)(?:ing)? (?:me |us |him |her |them )?(?:back |over )?"
            r"(?:to|towards?|home)\b(?! (?:the )?(?:left|right|\d|speed|sleep))",
        ),
    ),
    ("wait", 0, (r"wait(?:ing)?\b|stand by\b|stay (?:here|there|put)",)),
    (
        "follow",
        0,
        (r"follow(?:ing)?\b(?! (?:the )?(?:road|street|signs?|rules?|limit))|(?:stay|keep|remain) behind",),
    ),
    (
        "gap",
        1,
        (
            rf"(?:more|larger|bigger|greater|wider|longer|extra|some) {_ROOM}",
            r"(?:further|farther) (?:back|away|behind)|(?:back|drop|fall|hang) (?:off|back)",
            r"(?:increase|widen|open)\b.{0,12}\b(?:gap|distance)|keep (?:your |a |some )?distance",
        ),
    ),
    (
        "gap",
        -1,
        (
            rf"(?:less|smaller|shorter) {_ROOM}",
            r"closer|nearer|close (?:the|up)|tailgat\w{2,3}",
            r"(?:reduce|shorten|close|decrease)\b.{0,12}\b(?:gap|distance)",
        ),
    ),
    (
        "gap",
        0,
        (
            r"(?:gap|headway|distance)\b",
            r"(?:keep|leave|stay|hold|follow)\b.{0,15}\d ?"
            r"(?:m|met(?:re|er)s?|feet|foot|yards?|car lengths?|s|sec\w{0,4})\b",
        ),
    ),
    (
        "speed",
        1,
        (
            r"faster|quicker|speed(?:ing)? up|accelerat\w{1,3}|step on it|floor it|hurry up|more speed",
            r"(?:increase|raise)\b.{0,12}\b(?:speed|pace)",
        ),
    ),
    (
        "speed",
        -1,
        (
            r"slower|slow(?:ing)?(?: it)? down|slow\b|brak(?:e|ing)|decelerat\w{1,3}|less speed|ease off",
            r"(?:decrease|reduce|lower)\b.{0,12}\b(?:speed|pace)",
        ),
    ),
    (
        "speed",
        0,
        (
            r"(?:speed|pace|cruise|km/h|kmh|mph|kph|kilomet\w{2,3} (?:per|an)|miles (?:per|an)|speed limit)\b",
            r"(?:go|do|drive|drive at|hold) \d",
        ),
    ),
    (
        "style",
        0,
        (
            r"careful\w{0,2}|gentl[ey]|smooth\w{0,2}|calm\w{0,2}|relax\w{0,3}|(?:in a|in no) (?:hurry|rush)|easy",
            r"sporty|econom\w{3,6}|comfort\w{0,5}|hurry",
        ),
    ),
    (
        "keep",
        0,
        (
            r"(?:keep|carry|go|drive) (?:on|going|driving|it up)|continue|stay\b",
            r"keep (?:it|this|that|the|your)\b",
        ),
    ),
)
_ACTS: Final[tuple[tuple[ActKind, int, re.Pattern[str]], ...]] = tuple(
    (kind, sign, re.compile("|".join(rf"\b(?:{pattern})" for pattern in patterns), re.IGNORECASE))
    for kind, sign, patterns in _PATTERNS
)
"""An act with its sign, and the words for it; the first that begins earliest in a clause is meant."""
_OTHER: Final = re.compile(
    r"^(?:call|ring|phone|pick|collect|fetch|get|buy|bring|play|sing|open|close|shut|honk|beep|flash|signal|indicate|"
    r"wave|tell|text|send|book|order|find|look|show|check|ask|say|put|give|use|watch|mind|wake|help|race|chase|reverse|"
    r"back|load|unload|charge|refuel|fill|wash|visit|meet|return|come|take|turn (?:on|off|up|down)|switch|read|avoid|"
    r"greet|drop|grab|leave|swerve|circle|film|photograph|move|join|merge|pull)\b",
    re.IGNORECASE,
)
"""Imperatives that are none of the acts above."""
_ELLIPTIC: Final = re.compile(
    r"^(?:(?:then|immediately|the|a|an|at|another|again|next|first|second|third|fourth|on|to|your|my|sharp|slight|hard|"
    r"finally|straight|directly|right) ){0,5}(?P<side>left|right)\b(?! (?:now|away|here|lane|behind))",
    re.IGNORECASE,
)
"""A side that stands alone: the verb is that of the part before, or it is a turn."""
_SIDE: Final = re.compile(r"\b(left|right)\b(?! (?:now|away|here|behind|there|after|before)\b)", re.IGNORECASE)
_STRAIGHT: Final = re.compile(r"\bstraight\b(?! (?:away|after|behind|to)\b)", re.IGNORECASE)
_PLACE: Final = re.compile(
    r"\b(?:at|behind|beside|next to|near|close to|in front of|past|through|via|opposite|under|by|across from|around|"
    r"between|(?:far |away )?from|over|along|outside|inside|onto|on|in|into|to|towards?|beyond) "
    r"(?:the|a|an|that|this|my|our|some|any|[A-Z]\w+)\b"
    r"(?:(?! (?:at|behind|beside|next|near|in|past|through|via|opposite|by|from|to|on|onto|into|and|but|with|for) )"
    r" [\w'-]{1,30}){0,4}"
)
_SPAN: Final = re.compile(
    r"\b(?:in|for|within|after) (?:about |the next |another |exactly |roughly )?"
    r"(?:\d{1,5}(?:\.\d+)?|a few|a couple of|a|one|two|three|four|five|six|seven|eight|nine|ten|fifteen|"
    r"twenty|thirty|forty|fifty|hundred|half an?)[ -]?"
    r"(?:hundred )?(?:m|metres?|meters?|km|kilomet(?:re|er)s?|miles?|yards?|s|secs?|seconds?|min(?:ute)?s?|hours?)\b",
    re.IGNORECASE,
)
_STANDING: Final = re.compile(
    r"\b(?:by|faster|slower|more|less|than|over|under|below|above|most|least|max\w*|min\w*|up to|between|or|within|"
    r"about|around|roughly|limit)\b",
    re.IGNORECASE,
)
"""Beside a number: it is no new value that is to be met."""


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_EMPTY: Final = _words("""
a an the this that these those my our your his her its their some any all me us you we i he she it they him them be
is are was were am been being do does did done have has had having will would can could shall should may might must
of to in on at by for with from as so too very please now then again also just only ahead here there and or not no
bit little lot way side hand next first second third fourth last other left right straight front behind back up down
out off away over under near close past until till after before when while if once unless soon long as moment time
every each s t d ll re ve m into onto beside beyond towards toward through via opposite across around between along
outside inside under right-hand left-hand hand-side never not mind
""")
"""Words by which no place and no condition is known."""
_ROAD: Final = _words("""
lane lanes shoulder road street highway motorway freeway junction junctions intersection crossing crossroad
crossroads corner light lights signal sign stop traffic roundabout speed limit pace gap distance hurry rush
direction middle emergency hard fast slow slower faster passing rest track course safety turn drive point journey
""")
"""What every world knows."""
_USERS: Final = _words("""
car cars vehicle vehicles truck trucks lorry lorries van vans bus buses bike cyclist cyclists motorcycle tractor guy
driver drivers one ones leader lead slowpoke red blue white black silver grey gray green yellow big small old
""")
"""Road users and their looks: which of them is meant is no place."""
_WORD: Final = re.compile(r"[a-z][a-z'-]{0,40}|\d{1,6}", re.IGNORECASE)
_OWN: Final = re.compile(r"^(?:\w+ ){1,2}?(?:(?:you|we)(?:'\w+)?(?: (?:have|are|can|will))?|\w+ing\b)", re.IGNORECASE)
"""A condition about what the car itself does."""
_FIRST_PERSON: Final = re.compile(
    r"^(?:while|as|when|so) (?:i|we)(?:'\w+)?\b(?! (?:say|tell|reach|get|come|pass|arrive))", re.I
)


@lru_cache(maxsize=64)
def read_wanted(text: str) -> tuple[WantedPart, ...]:
    """The parts of a wish in the order they are said, as last corrected. Never raises."""
    said = last_said(text[:MAX_CHARS].replace("\N{RIGHT SINGLE QUOTATION MARK}", "'"))
    if said.rstrip().endswith("?") and _REMARK.match(said.strip()):
        return ()
    parts: list[WantedPart] = []
    for clause, negates in _clauses(" ".join(said.split())):
        parts.extend(_read(clause, parts, negates=negates))
    return tuple(parts)


def _clauses(text: str) -> Iterator[tuple[str, bool]]:
    """Clauses, and whether one stands after a negated imperative that it shares ("don't brake or swerve")."""
    begin, negated, mark = 0, False, ""
    for cut in (*_BREAK.finditer(text), None):
        piece = text[begin : len(text) if cut is None else cut.start()].strip(" ,")
        if piece:
            shared = negated and mark in ("or", "nor")
            yield piece, shared
            negated = shared or _is_negated(_POLITE.sub("", piece))
        if cut is not None:
            begin, mark = cut.end(), cut[0].strip().lower()


def _is_negated(clause: str) -> bool:
    return _NEGATED.match(clause) is not None and _NO_DENIAL.search(clause) is None


def _read(clause: str, before: list[WantedPart], *, negates: bool) -> Iterator[WantedPart]:
    lowered = clause.lower()
    if re.match(rf"(?:{_REASON})\b", lowered):
        return
    if re.match(rf"(?:{_CONDITION})\b", lowered):
        yield from _condition(clause, before)
        return
    body = _POLITE.sub("", clause)
    denied = negates or _is_negated(body)
    if not denied and body == clause.strip() and _REMARK.match(body) and not _ELLIPTIC.match(body):
        return
    act = _act(body, before, denied=denied)
    if act is None or (denied and act.act == "other"):
        content = _content(body, _EMPTY | _ROAD)
        if denied and content and not _REMARK.match(body):
            yield WantedPart("exclusion", clause, before[-1].act if before else "other", denied=True, content=content)
        elif before and (place := _PLACE.match(body)) is not None and before[-1].kind != "exclusion":
            yield from _places(place[0], before[-1].act)
        return
    yield replace(act, words=clause)
    if not denied:
        yield from _places(body, act.act)


def _act(body: str, before: list[WantedPart], *, denied: bool) -> WantedPart | None:
    """The first act of a clause; None where it has none."""
    found: list[tuple[int, int, ActKind, int]] = []
    for order, (kind, sign, pattern) in enumerate(_ACTS):
        if (hit := pattern.search(body)) is not None:
            found.append((hit.start(), order, kind, sign))
    alone = _ELLIPTIC.match(body)
    if alone is not None and not (found and min(found)[2] in ("lane", "return", "overtake", "pull_over", "park")):
        earlier = next((part for part in reversed(before) if part.kind == "act"), None)
        kind: ActKind = earlier.act if earlier is not None and earlier.act in ("turn", "lane") else "turn"
        return WantedPart("act", body, kind, _side(alone["side"]), denied=denied, nth=nth_of(body))
    if found:
        _, _, kind, sign = min(found, key=lambda one: (one[1] if one[2] in _FIRST else 99, one[0], one[1]))
        sign = sign or next((more for _, _, same, more in found if same == kind and more), 0)
        side = _SIDE.search(body) if kind in ("turn", "lane", "overtake") else None
        word = "straight" if side is None and kind == "turn" and _STRAIGHT.search(body) else side[1] if side else ""
        return WantedPart(
            "act", body, kind, _side(word), sign, _amount(body, kind), denied, nth_of(body) if kind == "turn" else 1
        )
    return WantedPart("act", body, "other", denied=denied) if _OTHER.match(body) else None


_FIRST: Final = frozenset(("yield", "overtake", "pull_over", "park", "return"))
"""Acts that decide a clause wherever their words stand in it."""


def _side(word: str) -> WantedSide:
    match word.lower():
        case "left":
            return "left"
        case "right":
            return "right"
        case "straight":
            return "straight"
        case _:
            return ""


def _amount(body: str, kind: ActKind) -> Quantity | None:
    """The one number that is to be the new speed or gap."""
    dimension = {"speed": "speed", "gap": "distance"}.get(kind)
    found = [one for one in read_quantities(body) if one.dimension == dimension]
    return found[0] if len(found) == 1 and not _STANDING.search(body) else None


def _condition(clause: str, before: list[WantedPart]) -> Iterator[WantedPart]:
    """A condition; an act where it only puts two acts of the car in order ("after overtaking, slow down")."""
    if _ALWAYS.search(clause) or _FIRST_PERSON.match(clause):
        return
    act = _act(clause.partition(" ")[2], [], denied=False) if _OWN.match(clause) else None
    if act is not None and act.act in ("turn", "lane", "overtake", "stop", "pull_over", "park", "yield"):
        yield replace(act, words=clause)
        return
    owner: ActKind = before[-1].act if before else "other"
    content = _content(clause, _EMPTY | _ROAD)
    if content:
        yield WantedPart("condition", clause, owner, content=content)


def _places(body: str, act: ActKind) -> Iterator[WantedPart]:
    known = _EMPTY | _ROAD | (frozenset() if act == "park" else _USERS)
    for phrase in _PLACE.finditer(body):
        if content := _content(phrase[0], known | frozenset(("spot", "bay", "space", "place", "lot", "car"))):
            yield WantedPart("place", phrase[0], act, content=content)
    if act != "gap" and (span := _SPAN.search(body)) is not None:
        yield WantedPart("condition", span[0], act, content=_content(span[0], _EMPTY) or (span[0].lower(),))


def _content(words: str, known: frozenset[str]) -> tuple[str, ...]:
    return tuple(word for word in (one.lower() for one in _WORD.findall(words)) if word not in known)
