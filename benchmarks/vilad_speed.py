"""Fig. 17 on one CPU core or an accelerator: masked diffusion and its autoregressive twin; same tokens, with caches.

    python benchmarks/vilad_speed.py
    python benchmarks/vilad_speed.py --sizes lot 3M 10M 30M --repeats 5 --json speed.json --plot speed.svg
    python benchmarks/vilad_speed.py --device cuda --dtype bfloat16 --sizes 170M 8B --prompts 128 1024 3700
    python benchmarks/vilad_speed.py --frames frames --model runs/frames/model --json quality.json

Weights are random: time does not depend on them. The number of forward passes (NFE) of a trained model does, so it is
set here, and beside the time stands up to how many passes the diffusion model is the faster one. Milliseconds of CPU
time of one thread, which other work on the machine disturbs least; the median of the repeats.

With `--device cuda` it is wall time between two synchronisations, and each way to decide stands there twice: launched
kernel by kernel, and with its passes recorded as CUDA graphs (`vilad_graphs`), without the prompt's connectors, which
are computed once. Beside each stands what the machine allows (`vilad_limits`) and which share of it is reached. A long
prompt is mostly words: that of a picture, which no decision points into.

With `--frames` trained networks decide real frames (`chauffeur model train vilad-frames`): what is measured is then
time and quality together, L2 (m, ST-P3's average) on the test split beside milliseconds and passes.
"""

from __future__ import annotations

import argparse
import json
import math
import platform
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import torch

from chauffeur.models.net.transformer import parameter_count
from chauffeur.models.vilad.decoding import AdaptiveCached, PrefixCached, Refresh, Twin, Uncached
from chauffeur.models.vilad.network import SIZES, Vilad, ViladConfig
from chauffeur.planners.vilad.parking import TEMPLATE
from chauffeur.planners.vilad.template import ActionSlot, ActionTemplate
from chauffeur.planners.vilad.unmasking import Unmasking, unmask
from vilad_limits import Limit, Machine, diffusion_passes, limit, machine, twin_passes
from vilad_speed_svg import drawn

WORDS, SCENE = 96, 27


def digit_slots(name: str, whole: int, decimals: int) -> tuple[str | ActionSlot, ...]:
    """A signed number as the paper writes waypoints, digit by digit: +12.5 for whole=2, decimals=1.

    The planners write one token a quantity instead (see `planners/vilad/template.py`).
    """
    digits = tuple("0123456789")
    front = tuple(ActionSlot(f"{name}.{i}", digits) for i in range(whole))
    back = tuple(ActionSlot(f"{name}.-{i + 1}", digits) for i in range(decimals))
    return (ActionSlot(f"{name}.sign", ("+", "-")), *front, ".", *back)


def waypoints(count: int) -> ActionTemplate:
    """(x, y) of so many waypoints, digit by digit as the paper writes them: 12 tokens each, 8 of them decided."""
    pieces: list[Any] = []
    for i in range(count):
        pieces += [*digit_slots(f"x{i}", 2, 1), ",", *digit_slots(f"y{i}", 2, 1), ";"]
    return ActionTemplate(tuple(pieces))


def codes(count: int) -> ActionTemplate:
    """So many waypoints, one token each from a codebook of 64, as `models.vilad.waypoints` has them."""
    words = tuple(f"#{i}" for i in range(64))
    pieces: list[Any] = []
    for i in range(count):
        pieces += [ActionSlot(f"w{i}", words), ";"]
    return ActionTemplate(tuple(pieces))


TASKS = {
    "parking": TEMPLATE,
    "6 waypoints, codebook": codes(6),
    "3 waypoints": waypoints(3),
    "6 waypoints": waypoints(6),
    "16 waypoints": waypoints(16),
}


def cpu_ms(run: Callable[[], object], repeats: int) -> float:
    """Median CPU time of a call after one to warm up."""
    run()
    found: list[float] = []
    for _ in range(repeats):
        begun = time.process_time()
        run()
        found.append(1000.0 * (time.process_time() - begun))
    return median(found)


