# pyright: reportMissingImports=false, reportPrivateImportUsage=false, reportUnknownParameterType=false
"""The one training loop: plain PyTorch, resumable bit for bit, metrics as JSON lines.

All chance of a run comes from its seed and the number of the step, so a run that is stopped and continued gives the
same weights as one that was not. A recipe says what to learn from (`batches`) and how wrong the network is (`loss`).
"""

from __future__ import annotations

import json
import signal
import threading
import time
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import torch
from torch import nn

from chauffeur.concept import ConfigError

Precision = Literal["auto", "float32", "bfloat16"]
EVERY_STEPS: Final = 250
"""Steps between two lines of metrics."""


@dataclass(frozen=True, slots=True)
class Optimisation:
    """Optimiser settings: AdamW (Loshchilov and Hutter 2019).

    Attributes:
        decay: Weight decay of matrices; vectors have none.
        betas: Of the moments.
        clip: Largest norm of a gradient.
        ema: Decay of the running mean of the weights, which is what is exported; 0 for none.
        precision: Of the forward pass; `auto` takes bfloat16 only where it is the faster here.
    """

    decay: float = 0.05
    betas: tuple[float, float] = (0.9, 0.98)
    clip: float = 1.0
    ema: float = 0.0
    precision: Precision = "auto"


def bfloat16_pays(device: torch.device) -> bool:
    """True if bfloat16 products are the faster here: without hardware for them they are ten times slower."""
    if device.type != "cpu":
        return True
    one, two = torch.randn(256, 256), torch.randn(256, 256)

    def seconds(a: torch.Tensor, b: torch.Tensor) -> float:
        best = float("inf")
        for _ in range(4):
            begun = time.perf_counter()
            _ = a @ b
            best = min(best, time.perf_counter() - begun)
        return best

    return seconds(one.bfloat16(), two.bfloat16()) < seconds(one, two)


def fit(
    model: nn.Module,
    batches: Callable[[int], Iterator[Any]],
    loss: Callable[[Any], torch.Tensor],
    rate: Callable[[int], float],
    folder: Path,
    recipe: Mapping[str, Any],
    steps: int,
    how: Optimisation,
    *,
    continues: Callable[[dict[str, Any], int], bool] | None = None,
    evaluate: Callable[[], Mapping[str, float]] | None = None,
    watch: Callable[[int, float, float], None] | None = None,
    save_s: float = 120.0,
    around: Callable[[], AbstractContextManager[object]] = nullcontext,
    every: int = EVERY_STEPS,
) -> nn.Module | None:
    """Train a network in place, or go on where a run in this folder stopped.

    Args:
        model: The network, where it is to be trained.
        batches: Endless batches from a step on; the same for the same step.
        loss: Of a batch.
        rate: Learning rate of a step.
        folder: Where the run keeps its state (`state.pt`) and metrics (`log.jsonl`).
        recipe: What decides the run, as plain values; a run of another one is not continued.
        steps: Optimiser steps.
        how: See there.
        continues: Whether a stored recipe at a step may be continued; None for the same recipe only.
        evaluate: Called now and then, with the weights that would be exported in `model`; gives metrics.
        watch: Called after each step with (step, loss, seconds).
        save_s: Seconds between two saves.
        around: Context of a forward and backward pass.
        every: Steps between two lines of metrics.

    Returns:
        The mean of the weights where `how.ema` asks for one, as a copy of the network.

    Raises:
        ConfigError: The folder holds a run of another recipe.
    """
    device = next(model.parameters()).device
    matrices = [p for p in model.parameters() if p.requires_grad and p.dim() >= 2]
    vectors = [p for p in model.parameters() if p.requires_grad and p.dim() < 2]
    groups: list[dict[str, Any]] = [
        {"params": matrices, "weight_decay": how.decay},
        {"params": vectors, "weight_decay": 0.0},
    ]
    optimiser = torch.optim.AdamW(groups, lr=rate(0), betas=how.betas, fused=True)
    mean = _Mean(model, how.ema) if how.ema else None
    folder.mkdir(parents=True, exist_ok=True)
    state_path = folder / "state.pt"
    first = 0
    low = how.precision == "bfloat16" or (how.precision == "auto" and bfloat16_pays(device))
    if state_path.exists():
        state: dict[str, Any] = torch.load(state_path, map_location=device, weights_only=True)
        same = state["recipe"] == dict(recipe) if continues is None else continues(state["recipe"], int(state["step"]))
        if not same:
            raise ConfigError(f"{folder} holds a run of another recipe.", hint="Choose another folder, or delete it.")
        model.load_state_dict(state["model"])
        optimiser.load_state_dict(state["optimiser"])
        if mean is not None:
            mean.model.load_state_dict(state["mean"])
        first = int(state["step"])
        low = bool(state.get("bfloat16", low))  # a run keeps its precision, whatever a probe says today
    model.train()
    feed = batches(first)
    saved, done = time.monotonic(), first
    with (
        (folder / "log.jsonl").open("a", encoding="utf-8") as log,
        _kept_at_interrupt(lambda: done > first and _save(state_path, recipe, model, optimiser, mean, done, low)),
    ):
        for step in range(first, steps):
            begun = time.perf_counter()
            for group in optimiser.param_groups:
                group["lr"] = rate(step)
            batch = next(feed)
            optimiser.zero_grad(set_to_none=True)
            with around():
                with torch.autocast(device.type, torch.bfloat16) if low else nullcontext():
                    value = loss(batch)
                value.backward()
            torch.nn.utils.clip_grad_norm_(model.parameters(), how.clip)
            with _uninterrupted():
                optimiser.step()
                if mean is not None:
                    mean.take(model, step)
                done = step + 1
            if watch is not None:
                watch(step, float(value.detach()), time.perf_counter() - begun)
            last = step + 1 == steps
            if last or (step + 1) % every == 0:
                row: dict[str, float] = {"step": step + 1, "loss": float(value.detach())}
                if evaluate is not None:
                    with mean.put_into(model) if mean is not None else nullcontext():
                        row |= evaluate()
                    model.train()
                log.write(json.dumps(row) + "\n")
                log.flush()
            if last or time.monotonic() - saved > save_s:
                _save(state_path, recipe, model, optimiser, mean, step + 1, low)
                saved = time.monotonic()
    return None if mean is None else mean.model


