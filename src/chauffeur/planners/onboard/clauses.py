"""From a sentence to clauses with their evidence: where one wish ends, what is negated, which quantity is where."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from chauffeur.language.quantities import Quantity, mark_quantities
from chauffeur.language.tokens import tokens_of
from chauffeur.planners.onboard.cues import CUES, Cue
from chauffeur.planners.onboard.lexicon import FILLERS, rewrite
from chauffeur.planners.onboard.meaning import Side

_BREAK = re.compile(
    r"(?P<hard>[.;!?]|\b(?:and then|then|after that|afterwards?|followed by"
    r"|next(?= (?:turn|change|pull|overtake)))\b)\s*"
    r"|(?P<soft>,|\b(?:and|but|because|since|so that|so(?= (?:please|go|speed up|drive|can|could|do|i|we|you|he))|"
    r"although|though|while|until|just|instead(?! of)|rather(?! (?:slow|fast|close|far|than|not)))\b)\s*"
)
_NEGATOR = re.compile(
    r"\b(?:not|never|no|nor|neither|without|avoid|refrain from|rather than|instead of|no need|enough with|enough of"
    r"|(?:stop|quit|cease|less of)(?= (?:\w+ )?(?:being|going|driving|following|moving|making|doing|\w+ing)\b))\b"
)
_LONE_STOP = re.compile(r"\bstop (?:driving|moving|rolling)(?= ?$)")
_AFTER = re.compile(r"^(?:after|once|as soon as) (?P<first>[^,]+?) ?, (?P<second>.+)$")
_THEN_AFTER = re.compile(
    r"^(?P<second>.+?) (?:after|once) (?P<first>(?:you|we|passing|overtaking|turning|changing|that|i) .+)$"
)
_BEFORE = re.compile(
    r"^(?P<first>.+?) before (?P<second>(?:you |we )?(?:turn|chang|overtak|pass|pull|stop|merg|speed|slow)\w* ?.*)$"
)
_MARK = re.compile(r"#(\d+)")
_MASK = "~"


@dataclass(frozen=True, slots=True)
class Evidence:
    """A cue found.

    Attributes:
        cue: Its row.
        start, end: Where in the clause.
        words: The words.
        side: Left, right or straight, where the cue carries one.
        negated: Whether an odd number of negators governs it.
    """

    cue: Cue
    start: int
    end: int
    words: str
    side: Side | None
    negated: bool


@dataclass(slots=True)
class Clause:
    """A stretch of the wish that says one thing.

    Attributes:
        text: Its words, with `#k` for quantities.
        evidence: Cues in order of position.
        quantities: Quantities by position.
        hard: Whether it begins a new step ("then").
        unknown: Words that no cue and no filler explains.
    """

    text: str
    evidence: list[Evidence] = field(default_factory=list["Evidence"])
    quantities: list[tuple[int, Quantity]] = field(default_factory=list["tuple[int, Quantity]"])
    hard: bool = False
    unknown: tuple[str, ...] = ()


def clauses_of(text: str) -> list[Clause]:
    """Clauses of a wish in the order they are to be done."""
    marked, quantities = mark_quantities(tokens_of(text))
    line = rewrite(" ".join(marked))
    return [clause for part, hard in _parts(line) if (clause := read_clause(part, quantities, hard=hard)) is not None]


def _parts(line: str) -> list[tuple[str, bool]]:
    """Clause texts with whether each begins a step of its own, reordered where "after" or "before" turns them round."""
    parts: list[tuple[str, bool]] = []
    for sentence in map(str.rstrip, re.split(r"[.;!?]\s*", line)):
        for pattern in (_AFTER, _BEFORE, _THEN_AFTER):
            turned = pattern.match(sentence)
            if turned is not None:
                parts += [*_split(turned["first"]), (turned["second"], True)]
                break
        else:
            parts += _split(sentence)
    return parts


def _split(sentence: str) -> list[tuple[str, bool]]:
    out: list[tuple[str, bool]] = []
    hard, begin = True, 0
    for cut in _BREAK.finditer(sentence):
        piece = sentence[begin : cut.start()].strip()
        if piece:
            out.append((piece, hard))
            hard = False
        hard = hard or cut["hard"] is not None
        begin = cut.end()
    last = sentence[begin:].strip()
    if last:
        out.append((last, hard))
    return out


def read_clause(text: str, quantities: list[Quantity], *, hard: bool) -> Clause | None:
    """Evidence of one clause; None when it has no words."""
    if not re.search(r"[a-z#]", text):
        return None
    hits = [m for m in _NEGATOR.finditer(text) if not _LONE_STOP.match(text, m.start())]
    negators = [m.start() for m in hits]
    masked = text
    for hit in hits:
        if hit[0] in ("stop", "quit", "cease"):  # "stop tailgating" halts nothing
            masked = masked[: hit.start()] + _MASK * len(hit[0]) + masked[hit.end() :]
    found: list[Evidence] = []
    for cue in CUES:
        for match in cue.pattern.finditer(masked):
            if match.end() == match.start():
                continue
            found.append(_evidence(cue, match, text, negators))
        masked = cue.pattern.sub(lambda m: re.sub(r"[^ ]", _MASK, m[0]), masked)
    found.sort(key=lambda item: item.start)
    marks = [(m.start(), quantities[int(m[1])]) for m in _MARK.finditer(text)]
    unknown = tuple(
        word for word in re.findall(r"[a-z/]+", _MARK.sub(" ", masked)) if word not in FILLERS and len(word) > 1
    )
    return Clause(text, found, marks, hard, unknown)


def _evidence(cue: Cue, match: re.Match[str], text: str, negators: list[int]) -> Evidence:
    groups = match.groupdict()
    side = groups.get("side") or groups.get("side2") or cue.side
    start = match.start()
    # a negator that the cue itself contains is part of its meaning ("not feeling well") and negates nothing more
    negated = sum(1 for at in negators if at < start) % 2 == 1
    return Evidence(cue, start, match.end(), text[start : match.end()], _side(side), negated)


def _side(word: str | None) -> Side | None:
    if word == "left":
        return "left"
    if word == "right":
        return "right"
    return "straight" if word == "straight" else None
