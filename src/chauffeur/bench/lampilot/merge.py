"""Putting the shards of a run together: from their full rows, never from their summaries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from chauffeur.bench.kernel.shards import WHOLE
from chauffeur.bench.kernel.stages import StageStore
from chauffeur.bench.kernel.store import Row, RowStore, sole_writer
from chauffeur.bench.lampilot.frozen import Frozen
from chauffeur.bench.lampilot.results import open_stages, publish_results, results
from chauffeur.concept import ConfigError, DataError
from chauffeur.driving.judge.metrics import ruler_named
from chauffeur.worlds.highway.dblv1 import Item

_AGAIN = "Run its command again; it goes on where it stopped."


def merge_shards(out: Path, folders: Sequence[Path], ruler: str = "origin") -> list[Row]:
    """Merge all shards of a run into one run folder, scored as if it had never been split.

    Args:
        out: Folder for the whole run; may be merged into again.
        folders: The shards' run folders. One whole run is its only shard: merging it scores it anew.
        ruler: Short name or id of the ruler to score by.

    Returns:
        The rows that were written to `results.jsonl`.

    Raises:
        ConfigError: The folders are not the shards of one run, or `out` holds another run.
        DataError: A shard is damaged, or has items that were neither driven nor tried.
    """
    ruler = ruler_named(ruler).id
    plans = [Frozen.read(folder) for folder in folders]
    parts = [open_stages(folder, plan) for folder, plan in zip(folders, plans, strict=True)]
    _check_alike(parts, folders)
    for stages, folder in zip(parts, folders, strict=True):
        _check_complete(stages, folder)
    whole = _joined(plans)
    with sole_writer(out):
        whole.freeze(out)
        merged = open_stages(out, whole)
        try:
            _copy(parts, merged)
        finally:
            for store in merged.stores:
                store.close()
        rows = results(merged, ruler)
        publish_results(out, merged, rows)
    return rows


def _check_alike(parts: Sequence[StageStore[Item]], folders: Sequence[Path]) -> None:
    first = parts[0].manifest
    for stages, folder in zip(parts, folders, strict=True):
        differs = [name for name, value in first.about.items() if stages.manifest.about[name] != value]
        if stages.manifest.shard.count != first.shard.count:
            differs.append("number of shards")
        if differs:
            raise ConfigError(
                f"{folder} is of another run than {folders[0]}: they differ in {', '.join(differs)}.",
                hint="Merge the shards of one run.",
            )
    found = [stages.manifest.shard.number for stages in parts]
    twice = sorted({number for number in found if found.count(number) > 1})
    missing = sorted(set(range(1, first.shard.count + 1)) - set(found))
    if twice or missing:
        said = [f"{what} {', '.join(map(str, numbers))}" for what, numbers in (("twice", twice), ("missing", missing))]
        given = "; ".join(text for text, numbers in zip(said, (twice, missing), strict=True) if numbers)
        raise ConfigError(
            f"These are not the {first.shard.count} shards of the run, each once ({given}).",
            hint="Name every shard's folder once, e.g. chauffeur bench merge runs/x runs/x/shard-*.",
        )


def _check_complete(stages: StageStore[Item], folder: Path) -> None:
    unasked = [item.id for item in stages.manifest.items if not stages.asked(item)]
    if unasked:
        raise DataError(
            f"{folder} is not finished: {len(unasked)} of {len(stages.manifest.items)} items have been neither driven "
            f"nor tried, {unasked[0]} among them.",
            hint=f"{_AGAIN} A run made by another version of Chauffeur has to be driven again by this one.",
        )


def _joined(parts: Sequence[Frozen]) -> Frozen:
    items: dict[int, Item] = {}
    for part in parts:
        items |= zip(part.places, part.items, strict=True)
    if sorted(items) != list(range(parts[0].planned)):
        raise ConfigError(
            f"The shards hold {len(items)} different items of a run of {parts[0].planned}.",
            hint="Were they all made from the same data set?",
        )
    places = tuple(range(parts[0].planned))
    return replace(parts[0], shard=WHOLE, items=tuple(items[place] for place in places), places=places)


def _copy(parts: Sequence[StageStore[Item]], merged: StageStore[Item]) -> None:
    """Append what `merged` lacks, in an order that does not depend on who finished when."""
    contexts: dict[str, Row] = {}
    plans: dict[str, Row] = {}
    rollouts: dict[str, Row] = {}
    for stages in parts:
        contexts |= stages.contexts.rows
        plans |= stages.plans.rows
        # A drive that a machine spoiled in one shard may have come off in another.
        rollouts |= {
            key: row for key, row in stages.rollouts.rows.items() if key not in rollouts or not row["infra_failed"]
        }
    for store, rows in ((merged.contexts, contexts), (merged.plans, plans), (merged.rollouts, rollouts)):
        _append(store, [row for key, row in sorted(rows.items()) if store.rows.get(key) != row])


def _append(store: RowStore, rows: Sequence[Row]) -> None:
    if rows:
        store.append(*rows)