def wall_ms(run: Callable[[], object], repeats: int, most_s: float = 1.5) -> float:
    """Median wall time of a call on an accelerator after one to warm up; of fewer calls where they take long."""
    run()
    found: list[float] = []
    while not found or (len(found) < repeats and sum(found) < 1000.0 * most_s):
        torch.cuda.synchronize()
        begun = time.perf_counter()
        run()
        torch.cuda.synchronize()
        found.append(1000.0 * (time.perf_counter() - begun))
    return median(found)


@dataclass(frozen=True, slots=True)
class Where:
    """Where the networks are, in which precision, and what the machine allows there (not asked of a CPU)."""

    device: torch.device
    dtype: torch.dtype
    on: Machine | None

    def built(self, config: ViladConfig, template: ActionTemplate) -> Vilad:
        """A network with random weights, made where it stays."""
        torch.manual_seed(0)
        before = torch.get_default_dtype()
        torch.set_default_dtype(self.dtype)
        try:
            with self.device:
                return Vilad(config, template).to(self.device).eval()
        finally:
            torch.set_default_dtype(before)


def measured(
    size: str, template: ActionTemplate, prompt: int, passes: int, repeats: int, where: Where
) -> dict[str, Any]:
    """One row of the table."""
    config = ViladConfig(SIZES[size], WORDS, SCENE)
    model, twin = where.built(config, template), where.built(config.twin, template)
    torch.manual_seed(0)
    near = min(64, prompt - prompt // 2)  # candidates; the rest are words
    words = torch.randn(1, prompt - near, WORDS).to(where.device, where.dtype)
    scene = torch.rand(1, near, SCENE).to(where.device, where.dtype)
    length, allowed = template.length, template.allowed(scene.shape[1])
    places = [int(one) for one in np.flatnonzero(template.maskable)]
    slots = len(places)
    share = math.ceil(slots / passes)  # of the decisions, each pass
    done = math.ceil(slots / share)
    clock = cpu_ms if where.on is None else wall_ms

    def diffusion(make: Callable[[], Uncached], steps: int) -> Callable[[], object]:
        how = Unmasking(steps=steps, tau=2.0)  # no confidence is above 2: the schedule alone decides, in `steps` passes
        return lambda: unmask(make(), template.canvas, allowed, how)

    def plain() -> Uncached:
        return Uncached(model, words, scene, length)

    def prefix() -> Uncached:
        return PrefixCached(model, words, scene, length)

    def adaptive() -> Uncached:
        return AdaptiveCached(model, words, scene, length, Refresh(25, 7, 0.25))

    def twins(*, cached: bool, skip: bool) -> float:
        return clock(
            lambda: Twin(twin, words, scene, length).decide(template, allowed, cached=cached, skip=skip), repeats
        )

    row: dict[str, Any] = {
        "size": size,
        "weights": parameter_count(model),
        "prompt": prompt,
        "length": length,
        "decided": slots,
        "passes": done,
        "twin": twins(cached=False, skip=False),
        "twin, KV": twins(cached=True, skip=False),
        "twin, KV, pattern skipped": twins(cached=True, skip=True),
        "diffusion": clock(diffusion(plain, passes), repeats),
        "diffusion, prefix": clock(diffusion(prefix, passes), repeats),
        "diffusion, adaptive": clock(diffusion(adaptive, passes), repeats),
        "one pass": clock(diffusion(plain, 1), repeats),
        "a pass a decision": clock(diffusion(prefix, slots), repeats),
    }
    if where.on is not None:
        from vilad_graphs import RecordedPrefix, RecordedTwin, RecordedUncached

        for name, skip in (("twin, KV", False), ("twin, KV, pattern skipped", True)):
            one = RecordedTwin(twin, words, scene, length)
            one.decide(template, allowed, skip=skip)  # records
            row[f"{name}, graph"] = clock(lambda d=one, k=skip: d.decide(template, allowed, skip=k), repeats)
            del one
            torch.cuda.empty_cache()
        bound = RecordedUncached(model, words, scene, length)
        bound(template.canvas)
        row["diffusion, graph"] = clock(diffusion(lambda: bound, passes), repeats)
        row["one pass, graph"] = clock(diffusion(lambda: bound, 1), repeats)
        for name, steps, times in (
            ("diffusion, prefix, graph", passes, done),
            ("a pass a decision, graph", slots, slots),
        ):
            kept = RecordedPrefix(model, words, scene, length, times)
            diffusion(lambda d=kept: d, steps)()
            row[name] = clock(diffusion(lambda d=kept: d, steps), repeats)
        every = list(range(length))
        ways = {
            "twin": twin_passes(prompt, every, cached=False),
            "twin, KV": twin_passes(prompt, every, cached=True),
            "twin, KV, pattern skipped": twin_passes(prompt, places, cached=True),
            "diffusion": diffusion_passes(prompt, length, done, prefix=False),
            "diffusion, prefix": diffusion_passes(prompt, length, done, prefix=True),
            "one pass": diffusion_passes(prompt, length, 1, prefix=False),
            "a pass a decision": diffusion_passes(prompt, length, slots, prefix=True),
        }
        width = words.element_size()
        for name, each in ways.items():
            least = limit(config.body, each, width, where.on)
            for way in (name, f"{name}, graph"):
                if way in row:
                    row[f"{way}: limit"] = reached(least, row[way], where.on)
    kind = ", graph" if where.on is not None else ""
    further = max(1e-6, (row[f"diffusion, prefix{kind}"] - row[f"one pass{kind}"]) / max(1, done - 1))
    for name in ("", ", pattern skipped"):
        gap = row[f"twin, KV{name}{kind}"] - row[f"one pass{kind}"]
        row[f"faster up to{name}"] = 1 + int(max(0.0, gap) / further) if gap > 0.0 else 0
    return row


def reached(least: Limit, ms: float, on: Machine) -> dict[str, float]:
    """The limit (ms), the share of it that a time reaches, of FLOP and of bandwidth, and what bounds it."""
    seconds = ms / 1000.0
    return {
        "ms": 1000.0 * least.seconds,
        "share": least.seconds / seconds,
        "flop share": least.flop / on.peak / seconds,
        "bandwidth share": least.moved / on.bandwidth / seconds,
        "bound by bytes": least.by_bytes / least.seconds,
    }


def trained(data: Path, folder: Path, repeats: int, limit: int) -> list[dict[str, Any]]:
    """Time and quality of trained networks on the frames of a test split: one row a way to decode."""
    from chauffeur.models.vilad.frames_baselines import expected_paths
    from chauffeur.models.vilad.frames_data import load_frames
    from chauffeur.models.vilad.frames_pipeline import line_of
    from chauffeur.models.vilad.frames_recipe import plan_paths, prompts
    from chauffeur.models.vilad.frames_store import load_frames_model
    from chauffeur.models.vilad.frames_vision import tokens_of

    model = load_frames_model(folder)
    frames = load_frames(data, "test", model.size)
    book, template = model.book, model.book.template
    tokens, words = tokens_of(model.vision, frames.pictures), prompts(frames.ego, frames.commands)
    expected = expected_paths(model.status, frames)
    allowed = template.allowed(tokens.shape[1])
    chosen = np.linspace(0, len(frames.samples) - 1, min(limit, len(frames.samples))).astype(int)
    rules = {f"ViLaD, tau {tau}": Unmasking(steps=6, tau=tau) for tau in (0.3, 0.5, 0.7, 0.9)}
    rules |= {"ViLaD, one pass": Unmasking(steps=1, tau=2.0), "ViLaD, a pass a decision": Unmasking(steps=6, tau=2.0)}

    def quality(network: Vilad, how: Unmasking) -> tuple[float, float, float]:
        found = plan_paths(network, book, expected[chosen], words[chosen], tokens[chosen], how)
        line = line_of("", np.stack([one.waypoints for one in found]), frames.futures[chosen], 0.0)
        passes = np.array([one.decided.passes for one in found])
        return line.l2["stp3"][3], line.failures, float(passes.mean())

    timed = chosen[:: max(1, len(chosen) // 20)]

    def cost(one: Callable[[Any, Any], object]) -> float:
        return cpu_ms(lambda: [one(words[i : i + 1], tokens[i : i + 1]) for i in timed], repeats) / len(timed)

    rows: list[dict[str, Any]] = []
    l2, failures, passes = quality(model.twin, rules["ViLaD, one pass"])
    for name, cached, skip in (
        ("twin", False, False),
        ("twin, KV", True, False),
        ("twin, KV, pattern skipped", True, True),
    ):
        ms = cost(
            lambda w, t, c=cached, k=skip: Twin(model.twin, w, t, template.length).decide(
                template, allowed, cached=c, skip=k
            )
        )
        rows.append({"how": name, "l2": l2, "failures": failures, "passes": 6.0 if skip else passes, "ms": ms})
    for name, how in rules.items():
        l2, failures, passes = quality(model.vilad, how)
        for kind, make in (("", Uncached), (", prefix cache", PrefixCached)):
            ms = cost(
                lambda w, t, m=make, h=how: unmask(m(model.vilad, w, t, template.length), template.canvas, allowed, h)
            )
            rows.append({"how": name + kind, "l2": l2, "failures": failures, "passes": passes, "ms": ms})
    bare, kept = rows[0]["ms"], rows[1]["ms"]
    for row in rows:
        row["times the twin"], row["times the twin, KV"] = bare / row["ms"], kept / row["ms"]
    return rows


def told(row: dict[str, Any]) -> str:
    """A row in a line."""
    return ", ".join(
        f"{name} {value['ms']:.1f} ({value['share']:.0%})"
        if isinstance(value, dict)
        else f"{name} {value:.1f}"
        if isinstance(value, float)
        else f"{name} {value}"
        for name, value in row.items()
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", default=["lot", "3M", "10M"], choices=sorted(SIZES))
    parser.add_argument("--prompts", nargs="+", type=int, default=[36, 128])
    parser.add_argument("--tasks", nargs="+", default=list(TASKS), choices=list(TASKS))
    parser.add_argument("--device", default="cpu", choices=["cpu", "cuda"])
    parser.add_argument("--dtype", default="float32", choices=["float32", "bfloat16"])
    parser.add_argument("--passes", type=int, default=4)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--json", type=Path, default=None)
    parser.add_argument("--plot", type=Path, default=None, help="SVG of time over passes")
    parser.add_argument("--frames", type=Path, default=None, help="set of frames: time and quality of --model on it")
    parser.add_argument("--model", type=Path, default=None)
    parser.add_argument("--limit", type=int, default=400, help="frames that quality is measured on")
    args = parser.parse_args()
    torch.set_num_threads(1)
    if args.frames is not None:
        found = trained(args.frames, args.model, args.repeats, args.limit)
        for row in found:
            print(", ".join(f"{k} {v:.2f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items()), flush=True)
        if args.json is not None:
            args.json.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
        return
    device, dtype = torch.device(args.device), getattr(torch, args.dtype)
    where = Where(device, dtype, machine(device, dtype) if args.device == "cuda" else None)
    about = {"python": platform.python_version(), "torch": torch.__version__, "device": args.device}
    if where.on is not None:
        about |= {"device": torch.cuda.get_device_name(), "copy TB/s": f"{where.on.bandwidth / 1e12:.2f}"}
        about |= {"peak TFLOP/s": f"{where.on.peak / 1e12:.0f}"}
    print(", ".join(f"{k} {v}" for k, v in about.items()), flush=True)
    rows: list[dict[str, Any]] = []
    for size in args.sizes:
        for name in args.tasks:
            template = TASKS[name]
            for prompt in args.prompts:
                row = {"task": name, **measured(size, template, prompt, args.passes, args.repeats, where)}
                rows.append(row | {"machine": about})
                print(told(row), flush=True)
                if args.json is not None:
                    args.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if args.plot is not None:
        args.plot.write_text(drawn(rows), encoding="utf-8")
    gain = np.array([row["twin, KV"] / row["diffusion, prefix"] for row in rows])
    bare = np.array([row["twin"] / row["diffusion"] for row in rows])
    print(f"\nat {args.passes} passes: {bare.min():.1f} to {bare.max():.1f} times faster without caches, ", end="")
    print(f"{gain.min():.1f} to {gain.max():.1f} times with them")


if __name__ == "__main__":
    main()
