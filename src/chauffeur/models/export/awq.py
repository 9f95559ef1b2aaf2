# pyright: reportMissingImports=false, reportUnknownMemberType=false
"""Activation-aware quantisation to 4 bits (AWQ, Lin et al. 2024) of a decoder of `transformers`, for real servers.

Few input channels carry large activations, and rounding the weights that meet those costs most. AWQ multiplies the
columns of such channels by s > 1 before rounding, and divides what comes before them (a norm's weights, or the rows of
the matrix before) by s: the function stays the same, the error of those columns falls by s. With x the calibration
inputs of matrices that share them, s = mean|x| ** a, and `a` is searched for the least ||Q(W s) (x / s) - W x||^2.

Written as `pack-quantized` of compressed-tensors, which vLLM and LMDeploy read; for every matrix (out, in):

    weight_packed      int32 (out, in / 8)       eight numbers a word, the first in the lowest bits, each plus 8
    weight_scale       (out, in / group)         w = (q - z) * scale
    weight_zero_point  int32 (out / 8, in / group)
    weight_shape       int64 (2,)                (out, in)
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import torch
from torch import Tensor, nn

from chauffeur.concept import ConfigError

BITS: Final = 4
_LOW: Final = -(1 << (BITS - 1))
_HIGH: Final = (1 << (BITS - 1)) - 1
_A_WORD: Final = 32 // BITS
_EXPONENTS: Final = tuple(step / 20.0 for step in range(20))
"""Searched for `a`; 0 is rounding to nearest, so that the search is never worse than that on its own inputs."""
_ROWS: Final = 512
"""Calibration rows kept a group of matrices."""


@dataclass(frozen=True, slots=True)
class Rounded:
    """A matrix in 4 bits.

    Attributes:
        numbers: int8 (out, in), -8 to 7.
        scale: (out, in / group).
        zero: int8 (out, in / group), -8 to 7.
    """

    numbers: Tensor
    scale: Tensor
    zero: Tensor

    def weight(self) -> Tensor:
        """Dequantised weight that a server computes with: (out, in), in the scale's type."""
        group = self.numbers.shape[1] // self.scale.shape[1]
        wide = (self.numbers - self.zero.repeat_interleave(group, 1)).to(self.scale.dtype)
        return wide * self.scale.repeat_interleave(group, 1)


