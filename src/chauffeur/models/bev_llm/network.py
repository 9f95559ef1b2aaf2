# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""BEV-LLM: a vision encoder for every view, BEV fusion, a projector, and a decoder with cross-attention layers.

The decoder is `transformers`' Mllama text model (Llama-3.2-Vision). With real weights the vision encoder is Mllama's as
well (`from_mllama`); the compact one has a small convolutional encoder in its place and is trained from nothing.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

import torch
from torch import nn

from chauffeur.models.bev_llm.fusion import BevFusion, CrossAttention, FusionConfig
from chauffeur.models.bev_llm.views import FRONT_VIEWS, VIEWS
from chauffeur.models.net.connector import Connector

Network = Any
END_TOKEN: Final = 1
_BAGS: Final = (1, 2)
"""Of the parts of a text that END_TOKEN ends, the question and the option; before them come the speeds."""
_FORGOTTEN: Final = 0.2
"""Share of the gist's inputs that are dropped in training."""


_LISTS: Final = ("facets", "cross", "size", "channels", "gist")
Keep = Literal["full", "no-bev", "no-history", "single-view", "blind"]
"""Inputs that a network keeps: an ablation, in training or at the test alone."""


@dataclass(frozen=True, slots=True)
class CompactConfig:
    """Shape of the compact network.

    Attributes:
        vocabulary: Words it reads; the first `strange` of them are none it knows.
        facets: Sizes of the classes of what its first tokens are taught to hold; see `facets`.
        hidden, layers, heads, cross: Of the decoder; `cross` names its cross-attention layers.
        size: Views' (height, width), px; multiples of 16.
        channels: Of the encoder's three stages; the last two are its features.
        fusion: Of the BEV fusion; its width is that of the last stage.
        free: Tokens that are taught nothing but the answers.
        views: How many there are.
        gist: Numbers of the gist, and of each patch and cell as it enters it.
        kinds: Kinds of road users that a cell is taught to hold.
        positions: Longest text, words.
    """

    vocabulary: int
    facets: tuple[int, ...]
    strange: int = 18
    hidden: int = 64
    layers: int = 4
    heads: int = 4
    cross: tuple[int, ...] = (1, 3)
    size: tuple[int, int] = (64, 112)
    channels: tuple[int, ...] = (24, 48, 64)
    fusion: FusionConfig = field(default_factory=lambda: FusionConfig(64, 2, bev_width=64))
    free: int = 4
    views: int = len(VIEWS)
    gist: tuple[int, int] = (192, 12)
    kinds: int = 7
    positions: int = 96

    @property
    def patches(self) -> tuple[int, int]:
        """Rows and columns of features of a view."""
        return self.size[0] // 16, self.size[1] // 16

    def json(self) -> dict[str, Any]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def of(cls, values: dict[str, Any]) -> CompactConfig:
        """From plain values."""
        lists: dict[str, Any] = {name: tuple(values[name]) for name in _LISTS}
        rest: dict[str, Any] = {**values, **lists, "fusion": FusionConfig(**values["fusion"])}
        return cls(**rest)


class CompactViews(nn.Module):
    """A strided stem and two strided stages with a convolution more each; features of both on one grid of patches."""

    def __init__(self, config: CompactConfig) -> None:
        """Args: shape of the network."""
        super().__init__()
        stem, fine, coarse = config.channels
        self.stem = _convolved(3, stem, 6, 4, 1)
        self.middle = nn.Sequential(_convolved(stem, fine, 3, 2, 1), _convolved(fine, fine, 3, 1, 1))
        self.last = nn.Sequential(_convolved(fine, coarse, 3, 2, 1), _convolved(coarse, coarse, 3, 1, 1))
        self.fine = nn.Linear(4 * fine, coarse)

    def forward(self, pixels: torch.Tensor) -> torch.Tensor:
        """(N, 3, H, W) in 0..1 to (N, patches, 2 * width): the coarse stage, then the fine one folded onto its grid."""
        fine = self.middle(self.stem((pixels - 0.45) * 2.0))
        coarse = self.last(fine)
        folded = nn.functional.pixel_unshuffle(fine, 2)
        return torch.cat([coarse.flatten(2).transpose(1, 2), self.fine(folded.flatten(2).transpose(1, 2))], dim=-1)


def _convolved(before: int, after: int, kernel: int, stride: int, padding: int) -> nn.Sequential:
    return nn.Sequential(nn.Conv2d(before, after, kernel, stride, padding), nn.GroupNorm(4, after), nn.GELU())


