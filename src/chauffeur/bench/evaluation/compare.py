"""Two score cards side by side: differences where benchmark, version, data and options agree, and reasons elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chauffeur.bench.evaluation.card import CardEntry, Figure, ScoreCard, read_card
from chauffeur.bench.evaluation.parts import part_of
from chauffeur.bench.kernel.headline import Headline
from chauffeur.bench.kernel.report import interval_text
from chauffeur.bench.kernel.stats import Interval
from chauffeur.bench.report.runs import load_run
from chauffeur.concept import ChauffeurError


@dataclass(frozen=True, slots=True)
class Change:
    """A figure on two cards.

    Attributes:
        name: Of the benchmark.
        old, new: The figures.
        difference: New less old, with an interval where the rows of both runs are at hand.
    """

    name: str
    old: Figure
    new: Figure
    difference: Interval

    @property
    def text(self) -> str:
        """The difference with its sign and ends, as it is shown."""
        text = interval_text(self.difference, self.new.scale, self.new.digits)
        return text if text.startswith(("-", "n")) else f"+{text}"

    @property
    def sure(self) -> bool:
        """True if the interval does not hold 0."""
        low, high = self.difference.low, self.difference.high
        return low is not None and high is not None and (low > 0.0 or high < 0.0)


@dataclass(frozen=True, slots=True)
class CardComparison:
    """Two cards compared.

    Attributes:
        old, new: The cards.
        changes: Figures that may be compared.
        refused: (benchmark, why its figures may not be compared).
        notes: What else differs: planner, versions, machine.
    """

    old: ScoreCard
    new: ScoreCard
    changes: tuple[Change, ...]
    refused: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]


def compare_cards(old: Path, new: Path) -> CardComparison:
    """Compare the cards of two folders; intervals are paired, over the items of both runs.

    Raises:
        DataError: One of them is no score card.
    """
    first, second = read_card(old), read_card(new)
    known = {one.name: one for one in first.entries}
    changes: list[Change] = []
    refused: list[tuple[str, str]] = []
    for entry in second.entries:
        before = known.pop(entry.name, None)
        if before is None or not (before.figures or entry.figures):
            if entry.figures:
                refused.append((entry.name, "It is on the new card only."))
            continue
        if why := _unlike(before, entry):
            refused.append((entry.name, why))
        else:
            changes += _changes(before, entry, old, new)
    refused += [(name, "It is on the old card only.") for name, one in known.items() if one.figures]
    return CardComparison(first, second, tuple(changes), tuple(refused), tuple(_notes(first, second)))


def _unlike(old: CardEntry, new: CardEntry) -> str:
    """Why two entries may not be compared; empty where they may."""
    for entry, which in ((old, "old"), (new, "new")):
        if not entry.figures:
            return f"The {which} card has no figures of it: {entry.why or entry.state}"
        if entry.state != "done":
            return f"On the {which} card it is {entry.state} ({entry.items} of {entry.planned} items)."
    if old.bench != new.bench:
        return f"Versions differ: {old.bench} and {new.bench}."
    if old.basis == new.basis:
        return ""
    names = sorted({*old.config, *new.config})
    differing = [name for name in names if old.config.get(name) != new.config.get(name)]
    told = ", ".join(f"{name} {_short(old.config.get(name))} and {_short(new.config.get(name))}" for name in differing)
    return f"Data or options differ: {told or f'{old.planned} and {new.planned} items'}."


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 16 else f"{text[:12]}..."


def _changes(old: CardEntry, new: CardEntry, first: Path, second: Path) -> Iterator[Change]:
    before = {(one.metric, one.title): one for one in old.figures}
    headlines = _headlines(new.name)
    rows = _rows_of(first, second, new.name)
    for figure in new.figures:
        one = before.get((figure.metric, figure.title))
        if one is None or one.found.value is None or figure.found.value is None:
            continue
        headline = next((head for head in headlines if head.title == figure.title), None)
        yield Change(new.name, one, figure, _difference(headline, rows, figure.found.value - one.found.value))


def _headlines(name: str) -> tuple[Headline, ...]:
    try:
        part = part_of(name)
    except ChauffeurError:
        return ()
    return () if part is None else part.headlines


def _rows_of(first: Path, second: Path, name: str) -> tuple[Any, Any] | None:
    """The rows of both runs; None where one is not there any more."""
    try:
        found = [load_run(folder / name).rows for folder in (first, second) if folder.is_dir()]
    except ChauffeurError:
        return None
    return (found[0], found[1]) if len(found) == 2 else None


def _difference(headline: Headline | None, rows: tuple[Any, Any] | None, plain: float) -> Interval:
    """The difference, with an interval where both runs have the same rows behind the figure."""
    if headline is not None and rows is not None:
        old, new = (headline.rows(part) for part in rows)
        if len(old) == len(new):
            found = headline.measure.difference(old, new, headline.table.cluster)
            if found.value is not None:
                return found
    return Interval(plain)


def _notes(old: ScoreCard, new: ScoreCard) -> Iterator[str]:
    if (old.planner, old.model) != (new.planner, new.model):
        yield f"Planners: {old.planner} ({old.model}) and {new.planner} ({new.model})."
    names = sorted({*old.versions, *new.versions})
    differing = [name for name in names if old.versions.get(name) != new.versions.get(name)]
    if differing:
        told = ", ".join(f"{one} {old.versions.get(one)} and {new.versions.get(one)}" for one in differing)
        yield f"Versions: {told}."
    if old.machine != new.machine:
        yield f"Machines: {old.machine}; {new.machine}. Latencies are not comparable."
