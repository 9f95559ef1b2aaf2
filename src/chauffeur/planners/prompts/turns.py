"""The conversation: S, then C, H and I as quoted data, then earlier rounds with what was said of them."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Sequence
from typing import Literal, TypedDict

from chauffeur.concept import CameraImage, History, HistoryItem, PlanRequest, Round, SystemMessage
from chauffeur.planners.prompts.blocks import (
    CONTEXT_CHARS,
    FEEDBACK_CHARS,
    HISTORY_FIELD_CHARS,
    HISTORY_ITEMS,
    HISTORY_POLICY_CHARS,
    INSTRUCTION_CHARS,
    PROGRAM_CHARS,
    cap,
    clean,
    data_block,
    defuse,
    program_block,
)
from chauffeur.planners.prompts.system import build_system_message


class TextPart(TypedDict):
    """Words in a turn that has pictures."""

    type: Literal["text"]
    text: str


class ImageUrl(TypedDict):
    """The place of a picture; a data URL holds it."""

    url: str


class ImagePart(TypedDict):
    """A picture in a turn."""

    type: Literal["image_url"]
    image_url: ImageUrl


class Message(TypedDict):
    """One turn, as chat-completions endpoints take it; parts only where there are pictures."""

    role: Literal["system", "user", "assistant"]
    content: str | list[TextPart | ImagePart]


MAX_ROUNDS = 6
"""Earlier rounds shown to the model; older ones are left out."""

MAX_FINDINGS = 12
"""Findings of the gate shown in a repair turn."""

REFUSED_BY_CHECKS = "The checks refused this answer:"
"""Opening of a repair turn."""

_FORGED = re.compile(r"^(wish|situation|settings used|outcome|passenger said afterwards|program) ?:", re.I | re.M)

_ASK = "Write the program for the instruction above, in the answer format."
_ASK_AGAIN = "Write the whole program again, taking this into account, in the answer format."


def _item(item: HistoryItem) -> str:
    settings = ", ".join(f"{name} = {value:g}" for name, value in item.settings)
    said = " / ".join(feedback.text for feedback in item.feedback)
    rows = (  # the program comes last: a line of it that looks like one of the others has nothing to follow it
        ("wish", item.instruction, HISTORY_FIELD_CHARS),
        ("situation", item.context, HISTORY_FIELD_CHARS),
        ("settings used", settings, HISTORY_FIELD_CHARS),
        ("outcome", item.outcome, HISTORY_FIELD_CHARS),
        ("passenger said afterwards", said, HISTORY_FIELD_CHARS),
        ("program", item.policy, HISTORY_POLICY_CHARS),
    )
    return "\n".join(_row(label, text, limit) for label, text, limit in rows if text)


def _row(label: str, text: str, limit: int) -> str:
    """A row of a remembered trip, in which no later line passes for the beginning of another row."""
    if label != "program":
        text = _FORGED.sub(r"\1 -", clean(text[: 4 * limit]))
    return f"{label}:\n{cap(text, limit)}" if "\n" in text else f"{label}: {cap(text, limit)}"


def _history(history: History) -> str:
    from chauffeur.memory.conflicts import conflicts_in  # with its memory it is heavy; prompts are imported early

    limit = len(history.items) and (4 * HISTORY_FIELD_CHARS + HISTORY_POLICY_CHARS)
    shown = history.items[:HISTORY_ITEMS]
    blocks = (data_block(f"trip-{index}", _item(item), limit) for index, item in enumerate(shown, start=1))
    told = "Remembered trips of this passenger, most relevant first:\n" + "\n".join(blocks)
    conflicts = "\n".join(conflict.to_model() for conflict in conflicts_in(History(shown)))
    if not conflicts:
        return told
    return f"{told}\nWhat of it contradicts itself:\n{data_block('conflicts', conflicts, limit)}"


def wish_turn(request: PlanRequest, *, history: str | None = None, ask: str = _ASK) -> str:
    """C, H and I, each quoted; the instruction comes last, right before the question.

    Args:
        request: What is asked.
        history: H in words, quoted already; default the remembered trips with their programs.
        ask: The question.
    """
    parts = [data_block("context", request.context.text, CONTEXT_CHARS)]
    if history is None and request.history.items:
        history = _history(request.history)
    if history:
        parts.append(history)
    parts.append(data_block("instruction", request.instruction.text, INSTRUCTION_CHARS))
    parts.append(ask)
    return "\n\n".join(parts)


def _round(earlier: Round) -> tuple[Message, Message]:
    text = earlier.plan_text
    answer = cap(text, PROGRAM_CHARS) if "```" in text else program_block(text)
    feedback = data_block("feedback", earlier.feedback, FEEDBACK_CHARS)
    said = f"The program was driven or checked. What was said of it:\n{feedback}\n\n{_ASK_AGAIN}"
    return ({"role": "assistant", "content": defuse(clean(answer))}, {"role": "user", "content": said})


def words_of(message: Message) -> str:
    """The words of a turn, pictures left out."""
    content = message["content"]
    if isinstance(content, str):
        return content
    return "\n\n".join(part["text"] for part in content if part["type"] == "text")


def pictures_in(messages: Sequence[Message]) -> int:
    """Number of pictures in a conversation."""
    return sum(
        part["type"] == "image_url"
        for message in messages
        if not isinstance(message["content"], str)
        for part in message["content"]
    )


def with_pictures(words: str, images: Sequence[CameraImage]) -> str | list[TextPart | ImagePart]:
    """V, each picture behind the name of its camera, then the words; words alone where there is no picture."""
    if not images:
        return words
    parts: list[TextPart | ImagePart] = []
    for image in images:
        url = f"data:image/png;base64,{b64encode(image.png()).decode('ascii')}"
        parts.append({"type": "text", "text": f"Camera {defuse(clean(image.camera))}:"})
        parts.append({"type": "image_url", "image_url": {"url": url}})
    parts.append({"type": "text", "text": words})
    return parts


def _system_for(request: PlanRequest) -> SystemMessage:
    from chauffeur.programs.catalogue import vocabulary_of

    return build_system_message(limits=request.limits, vocabulary=vocabulary_of(request.context.situation.world))


def build_messages(request: PlanRequest) -> list[Message]:
    """The whole conversation for a request; an empty S is filled with the zero-shot one for the request's limits."""
    system = request.system if request.system.text else _system_for(request)
    messages: list[Message] = [
        {"role": "system", "content": system.text},
        {"role": "user", "content": with_pictures(wish_turn(request), request.images)},
    ]
    for earlier in request.rounds[-MAX_ROUNDS:]:
        messages.extend(_round(earlier))
    return messages


def repair_turns(reply: str, findings: list[str], *, ask: str = _ASK_AGAIN) -> list[Message]:
    """The model's own answer, and what the checks found in it, for one more try; `ask` is the question."""
    shown = findings[:MAX_FINDINGS]
    if len(findings) > len(shown):
        shown = [*shown, f"and {len(findings) - len(shown)} more"]
    listed = data_block("findings", "\n".join(f"- {finding}" for finding in shown), FEEDBACK_CHARS)
    return [
        {"role": "assistant", "content": defuse(clean(cap(reply, PROGRAM_CHARS))) or "(empty)"},
        {"role": "user", "content": f"{REFUSED_BY_CHECKS}\n{listed}\n\n{ask}"},
    ]
