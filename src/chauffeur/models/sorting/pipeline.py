"""From the sentences to the two sorters that ship, with their cards.

folder/wishes.npz     for `chauffeur.planners.talk2drive`
folder/remarks.npz    for `chauffeur.memory`
folder/CARD.md        data and models: how many sentences, how well writers never learned from are sorted
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.drive.files import publish
from chauffeur.models.sorting.sentences import Name, Sentence, kinds_of, sentences, table
from chauffeur.models.sorting.tables import drawn
from chauffeur.models.sorting.training import Recipe, by_writer, right, train, write

Told = Callable[[str, int, int], None]
"""Is told a stage, how much of it is done, and of how much."""

VERSION: Final = "sorters-v3"
NAMES: Final[tuple[Name, ...]] = ("wishes", "remarks")


@dataclass(frozen=True, slots=True)
class Figures:
    """What came of a sorter.

    Attributes:
        learned: Share of the sentences it learned from that it sorts as meant.
        unheard: The same of sentences of writers it had not learned from; None where that was not measured.
        by_kind: That share of each kind, and how many sentences there are; empty where it was not measured.
    """

    learned: float
    unheard: float | None
    by_kind: dict[str, tuple[float, int]]


def make_sorters(folder: Path, recipe: Recipe, told: Told, *, measured: bool = False) -> Path:
    """Train and write both sorters and their card; the card's path.

    Args:
        folder: Where to.
        recipe: How; its seed draws the tables' sentences too.
        told: Is told how far it is.
        measured: Whether sorters are also trained without a fifth of the writers in turn, to see how they sort those.

    Raises:
        StorageError, DataError: The folder cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    found: dict[Name, tuple[Sequence[Sentence], Figures]] = {}
    tables = drawn(recipe.seed)
    for name in NAMES:
        own, kinds = sentences(name), kinds_of(name)
        sorter = train((*own, *(tables if name == "wishes" else ())), kinds, recipe, _percent(name, told))
        write(sorter, folder / f"{name}.npz")
        hits = by_writer(own, kinds, recipe, _percent(f"{name} without a writer", told)) if measured else None
        found[name] = own, _figures(own, right(sorter, own), hits)
    card = folder / "CARD.md"
    publish(card, _card(found, recipe, len(tables)).encode(), "card")
    return card


def _percent(stage: str, told: Told) -> Callable[[float], None]:
    return lambda share: told(f"{stage}, %", round(100 * share), 100)


def _figures(own: Sequence[Sentence], learned: np.ndarray[Any, Any], hits: np.ndarray[Any, Any] | None) -> Figures:
    if hits is None:
        return Figures(float(learned.mean()), None, {})
    of = Counter(one.kind for one in own)
    good = Counter(one.kind for one, hit in zip(own, hits, strict=True) if hit)
    by_kind = {kind: (good[kind] / count, count) for kind, count in sorted(of.items())}
    return Figures(float(learned.mean()), float(hits.mean()), by_kind)


def _card(found: dict[Name, tuple[Sequence[Sentence], Figures]], recipe: Recipe, tables: int) -> str:
    parts = [_HEAD.format(version=VERSION, seed=recipe.seed, epochs=recipe.epochs, tables=tables)]
    for name, (own, figures) in found.items():
        digest = hashlib.sha256(table(name)).hexdigest()[:16]
        writers = len({one.writer for one in own})
        parts.append(
            f"## {name}.npz\n\n{len(own):,} sentences by {writers} writers, {len(kinds_of(name))} kinds; sha256 of the "
            f"table `{digest}`. Sorted as meant: {100 * figures.learned:.1f} % of the "
            f"sentences it learned from{_unheard(figures)}.\n"
        )
        if figures.by_kind:
            parts.append("| kind | sentences | sorted as meant when their writer was left out, % |\n|---|---:|---:|")
            parts += [f"| {kind} | {many:,} | {100 * share:.0f} |" for kind, (share, many) in figures.by_kind.items()]
            parts.append("")
    return "\n".join(parts)


def _unheard(figures: Figures) -> str:
    if figures.unheard is None:
        return ""
    return f", {100 * figures.unheard:.1f} % when their writer was left out of the training"


_HEAD: Final = """# Data and model card: {version}

Two sorters of short English sentences for the `talk2drive` planner and for feedback: what a passenger is after who only
hints at it, and what a remark after a drive says. Softmax regression over hashed words, pairs of words, negated words
and parts of words; int8 weights, {epochs} epochs, seed {seed}. `chauffeur model train sorters --out DIR` makes the same
files again from the tables in `data/sorters`.

- **Data**: written for this repository by writers (large language models) who were told the situation and what a
  passenger has in mind, and nothing of the planner, its tables, or the words it is measured on; three writers are the
  planner's developers: j and k (the tuning half of the simulated passengers) with older development data, bb with plain
  sentences that had been misread. Nobody's own words are in it. To the wishes, sentences of the on-board model's tables
  are added ({tables:,}), half of them of kinds no hint is sorted as. One label a sentence: what is vague by nature
  has the label it was written for.
- **Meant for** reading hints behind the refusal of dangerous wishes, and before all checks: a hint becomes an ordinary
  wish, never more. Feedback that known phrases read is left as they read it, but where this is sure of another thing.
- **Not for** other languages, longer texts, roads other than highways, junctions and parking lots, or deciding anything
  about a person.
- **Licence**: that of the repository.
"""
