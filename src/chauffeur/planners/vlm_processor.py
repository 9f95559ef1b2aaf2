# pyright: reportMissingImports=false
"""Processors of vision-language models without torchvision.

The processors of Qwen2.5-VL and Qwen3-VL insist on a part for videos that needs torchvision. Pictures do not: what is
left is their image processor (the Pillow one), the tokenizer and the chat template, put together here.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

IMAGE_PAD = "<|image_pad|>"
"""Token for a patch of a picture in the chat templates of Qwen-VL."""


def load_processor(name: str) -> Any:
    """The processor of a checkpoint; without the part for videos where that cannot be had.

    Raises:
        OSError: There is no such checkpoint.
        ValueError: It reads no pictures.
    """
    from transformers import AutoConfig, AutoProcessor

    config: Any = AutoConfig.from_pretrained(name)
    if not hasattr(config, "video_token_id"):
        return AutoProcessor.from_pretrained(name)
    try:
        return AutoProcessor.from_pretrained(name)
    except (ImportError, AttributeError):  # what transformers raises without torchvision depends on its version
        return PictureProcessor.from_pretrained(name)


class PictureProcessor:
    """Qwen-VL's processor for pictures and words.

    Attributes:
        tokenizer: The words' part.
        image_processor: The pictures' part.
    """

    def __init__(self, tokenizer: Any, image_processor: Any, chat_template: str | None = None) -> None:
        """Args: its parts; the chat template, the tokenizer's own if left out."""
        self.tokenizer, self.image_processor = tokenizer, image_processor
        if chat_template:
            self.tokenizer.chat_template = chat_template
        self._pad: int = tokenizer.convert_tokens_to_ids(IMAGE_PAD)

    @classmethod
    def from_pretrained(cls, name: str) -> PictureProcessor:
        """From a folder or the hub. Raises OSError: a file is not there; ValueError: it is no Qwen-VL."""
        from transformers import AutoTokenizer, Qwen2VLImageProcessorPil
        from transformers.utils.hub import cached_file

        tokenizer: Any = AutoTokenizer.from_pretrained(name)
        if tokenizer.convert_tokens_to_ids(IMAGE_PAD) in (None, tokenizer.unk_token_id):
            raise ValueError(f"{name} has no token {IMAGE_PAD}.")
        template = cached_file(name, "chat_template.jinja", _raise_exceptions_for_missing_entries=False)
        text = Path(template).read_text(encoding="utf-8") if template else None
        return cls(tokenizer, Qwen2VLImageProcessorPil.from_pretrained(name), text)

    def save_pretrained(self, folder: Path | str) -> None:
        """Write both parts and the chat template."""
        self.tokenizer.save_pretrained(folder)
        self.image_processor.save_pretrained(folder)

    def apply_chat_template(self, turns: Sequence[Any], **options: Any) -> str:
        """A conversation as text; options as of the tokenizer's."""
        return str(self.tokenizer.apply_chat_template(turns, **options))

    def __call__(self, text: str | Sequence[str], images: Sequence[Any] | None = None, **options: Any) -> Any:
        """Inputs of the model, as `transformers.BatchEncoding`.

        Args:
            text: Conversations, with one `IMAGE_PAD` for each picture, in order.
            images: The pictures of all, PIL.
            **options: Of the tokenizer, e.g. `padding`.
        """
        import torch

        texts = [text] if isinstance(text, str) else list(text)
        fed: dict[str, Any] = {}
        if images:
            fed = dict(self.image_processor(images=list(images), return_tensors="pt"))
            merged = int(self.image_processor.merge_size) ** 2
            counts = [int(grid.prod()) // merged for grid in fed["image_grid_thw"]]
            texts = [self._widened(one, counts) for one in texts]
        encoded = self.tokenizer(texts, **options)
        for name, value in fed.items():
            encoded[name] = value
        ids = encoded["input_ids"]
        if images:
            encoded["mm_token_type_ids"] = (ids == self._pad).to(torch.int64)
        return encoded

    @staticmethod
    def _widened(text: str, counts: list[int]) -> str:
        """A conversation with as many pads for each picture as it has patches; takes their counts off the list."""
        parts = text.split(IMAGE_PAD)
        found = parts[0]
        for part in parts[1:]:
            found += IMAGE_PAD * counts.pop(0) + part
        return found
