"""How a benchmark stands on a score card: its headline figures, what a planner must write to take it, a quick profile.

A benchmark says it by a class attribute `card`; one without is judged by the first measure of its first table.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec
from chauffeur.bench.kernel.report import Line, fill, published_lines, published_table
from chauffeur.concept import DataError


@dataclass(frozen=True, slots=True)
class PrintedFigure:
    """A figure of the paper: of which method, its value (rates in 0..1), and the table's number, e.g. `Tab. IV`."""

    name: str
    value: float
    table: str


@dataclass(frozen=True, slots=True)
class Headline:
    """A figure for a score card: one cell of a table.

    Attributes:
        title: What it is, in a few words.
        table: Where it stands; it need not be one of the benchmark's report.
        measure: Its column.
        line: Name of its line; empty for the last, which is over all.
        paper: Names of printed rows of the table to stand beside it.
    """

    title: str
    table: TableSpec
    measure: Measure
    line: str = ""
    paper: tuple[str, ...] = ()

    @property
    def place(self) -> int:
        """Place of its column."""
        return [measure.id for measure in self.table.measures].index(self.measure.id)

    def found(self, rows: Sequence[AnyRow]) -> Line | None:
        """The line that it is in, over the rows of a run; None where there is none."""
        lines = fill(self.table, rows).lines
        named = [one for one in lines if one.name == self.line] if self.line else lines[-1:]
        return named[0] if named else None

    def rows(self, rows: Sequence[AnyRow]) -> list[AnyRow]:
        """The rows that it is over, of those of a run."""
        about, group = self.table.about(rows), self.table.group
        if not self.line or not group:
            lines = fill(self.table, rows).lines
            last = lines[-1].name if lines and group and not self.table.total else ""
        else:
            last = self.line
        return [row for row in about if not last or str(row[group]).replace("_", " ") == last]

    def printed(self, rows: Sequence[AnyRow]) -> tuple[PrintedFigure, ...]:
        """The paper's own figures that may stand beside it; none where the data folder is not here."""
        if not self.paper:
            return ()
        try:
            lines, source = published_lines(self.table, rows), published_table(self.table)
        except DataError:
            return ()
        found = ((one.name, one.found[self.place].value) for one in lines if one.name in self.paper)
        return tuple(PrintedFigure(name, value, source) for name, value in found if value is not None)


@dataclass(frozen=True, slots=True)
class CardPart:
    """What a score card needs to know of a benchmark before and after it is run.

    Attributes:
        headlines: Its figures, the first one first.
        evidence: What the figures come from, e.g. `simulated drives (highway-env)`.
        quick: Options of the quick profile; the full one has the benchmark's own defaults.
        full: Options of the full profile that differ from those defaults.
        drives: Kinds of policy that it drives, by the scenario in which a planner shows it (`driving.aptitude`); a
            planner that writes none of them for one of the scenarios cannot take it.
        planner: Option that names the planner, where the benchmark asks it in its workers.
        extra: Extra of the package that it needs, and a module by which that is found; empty for none.
    """

    headlines: tuple[Headline, ...]
    evidence: str
    quick: Mapping[str, Any] = field(default_factory=dict[str, Any])
    full: Mapping[str, Any] = field(default_factory=dict[str, Any])
    drives: Mapping[str, tuple[str, ...]] = field(default_factory=dict[str, "tuple[str, ...]"])
    planner: str = "planner"
    extra: tuple[str, str] | None = None


def usual_part(tables: Sequence[TableSpec]) -> CardPart:
    """The part of a benchmark that says nothing of score cards: the first measure of its first table, of all rows."""
    first = tables[0]
    return CardPart((Headline(first.title, first, first.measures[0]),), "not told by the benchmark")
