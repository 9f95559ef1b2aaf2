"""Reading a model's reply: thoughts, and a program or a refusal, or what is wrong with it.

A reply is whatever a model or a broken proxy wrote. Nothing here raises, and every pattern runs in linear time.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

MAX_REPLY_CHARS = 200_000
"""Longest reply read, reasoning in front of the answer included; the answer itself has a few thousand characters."""

_FENCE = re.compile(r"^[ \t]*(?:`{3,}|~{3,})", re.MULTILINE)
_REFUSE = re.compile(r"^[ \t>*_#]*REFUSE[*_ \t]*:[*_\s]{0,20}([^\n]{0,600})", re.MULTILINE)
_LABEL = re.compile(r"\A[\s*_#]*Thoughts?[*_ \t]*:[*_ \t]*", re.IGNORECASE)
_THINK_END = "</think>"
_THINK_START = "<think>"
_THOUGHTS_CHARS = 8_000
_ANSWER_CHARS = 64_000


@dataclass(frozen=True, slots=True)
class Reply:
    """What a reply holds.

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

    Args:
        text: The reply as it came.
        cut: Whether it ended at a token or length limit instead of by the model's own will.
    """
    visible = without_thinking(text[:MAX_REPLY_CHARS])[:_ANSWER_CHARS]
    prose, complete = _split_fences(visible)
    refusal = _REFUSE.search(prose)
    if refusal:
        # A program beside a refusal is one the model itself does not stand by.
        reason = refusal[1].strip(" *_") or "The model declined without giving a reason."
        return Reply(thoughts=_tidy(_REFUSE.sub("", prose)), refusal=reason)
    if cut and not complete:
        return Reply(_tidy(prose), problem="the answer was cut off at its length limit; answer more briefly")
    if not visible.strip():
        return Reply("", problem="the answer was empty")
    from chauffeur.programs.extract import extract_program

    found = extract_program(visible)
    if found.source is None or not found.source.strip():
        return Reply(_tidy(prose), problem="the answer holds no program; give it in one ```python block")
    return Reply(_tidy(_split_fences(found.thoughts)[0]), source=found.source)


def _tidy(prose: str) -> str:
    return _LABEL.sub("", prose).strip()[:_THOUGHTS_CHARS]


def without_thinking(text: str) -> str:
    """The answer proper of models that write their reasoning in front of it, drafts of programs included."""
    end = text.rfind(_THINK_END)
    if end >= 0:
        return text[end + len(_THINK_END) :]
    return "" if text.lstrip().startswith(_THINK_START) else text


def _split_fences(text: str) -> tuple[str, bool]:
    """(text outside code fences, whether every fence that opened was closed, and there was one)."""
    outside: list[str] = []
    inside = False
    seen = False
    for line in text.split("\n"):
        if _FENCE.match(line):
            inside = not inside
            seen = True
        elif not inside:
            outside.append(line)
    return "\n".join(outside), seen and not inside
