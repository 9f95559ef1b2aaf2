"""Putting the shards of a run together: from their full rows, never from their summaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.kernel.benchmark import Benchmark
from chauffeur.bench.kernel.run import score
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.stages import Manifest, StageStore, adopt, read_plan
from chauffeur.bench.kernel.store import Row, sole_writer
from chauffeur.concept import ConfigError, DataError

_AGAIN: Final = "Run its command again; it goes on where it stopped."


def made_of(folder: Path) -> tuple[str, Mapping[str, Any]]:
    """How the benchmark of a run folder was made: its name and options, as its command was given them.

    Raises:
        DataError: There is no plan in the folder, it is damaged, or does not tell.
    """
    made: Any = read_plan(folder).get("made")
    name, options = (made.get("name"), made.get("options")) if isinstance(made, dict) else (None, None)
    if not isinstance(name, str) or not isinstance(options, dict):
        raise DataError(
            f"The plan in {folder} does not say how its benchmark was made, as those of earlier versions.",
            hint="Its own command without --shard, with the same --out, takes over what its shards have done.",
        )
    return name, options


def merge_shards(
    out: Path, folders: Sequence[Path], benchmark: Benchmark[Any], made: Mapping[str, Any]
) -> tuple[StageStore[Any], list[Row]]:
    """Merge all shards of a run into one run folder, scored as if it had never been split.

    Args:
        out: Folder for the whole run; may be merged into again.
        folders: The shards' run folders. One whole run is its only shard: merging it scores it anew.
        benchmark: The shards', made again.
        made: How it was made.

    Returns:
        What is stored of the whole run, and the rows that were written to `results.jsonl`.

    Raises:
        ConfigError: The folders are not the shards of one run of the benchmark, or `out` holds another run.
        DataError: A shard is damaged, or has items that were neither done nor tried.
    """
    plans = [(folder, read_plan(folder)) for folder in folders]
    whole = _manifest(plans[0], benchmark, WHOLE, made)
    shards = _alike(plans, whole)
    parts = [
        (folder, StageStore[Any].open(folder, benchmark, _manifest((folder, plan), benchmark, shard, made)))
        for (folder, plan), shard in sorted(zip(plans, shards, strict=True), key=lambda one: one[1].number)
    ]
    for folder, stages in parts:
        _check_complete(stages, folder)
    with sole_writer(out):
        whole.freeze(out)
        merged = StageStore[Any].open(out, benchmark, whole)
        try:
            for folder, _ in parts:
                adopt(merged, folder)
        finally:
            for store in merged.stores:
                store.close()
        return merged, score(out, merged)


def _manifest(
    part: tuple[Path, Mapping[str, Any]], benchmark: Benchmark[Any], shard: Shard, made: Mapping[str, Any]
) -> Manifest[Any]:
    """The manifest of a shard; its planner, model and labels are what a plan tells and the benchmark cannot."""
    folder, plan = part
    config, labels = plan.get("config"), plan.get("labels")
    if not isinstance(config, dict) or not isinstance(labels, list):
        raise _damaged(folder)
    about = {**({"planner": config["planner"]} if "planner" in config else {}), **benchmark.config}
    return Manifest[Any].of(benchmark, about, model=str(plan.get("model", "")), labels=labels, shard=shard, made=made)


def _damaged(folder: Path) -> DataError:
    return DataError(
        f"{folder / 'plan.json'} is damaged.",
        hint="Delete it and run the same command: what was asked and done is kept.",
    )


def _alike(plans: Sequence[tuple[Path, Mapping[str, Any]]], whole: Manifest[Any]) -> list[Shard]:
    """Which shard each is. Raises ConfigError: they are not all those of one run, each once."""
    shards: list[Shard] = []
    for folder, plan in plans:
        try:
            number, count = map(int, str(plan["shard"]).split("/"))
            shards.append(Shard(number, count))
        except (KeyError, ValueError, ConfigError) as error:
            raise _damaged(folder) from error
        differs = [name for name, value in whole.about.items() if plan.get(name) != value]
        if shards[-1].count != shards[0].count:
            differs.append("number of shards")
        if differs:
            raise ConfigError(
                f"{folder} is of another run, or its data have changed: {', '.join(differs)} differ.",
                hint="Merge the shards of one run; name data that have moved with -o data=FOLDER.",
            )
    found = [shard.number for shard in shards]
    twice = sorted({number for number in found if found.count(number) > 1})
    missing = sorted(set(range(1, shards[0].count + 1)) - set(found))
    if twice or missing:
        named = (
            f"{what} {', '.join(map(str, some))}" for what, some in (("twice", twice), ("missing", missing)) if some
        )
        raise ConfigError(
            f"These are not the {shards[0].count} shards of the run, each once ({'; '.join(named)}).",
            hint="Name every shard's folder once, e.g. chauffeur bench merge runs/x runs/x/shard-*.",
        )
    return shards


def _check_complete(stages: StageStore[Any], folder: Path) -> None:
    unasked = [item.id for item in stages.manifest.items if not stages.asked(item)]
    if unasked:
        raise DataError(
            f"{folder} is not finished: {len(unasked)} of {len(stages.manifest.items)} items have been neither done "
            f"nor tried, {unasked[0]} among them.",
            hint=f"{_AGAIN} A run made by another version of Chauffeur has to be driven again by this one.",
        )