def rounded(weight: Tensor, group: int) -> Rounded:
    """Round a matrix (out, in) to nearest, a scale and a zero for each `group` of a row."""
    out, width = weight.shape
    parts = weight.float().reshape(out, width // group, group)
    low, high = parts.amin(2).clamp(max=0.0), parts.amax(2).clamp(min=0.0)
    # The scale is rounded to the type it is stored in first: the numbers must fit the scale that is read.
    scale = ((high - low) / (_HIGH - _LOW)).clamp(min=1e-8).to(weight.dtype)
    zero = (_LOW - low / scale.float()).round().clamp(_LOW, _HIGH)
    numbers = (parts / scale.float()[..., None]).round().add(zero[..., None]).clamp(_LOW, _HIGH)
    return Rounded(numbers.reshape(out, width).to(torch.int8), scale, zero.to(torch.int8))


def packed(numbers: Tensor, along: int = 1) -> Tensor:
    """Numbers of -8 to 7 as int32 words, eight to a word along an axis; the last word is filled up with zero bits."""
    rows = numbers if along == 1 else numbers.T
    lacking = -rows.shape[1] % _A_WORD
    shifted = nn.functional.pad(rows.to(torch.int64) - _LOW, (0, lacking))
    places = BITS * torch.arange(_A_WORD)
    words = (shifted.reshape(rows.shape[0], -1, _A_WORD) << places).sum(2)
    words = torch.where(words >= 1 << 31, words - (1 << 32), words).to(torch.int32)
    return (words if along == 1 else words.T).contiguous()


@dataclass(frozen=True, slots=True)
class _Group:
    """Matrices with the same input, and what makes that input: a norm's weights, or the matrix before."""

    readers: Mapping[str, nn.Linear]
    before: nn.Module


@dataclass(frozen=True, slots=True)
class GroupError:
    """Error of one group's outputs on its calibration inputs, as a share of their own size.

    Attributes:
        readers: Names of the matrices.
        exponent: What the search chose for `a`.
        nearest: Relative root mean square error of rounding to nearest.
        chosen: That of the scaled matrices.
    """

    readers: tuple[str, ...]
    exponent: float
    nearest: float
    chosen: float


def quantise(
    model: nn.Module,
    forwards: Iterable[Callable[[], object]],
    group: int = 128,
    watch: Callable[[int, int], None] | None = None,
) -> tuple[dict[str, Rounded], list[GroupError]]:
    """Quantise the decoder layers of a model; it is scaled in place, its function as before.

    Args:
        model: Llama, Qwen2, Qwen3, or a vision-language model around one; only its language layers are quantised.
        forwards: Each runs the model once on calibration inputs.
        group: Weights of a row that share a scale; divides every matrix's width.
        watch: Called after each group of matrices with (how many are done, of how many).

    Returns:
        (matrices by module name, errors group by group).

    Raises:
        ConfigError: It has no such layers, or the group does not divide a matrix.
    """
    groups = _groups_of(model)
    if not groups:
        raise ConfigError(
            f"{type(model).__name__} has no decoder layers that are known here.",
            hint="Llama, Qwen2, Qwen3 and vision-language models around them can be quantised.",
        )
    for one in groups:
        for name, reader in one.readers.items():
            if reader.in_features % group:
                raise ConfigError(
                    f"{name} is {reader.in_features} wide, which groups of {group} do not divide.",
                    hint="Give another --group-size, e.g. 64 or 32.",
                )
    inputs = _calibrated(groups, forwards)
    errors: list[GroupError] = []
    with torch.no_grad():
        for place, (one, x) in enumerate(zip(groups, inputs, strict=True)):
            error, scale = _searched(one, x, group)
            _scale(one, scale)
            errors.append(error)
            if watch is not None:
                watch(place + 1, len(groups))
    # Rounded only now: the rows of a matrix that feeds another (up before down) are scaled after its own turn.
    matrices = {name: reader for one in groups for name, reader in one.readers.items()}
    return {name: rounded(reader.weight.detach().cpu(), group) for name, reader in matrices.items()}, errors


def write_packed(model: Any, matrices: Mapping[str, Rounded], out: Path, group: int = 128) -> None:
    """Write a checkpoint folder: the model with its quantised matrices packed, and how to read them in `config.json`.

    Args:
        model: A model of transformers, as `quantise` left it.
        matrices: What `quantise` found.
        out: The folder.
        group: As quantised.
    """
    state: dict[str, Tensor] = dict(model.state_dict())
    for name, one in matrices.items():
        del state[f"{name}.weight"]
        state |= {
            f"{name}.weight_packed": packed(one.numbers),
            f"{name}.weight_scale": one.scale.contiguous(),
            f"{name}.weight_zero_point": packed(one.zero, 0),
            f"{name}.weight_shape": torch.tensor(one.numbers.shape, dtype=torch.int64),
        }
    model.save_pretrained(out, state_dict=state)
    weights = {"num_bits": BITS, "type": "int", "symmetric": False, "strategy": "group", "group_size": group}
    config = json.loads((out / "config.json").read_text("utf-8"))
    config["quantization_config"] = {
        "quant_method": "compressed-tensors",
        "format": "pack-quantized",
        "quantization_status": "compressed",
        "config_groups": {
            "group_0": {
                "targets": ["Linear"],
                "weights": {**weights, "dynamic": False},
                "input_activations": None,
                "output_activations": None,
            }
        },
        "ignore": _left_out(model, matrices),
        "kv_cache_scheme": None,
    }
    (out / "config.json").write_text(json.dumps(config, indent=2) + "\n", encoding="utf-8")


def _groups_of(model: nn.Module) -> list[_Group]:
    found: list[_Group] = []
    for name, layer in model.named_modules():
        parts = dict(layer.named_modules())
        if not {"input_layernorm", "post_attention_layernorm", "self_attn.q_proj", "mlp.gate_proj"} <= parts.keys():
            continue

        def readers(*names: str, of: dict[str, nn.Module] = parts, at: str = name) -> dict[str, nn.Linear]:
            return {f"{at}.{one}": part for one in names if isinstance(part := of.get(one), nn.Linear)}

        found += [
            _Group(readers("self_attn.q_proj", "self_attn.k_proj", "self_attn.v_proj"), parts["input_layernorm"]),
            _Group(readers("self_attn.o_proj"), parts["self_attn.v_proj"]),
            _Group(readers("mlp.gate_proj", "mlp.up_proj"), parts["post_attention_layernorm"]),
            _Group(readers("mlp.down_proj"), parts["mlp.up_proj"]),
        ]
    return found


def _calibrated(groups: list[_Group], forwards: Iterable[Callable[[], object]]) -> list[Tensor]:
    """Inputs of each group, (rows, width): at most `_ROWS`, as many of each forward pass, spread over it."""
    runs = list(forwards)
    each = max(1, _ROWS // max(1, len(runs)))
    kept: list[list[Tensor]] = [[] for _ in groups]

    def keep(place: int) -> Callable[[nn.Module, tuple[Tensor, ...]], None]:
        def hook(_: nn.Module, given: tuple[Tensor, ...]) -> None:
            rows = given[0].detach().reshape(-1, given[0].shape[-1])
            at = torch.linspace(0, len(rows) - 1, min(each, len(rows))).round().long()
            kept[place].append(rows[at.to(rows.device)].float().cpu())

        return hook

    hooks = [next(iter(one.readers.values())).register_forward_pre_hook(keep(i)) for i, one in enumerate(groups)]
    try:
        with torch.no_grad():
            for run in runs:
                run()
    finally:
        for hook in hooks:
            hook.remove()
    if not all(kept):
        raise ConfigError("No calibration input came through every layer.", hint="Give at least one example.")
    return [torch.cat(rows) for rows in kept]


def _searched(one: _Group, x: Tensor, group: int) -> tuple[GroupError, Tensor | None]:
    """The best scales of the input channels, (width,); None where they cannot be moved to what comes before."""
    weights = [reader.weight.detach().float().cpu() for reader in one.readers.values()]
    stored = next(iter(one.readers.values())).weight.dtype
    size = sum(float((x @ w.T).pow(2).sum()) for w in weights)

    def error(scale: Tensor) -> float:
        off = 0.0
        for w in weights:
            near = rounded((w * scale).to(stored), group).weight().float()
            off += float(((x / scale) @ near.T - x @ w.T).pow(2).sum())
        return (off / max(size, 1e-30)) ** 0.5

    def scales(exponent: float) -> Tensor:
        scale = x.abs().mean(0).clamp(min=1e-4).pow(exponent)
        return scale / (scale.max() * scale.min()).sqrt()

    nearest = error(torch.ones(x.shape[1]))
    best, exponent = nearest, 0.0
    if _can_scale(one):
        for tried in _EXPONENTS[1:]:
            off = error(scales(tried))
            if off < best:
                best, exponent = off, tried
    told = GroupError(tuple(one.readers), exponent, nearest, best)
    return told, scales(exponent) if exponent else None


def _can_scale(one: _Group) -> bool:
    """True if what comes before gives every channel its own; heads that share their values do not."""
    width = next(iter(one.readers.values())).in_features
    return one.before.get_parameter("weight").shape[0] == width


def _scale(one: _Group, scale: Tensor | None) -> None:
    if scale is None:
        return
    for reader in one.readers.values():
        reader.weight.mul_(scale.to(reader.weight))
    before = one.before.get_parameter("weight")
    before.div_(scale.to(before) if before.dim() == 1 else scale.to(before)[:, None])
    bias = getattr(one.before, "bias", None)
    if bias is not None:
        bias.div_(scale.to(bias))


def _left_out(model: nn.Module, matrices: Mapping[str, Rounded]) -> list[str]:
    """Patterns of the matrices that stay as they were: the largest parts that hold no quantised one."""
    whole: set[str] = set()
    for name, module in model.named_modules():
        if not isinstance(module, nn.Linear) or name in matrices:
            continue
        steps = name.split(".")
        for depth in range(1, len(steps) + 1):
            prefix = ".".join(steps[:depth])
            if not any(one.startswith(f"{prefix}.") for one in matrices):
                whole.add(steps[depth - 1])
                break
    return [f"re:.*{re.escape(one)}.*" for one in sorted(whole)]
