"""Claims of an explanation: its sentences as acts, read by the one reader of words, each with how firmly it is said.

The reader reads passengers' wishes; an explanation is a model's own text. What only an explanation has is sorted out
here by a few phrases: quoted wishes, thoughts that are turned down, remarks on the situation, order words.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final, Literal

from chauffeur.concept.utterance import Act
from chauffeur.language.meaning.reader import read
from chauffeur.language.quantities import Quantity, mark_quantities
from chauffeur.language.tokens import tokens_of

Matter = Literal[
    "lane", "overtake", "back", "turn", "stop", "pull over", "speed", "gap", "check", "number", "stay", "go"
]
"""Subject of a claim. `check` is asking whether a way is free;
`stay` leaves lane, speed or gap alone; `go` says no more than that the car drives."""
Mood = Literal["plan", "wish", "aside"]
"""A plan is what is done; a wish what somebody asked for; an aside what is, or what might be done."""
LANES: Final = frozenset({"lane", "overtake", "back", "pull over"})

_MAX_CHARS: Final = 6_000
"""Of a text; what follows is not compared."""


@dataclass(frozen=True, slots=True)
class Claim:
    """A claim.

    Attributes:
        matter: What it is about.
        sentence: The sentence of the text.
        order: Its place in time, as the text tells it.
        firm: Whether the text says that it is done; else somebody only wishes it.
        aside: Whether it is only mentioned; nothing is held against it.
        unsure: Whether it is a plan that was not read with certainty.
        denied: Whether the text says that it is not done.
        sides: -1 left, 0 straight, +1 right, 2 round; empty where none is named.
        sign: Of a speed or a gap: -1 less, +1 more, 0 not said.
        quantity: Of a number.
        exact: Of a number: it is what is driven at, not a step on the way.
        at_limit: Of a speed: it is that of the limit, or with a sign that much below or above it.
        about: Of `stay`: which of lane, speed, gap; empty for all.
        told: Whether its place in time is told in words.
        lasting: Of a stop: whether the car is to stay there.
        count: Lanes to cross; 0 where it is not said.
    """

    matter: Matter
    sentence: str
    order: float = 0.0
    firm: bool = True
    aside: bool = False
    unsure: bool = False
    denied: bool = False
    sides: frozenset[int] = frozenset()
    sign: int = 0
    quantity: Quantity | None = None
    exact: bool = False
    at_limit: bool = False
    about: frozenset[str] = frozenset()
    told: bool = False
    lasting: bool = False
    count: int = 0


def _any(*phrases: str) -> re.Pattern[str]:
    return re.compile(rf"\b(?:{'|'.join(phrases)})\b", re.IGNORECASE)


_THINKING: Final = re.compile(r"</?think(?:ing)?>|[`*]|(?:\b\d+(?:\.\d+)?\s*)?m/s\s*(?:2|²|\^2)(?!\d)")
"""Marks of a model's text, and accelerations, which nothing is compared with."""
_LISTED: Final = re.compile(r"(?:^|(?<=[\s.;:]))\(?(?:\d{1,2}[.)]|step \d{1,2}[:.)])\s", re.IGNORECASE)
_QUOTED: Final = re.compile(r"[\"“«]([^\"”»]{1,300})[\"”»]")
_SENTENCES: Final = re.compile(r"(?<=[.!?])\s+|\n+|->|→")
_CLAUSES: Final = re.compile(
    r"(?<!\s)\s*[;:]\s+|,? (?=(?:and |but )?then\b(?! on))|,? and (?=after that)|,? (?=so (?:that )?(?:I|we)\b)"
    r"|, (?=(?:and|but) (?:I|we)\b)"
    r"|,? (?=(?:after|before|once) (?:I|we|\w+ing)\b)|,? (?=until (?:I|we)\b)",
)
_ASKED: Final = _any(
    r"(?:passenger|user|rider|driver|you|they|he|she|instruction|request|command)\b.{0,24}"
    r"\b(?:want(?:s|ed)?|ask(?:s|ed)|likes?|dislikes?|says|said|is|are|feels?|complains)",
    r"(?:is|are) (?:asked|wanted|needed)", r"requested", r"asked for", r"I'd (?:like|rather)",
)  # fmt: skip
_THOUGHT: Final = _any(
    r"could", r"might", r"would", r"may", r"can't", r"cannot", r"another possibility", r"normally", r"maybe",
    r"not (?:needed|necessary|possible|sure)", r"no need", r"doesn't need", r"nobody asked", r"something unforeseen",
    r"instead of", r"turn (?:it|this) into", r"neither", r"^not with", r"think step by step",
    r"rather than", r"autopilot (?:still|keeps)",
)  # fmt: skip
_STATE: Final = re.compile(
    r"^(?:(?:right now|currently|at the moment|here|but|and|because|since|as),? )?"
    r"(?:(?:the|there|a|an|our|this|that|it|everything|no|every|being|cars|vehicles|traffic|people)"
    r"\b(?! (?:plan|program|decision|goal|target|route|change|lane change|only|run))[^,]{0,60}?"
    r"\b(?:is|are|was|'s|has|have|drives|keeps|leaves|should|needs|had)\b"
    r"|(?:we are|we're|we do(?! not)|we have(?! to))\b|(?:right now|currently) we\b|.*\bat the moment$)",
    re.IGNORECASE,
)
_OURS: Final = _any(r"I", r"I'll", r"we", r"we'll", r"let me", r"let us", r"let's", r"plan", r"program", r"decision")
_LEAD: Final = re.compile(
    r"^(?:okay|ok|so|after|once|before|therefore|thus|hence|and|but|then|next|finally|afterwards"
    r"|first(?: of all)?|second|my decision|that"
    r"|after that|in the end|here|now|the plan is|the program has|the goal is|the only thing to do is|in this case"
    r"|to comply with the (?:instruction|request)|I(?:'ll|'ve| will| shall| am going| have| need| want| must)?"
    r"|we(?:'ll|'ve| will| shall| should| must| have| need)?|let (?:me|us)|let's|to|also|just|simply)\b[\s,:]*",
    re.IGNORECASE,
)  # fmt: skip
_FIRST_OR_LATER: Final = _any(
    "first",
    "then",
    "afterwards",
    "next",
    "finally",
    "second",
    r"(?:after|before|once) (?:that|this|which|we|I|\w+ing|there)",
)
_THEN: Final = re.compile(r"after (?:that|this|which)\b", re.IGNORECASE)
_SUBORDINATE: Final = re.compile(
    r"^(?:after|once|before) (?:I|we|we've|I've|\w+ing)\b.+?(?:, | (?=(?:I|we) ))", re.IGNORECASE
)
_AS_SAID: Final = {
    "pull out": "move over", "safe gap": "safe way", "are left to": "remain to", "moved": "move", "changed": "change",
    "get past": "overtake", "go by": "overtake", "passed": "pass",
}  # fmt: skip
"""Phrases of explanations that no passenger uses -> a passenger's phrase."""
_SAID: Final = _any(*_AS_SAID)
_LOOKS: Final = _any(
    r"is[ _]safe[ _]enter", r"(?:when|once|if|until|as soon as|whenever|provided|only|upon|while|after)\b.{0,40}"
    r"\b(?:safe|safely|clear|free|vacant|nobody|no one|nothing comes)",
    r"safe (?:gap|moment|opening)", r"sufficient gap", r"(?:gap|it|space) (?:opens(?: up)?|is available)",
    r"(?:check|verify|verifying|make sure|ensure|look(?:ing)?|checked|checking)\b.{0,50}"
    r"\b(?:safe|clear|free|lanes?|nobody|no one|traffic|vehicles|way|sides?|gap|ways)",
    r"nobody (?:there )?(?:is coming|has to brake|comes)", r"no one is", r"traffic has gone", r"is safe",
    r"there's (?:space|room)",
    r"no traffic from", r"give way", r"yields? to", r"wait for (?:a|safety|those lanes|the traffic)", r"when safe",
    r"if safe",
)  # fmt: skip
_NO_LOOK: Final = _any("no need", "skip", "not check", "no waiting", "known to be", "limit", "without checking")
_NOTHING: Final = _any(
    r"chang(?:e|ing) nothing", r"nothing (?:else |about |needs|has|but)\b.*", r"no (?:action|change|manoeuvre)s?",
    r"unchanged", r"untouched", r"left alone", r"leave everything", r"(?<!soon )as (?:it|they) (?:is|are)",
    r"the way it is",
    r"same (?:lane|speed)(?! as)", r"do nothing", r"where we are", r"keep the present", r"leave the target speed",
    r"stay in (?:the|this|our) lane", r"keep (?:the |this |our )?lane", r"remain in the present lane",
)  # fmt: skip
_TOPICS: Final = {"lane": _any("lanes?", "where we are"), "speed": _any("speed", "pace"), "gap": _any("headway", "gap")}
_EXACT: Final = frozenset({"to", "at", "exactly", "speed", "target", "be", "is"})
_STEP: Final = frozenset({"more", "less", "faster", "slower", "higher", "lower", "above", "below", "off"})
_DENIED: Final = re.compile(r"\bnot\b(?!.*\b(?:above|exceed|over|more|faster)\b)|\bwithin\b", re.IGNORECASE)
"""Words beside which a number is no deed, or a time limit."""
_LASTING: Final = _any("remain", "keeps? standing", "stay there", "stays there", "for good")
_VAGUE: Final = _any("few", "couple", "several", "some")
_CLOSER: Final = _any(r"clos(?:e|er|ing)", "reduce", "shrink", "tighten", "shorten", "shorter", "smaller", "less")
_WIDER: Final = _any("open", "grow", "increase", "back", "wider", "more", "larger", "longer")
_SLOWER: Final = _any("lower", r"slow\w*", "brake", "ease", "reduce", r"decelerat(?:e|ing)", "down", "drop")
_REASON: Final = re.compile(
    r",? \b(?:because|since|so that|so it|in order to|to (?:avoid|save))\b.*$|\([^()]*\)",
    re.IGNORECASE,
)
_ELSE: Final = re.compile(r"\b(?:if|unless|otherwise|else|as long as|until)\b", re.IGNORECASE)
_BACK: Final = _any(r"back", "return", "original lane", "where we were")
_OTHERS_SPEED: Final = _any(r"than (?!now|before|the (?:current|present)|our)", r"lead's")
"""Speeds of others, and bounds: they tell no way in which the own speed changes."""
_TWO_OR_MORE: Final = {"two": 2, "three": 3, "four": 4}
_SURE: Final = 0.15
"""A reading less sure claims nothing, and what it may have been about is not called untold."""
_SIDES: Final = {"left": -1, "right": 1}
_SIDE: Final = re.compile(r"\b(left|right)(?=most|wards?\b|-hand|\b)")
_LANE_COUNT: Final = re.compile(r"\b(two|three|four) lanes\b|\blanes? (two|three) (?:away|over)\b", re.IGNORECASE)


