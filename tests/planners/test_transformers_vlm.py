"""A vision-language model of transformers in this process, from a checkpoint of a few kilobytes."""

from __future__ import annotations

import asyncio
import base64
import io
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("tokenizers")

from chauffeur.concept import ConfigError, PlannerError  # noqa: E402
from chauffeur.planners.base import Answerer  # noqa: E402
from chauffeur.planners.picture_parts import parts_of  # noqa: E402
from chauffeur.planners.transformers_vlm import TransformersAnswerer  # noqa: E402

TEMPLATE = (
    "{% for m in messages %}{% for c in m['content'] %}{% if c['type'] == 'image' %}<image> {% else %}{{ c['text'] }} "
    "{% endif %}{% endfor %}{% endfor %}"
)


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """LLaVA with a CLIP tower of one layer, written by `save_pretrained`."""
    from tokenizers import Tokenizer
    from tokenizers.models import WordLevel
    from tokenizers.pre_tokenizers import WhitespaceSplit
    from transformers import (
        CLIPImageProcessorPil,
        CLIPVisionConfig,
        LlamaConfig,
        LlavaConfig,
        LlavaForConditionalGeneration,
        LlavaProcessor,
        PreTrainedTokenizerFast,
    )

    words = ["<pad>", "<s>", "</s>", "<unk>", "<image>", "What", "is", "ahead?", "(a)", "(b)", "front", "car", "truck"]
    raw = Tokenizer(WordLevel({word: place for place, word in enumerate(words)}, unk_token="<unk>"))
    raw.pre_tokenizer = WhitespaceSplit()
    tokenizer = PreTrainedTokenizerFast(
        tokenizer_object=raw, pad_token="<pad>", bos_token="<s>", eos_token="</s>", unk_token="<unk>",
        additional_special_tokens=["<image>"],
    )  # fmt: skip
    sight = CLIPImageProcessorPil(size={"shortest_edge": 28}, crop_size={"height": 28, "width": 28})
    processor = LlavaProcessor(
        sight, tokenizer, patch_size=14, vision_feature_select_strategy="default", chat_template=TEMPLATE,
        num_additional_image_tokens=1,
    )  # fmt: skip
    vision = CLIPVisionConfig(
        hidden_size=16, intermediate_size=16, num_hidden_layers=2, num_attention_heads=2, image_size=28, patch_size=14
    )
    text = LlamaConfig(
        vocab_size=len(words), hidden_size=16, intermediate_size=16, num_hidden_layers=1, num_attention_heads=2,
        pad_token_id=0, bos_token_id=1, eos_token_id=2,
    )  # fmt: skip
    torch.manual_seed(0)
    config = LlavaConfig(vision_config=vision, text_config=text, image_token_index=4, image_token_id=4)
    folder = tmp_path_factory.mktemp("llava")
    LlavaForConditionalGeneration(config).save_pretrained(folder)
    processor.save_pretrained(folder)
    return folder


def message(*colours: tuple[int, int, int]) -> list[Any]:
    parts: list[dict[str, Any]] = []
    for colour in colours:
        file = io.BytesIO()
        Image.new("RGB", (40, 30), colour).save(file, "PNG")
        url = f"data:image/png;base64,{base64.b64encode(file.getvalue()).decode()}"
        parts += [{"type": "text", "text": "front"}, {"type": "image_url", "image_url": {"url": url}}]
    return [{"role": "user", "content": [*parts, {"type": "text", "text": "What is ahead?"}]}]


def test_a_checkpoint_answers_about_pictures(checkpoint: Path) -> None:
    model = TransformersAnswerer.from_spec(str(checkpoint), max_tokens=4)
    assert isinstance(model, Answerer)
    one = asyncio.run(model.write(message((250, 0, 0), (0, 0, 250))))
    again = asyncio.run(model.write(message((250, 0, 0), (0, 0, 250))))
    assert one == again and one.usage.completion_tokens <= 4
    assert one.usage.prompt_tokens == 2 * (1 + 4) + 3  # a caption and four patches a picture, three words
    alone = asyncio.run(model.write([{"role": "user", "content": "What is ahead?"}]))
    assert alone.usage.prompt_tokens == 3


def test_a_folder_without_a_model_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="no vision-language model"):
        TransformersAnswerer.from_spec(str(tmp_path))


@pytest.mark.parametrize("url", ["https://example.org/a.jpg", "data:image/png;base64,AAAA", "data:image/png;base64,%%"])
def test_what_is_no_picture_is_told(url: str) -> None:
    with pytest.raises(PlannerError, match="picture"):
        parts_of({"content": [{"type": "image_url", "image_url": {"url": url}}]})
