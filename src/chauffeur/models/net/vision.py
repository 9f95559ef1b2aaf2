# pyright: reportMissingImports=false, reportUntypedBaseClass=false, reportUnknownParameterType=false
"""Vision encoders: pictures to tokens. One interface for the small one that is trained here and for open weights.

    encoder = vision(VisionConfig())                 # ours, from nothing
    encoder = vision(VisionConfig("siglip", weights="FOLDER"))
    tokens = encoder(pictures)                       # (B, H, W, 3) to (B, T, encoder.width)

What comes out goes through a `Connector` (Eq. 28) into the transformer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Literal, Protocol, cast

import torch
from torch import nn

from chauffeur.concept import ConfigError, MissingExtraError
from chauffeur.models.net import efficientnet

VisionKind = Literal["small", "efficientnet-lite0", "siglip"]


@dataclass(frozen=True, slots=True)
class VisionConfig:
    """A vision encoder.

    Attributes:
        kind: `small`: strided convolutions, trained from nothing. `efficientnet-lite0`: its first stages, frozen.
            `siglip`: transformers' SigLIP or SigLIP 2 tower.
        size: Height and width of the pictures, px; of `small` multiples of all its strides together, of
            `efficientnet-lite0` of 16.
        channels: Of `small`: width of its stages, each halving the picture; the last one is the tokens' width.
        stem: Of `small`: stride of its first stage; 4 costs half of what 2 does.
        weights: Of `siglip`: folder or hub name of a checkpoint; empty for an untrained one (see `shape`). Of
            `efficientnet-lite0`: the file of its weights; empty for an untrained one.
        shape: Of an untrained `siglip`: arguments of its configuration.
        layer: Of `siglip`: whose hidden states are the tokens; LLaDA-V takes the one before the last.
    """

    kind: VisionKind = "small"
    size: tuple[int, int] = (64, 112)
    channels: tuple[int, ...] = (16, 32, 64, 128)
    stem: int = 2
    weights: str = ""
    shape: tuple[tuple[str, int], ...] = ()
    layer: int = -2


class VisionEncoder(Protocol):
    """Pictures to tokens; a module of torch.

    Attributes:
        width: Numbers of a token.
        tokens: How many a picture has, T.
    """

    width: int
    tokens: int

    def __call__(self, pictures: torch.Tensor) -> torch.Tensor:
        """Tokens (B, T, width), row by row, of pictures (B, H, W, 3): uint8, or floats from 0 to 1."""
        ...

    def parameters(self) -> Any:
        """Weights."""
        ...


def scaled(pictures: torch.Tensor) -> torch.Tensor:
    """Pictures (B, H, W, 3), uint8 or 0..1, as convolutions take them: (B, 3, H, W), float, 0..1."""
    floats = pictures.float() / 255.0 if pictures.dtype == torch.uint8 else pictures
    return floats.permute(0, 3, 1, 2)


def positions(rows: int, columns: int, width: int) -> torch.Tensor:
    """Sines and cosines of rows and columns, (rows * columns, width); width is a multiple of four."""
    quarter = width // 4
    frequency = torch.exp(torch.arange(quarter) * (-math.log(100.0) / quarter))
    at = torch.stack(torch.meshgrid(torch.arange(rows), torch.arange(columns), indexing="ij"), dim=-1).flatten(0, 1)
    angles = at[:, :, None].float() * frequency  # (N, 2, quarter)
    return torch.cat((angles.sin(), angles.cos()), dim=-1).flatten(1)


class SmallVision(nn.Module):
    """Strided convolutions with group norm; the last stages' features say where they are by sines."""

    def __init__(self, config: VisionConfig) -> None:
        """Args: its shape. Weights come from torch's global generator."""
        super().__init__()
        height, width = config.size
        step = config.stem * 2 ** (len(config.channels) - 1)
        if height % step or width % step:
            raise ConfigError(
                f"Pictures of {width}x{height} px do not divide by {step}.",
                hint="Choose another size, or fewer stages.",
            )
        stages: list[nn.Module] = []
        for place, (before, after) in enumerate(pairwise((3, *config.channels))):
            kernel, stride = (2 * config.stem - 1 if config.stem > 2 else 5, config.stem) if place == 0 else (3, 2)
            stages += [nn.Conv2d(before, after, kernel, stride, kernel // 2), nn.GroupNorm(4, after), nn.GELU()]
            if place >= len(config.channels) - 2:  # another look where the grid is coarse, and so costs little
                stages.append(_Residual(after))
        self.stages = nn.Sequential(*stages)
        self.width = config.channels[-1]
        rows, columns = height // step, width // step
        self.tokens = rows * columns
        self.where: Any = nn.Buffer(positions(rows, columns, self.width), persistent=False)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        features = self.stages(scaled(pictures) - 0.45)
        return features.flatten(2).transpose(1, 2) + self.where


class _Residual(nn.Module):
    """x + conv(gelu(norm(conv(x))))."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.first = nn.Conv2d(width, width, 3, 1, 1)
        self.norm = nn.GroupNorm(4, width)
        self.second = nn.Conv2d(width, width, 1)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        return x + self.second(nn.functional.gelu(self.norm(self.first(x))))


class EfficientNetVision(nn.Module):
    """EfficientNet-Lite0's features at a stride of 16, with open ImageNet weights that stay as they are."""

    def __init__(self, config: VisionConfig) -> None:
        """Args: the file of its weights, and the pictures' size.

        Raises:
            ConfigError: The weights cannot be read or are others, or the size does not divide.
        """
        super().__init__()
        height, width = config.size
        if height % efficientnet.STRIDE or width % efficientnet.STRIDE:
            raise ConfigError(
                f"Pictures of {width}x{height} px do not divide by {efficientnet.STRIDE}.", hint="Choose another size."
            )
        lite = efficientnet.EfficientNetLite0
        self.features = (lite.of(Path(config.weights)) if config.weights else lite()).eval().requires_grad_(False)
        self.width = efficientnet.WIDTH
        rows, columns = height // efficientnet.STRIDE, width // efficientnet.STRIDE
        self.tokens = rows * columns
        self.where: Any = nn.Buffer(positions(rows, columns, self.width), persistent=False)

    def train(self, mode: bool = True) -> EfficientNetVision:
        """Its batch norms keep their statistics: the encoder is never in training mode."""
        del mode
        return super().train(mode=False)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        return self.features(scaled(pictures)).flatten(2).transpose(1, 2) + self.where


class SiglipVision(nn.Module):
    """transformers' SigLIP tower (the fixed-resolution checkpoints of SigLIP 2 have its layout as well)."""

    def __init__(self, config: VisionConfig) -> None:
        """Args: checkpoint, or shape of an untrained one.

        Raises:
            MissingExtraError: transformers is not installed.
            ConfigError: The checkpoint cannot be read, or takes pictures of another size.
        """
        super().__init__()
        try:
            from transformers import SiglipVisionConfig, SiglipVisionModel
        except ImportError as error:
            raise MissingExtraError("SigLIP needs transformers.", extra="models") from error
        if config.weights:
            try:
                self.tower: Any = cast("Any", SiglipVisionModel).from_pretrained(config.weights)
            except (OSError, ValueError) as error:
                raise ConfigError(f"No SigLIP checkpoint at {config.weights!r}: {error}") from error
        else:
            shape: dict[str, Any] = {"image_size": config.size[0], "vision_use_head": False, **dict(config.shape)}
            self.tower = SiglipVisionModel(SiglipVisionConfig(**shape))
        own: Any = self.tower.config
        if config.size != (own.image_size, own.image_size):
            raise ConfigError(
                f"This SigLIP takes pictures of {own.image_size}x{own.image_size} px, not {config.size}.",
                hint=f"Set size=({own.image_size}, {own.image_size}).",
            )
        self.width, self.tokens = int(own.hidden_size), (own.image_size // own.patch_size) ** 2
        self._layer = config.layer

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """See VisionEncoder. SigLIP was trained on values from -1 to 1."""
        pixels = scaled(pictures) * 2.0 - 1.0
        return self.tower(pixel_values=pixels, output_hidden_states=True).hidden_states[self._layer]


_KINDS: Final[Mapping[str, Callable[[VisionConfig], nn.Module]]] = {
    "small": SmallVision,
    "efficientnet-lite0": EfficientNetVision,
    "siglip": SiglipVision,
}


def vision(config: VisionConfig) -> VisionEncoder:
    """The encoder of a configuration.

    Raises:
        ConfigError: No such kind, a size that it cannot take, or weights that cannot be read.
        MissingExtraError: It needs a package that is not installed.
    """
    if config.kind not in _KINDS:
        raise ConfigError(f"There is no vision encoder {config.kind!r}.", hint=f"Choose of: {', '.join(_KINDS)}.")
    return cast("VisionEncoder", _KINDS[config.kind](config))
