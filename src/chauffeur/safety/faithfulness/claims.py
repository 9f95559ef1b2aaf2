"""What a text claims of the program: its clauses as claims of a fixed form.

A claim is firm where the text says what is done, and loose where it only repeats what somebody wished. Only firm ones
have to be kept; loose ones are held against the program where nothing firm is said of the same matter.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from chauffeur.safety.faithfulness import lexicon as words
from chauffeur.safety.faithfulness.amounts import gaps, speeds, waits
from chauffeur.safety.faithfulness.claim import Claim
from chauffeur.safety.faithfulness.clauses import ExplainedClause, clauses_of
from chauffeur.safety.faithfulness.conditions import conditions, looks, stays
from chauffeur.safety.faithfulness.motions import motions, sides_of


def claims_of(text: str, *, crossing: bool = False) -> tuple[Claim, ...]:
    """All claims of a text, in its order.

    Args:
        text: What the planner gives as its thoughts.
        crossing: Whether the way leads over an intersection: going left is a turn there, not a change of lanes.
    """
    clauses = clauses_of(text)
    found: list[Claim] = []
    for index, clause in enumerate(clauses):
        following = clauses[index + 1] if index + 1 < len(clauses) else clause
        if clause.mood == "condition" and following.place == clause.place and "autopilot" in following.words[:2]:
            continue  # what the autopilot does in any case
        beside = [
            one for one in clauses[max(0, index - 1) : index + 2] if one is not clause and one.place == clause.place
        ]
        conditional = clause.opener in ("else", "or else") or clause.says("in which case")
        conditional = conditional or any(one.mood == "condition" and one.opener in _LASTING for one in beside)
        for claim in _claims(clause, crossing=crossing):
            if not (conditional and claim.matter in ("stay", "nothing")):
                found.append(_ordered(claim, clause, clauses, index))
    return tuple(found)


_LASTING: Final = frozenset({"as long as", "so long as", "until", "till", "unless", "if", "while", "when", "only if"})
"""Openers of what limits how long something is left as it is."""


def describes(text: str) -> bool:
    """Whether a text tells what is done, by whom or as a list of deeds; a mere label (`rule: lane.left`) does not."""
    deeds = words.MOVES | words.UP | words.DOWN | words.RAISE | words.LOWER | words.STOPS | words.KEEPS | words.LOOKS
    deeds |= words.OVERTAKES | words.PASSES | {"wait", "adapt", "match", "follow"}
    ours = words.OURSELVES - {"it"}
    return any(clause.mood == "plan" and (clause.has(ours) or clause.words[0] in deeds) for clause in clauses_of(text))


def _ordered(claim: Claim, clause: ExplainedClause, clauses: Sequence[ExplainedClause], index: int) -> Claim:
    """A claim with its place in time: what comes `after` a thing is told later than it, wherever it stands."""
    order = float(index)
    told = clause.opener in words.LATER | words.FIRST | {"once", "and then", "after that", "after this", "after which"}
    told = told or clause.has(words.LATER) or clause.has(words.FIRST)
    previous = clauses[index - 1] if index and clauses[index - 1].place == clause.place else None
    followed = index + 1 < len(clauses) and clauses[index + 1].place == clause.place
    # Where something follows, `after` tells the place of that, not of what stands before.
    told = told and not (followed and clause.opener in ("after", "once"))
    if previous is not None and previous.opener in ("after", "once"):
        told = True
    if clause.opener in ("after", "once", "when", "as soon as", "until") and not followed and previous is not None:
        order -= 1.5  # "B after A"
        told = True
    if clause.opener == "before":
        # "A before B" is in order as it stands; "before B, A" is not.
        order += 1.5 if followed and previous is None else 0.0
        told = True
    return replace(claim, order=order, told=told)


def _claims(clause: ExplainedClause, *, crossing: bool) -> Iterator[Claim]:
    if clause.mood in ("state", "thought"):
        return
    base = Claim("nothing", clause.sentence, 0.0, firm=clause.mood != "wish", denied=clause.negated)
    if clause.mood == "reason":
        mentioned = replace(base, firm=False, aside=True)
        yield from motions(clause, mentioned, sides_of(clause), crossing=crossing)
        yield from speeds(clause, mentioned)
        yield from gaps(clause, mentioned)
        return
    if clause.mood == "condition" or clause.opener == "unless":
        yield from conditions(clause, base, crossing=crossing)
        return
    check = looks(clause)
    if check and clause.mood == "plan" and not clause.negated:
        yield replace(base, matter="check", sides=sides_of(clause))
        yield replace(base, matter="lane", sides=sides_of(clause), aside=True)
    sides = sides_of(clause)
    yield from motions(clause, base, sides, crossing=crossing, checking=check)
    yield from speeds(clause, base)
    yield from gaps(clause, base)
    yield from waits(clause, base)
    yield from stays(clause, base)
