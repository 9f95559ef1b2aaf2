"""Published weights under our names: tiny checkpoints in their layouts against forward passes written from them."""

# ruff: noqa: E402
from __future__ import annotations

import math
from typing import Any

import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("transformers")

from chauffeur.concept import DataError
from chauffeur.models.net.transformer import TransformerConfig, language_model
from chauffeur.models.vilad.published import (
    from_llada,
    from_smdm,
    load_published,
    response_logits,
    to_masked_diffusion,
)

HIDDEN, LAYERS, HEADS, INNER, WORDS = 32, 2, 4, 48, 23


def weight(*shape: int) -> Any:
    return torch.randn(*shape) / math.sqrt(shape[-1])


def norm(x: Any, scale: Any) -> Any:
    return x * torch.rsqrt(x.pow(2).mean(-1, keepdim=True) + 1e-5) * scale


def turn(x: Any) -> Any:
    width = x.shape[-1]
    at = torch.arange(x.shape[-2])[:, None] / 10_000.0 ** (torch.arange(0, width, 2) / width)
    first, second = x[..., : width // 2], x[..., width // 2 :]
    return torch.cat((first * at.cos() - second * at.sin(), second * at.cos() + first * at.sin()), -1)


def attention(q: Any, k: Any, v: Any, groups: int) -> Any:
    n = q.shape[0]
    q = turn(q.view(n, HEADS, -1).transpose(0, 1))
    k = turn(k.view(n, groups, -1).transpose(0, 1)).repeat_interleave(HEADS // groups, 0)
    v = v.view(n, groups, -1).transpose(0, 1).repeat_interleave(HEADS // groups, 0)
    shares = torch.softmax(q @ k.transpose(1, 2) / math.sqrt(q.shape[-1]), -1)  # all see all
    return (shares @ v).transpose(0, 1).reshape(n, -1)


def llada() -> dict[str, Any]:
    found = {
        "model.transformer.wte.weight": weight(WORDS, HIDDEN),
        "model.transformer.ln_f.weight": 1 + 0.1 * torch.randn(HIDDEN),
        "model.transformer.ff_out.weight": weight(WORDS, HIDDEN),
    }
    shapes = {"q_proj": (HIDDEN, HIDDEN), "k_proj": (HIDDEN, HIDDEN), "v_proj": (HIDDEN, HIDDEN)}
    shapes |= {"attn_out": (HIDDEN, HIDDEN), "ff_proj": (INNER, HIDDEN), "up_proj": (INNER, HIDDEN)}
    shapes |= {"ff_out": (HIDDEN, INNER)}
    for layer in range(LAYERS):
        block = f"model.transformer.blocks.{layer}"
        found |= {f"{block}.{name}.weight": weight(*shape) for name, shape in shapes.items()}
        found |= {f"{block}.{name}.weight": 1 + 0.1 * torch.randn(HIDDEN) for name in ("attn_norm", "ff_norm")}
    return found


def llada_forward(held: dict[str, Any], ids: Any) -> Any:
    x = held["model.transformer.wte.weight"][ids]
    for layer in range(LAYERS):
        block = f"model.transformer.blocks.{layer}."
        w = {k[len(block) : -len(".weight")]: v for k, v in held.items() if k.startswith(block)}
        h = norm(x, w["attn_norm"])
        x = x + attention(h @ w["q_proj"].T, h @ w["k_proj"].T, h @ w["v_proj"].T, HEADS) @ w["attn_out"].T
        h = norm(x, w["ff_norm"])
        x = x + (torch.nn.functional.silu(h @ w["ff_proj"].T) * (h @ w["up_proj"].T)) @ w["ff_out"].T
    return norm(x, held["model.transformer.ln_f.weight"]) @ held["model.transformer.ff_out.weight"].T


def smdm(groups: int) -> dict[str, Any]:
    each = HIDDEN // HEADS
    found = {
        "transformer.wte.weight": weight(WORDS, HIDDEN),
        "transformer.ln_f.weight": 1 + 0.1 * torch.randn(HIDDEN),
        "lm_head.weight": weight(WORDS, HIDDEN),
    }
    for layer in range(LAYERS):
        h = f"transformer.h.{layer}"
        found[f"{h}.attn.attn.weight"] = weight((HEADS + 2 * groups) * each, HIDDEN)
        found[f"{h}.attn.proj.weight"] = weight(HIDDEN, HIDDEN)
        found[f"{h}.mlp.swiglu.w1.weight"] = weight(INNER, HIDDEN)
        found[f"{h}.mlp.swiglu.w2.weight"] = weight(INNER, HIDDEN)
        found[f"{h}.mlp.swiglu.w3.weight"] = weight(HIDDEN, INNER)
        for name in ("norm_1", "norm_2"):
            found[f"{h}.{name}.weight"] = 1 + 0.1 * torch.randn(HIDDEN)
    return found


def smdm_forward(held: dict[str, Any], ids: Any, groups: int) -> Any:
    """As lit-gpt has it: the fused matrix holds, group by group, its queries, its key and its value."""
    x = held["transformer.wte.weight"][ids]
    n, each, per = len(ids), HIDDEN // HEADS, HEADS // groups
    for layer in range(LAYERS):
        w = {k.removeprefix(f"transformer.h.{layer}."): v for k, v in held.items()}
        h = norm(x, w["norm_1.weight"])
        fused = (h @ w["attn.attn.weight"].T).view(n, groups, per + 2, each)
        q, k, v = fused.split((per, 1, 1), dim=2)
        parts = (q.reshape(n, -1), k.reshape(n, -1), v.reshape(n, -1))
        x = x + attention(*parts, groups) @ w["attn.proj.weight"].T
        h = norm(x, w["norm_2.weight"])
        gated = torch.nn.functional.silu(h @ w["mlp.swiglu.w1.weight"].T) * (h @ w["mlp.swiglu.w2.weight"].T)
        x = x + gated @ w["mlp.swiglu.w3.weight"].T
    return norm(x, held["transformer.ln_f.weight"]) @ held["lm_head.weight"].T


def config(kv_heads: int) -> TransformerConfig:
    return TransformerConfig(HIDDEN, LAYERS, HEADS, kv_heads, INNER, WORDS, causal=False, tied=False)


def test_llada_and_its_connector() -> None:
    torch.manual_seed(0)
    held = llada()
    extra = {f"model.mm_projector.{at}.{kind}": torch.zeros(1) for at in (0, 2) for kind in ("weight", "bias")}
    tower = {"model.vision_tower.vision_tower.embeddings.weight": torch.zeros(1)}
    model, connector = load_published(config(HEADS), from_llada(held | extra | tower))
    ids = torch.randint(WORDS, (9,))
    with torch.no_grad():
        assert torch.allclose(model.eval()(input_ids=ids[None]).logits[0], llada_forward(held, ids), atol=1e-4)
    assert sorted(connector) == [f"connector.{at}.{kind}" for at in ("first", "second") for kind in ("bias", "weight")]


@pytest.mark.parametrize("groups", [HEADS, 2])
def test_smdm_with_fused_groups(groups: int) -> None:
    torch.manual_seed(1)
    held = smdm(groups)
    model, _ = load_published(config(groups), from_smdm(held, HEADS, groups))
    ids = torch.randint(WORDS, (9,))
    with torch.no_grad():
        assert torch.allclose(model.eval()(input_ids=ids[None]).logits[0], smdm_forward(held, ids, groups), atol=1e-4)


def test_what_is_no_such_checkpoint_is_refused() -> None:
    held = llada()
    with pytest.raises(DataError, match="blocks"):
        from_llada(held | {"model.transformer.blocks.0.gate.weight": torch.zeros(1)})
    with pytest.raises(DataError, match="wpe"):
        from_smdm({"transformer.wpe.weight": torch.zeros(1)}, HEADS, HEADS)
    with pytest.raises(DataError, match="heads"):
        from_smdm({"transformer.h.0.attn.attn.weight": torch.zeros(50, HIDDEN)}, HEADS, HEADS)
    with pytest.raises(DataError, match="lacks lm_head"):
        load_published(config(HEADS), {k: v for k, v in from_llada(held).items() if k != "lm_head.weight"})
    with pytest.raises(DataError, match="causal=False"):
        load_published(TransformerConfig(HIDDEN, LAYERS, HEADS, HEADS, INNER, WORDS), {})


def test_a_causal_model_becomes_one_that_fills_masks() -> None:
    torch.manual_seed(2)
    causal = language_model(TransformerConfig(HIDDEN, LAYERS, HEADS, 2, INNER, WORDS)).eval()
    model, mask = to_masked_diffusion(causal)
    assert mask == WORDS
    assert model.config.vocab_size == WORDS + 1
    ids = torch.randint(WORDS, (8,))
    # The last word is now seen by the first; before it was not.
    other = ids.clone()
    other[-1] = (other[-1] + 1) % WORDS
    with torch.no_grad():
        assert torch.equal(causal(input_ids=ids[None]).logits[0, :-1], causal(input_ids=other[None]).logits[0, :-1])
        assert not torch.allclose(model(input_ids=ids[None]).logits[0, 0], model(input_ids=other[None]).logits[0, 0])
    # It can be trained on: predicting a word from both sides of it.
    optimiser = torch.optim.AdamW(model.parameters(), lr=1e-2)
    response = torch.tensor([3, 4, 5, 6])
    losses = []
    for step in range(80):
        hidden = response.clone()
        hidden[step % 4] = mask
        logits = model(input_ids=torch.cat((ids, hidden))[None]).logits[0, len(ids) - 1 : -1]
        loss = torch.nn.functional.cross_entropy(logits[step % 4][None], response[step % 4][None])
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        losses.append(float(loss.detach()))
    assert sum(losses[-4:]) < 0.2 * sum(losses[:4])
    logits = response_logits(model.eval(), ids, mask, shifted=True)(torch.tensor([3, mask, 5, 6]))
    assert int(logits[1].argmax()) == 4
    assert (logits[:, mask] == float("-inf")).all()