@lru_cache(maxsize=64)
def claims_of(text: str, *, crossing: bool = False) -> tuple[Claim, ...]:
    """All claims of a text, in its order.

    Args:
        text: What the planner gives as its thoughts.
        crossing: Whether the way leads over an intersection: going left is a turn there, not a change of lanes.
    """
    found: list[Claim] = []
    for place, (sentence, clauses) in enumerate(_sentences(text[:_MAX_CHARS])):
        for index, (clause, mood) in enumerate(clauses):
            order = float(100 * place + index)
            opener = clause.partition(" ")[0].lower()
            if index and opener in ("after", "once") and not _THEN.match(clause):
                order -= 1.5  # "B after A"
            elif not index and len(clauses) > 1 and opener == "before":
                order += len(clauses) + 0.5  # "before B, A"
            told = _FIRST_OR_LATER.search(sentence) is not None
            base = Claim("stay", sentence, order, firm=mood == "plan", aside=mood == "aside", told=told)
            found += _claims(clause, base, mood, crossing=crossing)
    return tuple(found)


def plain_words(text: str) -> str:
    """The text without its asides."""
    return " ".join(clause for _, clauses in _sentences(text) for clause, mood in clauses if mood != "aside")


def _sentences(text: str) -> Iterator[tuple[str, list[tuple[str, Mood]]]]:
    """Sentences as written, with their clauses and what each is."""
    text = _LISTED.sub("\nnext, ", _THINKING.sub(" ", text))
    end = 0
    for quoted in [*_QUOTED.finditer(text), None]:
        for sentence in _SENTENCES.split(text[end : quoted.start() if quoted else len(text)]):
            if re.search(r"\w", sentence):
                clauses: list[tuple[str, Mood]] = []
                first = _SUBORDINATE.match(sentence)
                heads = [] if first is None else [first[0]]
                parts = (*heads, *_CLAUSES.split(sentence[len("".join(heads)) :]))
                for clause in (part.strip(" .,!") for part in parts):
                    before: Mood = clauses[-1][1] if clauses else "plan"
                    if re.search(r"\w", clause):
                        clauses.append((clause, _mood(clause, before)))
                yield sentence.strip(), clauses
        if quoted:
            yield quoted[1], [(quoted[1], "wish")]
            end = quoted.end()


