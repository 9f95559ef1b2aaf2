"""Vision encoders: one interface, pictures to tokens."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from chauffeur.concept import ConfigError

torch = pytest.importorskip("torch")

from chauffeur.models.net.vision import VisionConfig, vision  # noqa: E402

SIGLIP = (
    ("patch_size", 16),
    ("hidden_size", 32),
    ("intermediate_size", 64),
    ("num_hidden_layers", 2),
    ("num_attention_heads", 2),
)


@pytest.mark.parametrize(
    "config",
    [
        VisionConfig(size=(32, 48), channels=(8, 16, 32)),
        VisionConfig("efficientnet-lite0", (32, 48)),
        VisionConfig("siglip", (32, 32), shape=SIGLIP),
    ],
)
def test_pictures_become_tokens(config: VisionConfig) -> None:
    if config.kind == "siglip":
        pytest.importorskip("transformers")
    torch.manual_seed(0)
    encoder = vision(config)
    pictures = torch.randint(0, 256, (2, *config.size, 3), dtype=torch.uint8)
    tokens = encoder(pictures)
    assert tokens.shape == (2, encoder.tokens, encoder.width)
    assert torch.allclose(tokens, encoder(pictures.float() / 255.0), atol=1e-5)
    changed = pictures.clone()
    changed[0] = 255 - changed[0]
    other = encoder(changed)
    assert not torch.allclose(tokens[0], other[0], atol=1e-3)
    assert torch.allclose(tokens[1], other[1], atol=1e-5)  # a picture is encoded by itself


def test_tokens_say_where_they_are() -> None:
    encoder = vision(VisionConfig(size=(32, 48), channels=(8, 16, 32)))
    tokens = encoder(torch.zeros((1, 32, 48, 3)))[0].detach()
    assert len({tuple(round(float(v), 3) for v in token) for token in tokens}) == len(tokens)


@pytest.mark.parametrize(
    "config",
    [VisionConfig(size=(30, 48)), VisionConfig("siglip", (32, 48), shape=SIGLIP), VisionConfig("nothing")],  # type: ignore[arg-type]
)
def test_what_cannot_be_is_refused(config: VisionConfig) -> None:
    if config.kind == "siglip":
        pytest.importorskip("transformers")
    with pytest.raises(ConfigError):
        vision(config)


def test_open_weights_stay_as_they_are_and_other_files_are_refused(tmp_path: Path) -> None:
    encoder: Any = vision(VisionConfig("efficientnet-lite0", (32, 48)))
    assert not encoder.train().training and not any(weight.requires_grad for weight in encoder.parameters())
    other = tmp_path / "other.pth"
    other.write_bytes(b"something else")
    for weights in (other, tmp_path / "none.pth"):
        with pytest.raises(ConfigError):
            vision(VisionConfig("efficientnet-lite0", (32, 48), weights=str(weights)))