class Gist(nn.Module):
    """All patches and all cells at a glance: a weight of its own for every place.

    The cameras are fixed to the car, so where the lane ahead or the lane beside shows is the same in every picture.
    Attention has to find that out from nothing; one matrix over all places learns it from a tenth of the scenes.
    """

    def __init__(self, config: CompactConfig) -> None:
        """Args: shape of the network."""
        super().__init__()
        inner, kept = config.gist
        fusion = config.fusion
        self.flat = config.views * config.patches[0] * config.patches[1] * kept
        self.tokens = len(config.facets) + config.free
        self.patch = nn.Linear(fusion.width * fusion.layers, kept)
        self.patches = nn.Linear(self.flat, inner)
        if fusion.bev:
            self.cell = nn.Linear(fusion.bev_width, kept)
            self.cells = nn.Linear(fusion.grid.cells * kept, inner)
        self.out = nn.Sequential(
            nn.LayerNorm(inner), nn.GELU(), nn.Dropout(_FORGOTTEN), nn.Linear(inner, self.tokens * config.hidden)
        )

    def forward(self, fused: torch.Tensor, cells: torch.Tensor | None) -> torch.Tensor:
        """Features of the first views' patches, (B, M, layers * width), and cells, (B, cells, bev_width) or none, to
        what is added to each token, (B, tokens, hidden)."""
        drop = nn.functional.dropout
        seen = nn.functional.gelu(self.patch(fused)).flatten(1)
        seen = nn.functional.pad(seen, (0, self.flat - seen.shape[1]))
        whole = self.patches(drop(seen, _FORGOTTEN, self.training))
        if cells is not None:
            whole = whole + self.cells(drop(nn.functional.gelu(self.cell(cells)).flatten(1), _FORGOTTEN, self.training))
        return self.out(whole).unflatten(1, (self.tokens, -1))


class Resampler(nn.Module):
    """A few learned queries that gather what the views show into as many tokens (the resampler of Flamingo)."""

    def __init__(self, tokens: int, hidden: int, heads: int, layers: int = 2) -> None:
        """Args: tokens out; numbers of a token; heads and layers."""
        super().__init__()
        self.tokens = nn.Parameter(torch.randn(tokens, hidden) * 0.1)
        self.gather = nn.ModuleList(CrossAttention(hidden, hidden, hidden, heads) for _ in range(layers))
        self.mix = nn.ModuleList(
            nn.Sequential(nn.LayerNorm(hidden), nn.Linear(hidden, 2 * hidden), nn.GELU(), nn.Linear(2 * hidden, hidden))
            for _ in range(layers)
        )

    def forward(self, seen: torch.Tensor, gist: torch.Tensor) -> torch.Tensor:
        """What the views show, (B, K, hidden), and what each token begins with, (B, tokens, hidden), to the latter."""
        x = self.tokens + gist
        for gather, mix in zip(self.gather, self.mix, strict=True):
            x = x + gather(x, seen)
            x = x + mix(x)
        return x


class MeaningHead(nn.Module):
    """Class and facet that a question with an option means, from which words are in the one and in the other.

    Order is left out on purpose: taught a few wordings of each class, a network that reads in order knows these
    wordings, one that does not knows their words. (With one wording in four kept apart, it understood 85 % of them;
    the decoder, taught the same, 78 %.)
    """

    def __init__(self, vocabulary: int, strange: int, hidden: int, classes: int) -> None:
        """Args: words it reads, and how many of the first are none it knows; numbers of a word; classes of all."""
        super().__init__()
        self.strange = strange
        self.words = nn.Embedding(vocabulary, hidden)
        nn.init.normal_(self.words.weight, std=0.3)
        self.first = nn.Linear(2 * hidden, hidden)
        self.out = nn.Linear(hidden, classes)

    def forward(self, words: torch.Tensor) -> torch.Tensor:
        """Texts of `WordTable.text`, (N, L), to logarithms of probabilities, (N, classes)."""
        ends = words == END_TOKEN
        part = ends.cumsum(dim=1)
        known = words >= self.strange
        seen = self.words(words)
        bags = [((known & (part == place)).to(seen.dtype)[:, None] @ seen).squeeze(1) for place in _BAGS]
        return self.out(nn.functional.gelu(self.first(torch.cat(bags, dim=1)))).log_softmax(dim=1)