def _mood(clause: str, before: Mood) -> Mood:
    if "?" in clause or _THOUGHT.search(clause):
        return "aside"
    if _ASKED.search(clause):
        return "wish"
    if _STATE.search(clause):
        return "aside"
    return "plan" if before == "aside" or _OURS.search(clause) else before


def _claims(clause: str, base: Claim, mood: Mood, *, crossing: bool) -> Iterator[Claim]:
    if mood == "plan" and not _DENIED.search(clause):
        yield from _numbers(clause, base)
    if clause.lower().startswith("until "):
        return
    if _LOOKS.search(clause) and not _NO_LOOK.search(clause):
        yield replace(base, matter="check")
    clause = _REASON.sub("", clause) or clause
    if _NOTHING.search(clause):
        if _ELSE.search(clause):
            return
        yield replace(base, about=frozenset(name for name, words in _TOPICS.items() if words.search(clause)))
        return
    spoken = _imperative(clause)
    acts, sure = _acts(spoken)
    if sure < _SURE:
        base = replace(base, firm=False, aside=True, unsure=mood == "plan")
    for act in acts:
        if (claim := _claim(act, spoken[slice(*(act.span or (0, 0)))], clause, base, crossing=crossing)) is not None:
            yield claim
        waited = act.when.ref if act.when is not None and act.when.event in ("gone", "passed") else None
        if waited is not None and waited.kind in ("traffic", "vehicles"):
            yield replace(base, matter="check")


