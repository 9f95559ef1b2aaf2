"""Scenes, instructions, questions and pictures of our own: a function for each command of `chauffeur bench scenes`."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any, Final

from annotated_types import Ge

from chauffeur.bench.kernel.task import Count, Positive, TaskResult, TextTable, Told

_SHOWN: Final = 20
"""Faults that are named one by one."""


def generate(
    out: Path,
    told: Told,
    items: Positive = 4900,
    seed: Count = 0,
    extras: Count | None = None,
    avoid: Path | None = None,
    workers: Count = 0,
) -> TaskResult:
    """A suite of our own with the statistics of LaMPilot-Bench (paper Tab. III), split for training and testing.

    Args:
        out: Folder to write; a suite begun there is continued.
        told: Is told how far it is.
        items: Items of the main suite.
        seed: Seed of everything.
        extras: Items beyond the original: hints, several steps, refusals, units. By default a fifth of the items.
        avoid: DbLv1 folder whose instructions must not come up, e.g. LaMPilot's own.
        workers: Worker processes; 0 for one per core.
    """
    from chauffeur.bench.lampilot.scenes.suite import Suite, SuiteConfig
    from chauffeur.worlds.highway.dblv1 import load_dataset

    avoided = None if avoid is None else load_dataset(avoid)
    more = items // 5 if extras is None else extras
    suite = Suite(out, SuiteConfig(items, seed, more, "" if avoided is None else avoided.sha256), avoided)
    manifest: Any = suite.generate(workers or os.cpu_count() or 1, lambda done, of: told("made", done, of))
    hashes, scenes, words = manifest["sha256"], manifest["scenes"]["main"], manifest["words"]
    folders = [(name, f"{count:,}", hashes[name]["tasks"][:12]) for name, count in manifest["items"].items()]
    left = [(why, f"{times:,}") for why, times in scenes["rejected"].items()]
    thrown = [(name, f"{held['drawn']:,}", f"{held['rejected_share']:.1%}") for name, held in words.items()]
    return TaskResult(
        (
            TextTable("Folders", ("Folder", "Items", "SHA-256"), folders),
            TextTable(
                f"Scenes: {scenes['drawn']:,} drawn, {scenes['kept']:,} kept. Left out:", ("Why", "Scenes"), left
            ),
            TextTable("Wordings not read as what they say", ("Family", "Drawn", "Thrown away"), thrown),
            f"Next: chauffeur bench lampilot --data {out / 'test'} --planner onboard",
        )
    )


def check(data: Path, /, told: Told, workers: Count = 0, out: Path | None = None) -> TaskResult:
    """Drive every scene with the scripted expert, and read every instruction back.

    Args:
        data: Suite, or any DbLv1 folder.
        told: Is told how far it is.
        workers: Worker processes; 0 for one per core.
        out: Write every fault as a JSON line.
    """
    from chauffeur.bench.lampilot.scenes.scene_check import check as look_over
    from chauffeur.bench.lampilot.scenes.scene_check import counts
    from chauffeur.driving.files import publish

    items, faults = look_over(data, workers or os.cpu_count() or 1, lambda done, of: told("checked", done, of))
    if out is not None:
        lines = "".join(json.dumps(asdict(fault), ensure_ascii=False) + "\n" for fault in faults)
        publish(out, lines.encode(), "list of faults")
    if not faults:
        return TaskResult((f"{items:,} items: every scene is solved by the expert, every instruction says its goal.",))
    counted = [(what, why, f"{times:,}") for what, why, times in counts(faults)]
    said = (f"{one.where}: {one.why}" + (f'  "{one.text}"' if one.text else "") for one in faults[:_SHOWN])
    more = (f"... and {len(faults) - _SHOWN:,} more: add --out FILE.",) if len(faults) > _SHOWN else ()
    table = TextTable(f"{items:,} items, {len(faults):,} faults", ("What", "Why", "Times"), counted)
    return TaskResult((table, *said, *more), faulty=True)


def stats(data: Path, /) -> TaskResult:
    """The columns of Tab. III for any DbLv1 folder, next to the paper's. Extras of a suite are counted apart.

    Args:
        data: Suite, or any DbLv1 folder.
    """
    from chauffeur.bench.lampilot.scenes.scene_check import folders_of, statistics_of, table
    from chauffeur.worlds.highway.dblv1 import load_dataset

    folders = {name: load_dataset(folder) for name, folder in folders_of(data).items()}
    main = [dataset for name, dataset in folders.items() if not name.startswith("extras/")]
    parts = [TextTable("Statistics", ("Statistic", "Here", "Paper"), table(statistics_of(main)))]
    if len(folders) > 1:
        counts = [(name, f"{len(dataset.items()):,}") for name, dataset in folders.items()]
        parts.append(TextTable("Folders", ("Folder", "Items"), counts))
    return TaskResult(tuple(parts))


def qa(
    out: Path,
    told: Told,
    scenes: Annotated[int, Ge(5)] = 1000,
    seed: Count = 0,
    width_px: Annotated[int, Ge(48)] = 448,
    height_px: Annotated[int, Ge(32)] = 256,
    frames: Positive = 4,
    pairs: Count = 0,
    render: bool = True,
    look: str = "default",
    sources: str = "all",
    front: Positive = 1,
    workers: Count = 0,
) -> TaskResult:
    """Questions about pictures in NuPlanQA's format, from scenes of our own, that no trick can answer.

    Args:
        out: Folder to write; a set begun there is continued.
        told: Is told how far it is.
        scenes: Scenes for training; validation and test have a fifth each.
        seed: Seed of everything.
        width_px: Pictures' width, px.
        height_px: Pictures' height, px.
        frames: Instants of a scene that are rendered, 5 at most.
        pairs: Free question-answer pairs for each fact of a training scene.
        render: Render, or write words alone.
        look: Palette and lens of the test split: `default`, `held_out_a`...
        sources: `all`, `staged` streets, our `worlds`, or one: `highway`, `crossing`, `town`, `lot`.
        front: Times as wide and high as others: front pictures, 4 at most.
        workers: Worker processes; 0 for one per core.
    """
    from chauffeur.bench.nuplanqa.scenes.gate import BOUND
    from chauffeur.bench.nuplanqa.scenes.making import SIMULATED, QaConfig, make_set

    config = QaConfig(scenes, seed, width_px, height_px, frames, pairs, render, look, sources, front)
    made = make_set(out, config, workers or os.cpu_count() or 1, lambda done, of: told("scenes", done, of))
    counts = [(name, f"{count:,}") for name, count in made.questions.items()]
    tricks = [(one.trick, f"{one.accuracy:.1%}", one.worst_told) for one in made.gate]
    sound = all(one.passes() for one in made.gate)
    told_off = f"The questions give themselves away: above {BOUND:.0%}. Make more scenes."
    return TaskResult(
        (
            TextTable("Questions", ("Split", "Questions"), counts),
            TextTable("What tricks make of the test split", ("Answered from", "Right", "Worst subtask"), tricks),
            SIMULATED,
            f"Next: chauffeur bench nuplanqa --data {out / 'test'} --planner openai/MODEL" if sound else told_off,
        ),
        faulty=not sound,
    )


def frames(
    out: Path,
    told: Told,
    trips: Annotated[int, Ge(8)] = 160,
    seed: Count = 0,
    width_px: Annotated[int, Ge(32)] = 160,
    height_px: Annotated[int, Ge(32)] = 96,
    seconds: Annotated[float, Ge(10)] = 80.0,
    most: Annotated[int, Ge(6)] = 60,
    towns: str = "",
) -> TaskResult:
    """Front pictures of our own traffic with 2 s of motion before and 3 s after them, in nuScenes' format.

    Args:
        out: Folder to write; a set begun there is continued.
        told: Is told how far it is.
        trips: Trips for training; validation has an eighth, the test split a quarter.
        seed: Seed of everything.
        width_px: Pictures' width, px.
        height_px: Pictures' height, px.
        seconds: Of a trip in town, at most.
        most: Frames kept of a trip, at most.
        towns: Towns of training and validation, by their packs' names with commas between; four of ours.
    """
    from chauffeur.bench.openloop.driving import TOWNS
    from chauffeur.bench.openloop.extrapolation import FUTURE_KINDS
    from chauffeur.bench.openloop.frames import SIMULATED, FramesConfig, make_frames

    named = tuple(one.strip() for one in towns.split(",") if one.strip()) or TOWNS
    config = FramesConfig(trips, seed, width_px, height_px, seconds, most, named)
    counts = make_frames(out, config, lambda done, of: told("trips", done, of))
    lines = [(kind, *(f"{counts[split].get(kind, 0):,}" for split in counts)) for kind in FUTURE_KINDS]
    return TaskResult(
        (
            TextTable("Frames by what happens next", ("next", *counts), lines),
            SIMULATED,
            f"Next: chauffeur model train vilad-frames --data {out} --out runs/frames",
        )
    )


def sft(data: Path, /, out: Path, tables: str = "", scene_list: Path | None = None, stride: Positive = 1) -> TaskResult:
    """Frames as lines for chat fine-tuning, in the words of `bench openloop --setting sft`.

    Args:
        data: Folder with nuScenes' tables and `samples`.
        out: File to write, one line a frame.
        tables: E.g. v1.0-mini; by default the only ones there.
        scene_list: File with the names of scenes, one a line.
        stride: Only every so many-th frame.
    """
    from chauffeur.bench.openloop import OpenLoopBenchmark
    from chauffeur.bench.openloop.requests import training_lines
    from chauffeur.driving.files import publish

    bench = OpenLoopBenchmark(str(data), tables, "sft", scene_list=str(scene_list or ""), stride=stride)
    lines = [*training_lines((one for one in bench.samples if one.whole), data)]
    publish(out, "".join(lines).encode(), "lines for fine-tuning")
    return TaskResult((f"{len(lines):,} lines in {out}; pictures are named below {data}.",))


SCENES: Final[dict[str, Callable[..., TaskResult]]] = {
    "generate": generate, "check": check, "stats": stats, "qa": qa, "frames": frames, "sft": sft,
}  # fmt: skip
"""What `chauffeur bench scenes` does, by name."""
