"""Asking a model in words, and once more with what the checks found in its answer."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import TypeVar

from chauffeur.concept import Usage
from chauffeur.planners.base import Prose, total_usage
from chauffeur.planners.prompts.turns import Message, repair_turns

T = TypeVar("T")


async def asked_and_repaired(
    write: Callable[[Sequence[Message]], Awaitable[Prose]],
    messages: Sequence[Message],
    read: Callable[[Prose], T],
    findings: Callable[[T], list[str]],
    *,
    repairs: int,
    ask: str,
) -> tuple[T, Prose, Usage]:
    """The answer as it was read, the model's last words, and what all of them cost.

    Args:
        write: Asks the model.
        messages: The conversation.
        read: Reads a reply.
        findings: What is wrong with an answer, in words for the model; empty for nothing.
        repairs: How often the model may correct its answer.
        ask: The question of a repair.
    """
    prose = await write(messages)
    costs, answer = [prose.usage], read(prose)
    for _ in range(repairs):
        found = findings(answer)
        if not found:
            break
        messages = [*messages, *repair_turns(prose.text, found, ask=ask)]
        prose = await write(messages)
        costs.append(prose.usage)
        answer = read(prose)
    return answer, prose, total_usage(costs)