@lru_cache(maxsize=512)
def _acts(text: str) -> tuple[tuple[Act, ...], float]:
    found = read(text)
    return found.acts or found.opinion, found.sure


def _imperative(clause: str) -> str:
    """A clause as it would be said to a driver: "I will slow down" is "slow down"."""
    while (lead := _LEAD.match(clause)) is not None and lead.end() < len(clause):
        clause = clause[lead.end() :]
    clause = _SAID.sub(lambda found: _AS_SAID[found[0].lower()], clause.replace("_", " "))
    return f"{clause[:1].upper()}{clause[1:]}."


def _numbers(clause: str, base: Claim) -> Iterator[Claim]:
    """Numbers with units; each has to be one of the program's, or of where the ego is."""
    tokens, quantities = mark_quantities(tokens_of(clause.replace("_", " ").replace("(", " , ").replace(")", " , ")))
    for index, token in enumerate(tokens):
        if token.startswith("#"):
            quantity = quantities[int(token[1:])]
            if quantity.dimension in ("speed", "distance", "time", "share") and not _VAGUE.search(quantity.said):
                exact = tokens[max(0, index - 1) : index] != [] and tokens[index - 1] in _EXACT
                exact = exact and tokens[index + 1 : index + 2] not in [[one] for one in _STEP]
                yield replace(base, matter="number", quantity=quantity, exact=exact)


