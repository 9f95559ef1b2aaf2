"""From the sentences to the four sorters that ship, with their cards.

folder/wishes.npz     for `chauffeur.planners.talk2drive`
folder/remarks.npz    for `chauffeur.memory`
folder/town.npz       for `chauffeur.planners.onboard`, in towns
folder/weather.npz    for `chauffeur.language`
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

from chauffeur.driving.files import publish
from chauffeur.language.weather import SAID_WEATHERS
from chauffeur.models.sorting.sentences import Name, Sentence, kinds_of, sentences, table
from chauffeur.models.sorting.tables import drawn
from chauffeur.models.sorting.training import SortingRecipe, by_writer, right, train, write
from chauffeur.models.sorting.weather import TEST_WRITERS, WeatherFigures, weather_figures, weather_sentences

Told = Callable[[str, int, int], None]
"""Is told a stage, how much of it is done, and of how much."""

VERSION: Final = "sorters-v5"
NAMES: Final[tuple[Name, ...]] = ("wishes", "remarks", "town")
"""Those that are measured on each writer in turn; weather is composed, and measured on six."""


@dataclass(frozen=True, slots=True)
class Figures:
    """Outcome of a sorter's training.

    Attributes:
        learned: Share of the sentences it learned from that it sorts as meant.
        unheard: The same of sentences of writers it had not learned from; None where that was not measured.
        by_kind: That share of each kind, and how many sentences there are; empty where it was not measured.
    """

    learned: float
    unheard: float | None
    by_kind: dict[str, tuple[float, int]]


def make_sorters(folder: Path, recipe: SortingRecipe, told: Told, *, measured: bool = False) -> Path:
    """Train and write the sorters and their card; the card's path.

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
    write(
        train(weather_sentences(recipe.seed), SAID_WEATHERS, recipe, _percent("weather", told)), folder / "weather.npz"
    )
    figures = None
    if measured:
        stage = _percent("weather without six writers", told)
        left = train(weather_sentences(recipe.seed, TEST_WRITERS), SAID_WEATHERS, recipe, stage)
        figures = weather_figures(left, recipe.seed)
    card = folder / "CARD.md"
    publish(card, (_card(found, recipe, len(tables)) + weather_part(figures)).encode(), "card")
    return card


def weather_part(figures: WeatherFigures | None) -> str:
    """Section of the model card on the sorter of weather."""
    own = sentences("weather")
    digest = hashlib.sha256(table("weather")).hexdigest()[:16]
    words = (
        f"\n## weather.npz\n\nWhat is said in passing of the weather or the road, {len(SAID_WEATHERS)} kinds: "
        f"{len(own):,} sentences of the wishes, labelled by hand (by a large language model), sha256 of the table "
        f"`{digest}`; the grammar `weather.txt`, and wishes alone. Texts are read whole and clause by clause; words of "
        "the weather services' vocabulary lower the threshold, and a clause in which all of them are denied says "
        "nothing. Recipe and thresholds were chosen on two writers (g, s).\n"
    )
    if figures is None:
        return words
    one = figures
    return (
        f"{words}\n| of six writers left out of the training, and held-out templates | texts | taken for weather |\n"
        "|---|---:|---:|\n"
        f"| says something of the weather or the road | {one.said:,} | {one.heard:,} |\n"
        f"| only looks so (ice cream, yesterday's rain) | {one.alike:,} | {one.mistaken:,} |\n"
        f"| held-out templates beside wishes | {one.held:,} | {one.held_heard:,} |\n"
        f"| the same, denied or of something else | {one.denied:,} | {one.denied_mistaken:,} |\n"
        f"| other wishes | {one.others:,} | {one.others_mistaken:,} |\n"
    )


def _percent(stage: str, told: Told) -> Callable[[float], None]:
    return lambda share: told(f"{stage}, %", round(100 * share), 100)


def _figures(own: Sequence[Sentence], learned: np.ndarray[Any, Any], hits: np.ndarray[Any, Any] | None) -> Figures:
    if hits is None:
        return Figures(float(learned.mean()), None, {})
    of = Counter(one.kind for one in own)
    good = Counter(one.kind for one, hit in zip(own, hits, strict=True) if hit)
    by_kind = {kind: (good[kind] / count, count) for kind, count in sorted(of.items())}
    return Figures(float(learned.mean()), float(hits.mean()), by_kind)


def _card(found: dict[Name, tuple[Sequence[Sentence], Figures]], recipe: SortingRecipe, tables: int) -> str:
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

Four sorters of short English sentences: what a passenger is after who only hints at it (for the `talk2drive`
planner), what a remark after a drive says (for feedback), what a passenger in a town is after (for the on-board
planners), and what is said of weather or road (for the `vlm` planner).
Softmax regression over hashed words, pairs of words, negated words and parts of words; int8 weights, {epochs} epochs,
seed {seed}. `chauffeur model train sorters --out DIR` makes the same files again from the tables in `data/sorters`.

- **Data**: written for this repository by writers (large language models) who were told the situation and what a
  passenger has in mind, and nothing of the planner, its tables, or the words it is measured on; three writers are the
  planner's developers: j and k (the tuning half of the simulated passengers) with older development data, bb with plain
  sentences that had been misread. The 20 people of the town's sentences are four writers playing five each, who knew
  the kinds and nothing else; a 21st is `describe.navigation`, which composes. Nobody's own words are in it. To the
  wishes, sentences of the on-board model's tables are added ({tables:,}), half of them of kinds no hint is sorted as.
  One label a sentence: what is vague by nature has the label it was written for.
- **Meant for** reading hints behind the refusal of dangerous wishes, and before all checks: a hint becomes an ordinary
  wish, never more. Feedback that known phrases read is left as they read it, but where this is sure of another thing.
- **Not for** other languages, longer texts, other roads than each was made for, or deciding anything about a person.
- **Licence**: that of the repository.
"""
