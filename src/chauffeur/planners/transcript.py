"""The conversation with a model, word for word, kept by the caller who asks for it."""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TypedDict

from chauffeur.planners.prompts.turns import Message


class ModelTurn(TypedDict):
    """One turn of a conversation: `role` is `system`, `user` or `assistant`; a picture is told by its size."""

    role: str
    text: str


_kept: ContextVar[list[ModelTurn] | None] = ContextVar("kept", default=None)


@contextmanager
def kept_turns() -> Generator[list[ModelTurn]]:
    """Collect the turns of all exchanges within the context, tasks that it starts included."""
    turns: list[ModelTurn] = []
    token = _kept.set(turns)
    try:
        yield turns
    finally:
        _kept.reset(token)


def keep_exchange(messages: Sequence[Message], reply: str) -> None:
    """Add what a model was sent and what it replied; turns that the conversation already holds are not repeated."""
    turns = _kept.get()
    if turns is None:
        return
    sent = [ModelTurn(role=message["role"], text=_text(message)) for message in messages]
    alike = next((n for n, (one, other) in enumerate(zip(sent, turns, strict=False)) if one != other), len(sent))
    # A repair quotes the reply before it, perhaps cut; a conversation of its own begins otherwise.
    held = min(len(turns), len(sent)) if alike >= len(turns) - 1 else 0
    turns.extend((*sent[held:], ModelTurn(role="assistant", text=reply)))


def _text(message: Message) -> str:
    content = message["content"]
    if isinstance(content, str):
        return content
    parts = (
        part["text"] if part["type"] == "text" else f"[picture, {len(part['image_url']['url']) * 3 // 4:,} bytes]"
        for part in content
    )
    return "\n".join(parts)
