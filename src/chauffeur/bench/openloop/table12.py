"""The paper's Tab. XII with our rows beside its own.

Its rows were measured by its authors, or quoted by them from OpenEMMA's, on nuScenes; ours say on what. They follow
OpenEMMA, failures left out of the means; whether they come out of the lines that OpenEMMA published (`openemma-code`,
a step late at 2 and 3 s) is nowhere said, so each of our methods has a line of either averaging.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final

from chauffeur.bench.openloop.benchmark import Whose, errors_of, failed_of
from chauffeur.bench.openloop.conventions import Convention
from chauffeur.concept.data import read_data

HEADER: Final = ("method", "learning", "averaging", "L2 1 s", "L2 2 s", "L2 3 s", "avg.", "failures %")
LEARNING: Final[Mapping[str, str]] = {
    "zero-shot": "Zero-Shot",
    "chain-of-thought": "Open-EMMA",
    "sft": "SFT",
}


def paper_lines() -> list[tuple[str, ...]]:
    """The paper's rows. Raises DataError: the data folder is not here."""
    table: Mapping[str, Any] = json.loads(read_data("openloop", "table12.json"))
    found: list[tuple[str, ...]] = []
    for name, learning, *values in table["rows"]:
        cells = ("n/a" if value is None else f"{value:.2f}" for value in values)
        found.append((f"{name} (paper, nuScenes)", str(learning), "as printed", *cells))
    return found


def our_line(
    name: str,
    learning: str,
    rows: Iterable[Mapping[str, Any]],
    whose: Whose = "l2",
    *,
    convention: Convention = "openemma",
    failures: bool = False,
) -> tuple[str, ...]:
    """A line of ours over stored rows: of the model, or of constant velocity (`whose`)."""
    told = [row for row in rows if failed_of(row, whose) is not None]
    kept = [errors_of(row, convention, whose) for row in told if failures or not failed_of(row, whose)]
    columns = [[getattr(one, part) for one in kept] for part in ("at_1s", "at_2s", "at_3s", "average")]
    broken = 100.0 * sum(bool(failed_of(row, whose)) for row in told) / len(told) if told else None
    return (name, learning, convention, *(_text(_mean(column)) for column in columns), _text(broken))


def our_lines(
    name: str, learning: str, rows: Sequence[Mapping[str, Any]], whose: Whose = "l2"
) -> list[tuple[str, ...]]:
    """Both lines of a method, failures left out; see `our_line`."""
    averagings: tuple[Convention, ...] = ("openemma-code", "openemma")
    return [our_line(name, learning, rows, whose, convention=one) for one in averagings]


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None


def _text(value: float | None) -> str:
    return "n/a" if value is None else f"{value:.2f}"
