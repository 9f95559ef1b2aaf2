"""Fig. 17 on one CPU core: masked diffusion and its autoregressive twin, without and with caches; same tokens.

    python benchmarks/vilad_speed.py
    python benchmarks/vilad_speed.py --sizes lot 3M 10M 30M --repeats 5 --json speed.json --plot speed.svg
    python benchmarks/vilad_speed.py --frames frames --model runs/frames/model --json quality.json

Weights are random: time does not depend on them. The number of forward passes (NFE) of a trained model does, so it is
set here, and beside the time stands up to how many passes the diffusion model is the faster one. Milliseconds of CPU
time of one thread, which other work on the machine disturbs least; the median of the repeats.

With `--frames` trained networks decide real frames (`chauffeur model train vilad-frames`): what is measured is then
time and quality together, L2 (m, ST-P3's average) on the test split beside milliseconds and passes.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
import torch

from chauffeur.models.net.transformer import parameter_count
from chauffeur.models.vilad.decoding import AdaptiveCached, PrefixCached, Refresh, Twin, Uncached
from chauffeur.models.vilad.network import SIZES, Vilad, ViladConfig
from chauffeur.planners.vilad.parking import TEMPLATE
from chauffeur.planners.vilad.template import ActionSlot, ActionTemplate, digit_slots
from chauffeur.planners.vilad.unmasking import Unmasking, unmask
from vilad_speed_svg import drawn

WORDS, SCENE = 96, 27


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


def measured(size: str, template: ActionTemplate, prompt: int, passes: int, repeats: int) -> dict[str, Any]:
    """One row of the table."""
    torch.manual_seed(0)
    config = ViladConfig(SIZES[size], WORDS, SCENE)
    model = Vilad(config, template).eval()
    twin = Vilad(config.twin, template).eval()
    words, scene = torch.randn(1, min(64, prompt // 2), WORDS), torch.rand(1, prompt - min(64, prompt // 2), SCENE)
    length, allowed = template.length, template.allowed(scene.shape[1])
    slots = int(template.maskable.sum())

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
        return cpu_ms(
            lambda: Twin(twin, words, scene, length).decide(template, allowed, cached=cached, skip=skip), repeats
        )

    row: dict[str, Any] = {
        "size": size,
        "weights": parameter_count(model),
        "prompt": prompt,
        "length": length,
        "decided": slots,
        "passes": passes,
        "twin": twins(cached=False, skip=False),
        "twin, KV": twins(cached=True, skip=False),
        "twin, KV, pattern skipped": twins(cached=True, skip=True),
        "diffusion": cpu_ms(diffusion(plain, passes), repeats),
        "diffusion, prefix": cpu_ms(diffusion(prefix, passes), repeats),
        "diffusion, adaptive": cpu_ms(diffusion(adaptive, passes), repeats),
        "one pass": cpu_ms(diffusion(plain, 1), repeats),
        "a pass a decision": cpu_ms(diffusion(prefix, slots), repeats),
    }
    further = max(1e-6, (row["diffusion, prefix"] - row["one pass"]) / (passes - 1))
    row["faster up to"] = 1 + int(max(0.0, row["twin, KV"] - row["one pass"]) / further)
    row["faster up to, pattern skipped"] = 1 + int(
        max(0.0, row["twin, KV, pattern skipped"] - row["one pass"]) / further
    )
    return row


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


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", nargs="+", default=["lot", "3M", "10M"], choices=sorted(SIZES))
    parser.add_argument("--prompts", nargs="+", type=int, default=[36, 128])
    parser.add_argument("--tasks", nargs="+", default=list(TASKS), choices=list(TASKS))
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
    rows: list[dict[str, Any]] = []
    for size in args.sizes:
        for name in args.tasks:
            template = TASKS[name]
            for prompt in args.prompts:
                row = {"task": name, **measured(size, template, prompt, args.passes, args.repeats)}
                rows.append(row)
                told = ", ".join(f"{k} {v:.1f}" if isinstance(v, float) else f"{k} {v}" for k, v in row.items())
                print(told, flush=True)
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
