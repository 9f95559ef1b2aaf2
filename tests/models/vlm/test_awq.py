"""AWQ: packed as servers read it, nearer than rounding to nearest, and the function before rounding unchanged."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")
pytest.importorskip("tokenizers")

from hypothesis import given, settings  # noqa: E402
from hypothesis import strategies as st  # noqa: E402
from safetensors.torch import load_file  # noqa: E402
from tiny_qwen import tiny_qwen  # noqa: E402

from chauffeur.concept import ConfigError  # noqa: E402
from chauffeur.models.export.awq import packed, quantise, rounded  # noqa: E402
from chauffeur.models.vlm.lora import ChatExamples  # noqa: E402
from chauffeur.models.vlm.quantise import quantise_vlm  # noqa: E402


def unpacked(words: torch.Tensor, length: int, along: int = 1) -> torch.Tensor:
    """What `packed` packed, eight numbers of 4 bits in a word, the first one lowest: int8, `length` long."""
    rows = words if along == 1 else words.T
    numbers = (rows.to(torch.int64)[..., None] >> (4 * torch.arange(8))) & 15
    whole = (numbers.reshape(rows.shape[0], -1)[:, :length] - 8).to(torch.int8)
    return whole if along == 1 else whole.T


@settings(max_examples=60)
@given(st.integers(1, 9), st.integers(1, 40), st.sampled_from([0, 1]), st.integers(0, 2**31))
def test_what_is_packed_comes_back(rows: int, width: int, along: int, seed: int) -> None:
    numbers = torch.randint(-8, 8, (rows, width), generator=torch.Generator().manual_seed(seed), dtype=torch.int8)
    words = packed(numbers, along)
    assert words.dtype == torch.int32 and words.shape[along] == -(-numbers.shape[along] // 8)
    assert torch.equal(unpacked(words, numbers.shape[along], along), numbers)


def test_a_word_is_the_layouts() -> None:
    """The first number lies in the lowest four bits, plus 8 (compressed-tensors, `pack_to_int32`)."""
    assert packed(torch.arange(-8, 0, dtype=torch.int8)[None]).item() == 0x76543210
    assert packed(torch.arange(0, 8, dtype=torch.int8)[None]).item() == 0xFEDCBA98 - (1 << 32)


@given(st.integers(0, 2**31), st.sampled_from([1e-6, 1.0, 300.0]), st.floats(-3.0, 3.0))
@settings(max_examples=40)
def test_rounding_is_off_by_half_a_step_at_most(seed: int, size: float, shift: float) -> None:
    weight = (torch.randn(6, 32, generator=torch.Generator().manual_seed(seed)) + shift) * size
    one = rounded(weight, 16)
    step = one.scale.repeat_interleave(16, 1)
    # The zero is rounded too: at the ends of a group's range that can cost another half step.
    assert ((one.weight() - weight).abs() <= step * 1.001 + 1e-7).all()


def _llama() -> Any:
    from transformers import LlamaConfig, LlamaForCausalLM

    torch.manual_seed(1)
    model = LlamaForCausalLM(
        LlamaConfig(
            vocab_size=40,
            hidden_size=64,
            intermediate_size=96,
            num_hidden_layers=2,
            num_attention_heads=4,
            num_key_value_heads=2,
            max_position_embeddings=64,
        )
    ).eval()
    with torch.no_grad():  # a few channels carry large activations, as in real models
        for layer in model.model.layers:
            layer.input_layernorm.weight[::13] = 25.0
            layer.post_attention_layernorm.weight[5::17] = 25.0
    return model


def test_the_search_beats_rounding_to_nearest_where_channels_stand_out() -> None:
    model = _llama()
    tokens = torch.randint(0, 40, (4, 32), generator=torch.Generator().manual_seed(2))
    with torch.no_grad():
        before = model(tokens).logits
    matrices, errors = quantise(model, [lambda: model(tokens)], 32)
    with torch.no_grad():
        assert torch.allclose(model(tokens).logits, before, atol=1e-3), "scaling alone must change nothing"
    assert len(errors) == 8 and len(matrices) == 14
    assert all(one.chosen <= one.nearest for one in errors)
    into_attention = [one for one in errors if one.readers[0].endswith("q_proj")]
    assert all(one.chosen < 0.8 * one.nearest and one.exponent > 0.0 for one in into_attention)
    shared = [one for one in errors if one.readers[0].endswith("o_proj")]
    assert all(one.exponent == 0.0 for one in shared), "heads that share their values cannot be scaled one by one"

    def off(weights: dict[str, Any]) -> float:
        again = _llama()
        quantise(again, [lambda: again(tokens)], 32)  # the same scales
        for name, weight in weights.items():
            again.get_submodule(name).weight.data = weight
        with torch.no_grad():
            return float((again(tokens).logits - before).pow(2).mean())

    plain = _llama()
    for name in matrices:
        part = plain.get_submodule(name)
        part.weight.data = rounded(part.weight.data, 32).weight()
    with torch.no_grad():
        nearest = float((plain(tokens).logits - before).pow(2).mean())
    assert off({name: one.weight() for name, one in matrices.items()}) < nearest


def test_what_cannot_be_quantised_is_said() -> None:
    model = _llama()
    with pytest.raises(ConfigError, match="groups of 48 do not divide"):
        quantise(model, [lambda: None], 48)
    with pytest.raises(ConfigError, match="no decoder layers"):
        quantise(torch.nn.Linear(8, 8), [], 8)


def test_a_vision_language_model_is_written_for_servers(tmp_path: Path) -> None:
    base, out = tiny_qwen(tmp_path / "base"), tmp_path / "awq"
    errors = quantise_vlm(str(base), out, ChatExamples(size=(112, 64)), pairs=2, group=8)
    assert [len(one.readers) for one in errors] == [3, 1, 2, 1]
    stored, plain = load_file(out / "model.safetensors"), load_file(base / "model.safetensors")
    short = {name.removesuffix(".weight_packed") for name in stored if name.endswith(".weight_packed")}
    assert len(short) == 7 and all("visual" not in name for name in short)
    for name in short:
        shape = stored[f"{name}.weight_shape"].tolist()
        assert shape == list(plain[f"{name}.weight"].shape) and f"{name}.weight" not in stored
        numbers = unpacked(stored[f"{name}.weight_packed"], shape[1])
        zero = unpacked(stored[f"{name}.weight_zero_point"], shape[0], 0)
        scale = stored[f"{name}.weight_scale"]
        assert scale.shape == (shape[0], shape[1] // 8) == zero.shape and numbers.shape == tuple(shape)
    # Names are those of the checkpoint that it came from, as servers know them.
    assert {name for name in stored if ".weight_" not in name} < set(plain)
    told = json.loads((out / "config.json").read_text("utf-8"))["quantization_config"]
    assert told["format"] == "pack-quantized" and told["config_groups"]["group_0"]["weights"]["group_size"] == 8
    assert told["ignore"] == ["re:.*lm_head.*", "re:.*visual.*"]
    assert (out / "tokenizer.json").is_file() and (out / "preprocessor_config.json").is_file()


def test_compressed_tensors_reads_it_as_it_was_meant(tmp_path: Path) -> None:
    pytest.importorskip("compressed_tensors", reason="needs compressed-tensors")
    from compressed_tensors.compressors import PackedQuantizationCompressor
    from compressed_tensors.quantization import QuantizationConfig

    base, out = tiny_qwen(tmp_path / "base"), tmp_path / "awq"
    quantise_vlm(str(base), out, ChatExamples(size=(112, 64)), pairs=2, group=8)
    told = json.loads((out / "config.json").read_text("utf-8"))["quantization_config"]
    scheme = QuantizationConfig.model_validate(told).config_groups["group_0"]
    stored = load_file(out / "model.safetensors")
    names = [name.removesuffix(".weight_packed") for name in stored if name.endswith(".weight_packed")]
    for name in names:
        own = {key.removeprefix(f"{name}."): value for key, value in stored.items() if key.startswith(f"{name}.weight")}
        theirs = PackedQuantizationCompressor.decompress(own, scheme)["weight"]
        rows, width = own["weight_shape"].tolist()
        numbers = unpacked(own["weight_packed"], width) - unpacked(own["weight_zero_point"], rows, 0).repeat_interleave(
            8, 1
        )
        ours = numbers.to(theirs.dtype) * own["weight_scale"].repeat_interleave(8, 1)
        assert torch.equal(theirs, ours), name