def _claim(act: Act, words: str, clause: str, base: Claim, *, crossing: bool) -> Claim | None:
    base = replace(base, denied=act.negated)
    back = act.to == "original" or (act.act in ("turn", "u_turn") and _BACK.search(clause) is not None)
    said = (act.side or (act.to or "").removesuffix("most"), *(() if back else _SIDE.findall(words.lower())))
    sides = frozenset(_SIDES[side] for side in said if side in _SIDES)
    match act.act:
        case "go" if act.style is None:
            return replace(base, matter="go")
        case "straight" if "straight" in clause.lower():
            return replace(base, matter="turn", sides=frozenset({0})) if crossing else None
        case "turn" | "lane" | "u_turn" if back and not crossing:
            return replace(base, matter="back", sides=sides)
        case "u_turn":
            return replace(base, matter="turn", sides=frozenset({2}))
        case "turn" | "lane" | "move" | "exit" | "enter" if crossing:
            return replace(base, matter="turn", sides=sides) if sides else None
        case "turn" | "lane" | "move":
            count = _LANE_COUNT.search(clause)
            lanes = 0 if count is None else _TWO_OR_MORE[(count[1] or count[2]).lower()]
            return replace(base, matter="lane", sides=sides, count=lanes)
        case "pass":
            return replace(base, matter="overtake", sides=sides)
        case "keep" if not sides:
            return replace(base, about=frozenset({"lane"}), denied=False, firm=base.firm and not act.negated)
        case "keep":
            return replace(base, matter="lane", sides=sides, firm=False)
        case "stop" | "park":
            return replace(base, matter="stop", lasting=_LASTING.search(clause) is not None)
        case "pull_over":
            return replace(base, matter="pull over", sides=sides)
        case "speed":
            sign = {"faster": 1, "more": 1, "slower": -1, "less": -1}.get(act.direction or "", 0)
            sign = 0 if act.style is not None else sign
            limit = act.aim == "limit" or (act.direction is None and act.value is None and "limit" in clause.lower())
            if act.measure in ("over_limit", "under_limit"):
                return replace(base, matter="speed", at_limit=True, sign=1 if act.measure == "over_limit" else -1)
            if act.direction == "same":
                return replace(base, about=frozenset({"speed"}))
            if act.negated or act.measure in ("at_most", "at_least") or _OTHERS_SPEED.search(clause):
                sign, base = 0, replace(base, denied=False)
            says = base.firm and bool(sign or limit or act.unit or act.aim)
            return replace(base, matter="speed", sign=0 if limit else sign, at_limit=limit, firm=says)
        case "gap":
            sign = {"more": 1, "slower": 1, "less": -1, "faster": -1}.get(act.direction or "", 0)
            sign = 0 if act.when is not None else sign or _sign(clause, _WIDER, _CLOSER)
            return replace(base, matter="gap", sign=0 if act.negated else sign)
        case _:
            return None


def _sign(clause: str, more: re.Pattern[str], less: re.Pattern[str]) -> int:
    """Direction of a change by the words of a clause, where the reader has only its number."""
    return bool(more.search(clause)) - bool(less.search(clause))
