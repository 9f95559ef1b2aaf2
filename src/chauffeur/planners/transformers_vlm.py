# pyright: reportMissingImports=false
"""Any vision-language model of `transformers` in this process: `transformers/FOLDER`, for questions with pictures."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from chauffeur.concept import ConfigError, MissingExtraError, Usage
from chauffeur.planners.base import Prose
from chauffeur.planners.picture_parts import parts_of
from chauffeur.planners.vlm_processor import load_processor

if TYPE_CHECKING:
    from chauffeur.planners.prompts import Message


def chat_turns(messages: Sequence[Mapping[str, Any]]) -> tuple[list[dict[str, Any]], list[Any]]:
    """(turns as chat templates of transformers take them, their pictures in order).

    Raises:
        PlannerError: A picture cannot be read.
    """
    images: list[Any] = []
    turns: list[dict[str, Any]] = []
    for message in messages:
        pictures, text = parts_of(message)
        content: list[dict[str, str]] = []
        for picture in pictures:
            content += [{"type": "text", "text": picture.caption}, {"type": "image"}]
            images.append(picture.image)
        turns.append({"role": message["role"], "content": [*content, {"type": "text", "text": text}]})
    return turns, images


class TransformersAnswerer:
    """A checkpoint with its processor; answers one question at a time, greedily."""

    def __init__(self, name: str, model: Any, processor: Any, max_tokens: int = 64) -> None:
        """Args: what it is called, an image-text-to-text model, its processor, and most tokens of an answer."""
        self._name, self._model, self._processor, self._max_tokens = name, model, processor, max_tokens
        self._turn = asyncio.Lock()

    @classmethod
    def from_spec(cls, argument: str, *, max_tokens: int = 64) -> TransformersAnswerer:
        """Model for `transformers/FOLDER`, or a name on the hub.

        Raises:
            ConfigError: There is no such checkpoint, or it reads no pictures.
            MissingExtraError: transformers is not installed.
        """
        try:
            from transformers import AutoModelForImageTextToText
        except ImportError as error:
            raise MissingExtraError("A model in this process needs transformers.", extra="transformers") from error
        try:
            processor: Any = load_processor(argument)
            model: Any = AutoModelForImageTextToText.from_pretrained(argument).eval()
        except ImportError as error:  # what a quantised checkpoint is read with
            raise MissingExtraError(f"{argument} cannot be read: {error}", hint="Install what it names.") from error
        except (OSError, ValueError) as error:
            raise ConfigError(
                f"transformers has no vision-language model {argument!r}: {error}",
                hint="Name a folder that save_pretrained has written, processor included.",
            ) from error
        return cls(Path(argument).name, model, processor, max_tokens)

    @property
    def id(self) -> str:
        """`transformers/NAME`."""
        return f"transformers/{self._name}"

    @property
    def model(self) -> str:
        """Class and name."""
        return f"{type(self._model).__name__} {self._name}"

    async def write(self, messages: Sequence[Message]) -> Prose:
        """The model's words. Raises PlannerError: a picture cannot be read."""
        async with self._turn:  # one model, one question at a time
            return await asyncio.to_thread(self._write, [cast("Mapping[str, Any]", one) for one in messages])

    def _write(self, messages: Sequence[Mapping[str, Any]]) -> Prose:
        import torch

        turns, images = chat_turns(messages)
        prompt = self._processor.apply_chat_template(turns, add_generation_prompt=True, tokenize=False)
        given = self._processor(text=prompt, images=images or None, return_tensors="pt").to(self._model.device)
        with torch.inference_mode():
            found = self._model.generate(**given, max_new_tokens=self._max_tokens, do_sample=False)
        length = given["input_ids"].shape[1]
        answer = self._processor.tokenizer.decode(found[0, length:], skip_special_tokens=True).strip()
        written = int(found.shape[1] - length)
        usage = Usage(prompt_tokens=int(length), completion_tokens=written)
        return Prose(answer, whole=written < self._max_tokens, model=self.model, usage=usage)
