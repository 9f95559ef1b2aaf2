"""What a machine allows a decision: bytes moved over bandwidth or FLOP over peak, whichever is slower, pass by pass.

Counted are the transformer's weights, read once a pass, keys and values that are kept, and the products of weights and
of attention: the least that any program has to do. Bandwidth and peak are measured on the machine itself: a large copy,
bytes read and written, and a large product of matrices in the networks' precision.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import median

import torch

from chauffeur.models.net.transformer import TransformerConfig


@dataclass(frozen=True, slots=True)
class Machine:
    """Measured: bytes moved per second, and FLOP per second."""

    bandwidth: float
    peak: float


@dataclass(frozen=True, slots=True)
class Pass:
    """A forward pass: tokens that are computed, those whose keys and values are kept, whether it is causal."""

    tokens: int
    kept: int = 0
    causal: bool = False


@dataclass(frozen=True, slots=True)
class Limit:
    """Of a decision: s at the limit, s of them in passes that bytes bound, all bytes and all FLOP."""

    seconds: float
    by_bytes: float
    moved: float
    flop: float


def machine(device: torch.device, dtype: torch.dtype, repeats: int = 10) -> Machine:
    """Measure it."""
    many = 1 << 31
    one = torch.randint(0, 99, (many,), dtype=torch.uint8, device=device)
    two = torch.empty_like(one)
    moved = 2.0 * many / _seconds(lambda: two.copy_(one), repeats)
    a, b = (torch.randn(8192, 8192, device=device, dtype=dtype) for _ in range(2))
    return Machine(moved, 2.0 * 8192**3 / _seconds(lambda: a @ b, repeats))


def _seconds(run: Callable[[], object], repeats: int) -> float:
    run()
    torch.cuda.synchronize()
    found: list[float] = []
    for _ in range(repeats):
        begun = time.perf_counter()
        run()
        torch.cuda.synchronize()
        found.append(time.perf_counter() - begun)
    return median(found)


def weights_of(config: TransformerConfig) -> int:
    """Weights of the layers' products."""
    heads = config.head_width * (2 * config.heads + 2 * config.kv_heads)
    return config.layers * config.hidden * (heads + 3 * config.inner)


def limit(config: TransformerConfig, passes: Sequence[Pass], width: int, on: Machine) -> Limit:
    """Of a decision in so many passes; `width` is bytes of a number."""
    weights, line = weights_of(config), config.layers * config.kv_heads * config.head_width
    seconds = by_bytes = moved = flop = 0.0
    for one in passes:
        sees = one.kept + ((one.tokens + 1) / 2 if one.causal else one.tokens)
        work = 2.0 * weights * one.tokens + 4.0 * config.layers * config.heads * config.head_width * one.tokens * sees
        carried = width * (weights + 2.0 * line * (one.kept + (one.tokens if one.kept else 0)))
        slow, fast = carried / on.bandwidth, work / on.peak
        seconds += max(slow, fast)
        by_bytes += slow if slow > fast else 0.0
        moved, flop = moved + carried, flop + work
    return Limit(seconds, by_bytes, moved, flop)


def twin_passes(prompt: int, places: Sequence[int], *, cached: bool) -> list[Pass]:
    """Of the twin that decides or feeds these places of a template."""
    found: list[Pass] = []
    for at, place in enumerate(places):
        if at and cached:
            found.append(Pass(place - places[at - 1], prompt + places[at - 1], causal=True))
        else:
            found.append(Pass(prompt + place, causal=True))
    return found


def diffusion_passes(prompt: int, length: int, passes: int, *, prefix: bool) -> list[Pass]:
    """Of masked diffusion, without a cache or with the prompt's."""
    whole = Pass(prompt + length)
    return [whole, *(Pass(length, prompt) if prefix else whole for _ in range(passes - 1))]