@contextmanager
def _kept_at_interrupt(save: Callable[[], object]) -> Generator[None]:
    """Save what is done when Ctrl-C comes, and go on with it."""
    try:
        yield
    except KeyboardInterrupt:
        save()
        raise


@contextmanager
def _uninterrupted() -> Generator[None]:
    """Put Ctrl-C off for as long as the weights are between two steps; elsewhere than in the main thread none comes."""
    if threading.current_thread() is not threading.main_thread() or signal.getsignal(signal.SIGINT) is None:
        yield
        return
    came: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
    if came:
        signal.raise_signal(signal.SIGINT)


class _Mean:
    """Running mean of a network's weights (exponential, warmed up)."""

    def __init__(self, model: nn.Module, decay: float) -> None:
        from copy import deepcopy

        self.model = deepcopy(model).requires_grad_(False).eval()
        self._decay = decay

    @torch.no_grad()
    def take(self, model: nn.Module, step: int) -> None:
        share = 1.0 - min(self._decay, (1.0 + step) / (10.0 + step))
        for own, new in zip(self.model.parameters(), model.parameters(), strict=True):
            own.lerp_(new.detach(), share)

    def put_into(self, model: nn.Module) -> AbstractContextManager[object]:
        """The mean's weights in the network's place, for as long as the context lasts."""
        return _Swapped(self.model, model)


class _Swapped:
    def __init__(self, mean: nn.Module, model: nn.Module) -> None:
        self._mean, self._model = mean, model

    def __enter__(self) -> None:
        self._exchange()

    def __exit__(self, *_: object) -> None:
        self._exchange()

    @torch.no_grad()
    def _exchange(self) -> None:
        for one, two in zip(self._mean.parameters(), self._model.parameters(), strict=True):
            one.data, two.data = two.data, one.data


def _save(
    path: Path,
    recipe: Mapping[str, Any],
    model: nn.Module,
    optimiser: torch.optim.Optimizer,
    mean: _Mean | None,
    step: int,
    low: bool,
) -> None:
    part = path.with_suffix(".part")
    state: dict[str, Any] = {"recipe": dict(recipe), "step": step, "bfloat16": low}
    state |= {"model": model.state_dict(), "optimiser": optimiser.state_dict()}
    if mean is not None:
        state["mean"] = mean.model.state_dict()
    torch.save(state, part)
    part.replace(path)


def stored(folder: Path) -> dict[str, Any] | None:
    """State of a run: `recipe`, `step`, `model` and, where one is kept, `mean`; None where there is none."""
    path = folder / "state.pt"
    return torch.load(path, map_location="cpu", weights_only=True) if path.exists() else None
