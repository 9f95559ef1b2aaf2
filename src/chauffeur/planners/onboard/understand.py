"""From words to meaning. Deterministic: the same words always mean the same.

The wish is cut into clauses; each clause's cues are weighed into at most a few meanings; neighbouring meanings that are
means and end, reason and wish, or part and whole are fused. What stays contradictory or thin is not guessed at.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from chauffeur.planners.onboard.clauses import Clause, clauses_of
from chauffeur.planners.onboard.doubts import doubt_before, doubt_without_meaning, is_question
from chauffeur.planners.onboard.fusion import fuse
from chauffeur.planners.onboard.meaning import Meaning, NotUnderstood, Reading
from chauffeur.planners.onboard.weigh import meanings_of

MAX_CHARS = 1000
"""Longest wish that is read; spoken wishes are a tenth of it."""

MAX_STEPS = 3


@lru_cache(maxsize=32)  # the draft and the guard of one plan ask about the same words
def understand(text: str) -> Reading | NotUnderstood:
    """Meaning of a wish, or why it has none for us. Never raises."""
    doubt = doubt_before(text, MAX_CHARS)
    if doubt is not None:
        return doubt
    clauses = _gathered(clauses_of(text))
    found: list[Meaning] = []
    hard: list[bool] = []
    for clause in clauses:
        for index, meaning in enumerate(meanings_of(clause)):
            found.append(meaning)
            hard.append(clause.hard and index == 0 and len(found) > 1)
    if not found:
        return doubt_without_meaning(text, clauses)
    if is_question(text, found):
        return NotUnderstood("question", _ask_back(found[0]))
    fused = fuse(found, hard)
    if isinstance(fused, NotUnderstood):
        return fused
    if _thin(clauses, fused):
        return NotUnderstood("ambiguous", _ask_back(fused[0]))
    if len(fused) > MAX_STEPS:
        return NotUnderstood("ambiguous", "That is a lot at once. Please tell me the first two or three things only.")
    return Reading(tuple(fused))


def meanings_said(text: str) -> tuple[Meaning, ...]:
    """What the rules find in a wish; nothing where they do not understand it."""
    reading = understand(text)
    return () if isinstance(reading, NotUnderstood) else reading.steps


def _gathered(clauses: list[Clause]) -> list[Clause]:
    """Clauses that say nothing alone ("at the crossroad", "by 15 metres") joined to the neighbour they belong to."""
    out: list[Clause] = []
    waiting: Clause | None = None
    for clause in clauses:
        complete = bool(meanings_of(clause))
        if not complete and out and clause.quantities and not out[-1].quantities and waiting is None:
            out[-1] = _joined(out[-1], clause)
            continue
        if waiting is not None:
            clause = _joined(waiting, clause)  # noqa: PLW2901 - the clause and what waited for it are one
            waiting = None
            complete = bool(meanings_of(clause))
        if complete:
            out.append(clause)
        else:
            waiting = clause
    if waiting is not None:
        if out:
            joined = _joined(out[-1], waiting)
            out[-1] = joined if meanings_of(joined) else out[-1]
        else:
            out.append(waiting)
    return out


def _joined(a: Clause, b: Clause) -> Clause:
    shift = len(a.text) + 3
    return Clause(
        f"{a.text} , {b.text}",
        a.evidence + [replace(e, start=e.start + shift, end=e.end + shift) for e in b.evidence],
        a.quantities + [(at + shift, q) for at, q in b.quantities],
        a.hard or b.hard,
        a.unknown + b.unknown,
    )


def _thin(clauses: list[Clause], fused: list[Meaning]) -> bool:
    """Whether a weak cue stands among words we know nothing of: then the wish may be about something else."""
    strongest = max(meaning.score for meaning in fused)
    unknown = min((len(c.unknown) for c in clauses if meanings_of(c)), default=0)
    return unknown >= (4 if strongest < 1.0 else 6)


def _ask_back(meaning: Meaning) -> str:
    what = {
        "speed.increase": "Shall I drive faster?",
        "speed.decrease": "Shall I slow down?",
        "gap.increase": "Shall I leave more room to the vehicle ahead?",
        "gap.decrease": "Shall I close up to the vehicle ahead?",
        "overtake": "Shall I overtake the vehicle ahead?",
        "overtake.left": "Shall I overtake on the left?",
        "overtake.right": "Shall I overtake on the right?",
        "pull_over": "Shall I pull over?",
        "stop": "Shall I stop?",
        "style.hurry": "Are you in a hurry: shall I drive faster?",
        "style.relax": "Shall I drive more slowly and leave more room?",
        "style.comfort": "Shall I drive more gently?",
        "style.careful": "Shall I drive more carefully?",
    }.get(meaning.family, f"Do you want this: {meaning.family.replace('.', ' ')}?")
    return f"I am not sure what you want. {what} Please say it as a wish."
