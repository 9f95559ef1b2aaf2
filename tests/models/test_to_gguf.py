"""The GGUF file: it holds the same numbers and words, and llama.cpp answers with it as `transformers` does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="PyTorch is not installed (extra: models)")
pytest.importorskip("transformers", reason="transformers is not installed (extra: models)")
pytest.importorskip("gguf", reason="gguf is not installed")

import gguf
import torch

from chauffeur.concept import DataError
from chauffeur.models.onboard.export import export_transformers
from chauffeur.models.onboard.to_gguf import interleaved, to_gguf
from chauffeur.models.onboard.tokens import train_tokenizer
from chauffeur.models.onboard.training import SIZES, network
from chauffeur.planners.onboard.prompt import program_reply, prompt

torch.set_num_threads(1)

WISHES = ("take the left lane", "drive at 45 mph, please", "don't hurry", "  odd   spaces ", "<|wish|>", "größer")


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    tokenizer = train_tokenizer([prompt(None, (), wish) + program_reply(()) for wish in WISHES])
    torch.manual_seed(0)
    model = network(SIZES["tiny"], tokenizer.get_vocab_size(), 0)
    for weight in model.parameters():  # far from its start, so that no two tokens are as likely as each other
        torch.nn.init.normal_(weight, std=0.3) if weight.ndim > 1 else torch.nn.init.uniform_(weight, 0.5, 1.5)
    return export_transformers(model, tokenizer, tmp_path_factory.mktemp("checkpoint"))


def test_every_matrix_is_in_the_file(checkpoint: Path, tmp_path: Path) -> None:
    from safetensors.torch import load_file

    read = gguf.GGUFReader(to_gguf(checkpoint, tmp_path / "sub" / "model.gguf"))
    weights = load_file(checkpoint / "model.safetensors")
    found = {tensor.name: np.asarray(tensor.data, np.float32) for tensor in read.tensors}
    assert len(found) == len(weights)
    embedding = weights["model.embed_tokens.weight"].float().numpy()
    assert found["token_embd.weight"] == pytest.approx(embedding, abs=1e-3)
    heads = SIZES["tiny"].heads
    query = weights["model.layers.0.self_attn.q_proj.weight"].float().numpy()
    assert found["blk.0.attn_q.weight"] == pytest.approx(interleaved(query, heads), abs=1e-3)


def test_interleaving_puts_the_halves_of_a_head_beside_each_other() -> None:
    rows = np.arange(8, dtype=np.float32)[:, None]
    assert interleaved(rows, 2)[:, 0].tolist() == [0.0, 2.0, 1.0, 3.0, 4.0, 6.0, 5.0, 7.0]


def test_eight_bits_are_near_and_half_the_size(checkpoint: Path, tmp_path: Path) -> None:
    plain = to_gguf(checkpoint, tmp_path / "plain.gguf")
    small = to_gguf(checkpoint, tmp_path / "small.gguf", eight_bit=True)
    assert small.stat().st_size < plain.stat().st_size
    whole = {tensor.name: tensor for tensor in gguf.GGUFReader(plain).tensors}
    for tensor in gguf.GGUFReader(small).tensors:
        near = gguf.quants.dequantize(tensor.data, tensor.tensor_type)
        assert near == pytest.approx(np.asarray(whole[tensor.name].data, np.float32), abs=0.02)


@pytest.mark.parametrize("spoilt", ["config.json", "model.safetensors"])
def test_what_is_no_checkpoint_is_refused(checkpoint: Path, tmp_path: Path, spoilt: str) -> None:
    for file in checkpoint.iterdir():
        data = file.read_bytes()
        (tmp_path / file.name).write_bytes(data[: len(data) // 2] if file.name == spoilt else data)
    with pytest.raises(DataError, match="no exported checkpoint"):
        to_gguf(tmp_path, tmp_path / "model.gguf")
    assert not (tmp_path / "model.gguf").exists()


def test_another_kind_of_network_is_refused(checkpoint: Path, tmp_path: Path) -> None:
    for file in checkpoint.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes().replace(b'"llama"', b'"opt"'))
    with pytest.raises(DataError, match="another kind of network"):
        to_gguf(tmp_path, tmp_path / "model.gguf")


@pytest.mark.parametrize("wish", WISHES)
def test_llama_cpp_answers_as_transformers_does(checkpoint: Path, tmp_path: Path, wish: str) -> None:
    llama_cpp = pytest.importorskip("llama_cpp", reason="llama-cpp-python is not installed")
    from transformers import AutoModelForCausalLM, AutoTokenizer

    file = to_gguf(checkpoint, tmp_path / "model.gguf")
    served = llama_cpp.Llama(str(file), n_ctx=256, n_threads=1, verbose=False, logits_all=False)
    words = AutoTokenizer.from_pretrained(checkpoint)
    asked = prompt(None, (), wish, drafted=False)
    ids: list[int] = words(asked, add_special_tokens=False).input_ids
    assert served.tokenize(asked.encode(), add_bos=False, special=True) == ids
    model: Any = AutoModelForCausalLM.from_pretrained(checkpoint, dtype=torch.float32)
    with torch.no_grad():
        out = model.generate(torch.tensor([ids]), max_new_tokens=12, do_sample=False, eos_token_id=-1, pad_token_id=0)
    theirs: list[int] = []
    for token in served.generate(ids, top_k=1, temp=0.0, repeat_penalty=1.0):
        theirs.append(token)
        if len(theirs) == 12:
            break
    assert theirs == out[0, len(ids) :].tolist()