class CompactBevLlm(nn.Module):
    """The compact network: it scores the options of a question, each read by itself after the question."""

    def __init__(self, config: CompactConfig) -> None:
        """Args: its shape. Weights come from torch's global generator."""
        super().__init__()
        self.config = config
        self.views = CompactViews(config)
        self.fusion = BevFusion(config.fusion)
        self.projector = Connector(config.fusion.width * config.fusion.layers, config.hidden)
        self.gist = Gist(config)
        self.resampler = Resampler(len(config.facets) + config.free, config.hidden, config.heads)
        self.taught = nn.ModuleList(nn.Linear(config.hidden, classes) for classes in config.facets)
        if config.fusion.bev:
            self.occupied = nn.Linear(config.fusion.bev_width, config.kinds)
        self.decoder = _decoder(config)
        self.means = MeaningHead(config.vocabulary, config.strange, config.hidden, sum(config.facets))
        self.rarity: torch.Tensor
        self.register_buffer("rarity", torch.zeros(sum(config.facets)))
        self.fits = nn.Linear(config.hidden, 1)
        nn.init.zeros_(self.fits.weight)

    def see(
        self,
        now: torch.Tensor,
        past: torch.Tensor,
        rig: tuple[torch.Tensor, ...],
        motion: torch.Tensor,
        keep: Keep = "full",
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Vectors that the decoder attends to.

        Args:
            now: Views at the present instant, (B, V, 3, H, W) in 0..1.
            past: The first views at the instants before, oldest first, (B, T - 1, P, 3, H, W).
            rig: See BevFusion.
            motion: See BevFusion.
            keep: What is used of all that.

        Returns:
            Tokens (B, facets + free, hidden), and the cells (B, cells, bev_width), where there are any.
        """
        return self.gather(*self.encode(now, past, keep), rig, motion, keep)

    def encode(self, now: torch.Tensor, past: torch.Tensor, keep: Keep = "full") -> tuple[torch.Tensor, torch.Tensor]:
        """Features of every patch, each view by itself.

        Args:
            now, past: See `see`.
            keep: `blind` shows grey pictures.

        Returns:
            (B, V, patches, layers * width) at the present instant, (B, T - 1, P, patches, layers * width) before.
        """
        if keep == "blind":
            now, past = torch.full_like(now, 0.5), torch.full_like(past, 0.5)
        features = self.views(torch.cat([now.flatten(0, 1), past.flatten(0, 2)]))
        count = now.shape[0] * now.shape[1]
        return features[:count].unflatten(0, now.shape[:2]), features[count:].unflatten(0, past.shape[:3])

    def gather(
        self,
        present: torch.Tensor,
        before: torch.Tensor,
        rig: tuple[torch.Tensor, ...],
        motion: torch.Tensor,
        keep: Keep = "full",
    ) -> tuple[torch.Tensor, torch.Tensor | None]:
        """Vectors that the decoder attends to, from the features of `encode`; see `see`."""
        if keep == "single-view":
            present = present[:, :FRONT_VIEWS]
        if keep in ("no-history", "no-bev") or not self.config.fusion.history:
            before, motion = before[:, :0], motion[:, -1:] * 0.0
        fused, cells = self.fusion(present.flatten(1, 2), before.flatten(2, 3), rig, motion, bev=keep != "no-bev")
        return self.resampler(self.projector(fused), self.gist(fused, cells)), cells

    def classes(self, tokens: torch.Tensor) -> list[torch.Tensor]:
        """Logits of every facet's classes, each (B, classes), from the tokens of `see`."""
        return [head(tokens[:, place]) for place, head in enumerate(self.taught)]

    def beliefs(self, tokens: torch.Tensor) -> torch.Tensor:
        """Logarithms of how likely each class of each facet is, one facet after the other, (B, classes of all).

        Questions are balanced and scenes are not: what is rare is believed more readily than the heads say it, by
        `rarity`, which follows from how often each class comes in the training split.
        """
        return torch.cat([logits.log_softmax(dim=1) for logits in self.classes(tokens)], dim=1) + self.rarity

    def forward(
        self, tokens: torch.Tensor, words: torch.Tensor, mask: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Score options: how likely what an option means is in the scene, and what the decoder adds to that.

        Args:
            tokens: From `see`, one row a text, (N, K, hidden).
            words: Questions with one option each, padded at the end, (N, L).
            mask: 1 where there is a word.

        Returns:
            (N,), the higher the likelier; and logarithms of how likely each text means each class, as in `beliefs`.
        """
        found = self.decoder(
            input_ids=words,
            attention_mask=mask,
            cross_attention_states=tokens,
            cross_attention_mask=_all_of(tokens, words),
            use_cache=False,
        ).last_hidden_state
        read = found[torch.arange(len(words)), mask.sum(dim=1) - 1]
        meant = self.means(words)
        return (meant + self.beliefs(tokens)).logsumexp(dim=1) + self.fits(read).squeeze(-1), meant


def _all_of(seen: torch.Tensor, tokens: torch.Tensor) -> torch.Tensor:
    """A mask that hides nothing, (B, 1, L, K): without one, transformers' scaled dot-product attention takes the
    cross-attention for causal, and a token would see the first patches alone."""
    return seen.new_zeros(seen.shape[0], 1, tokens.shape[1], seen.shape[1])


def _decoder(config: CompactConfig) -> Network:
    from transformers import MllamaTextModel
    from transformers.models.mllama.configuration_mllama import MllamaTextConfig

    text: Any = MllamaTextConfig(
        vocab_size=config.vocabulary,
        hidden_size=config.hidden,
        intermediate_size=2 * config.hidden,
        num_hidden_layers=config.layers,
        num_attention_heads=config.heads,
        num_key_value_heads=config.heads,
        cross_attention_layers=list(config.cross),
        max_position_embeddings=config.positions,
        pad_token_id=0,
        bos_token_id=END_TOKEN,
        eos_token_id=END_TOKEN,
        rope_parameters={"rope_type": "default", "rope_theta": 10_000.0},
    )
    model: Network = MllamaTextModel(text)
    for place in config.cross:  # untrained, nothing is gained by gates that let nothing through at first
        nn.init.ones_(model.layers[place].cross_attn_attn_gate)
        nn.init.ones_(model.layers[place].cross_attn_mlp_gate)
    return model


class MllamaBevLlm(nn.Module):
    """BEV-LLM on Llama-3.2-Vision: its encoder sees every view, the fusion stands before its own projector."""

    def __init__(self, mllama: Network, fusion: FusionConfig | None = None) -> None:
        """Args: a `MllamaForConditionalGeneration`; the fusion's shape, whose width and layers it decides itself."""
        super().__init__()
        self.mllama = mllama
        vision = mllama.config.vision_config
        base = fusion or FusionConfig(0, bev_width=256)
        layers = 1 + len(vision.intermediate_layers_indices)
        self.fusion = BevFusion(replace(base, width=vision.hidden_size, layers=layers)).to(mllama.dtype)
        self.fusion.start_silent()

    @classmethod
    def from_mllama(cls, folder: Path, fusion: FusionConfig | None = None) -> MllamaBevLlm:
        """Weights in the layout of transformers, e.g. Llama-3.2-11B-Vision-Instruct; `fusion.safetensors` beside them.

        Raises:
            OSError: There is no such checkpoint.
        """
        from safetensors.torch import load_file
        from transformers import MllamaForConditionalGeneration

        model = cls(MllamaForConditionalGeneration.from_pretrained(folder), fusion)
        if (own := folder / "fusion.safetensors").is_file():
            model.fusion.load_state_dict(load_file(own))
        return model

    def save(self, folder: Path) -> None:
        """Both in one folder: Mllama's own layout, and the fusion's weights."""
        from safetensors.torch import save_file

        self.mllama.save_pretrained(folder)
        save_file(self.fusion.state_dict(), folder / "fusion.safetensors")

    def see(
        self, pixels: torch.Tensor, ratios: torch.Tensor, rig: tuple[torch.Tensor, ...], motion: torch.Tensor
    ) -> torch.Tensor:
        """Vectors that the decoder attends to.

        Args:
            pixels: (B, T, V, tiles, 3, side, side), as Mllama's image processor makes them.
            ratios: Ids of the tilings, (B, T, V).
            rig: Geometry for the tokens of a view: `tile_geometry`.
            motion: See BevFusion.

        Returns:
            (B, V * tiles * tokens, hidden).
        """
        batch, instants = pixels.shape[:2]
        flat = pixels.flatten(0, 1)
        tiles = torch.ones(flat.shape[:3], dtype=torch.long, device=pixels.device)
        found = self.mllama.model.vision_model(
            pixel_values=flat, aspect_ratio_ids=ratios.flatten(0, 1), aspect_ratio_mask=tiles
        ).last_hidden_state
        features = found.reshape(batch, instants, -1, found.shape[-1])
        fused, _ = self.fusion(features[:, -1], features[:, :-1], rig, motion)
        return self.mllama.model.multi_modal_projector(fused)

    def forward(self, seen: torch.Tensor, tokens: torch.Tensor, mask: torch.Tensor | None = None) -> torch.Tensor:
        """Logits of the next token, (B, L, vocabulary)."""
        states = self.mllama.model.language_model(
            input_ids=tokens,
            attention_mask=mask,
            cross_attention_states=seen,
            cross_attention_mask=_all_of(seen, tokens),
            use_cache=False,
        ).last_hidden_state
        return self.mllama.lm_head(states)
