"""The one report over tidy rows: every benchmark's tables, as text cells, Markdown, CSV and JSON."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec
from chauffeur.bench.kernel.stats import Interval
from chauffeur.concept import DataError
from chauffeur.concept.data import read_data

ALL = "all"


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a table.

    Attributes:
        name: What it is about.
        items: How many rows; None where that is not known.
        found: One aggregate a column.
        group: Heading that it stands under, where there are several runs or printed rows.
        labels: What must be said beside the name.
        form: What it holds in place of the columns' own values: `count` (whole numbers), `p` (of a test).
        published: Whether its figures are printed ones, measured by others.
    """

    name: str
    items: int | None
    found: tuple[Interval, ...]
    group: str = ""
    labels: tuple[str, ...] = ()
    form: Literal["", "count", "p"] = ""
    published: bool = False

    @property
    def said(self) -> str:
        """The name with its labels: `onboard [critic: evaluator]`."""
        name = f"{self.name} [{'; '.join(self.labels)}]" if self.labels else self.name
        return f"paper: {name}" if self.published else name


@dataclass(frozen=True, slots=True)
class ResultTable:
    """A table, filled in.

    Attributes:
        spec: What it is made of.
        lines: Its lines; the last of a run's own is over all rows where the table has a total.
        notes: What stands below it.
    """

    spec: TableSpec
    lines: tuple[Line, ...]
    notes: tuple[str, ...] = ()

    @property
    def header(self) -> tuple[str, ...]:
        """Heads of the columns."""
        return (*self.spec.heads, *(head(measure) for measure in self.spec.measures))

    @property
    def cells(self) -> list[list[str]]:
        """The lines as text."""
        return [
            [self._name(line), count_text(line), *(self._text(line, place) for place in range(len(line.found)))]
            for line in self.lines
        ]  # fmt: skip

    @staticmethod
    def _name(line: Line) -> str:
        return f"{line.group}: {line.said}" if line.group and not line.published else line.said

    def _text(self, line: Line, place: int) -> str:
        value, ends = value_text(line, place, self.spec.measures[place])
        return f"{value} {ends}" if ends and self.spec.brackets else value

    @property
    def json(self) -> dict[str, Any]:
        """The table for machines; values in the unit of their metric, rates in 0..1."""
        lines = [
            {
                self.spec.group or "group": line.name,
                "items": line.items,
                "metrics": {
                    measure.id: {"title": measure.title, "unit": measure.unit, **asdict(interval)}
                    for measure, interval in zip(self.spec.measures, line.found, strict=True)
                },
            }
            for line in self.lines
            if not line.published
        ]
        return {"title": self.spec.title, "lines": lines}


def stored_table(stored: Mapping[str, Any]) -> ResultTable:
    """A table back from its JSON, with its figures and without its metrics: it can be shown, not compared."""
    lines: list[Line] = []
    measures: tuple[Measure, ...] = ()
    for line in stored["lines"]:
        found: dict[str, dict[str, Any]] = line["metrics"]
        measures = tuple(
            Measure(id, str(one.get("title", id)), lambda _: None, one["unit"], digits=1 if one["unit"] else 2)
            for id, one in found.items()
        )
        ends = (Interval(*(one[name] for name in ("value", "low", "high", "how"))) for one in found.values())
        name = next(value for key, value in line.items() if key not in ("items", "metrics"))
        lines.append(Line(str(name), line["items"], tuple(ends)))
    return ResultTable(TableSpec(str(stored["title"]), measures), tuple(lines))


def fill(spec: TableSpec, rows: Sequence[AnyRow], name: str = ALL) -> ResultTable:
    """A table over the rows it is about; without lines where there are none. `name` is that of a line on its own."""
    mine = spec.about(rows)
    groups: dict[str, list[AnyRow]] = {name: [] for name in spec.order} if spec.group else {}
    for row in mine if spec.group else ():
        groups.setdefault(str(row[spec.group]), []).append(row)
    parts = [(group.replace("_", " "), part) for group, part in groups.items() if part]
    if mine and (spec.total or not spec.group):
        parts.append((ALL if spec.group else name, mine))
    lines = tuple(Line(group, len(part), _aggregates(spec, part)) for group, part in parts)
    note = spec.note(mine) if spec.note is not None and mine else ""
    return ResultTable(spec, lines, (note,) if note else ())


def tables(specs: Iterable[TableSpec], rows: Sequence[AnyRow], name: str = ALL) -> tuple[ResultTable, ...]:
    """The tables that have lines, with the printed rows that they may stand beside."""
    return tuple(with_published(table, rows) for spec in specs if (table := fill(spec, rows, name)).lines)


