"""What one clause asks for: its cues weighed into meanings, with polarity decided by how the clause is built."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from chauffeur.planners.onboard.amounts import amount_of
from chauffeur.planners.onboard.clauses import Clause, Evidence
from chauffeur.planners.onboard.meaning import BIT, MUCH, PLAIN, Change, Dimension, Manoeuvre, Meaning, Side

_BIT = re.compile(
    r"\b(?:bit|a little|slightly|tad|touch|somewhat|smidgen?|hair|marginally|fraction|notch|kind of|sort of|a wee)\b"
)
_MUCH = re.compile(
    r"\b(?:much|a lot|lots|way|far (?=more|less|too|faster|slower|closer)|considerably|significantly|substantially"
    r"|drastically|extremely|massively|hugely|dramatically|really|a great deal|very|ridiculously|seriously|tons"
    r"|loads)\b"
)
_GENTLE = re.compile(
    r"\b(?:gently|gradually|smoothly|softly|slowly|carefully|safely|cautiously|nice and easy|gentle)\b"
)
_SWIFT = re.compile(r"\b(?:swift|quickly|fast|quick|rapidly|hurry|promptly|hard)\b")
_TOO = re.compile(
    r"\b(?:too|overly|excessively|awfully|terribly|ridiculously|painfully|insanely|dangerously|so|this|that|such"
    r"|such a)(?: (?:damn|darn|freaking|bloody|very|much))? $"
)
_MERE_BOUND = re.compile(r"\b(?:not too|without(?: being| going| driving)?(?: too)?) $")
_STATEMENT = re.compile(
    r"\b(?:you|we|i|it|this|that|they|he|she|car|vehicle|truck|driving|speed|pace|ride|there|gap|distance|everything)\b"
    r"(?: \w+){0,2}? (?:am|is|are|was|were|have|has|feels?|seems?|looks?|drive|drives|driving|going|keep|follow)\b"
)
_WISH = re.compile(r"\b(?:should|could|can|would|want|wish|need|like to|prefer|lets|better|may|might)\b")
_COMPLAINT = re.compile(
    r"\b(?:complain|why|hate|how come|tired of|fed up|sick of|have to|must (?:you|we)|stop being)\b"
    r"|^(?:do|does|must) (?:you|we|it)\b"
)
_BE_NOT = re.compile(r"\b(?:are|is|am|were|was) not(?: (?:driving|going|moving|really|exactly|very))* $")
_HOLD = re.compile(r"\b(?:keep|maintain|hold|stay|remain|stick|retain|preserve|continue|sustain)\w*\b")
_GAP_WORDS = re.compile(
    r"\b(?:behind|following|back|away|from|closer|headway|gap|distance|between|ahead|follow|within)\b"
)
_LEAVE = re.compile(r"\b(?:leave|leaving|allow)\b")
_KEEP_IT = re.compile(
    r"\b(?:keep|leave|leaving|allow|give|hold|maintain)(?: (?:a|an|about|at least|around|some|me))* #"
)
"""Verbs of keeping with a quantity as their object: "keep 4 car lengths"."""
_SPEED_WORDS = re.compile(
    r"\b(?:do|doing|go|going|drive|driving|hit|run|cruise|cruising|speed|at|faster|slower|hold|keep|travel)\b"
)
_TOO_MUCH = re.compile(r"\btoo much\b")
_TOO_LITTLE = re.compile(r"\b(?:too little|not (?:\w+ )?enough|not much|no)\b")
_SPEED_DIMS: tuple[Dimension, ...] = ("speed", "share", "bare")
_GAP_DIMS: tuple[Dimension, ...] = ("distance", "time", "share", "bare")
_BIG: frozenset[Manoeuvre] = frozenset({"lane", "overtake", "turn", "pull_over", "stop", "follow", "yield"})


def meanings_of(clause: Clause) -> list[Meaning]:
    """Everything the clause asks for, in its order; empty when it says nothing complete alone."""
    out: list[Meaning] = []
    for meaning in (*_acts(clause), *_pairs(clause), *_states(clause)):
        _put(out, meaning)
    for meaning in _quantities_alone(clause, out):
        _put(out, meaning)
    _sides(clause, out)
    big = any(m.manoeuvre in _BIG or (m.manoeuvre in ("speed", "gap") and m.score >= 1.2) for m in out)
    for meaning in _styles(clause):
        if not big:
            _put(out, meaning)
    if not out:
        out = [_meaning(clause, e) for e in clause.evidence if e.cue.kind in ("keep", "resume") and not e.negated][:1]
    manner = "gentle" if _GENTLE.search(clause.text) else "swift" if _SWIFT.search(clause.text) else ""
    if re.search(r"\b(?:late|hurry|rush|urgent)\w*\b", clause.text) and big:
        manner = "swift"
    condition = "safe" if "whensafe" in clause.text else "intersection" if "junction" in clause.text else ""
    return [replace(m, manner=m.manner or manner, condition=condition) for m in out]


def _put(out: list[Meaning], new: Meaning) -> None:
    """Adds a meaning; one of the same manoeuvre is strengthened instead, the surer one giving direction and sign."""
    for index, old in enumerate(out):
        if old.manoeuvre != new.manoeuvre or (old.variant == "hold") != (new.variant == "hold"):
            continue
        first, second = (old, new) if old.score >= new.score else (new, old)
        out[index] = replace(
            first,
            amount=first.amount or second.amount,
            change=first.change or second.change,
            direction=first.direction or second.direction,
            variant=first.variant or second.variant,
            loose=first.loose and second.loose,
            evidence=old.evidence + new.evidence,
            score=old.score + new.score,
        )
        return
    out.append(new)


def degree_of(text: str) -> float:
    """Strength in words of a clause."""
    if _BIT.search(text):
        return BIT
    return MUCH if _MUCH.search(text) else PLAIN


def _meaning(clause: Clause, e: Evidence, **changes: object) -> Meaning:
    base = Meaning(
        e.cue.manoeuvre,
        direction=e.side,
        change=e.cue.change,
        degree=degree_of(clause.text),
        variant=e.cue.variant,
        loose=e.cue.loose,
        evidence=(e.words,),
        score=e.cue.weight,
    )
    return replace(base, **changes)  # type: ignore[arg-type]


def _acts(clause: Clause) -> Iterator[Meaning]:
    for e in clause.evidence:
        if e.cue.kind != "act":
            continue
        manoeuvre = e.cue.manoeuvre
        if manoeuvre == "speed":
            yield _speed_act(clause, e)
        elif manoeuvre == "gap":
            yield _changed(clause, e, "gap", e.cue.change, verb=True)
        elif manoeuvre == "follow":
            found = None if e.negated else amount_of(clause, ("distance", "time"), 0, verb=False)
            if found is not None:
                yield _meaning(clause, e, manoeuvre="gap", amount=found[0], change=found[1])
            elif not e.negated:
                yield _meaning(clause, e)
        elif manoeuvre == "overtake":
            yield _overtake(clause, e)
        elif manoeuvre == "lane":
            yield from _lane(clause, e)
        elif manoeuvre == "turn":
            variant = "not" if e.negated and e.side in ("left", "right") else ""
            yield _meaning(clause, e, variant=variant)
        elif e.negated:  # no pulling over, no stop, no letting in: go on as before
            yield _meaning(clause, e, manoeuvre="gap" if manoeuvre == "yield" else "resume", variant="hold")
        else:
            yield _meaning(clause, e)


def _speed_act(clause: Clause, e: Evidence) -> Meaning:
    variant = e.cue.variant
    if variant == "much":
        return _meaning(clause, e, variant="hold" if e.negated else "", change=0 if e.negated else 1, degree=MUCH)
    if variant == "limit":
        found = amount_of(clause, ("speed", "bare"), 0, verb=False)
        over = found[0] if found is not None and found[0].frame == "over_limit" else None
        return _meaning(clause, e, amount=over, change=0)
    if variant == "max":
        return _meaning(clause, e, change=-1 if e.negated else 1, variant="" if e.negated else "max")
    if variant == "match":
        return _meaning(clause, e)
    return _changed(clause, e, "speed", e.cue.change, verb=True)


def _changed(clause: Clause, e: Evidence, what: Manoeuvre, change: Change, *, verb: bool) -> Meaning:
    """A change of speed or gap with its amount; negated, it holds what is, unless a bound was named."""
    found = amount_of(clause, _SPEED_DIMS if what == "speed" else _GAP_DIMS, change, verb=verb)
    if found is not None:
        amount, sign = found
        if not e.negated or amount.bound != "exact":
            return _meaning(clause, e, manoeuvre=what, amount=amount, change=sign or change, variant="")
    if e.negated:
        return _meaning(clause, e, manoeuvre=what, change=0, variant="hold")
    return _meaning(clause, e, manoeuvre=what, change=change, variant="")


def _overtake(clause: Clause, e: Evidence) -> Meaning:
    if e.negated:
        return _meaning(clause, e, manoeuvre="follow", variant="no overtaking")
    sides = {o.side for o in clause.evidence if o.side in ("left", "right") and not o.negated}
    return _meaning(clause, e, direction=sides.pop() if len(sides) == 1 else None)


def _lane(clause: Clause, e: Evidence) -> Iterator[Meaning]:
    held = [q for _, q in clause.quantities if q.dimension == "lanes"]
    if e.cue.variant == "hold":
        yield _meaning(clause, e, variant="hold")
    elif e.negated:
        yield _meaning(clause, e, variant="hold", direction=None)
    else:
        variant = e.cue.variant or ("edge" if "edge" in e.words else "")
        found = amount_of(clause, ("lanes",), 0, verb=False) if held else None
        yield _meaning(clause, e, variant=variant, amount=found[0] if found else None)


def _pairs(clause: Clause) -> Iterator[Meaning]:
    """A direction of change with the noun it changes ("increase ... the gap"), and nouns with an amount or held."""
    nouns = [e for e in clause.evidence if e.cue.kind == "noun"]
    for e in clause.evidence:
        if e.cue.kind != "verb":
            continue
        what = _noun_for(e, nouns, clause)
        if what is not None:
            yield replace(_changed(clause, e, what, e.cue.change, verb=True), score=1.2)
    for e in clause.evidence:
        if e.cue.kind == "adj" and nouns:
            what = min(nouns, key=lambda noun: abs(noun.start - e.start)).cue.manoeuvre
            change = _state_change(e, clause)
            if change:
                yield _changed(clause, replace(e, negated=False), what, change, verb=False)
    for noun in nouns:
        what = noun.cue.manoeuvre
        found = amount_of(clause, _SPEED_DIMS if what == "speed" else _GAP_DIMS, 0, verb=False)
        if found is not None:
            yield _meaning(clause, noun, amount=found[0], change=found[1], score=1.0)
        elif noun.cue.weight >= 0.5:
            yield from _bare_noun(clause, noun, what)


def _bare_noun(clause: Clause, noun: Evidence, what: Manoeuvre) -> Iterator[Meaning]:
    before = clause.text[: noun.start]
    changes = any(e.cue.kind in ("verb", "adj", "act") for e in clause.evidence)
    if _TOO_MUCH.search(before):
        yield _meaning(clause, noun, change=-1, score=1.0)
    elif _TOO_LITTLE.search(before):
        yield _meaning(clause, noun, change=1, score=1.0)
    elif not changes and _HOLD.search(before):
        yield _meaning(clause, noun, manoeuvre=what, variant="hold", score=0.9)


def _noun_for(verb: Evidence, nouns: list[Evidence], clause: Clause) -> Manoeuvre | None:
    strong = [noun for noun in nouns if noun.cue.weight >= 0.5] or nouns
    after = [noun for noun in strong if noun.start > verb.start]
    if after or strong:
        return min(after or strong, key=lambda noun: abs(noun.start - verb.start)).cue.manoeuvre
    dimensions = {q.dimension for _, q in clause.quantities}
    if "speed" in dimensions:
        return "speed"
    if dimensions & {"distance"} or ("time" in dimensions and _GAP_WORDS.search(clause.text)):
        return "gap"
    return None


def _states(clause: Clause) -> Iterator[Meaning]:
    nouns = any(e.cue.kind == "noun" and e.cue.weight >= 0.5 for e in clause.evidence)
    acts = any(e.cue.kind == "act" or (e.cue.kind == "verb" and nouns) for e in clause.evidence)
    for e in clause.evidence:
        if e.cue.kind != "state" or e.cue.manoeuvre == "style":
            continue
        adverb = e.words.endswith("ly") or e.words in ("fast", "quick")
        if adverb and acts and not _TOO.search(clause.text[: e.start]):
            continue  # says how the act is to be done, not what is wanted
        change = _state_change(e, clause)
        found = amount_of(clause, _SPEED_DIMS if e.cue.manoeuvre == "speed" else _GAP_DIMS, change, verb=False)
        if found is not None and (found[0].frame != "factor" or change):
            yield _meaning(clause, e, change=found[1] or change, amount=found[0])
        else:
            bounded = e.negated and _MERE_BOUND.search(clause.text[: e.start]) is not None
            yield _meaning(clause, e, change=change, variant="bounded" if bounded else "" if change else "hold")


def _state_change(e: Evidence, clause: Clause) -> Change:
    """Change wanted by somebody who names a state: a complaint wants the opposite, a wish the state itself."""
    state = e.cue.change
    opposite: Change = -1 if state > 0 else 1
    before, after = clause.text[: e.start], clause.text[e.end :]
    if after.startswith(" enough"):
        return state if e.negated else 0
    if before.endswith("less ") and not e.negated:
        return opposite
    if e.negated:
        return state if _BE_NOT.search(before) and not _TOO.search(before) else opposite
    others = [o.end for o in clause.evidence if o.end <= e.start and o.cue.kind in ("act", "style")]
    near = before[max(others, default=0) :].rpartition("please ")[2]
    said = [m.end() for m in _STATEMENT.finditer(near)]
    stated = bool(said) and not _WISH.search(near)
    return opposite if _TOO.search(before) or _COMPLAINT.search(before) or stated else state


def _styles(clause: Clause) -> Iterator[Meaning]:
    for e in clause.evidence:
        if e.cue.manoeuvre != "style":
            continue
        if e.cue.kind == "state":
            change = _state_change(e, clause)
            yield _meaning(clause, e, variant="sporty" if change > 0 else "careful", change=0)
        elif e.negated:
            flipped = {"hurry": "relax", "relax": "hurry", "sporty": "careful", "eco": ""}.get(
                e.cue.variant, e.cue.variant
            )
            if flipped:
                yield _meaning(clause, e, variant=flipped)
        else:
            yield _meaning(clause, e)


def _quantities_alone(clause: Clause, out: list[Meaning]) -> Iterator[Meaning]:
    """A speed is a wish by itself, a distance beside words of following, a bare number beside words of driving."""
    if any(m.amount is not None for m in out):
        return
    big = any(m.manoeuvre not in ("speed", "gap", "follow") for m in out)
    near = not big and (_GAP_WORDS.search(clause.text) or _KEEP_IT.search(clause.text)) is not None
    dimensions: tuple[tuple[Manoeuvre, Dimension, bool], ...] = (
        ("speed", "speed", True),
        ("gap", "distance", near),
        ("gap", "time", near or (not big and _LEAVE.search(clause.text) is not None)),
        ("speed", "bare", _SPEED_WORDS.search(clause.text) is not None and not out),
    )
    for what, dimension, fits in dimensions:
        found = amount_of(clause, (dimension,), 0, verb=False, factors=False) if fits else None
        if found is not None:
            yield Meaning(what, amount=found[0], change=found[1], evidence=(found[0].said,), score=1.0)
            return


def _sides(clause: Clause, out: list[Meaning]) -> None:
    """Left and right that stand alone, and lane moves at a junction, which are turns."""
    junction = any(e.cue.kind == "place" for e in clause.evidence)
    for index, meaning in enumerate(out):
        if junction and meaning.manoeuvre == "lane" and meaning.loose and meaning.variant != "hold":
            out[index] = replace(meaning, manoeuvre="turn", loose=False)
    alone = [e for e in clause.evidence if e.cue.kind == "side"]
    if not alone or out:
        return
    side: Side | None = alone[0].side
    direction = re.search(r"\b(?:direction|way|path|course|route|heading)\b", clause.text) is not None
    if junction:
        variant = "not" if alone[0].negated else ""
        out.append(_meaning(clause, alone[0], direction=side, variant=variant, score=1.2))
    elif direction or len(re.findall(r"[a-z]+", clause.text)) <= 6:
        if alone[0].negated:
            out.append(_meaning(clause, alone[0], variant="not", score=0.5))
        else:
            out.append(_meaning(clause, alone[0], manoeuvre="lane", loose=True, score=0.8))
