"""The one report over tidy rows: every benchmark's tables, as text cells, Markdown and JSON."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec
from chauffeur.bench.kernel.stats import Interval


@dataclass(frozen=True, slots=True)
class ResultTable:
    """A table, filled in.

    Attributes:
        spec: What it is made of.
        lines: Name, number of rows and aggregates of each line; the last is over all rows where the table has a total.
    """

    spec: TableSpec
    lines: tuple[tuple[str, int, tuple[Interval, ...]], ...]

    @property
    def header(self) -> tuple[str, ...]:
        """Heads of the columns."""
        return (*self.spec.heads, *(_head(measure) for measure in self.spec.measures))

    @property
    def cells(self) -> list[list[str]]:
        """The lines as text."""
        return [
            [name, str(size), *(map(_text, self.spec.measures, found))]
            for name, size, found in self.lines
        ]  # fmt: skip

    @property
    def json(self) -> dict[str, Any]:
        """The table for machines; values in the unit of their metric, rates in 0..1."""
        lines = [
            {
                self.spec.group or "group": name,
                "items": size,
                "metrics": {
                    measure.id: {"unit": measure.unit, **asdict(interval)}
                    for measure, interval in zip(self.spec.measures, found, strict=True)
                },
            }
            for name, size, found in self.lines
        ]
        return {"title": self.spec.title, "lines": lines}


def fill(spec: TableSpec, rows: Iterable[AnyRow]) -> ResultTable:
    """A table over the rows it is about; without lines where there are none."""
    mine = [row for row in rows if spec.rows(row)]
    groups: dict[str, list[AnyRow]] = {name: [] for name in spec.order} if spec.group else {}
    for row in mine if spec.group else ():
        groups.setdefault(str(row[spec.group]), []).append(row)
    parts = [(name.replace("_", " "), part) for name, part in groups.items() if part]
    if mine and (spec.total or not spec.group):
        parts.append(("all", mine))
    return ResultTable(spec, tuple((name, len(part), _aggregates(spec, part)) for name, part in parts))


def tables(specs: Iterable[TableSpec], rows: Sequence[AnyRow]) -> tuple[ResultTable, ...]:
    """The tables that have lines."""
    return tuple(table for spec in specs if (table := fill(spec, rows)).lines)


def report_markdown(title: str, found: Iterable[ResultTable], notes: Iterable[str] = ()) -> str:
    """All tables as Markdown."""
    parts = [f"# {title}", *notes]
    for table in found:
        parts += [f"## {table.spec.title}", markdown(table.header, table.cells)]
    return "\n\n".join(parts) + "\n"


def markdown(header: Iterable[str], lines: Iterable[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first columns are text, the others are numbers."""
    names = list(header)
    rule = ["---" if place < text_columns else "---:" for place in range(len(names))]
    return "\n".join("| " + " | ".join(line) + " |" for line in [names, rule, *lines])


def interval_text(interval: Interval, scale: float = 1.0, digits: int = 1, missing: str = "n/a") -> str:
    """`98.7 [97.4, 99.6]`; without ends where there is no interval, `missing` where there is no value."""
    if interval.value is None:
        return missing
    value = f"{scale * interval.value:.{digits}f}"
    if interval.low is None or interval.high is None:
        return value
    return f"{value} [{scale * interval.low:.{digits}f}, {scale * interval.high:.{digits}f}]"


def _aggregates(spec: TableSpec, rows: Sequence[Mapping[str, Any]]) -> tuple[Interval, ...]:
    return tuple(measure.aggregate(rows, spec.cluster) for measure in spec.measures)


def _head(measure: Measure) -> str:
    return f"{measure.title} {measure.unit}".strip()


def _text(measure: Measure, interval: Interval) -> str:
    return interval_text(interval, 100.0 if measure.unit == "%" else 1.0, measure.digits)