def with_published(table: ResultTable, rows: Sequence[AnyRow]) -> ResultTable:
    """A table with the printed rows that it may stand beside, or with a note why they are missing."""
    try:
        return replace(table, lines=(*table.lines, *published_lines(table.spec, rows)))
    except DataError as error:
        return replace(table, notes=(*table.notes, f"Without the printed rows: {error.message}"))


def published_lines(spec: TableSpec, rows: Sequence[AnyRow]) -> tuple[Line, ...]:
    """The printed rows of a table that may stand beside rows; none where it names no file.

    The file holds `table` (its number in the paper), `source` and `rows`: of each its `name`, `values` as printed
    (rates in %), `items` where they are known, and `where`, columns in which the rows of a run must agree with it.

    Raises:
        DataError: The data folder is not here.
    """
    if not spec.published:
        return ()
    stored = _published(spec)
    about = spec.about(rows)
    lines: list[Line] = []
    for one in stored["rows"]:
        where: Mapping[str, Any] = one.get("where", {})
        if any(row[column] != value for column, value in where.items() for row in about):
            continue
        values = (
            Interval(None if value is None else value / (100.0 if measure.unit == "%" else 1.0))
            for value, measure in zip(one["values"], spec.measures, strict=True)
        )
        heading = f"Printed in the paper ({stored['table']}): its authors' own figures and items"
        lines.append(Line(str(one["name"]), one.get("items"), tuple(values), heading, published=True))
    return tuple(lines)


def published_table(spec: TableSpec) -> str:
    """Number of the printed table that stands beside a table. Raises DataError: the data folder is not here."""
    return str(_published(spec)["table"])


def _published(spec: TableSpec) -> Mapping[str, Any]:
    folder, name = spec.published.split("/")
    return json.loads(read_data(folder, name))


def report_markdown(title: str, found: Iterable[ResultTable], notes: Iterable[str] = ()) -> str:
    """All tables as Markdown."""
    parts = [f"# {title}", *notes]
    for table in found:
        parts += [f"## {table.spec.title}", markdown(table.header, table.cells), *table.notes]
    return "\n\n".join(parts) + "\n"


def markdown(header: Iterable[str], lines: Iterable[Sequence[str]], text_columns: int = 1) -> str:
    """A Markdown table; the first columns are text, the others are numbers."""
    names = list(header)
    rule = ["---" if place < text_columns else "---:" for place in range(len(names))]
    return "\n".join("| " + " | ".join(line) + " |" for line in [names, rule, *lines])


def report_csv(found: Iterable[ResultTable]) -> str:
    """All tables as CSV, a figure a line; values in the unit of their metric, rates in 0..1."""
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(("table", "group", "line", "items", "metric", "unit", "value", "low", "high"))
    for table in found:
        for line in table.lines:
            for measure, one in zip(table.spec.measures, line.found, strict=True):
                unit = line.form or measure.unit
                about = (table.spec.title, line.group, line.said, line.items, measure.id, unit)
                out.writerow((*about, one.value, one.low, one.high))
    return text.getvalue()


def count_text(line: Line) -> str:
    """Number of items behind a line, as text; empty where it has none."""
    return "" if line.items is None else str(line.items)


def value_text(line: Line, place: int, measure: Measure) -> tuple[str, str]:
    """A figure of a line, `98.7`, and its ends, `[97.4, 99.6]`; empty where it has none."""
    interval = line.found[place]
    if interval.value is None:
        return ("" if line.form else "n/a"), ""
    if line.form == "p":
        return p_text(interval.value), ""
    scale = 100.0 if measure.unit == "%" and not line.form else 1.0
    value, _, ends = interval_text(interval, scale, 0 if line.form else measure.digits).partition(" ")
    return value, ends


def p_text(p: float) -> str:
    """A p value as it is read: `< 0.001`, `0.031`, `1`."""
    if p < 0.001:
        return "< 0.001"
    return "1" if p > 0.9995 else f"{p:.3f}"


def interval_text(interval: Interval, scale: float = 1.0, digits: int = 1, missing: str = "n/a") -> str:
    """`98.7 [97.4, 99.6]`; without ends where there is no interval, `missing` where there is no value."""
    if interval.value is None:
        return missing
    value = f"{scale * interval.value:.{digits}f}"
    if interval.low is None or interval.high is None:
        return value
    return f"{value} [{scale * interval.low:.{digits}f}, {scale * interval.high:.{digits}f}]"


def head(measure: Measure) -> str:
    """Head of a column."""
    return f"{measure.title} {measure.unit}".strip()


def _aggregates(spec: TableSpec, rows: Sequence[AnyRow]) -> tuple[Interval, ...]:
    return tuple(measure.aggregate(rows, spec.cluster) for measure in spec.measures)
