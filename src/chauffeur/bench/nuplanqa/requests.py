"""The conversation about one question: its pictures, each with a caption, then the text of the published format."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final, Literal, cast

from chauffeur.bench.nuplanqa.frames import FramePath
from chauffeur.bench.nuplanqa.questions import VqaItem
from chauffeur.bench.pictures import Pictures, data_uri, read_picture
from chauffeur.planners.prompts import Message

ASKING: Final = "ask-v1"
"""Id of the wording below; figures belong to it."""

Control = Literal["pictures", "blank", "text"]
"""What a model is shown: the pictures; grey ones of the same size; none at all."""

_ASK: Final = "Answer with the letter of the right option, (a), (b), (c) or (d), and nothing else."


def conversation(item: VqaItem, frames: Sequence[FramePath], control: Control, side_px: int) -> list[Message]:
    """What a model is sent.

    Args:
        item: The question.
        frames: Its pictures, oldest first; none for `text`.
        control: What it is shown.
        side_px: Longer side that pictures are scaled down to; 0 leaves them.

    Raises:
        DataError: A picture is missing or damaged.
    """
    asked = f"{item.text()}\n\n{_ASK}"
    if control == "text":
        return [{"role": "user", "content": asked}]
    kind: Pictures = "blank" if control == "blank" else "real"
    parts: list[dict[str, Any]] = []
    for frame in frames:
        parts.append({"type": "text", "text": f"{frame.caption}:"})
        picture = data_uri(read_picture(frame.path, side_px, kind))
        parts.append({"type": "image_url", "image_url": {"url": picture}})
    parts.append({"type": "text", "text": asked})
    return [cast("Message", {"role": "user", "content": parts})]
