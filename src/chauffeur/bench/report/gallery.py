"""Which rows that are not as they should be are worth showing, and what explains them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from chauffeur.bench.kernel.metrics import AnyRow, TableSpec, missed
from chauffeur.bench.report.model import Card, Gallery, asked_words, ending_words
from chauffeur.bench.report.runs import Run, keyed

PICKED = 12
"""Cards of a run, unless told otherwise."""
_FACTS = 12
_SHORT = 60

Tell = Callable[[int, int], None]
"""Called as (cards done, of how many)."""
MakeCard = Callable[[AnyRow], Card]


@runtime_checkable
class ShowsItems(Protocol):
    """Optional part of a benchmark class that can show more of an item than its row."""

    @staticmethod
    def cards(run: Run, data: Path | None) -> MakeCard:
        """Makes cards of a run's rows.

        Args:
            run: Whose rows.
            data: Folder of its data set, for runs that kept no scenes; None to do without.

        Raises:
            DataError: What the run kept cannot be read, or the data are not the run's.
        """
        ...


def plain_card(row: AnyRow) -> Card:
    """A card of what the row itself says."""
    facts = [
        (name.replace("_", " "), str(round(value, 3) if isinstance(value, float) else value))
        for name, value in row.items()
        if isinstance(value, str | int | float) and value != "" and len(str(value)) <= _SHORT and name not in _KNOWN
    ]
    why = tuple(str(row[name]) for name in ("detail",) if row.get(name))
    return Card(str(row["item"]), asked_words(row), ending_words(row), why=why, facts=tuple(facts[:_FACTS]))


_KNOWN = ("item", "bench", "chauffeur", "detail", "outcome", "planner", "model", "command", "wish", "instruction")


def choose(rows: Sequence[AnyRow], spec: TableSpec, group: str, limit: int) -> list[AnyRow]:
    """Up to `limit` rows that are not as they should be: the groups in turn, and within a group one of every ending and
    cluster before a second of any; failures of the machine last. The same rows give the same choice."""
    waiting: dict[str, list[tuple[int, AnyRow]]] = {}
    for place, row in enumerate(rows):
        if spec.rows(row) and missed(spec.measures, row):
            waiting.setdefault(str(row.get(group, "")), []).append((place, row))
    seen: Counter[tuple[str, str]] = Counter()

    def marks(row: AnyRow) -> tuple[tuple[str, str], tuple[str, str]]:
        return ("cluster", str(row[spec.cluster])), ("ending", f"{row.get(group, '')} {ending_words(row)}")

    def weight(entry: tuple[int, AnyRow]) -> tuple[int, ...]:
        place, row = entry
        cluster, ending = marks(row)
        return seen[cluster], int(bool(row.get("infra_failed"))), seen[ending], place

    chosen: list[AnyRow] = []
    while len(chosen) < limit and any(waiting.values()):
        for entries in waiting.values():
            if entries and len(chosen) < limit:
                best = min(entries, key=weight)
                entries.remove(best)
                chosen.append(best[1])
                seen.update(marks(best[1]))
    return chosen


def make_gallery(
    run: Run, others: Sequence[Run], spec: TableSpec, group: str, kind: Any, data: Path | None, limit: int, tell: Tell
) -> Gallery:
    """The gallery of a run.

    Args:
        run: Whose rows.
        others: Runs to compare the same items with.
        spec: The table whose rates say which rows are not as they should be.
        group: Column by which they are spread.
        kind: Class of the benchmark.
        data: See `ShowsItems`.
        limit: Cards at most.
        tell: Called after each.

    Raises:
        DataError: See `ShowsItems`.
    """
    chosen = choose(run.rows, spec, group, limit)
    make: MakeCard = kind.cards(run, data) if isinstance(kind, ShowsItems) and chosen else plain_card
    beside: list[tuple[str, dict[tuple[str, ...], AnyRow], dict[int, tuple[str, ...]]]] = []
    for other in others:
        if other.folder != run.folder:
            same_data = other.data == run.data
            keys = {id(row): key for key, row in keyed(run, same_data=same_data).items()}
            beside.append((other.said, dict(keyed(other, same_data=same_data)), keys))
    cards: list[Card] = []
    for row in chosen:
        elsewhere = [(name, ending_words(rows[keys[id(row)]])) for name, rows, keys in beside if keys[id(row)] in rows]
        cards.append(replace(make(row), elsewhere=tuple(elsewhere)))
        tell(len(cards), len(chosen))
    count = sum(spec.rows(row) and missed(spec.measures, row) for row in run.rows)
    return Gallery(run.name, run.labels, count, len(run.rows), tuple(cards))
