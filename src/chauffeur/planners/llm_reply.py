"""Reading a model's reply: thoughts, and a program or a refusal, or what is wrong with it.

A reply is whatever a model or a broken proxy wrote. Nothing here raises, and every pattern runs in linear time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

from chauffeur.foreign.fences import fenced_blocks, without_blocks
from chauffeur.foreign.fields import says_nothing
from chauffeur.foreign.model_text import read_model_text
from chauffeur.planners.prompts.turns import REFUSED_BY_CHECKS

_REFUSE: Final = re.compile(r"^[ \t>*_#]*REFUSE[*_ \t]*:[*_ \t]{0,20}([^\n]{0,600})", re.MULTILINE)
_LABEL: Final = re.compile(r"\A[\s*_#]*Thoughts?[*_ \t]*:[*_ \t]*", re.IGNORECASE)
_THOUGHTS_CHARS: Final = 8_000
_ANSWER_CHARS: Final = 64_000
_REASON_CHARS: Final = 600


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply, split.

    Attributes:
        thoughts: R, without programs and labels.
        source: The program; None where there is none.
        refusal: The model's reason for declining; empty when it did not.
        problem: What is wrong, in words for the model's repair turn; empty when there is a program or a refusal.
    """

    thoughts: str
    source: str | None = None
    refusal: str = ""
    problem: str = ""


def read_reply(text: str, *, cut: bool = False) -> Reply:
    """Split a reply.

    A reply that was cut counts where every block that it opened is closed. A refusal beside a program counts, because
    the model does not stand by that program; an empty one (`REFUSE: N/A`) beside a program is a form filled in.

    Args:
        text: The reply as it came.
        cut: Whether it ended at a token or length limit instead of by the model's own will.
    """
    said = read_model_text(text, cut=cut)
    if said.unfinished:
        return Reply("", problem="the thoughts did not come to an end; think less and give the answer")
    from chauffeur.programs.extract import extract_program  # heavy with its package, and many readers need no program

    answer = said.answer[:_ANSWER_CHARS]
    found = extract_program(answer)
    program = found.source if found.source and found.source.strip() else None
    blocks = fenced_blocks(answer)
    prose = without_blocks(answer, blocks)
    reason = refusal_in(prose, beside=program is not None or found.several)
    if reason is not None:
        return Reply(tidy(prose), refusal=reason or "The model declined without giving a reason.")
    if said.cut and not (blocks and all(block.closed for block in blocks)):
        return Reply(tidy(prose), problem="the answer was cut off at its length limit; answer more briefly")
    if not answer.strip():
        return Reply("", problem="the answer was empty")
    if found.several:
        return Reply(tidy(prose), problem="the answer holds different programs; give the one that is meant")
    if program is None and REFUSED_BY_CHECKS in answer:  # small models repeat the repair turn
        return Reply("", problem="the answer repeats what the checks said; write the program itself")
    if program is None:
        return Reply(tidy(prose), problem="the answer holds no program; give it in one ```python block")
    return Reply(tidy(without_blocks(found.thoughts, fenced_blocks(found.thoughts))), source=program)


def refusal_in(prose: str, *, beside: bool) -> str | None:
    """The model's reason for declining, empty if it gives none; None if it does not decline.

    Args:
        prose: The answer without its blocks.
        beside: Whether there is a program.
    """
    told: str | None = None
    for line in _REFUSE.finditer(prose):
        reason = line[1].strip(" *_\t")
        if not reason:
            behind = next((one.strip(" *_\t>") for one in prose[line.end() :].split("\n") if one.strip(" *_\t>")), "")
            reason = "" if _LABEL.match(behind) else behind[:_REASON_CHARS]
        if reason and not says_nothing(reason):
            return reason
        told = told if reason or beside else ""
    return told


def tidy(prose: str) -> str:
    """Prose as thoughts: without label and refusal, and not endless."""
    return _LABEL.sub("", _REFUSE.sub("", prose)).strip()[:_THOUGHTS_CHARS]
