"""Conversations with pictures, as chat-completions endpoints take them, taken apart for models in this process."""

from __future__ import annotations

import base64
import binascii
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

from chauffeur.concept import PlannerError


@dataclass(frozen=True, slots=True)
class ShownPicture:
    """A picture of a conversation.

    Attributes:
        caption: The text right before it; empty for none.
        image: The picture, a PIL image in RGB.
    """

    caption: str
    image: Any


def parts_of(message: Mapping[str, Any]) -> tuple[tuple[ShownPicture, ...], str]:
    """Pictures of a turn, and its last text. Raises PlannerError: a picture is no data URI that can be read."""
    content = message.get("content", "")
    if not isinstance(content, list):
        return (), str(content)
    pictures: list[ShownPicture] = []
    text = ""
    for part in cast("Sequence[Mapping[str, Any]]", content):
        if part.get("type") == "image_url":
            pictures.append(ShownPicture(text, _decoded(str(part["image_url"]["url"]))))
            text = ""
        else:
            text = str(part.get("text", ""))
    return tuple(pictures), text


def _decoded(url: str) -> Any:
    from PIL import Image

    _, comma, data = url.partition("base64,")
    if not comma:
        raise PlannerError(f"The picture {url[:60]!r} is no data URI.", hint="Send it as data:image/jpeg;base64,...")
    try:
        return Image.open(io.BytesIO(base64.b64decode(data, validate=True))).convert("RGB")
    except (binascii.Error, OSError) as error:
        raise PlannerError(f"A picture of the conversation cannot be read: {error}.") from error
