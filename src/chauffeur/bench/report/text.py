"""A report as Markdown."""

from __future__ import annotations

from chauffeur.bench.kernel.report import markdown
from chauffeur.bench.report.model import (
    SIMULATED,
    BenchReport,
    Cell,
    Column,
    FlipList,
    Gallery,
    ReportLine,
    ReportTable,
)
from chauffeur.bench.report.tables import number, said

_ARROWS = {"higher": "↑", "lower": "↓", "": ""}


def render_markdown(report: BenchReport) -> str:
    """The report as one Markdown document. What people and models wrote is escaped."""
    parts = [f"# {escape(report.title)}", f"{escape(report.subtitle)}; {SIMULATED}."]
    if report.labels:
        parts.append("Said of these runs: " + "; ".join(escape(label) for label in report.labels) + ".")
    parts.extend(f"> {escape(text)}" for text in report.warnings)
    after = "scores" if report.table("pairs") is None else "pairs"
    for table in report.tables:
        parts.extend(_table(table))
        if table.id == after:
            parts.append("## In words")
            parts.append(escape(report.summary))
            parts.append("\n".join(f"- **{escape(line.subject)}:** {escape(line.text)}" for line in report.headlines))
    if report.flips:
        parts.append("## Items that went differently")
        parts.extend(part for flips in report.flips for part in _flips(flips))
    parts.append("## Failures")
    parts.extend(part for gallery in report.galleries for part in _gallery(gallery))
    parts.append("## What the columns mean")
    parts.append("\n".join(_legend(report)))
    parts.append("## How the figures were made")
    parts.append("\n".join(f"- **{escape(term)}**: {escape(text)}" for term, text in report.terms))
    for run, facts in report.facts:
        parts.append(f"### {escape(run)}")
        parts.append("\n".join(f"- {escape(name)}: {escape(value)}" for name, value in facts))
    return "\n\n".join(parts) + "\n"


def heading(column: Column) -> str:
    """A column's head with unit and direction: `Completion % ↑`."""
    return " ".join(part for part in (column.title, column.unit, _ARROWS[column.better]) if part)


def cell_text(cell: Cell, column: Column) -> str:
    """`98.7 [97.4, 99.6] (24 of 25)`."""
    text = cell.text.replace("<", "\\<")
    if cell.ends is not None:
        low, high = (number(end, column.digits) for end in cell.ends)
        text += f" [{low}, {high}]"
    return f"{text} ({cell.note})" if cell.note else text


def line_name(line: ReportLine) -> str:
    """A row's name with its labels, and whose figures they are."""
    name = said(line.name, line.labels)
    return f"paper: {name}" if line.published else name


def escape(text: str) -> str:
    """Text that Markdown shows as it is, on one line."""
    flat = " ".join(text.split())
    for sign in "\\`*_[]<>|#":
        flat = flat.replace(sign, f"\\{sign}")
    return flat


def _table(table: ReportTable) -> list[str]:
    lines: list[list[str]] = []
    for group in table.groups:
        if group.heading:
            lines.append([f"**{escape(group.heading)}**", *("" for _ in table.columns)])
        lines.extend(
            [
                escape(line_name(line)),
                *(cell_text(cell, column) for cell, column in zip(line.cells, table.columns, strict=True)),
            ]
            for line in group.lines
        )
    header = [escape(table.first), *(escape(heading(column)) for column in table.columns)]
    parts = [f"## {escape(table.caption)}", escape(table.lead), markdown(header, lines)]
    return [part for part in (*parts, *(escape(note) for note in table.notes)) if part]


def _flips(flips: FlipList) -> list[str]:
    header = ("Scene", "Family", "B gained", "B lost", "One of the commands", "A", "B")
    lines = [[f.sample, f.family, str(f.gained), str(f.lost), f.command, f.first, f.second] for f in flips.flips]
    parts = [
        f"### A: {escape(flips.first)}; B: {escape(flips.second)} ({SIMULATED})",
        markdown(header, [[escape(cell) for cell in line] for line in lines], len(header)),
    ]
    if flips.left_out:
        parts.append(f"{flips.left_out} more scenes are not listed.")
    return parts


def _gallery(gallery: Gallery) -> list[str]:
    parts = [f"### {escape(said(gallery.run, gallery.labels))} ({SIMULATED})"]
    if not gallery.failed:
        return [*parts, f"None of {gallery.items:,} items failed."]
    parts.append(f"{gallery.failed:,} of {gallery.items:,} items failed; {len(gallery.failures)} are shown.")
    header = ("Command", "Item", "What happened", "What was wanted")
    lines = [[f.command, f.item, " ".join(f.happened), f.goal or "n/a"] for f in gallery.failures]
    if lines:
        parts.append(markdown(header, [[escape(cell) for cell in line] for line in lines], len(header)))
    return parts


def _legend(report: BenchReport) -> list[str]:
    columns = {column.title: column for table in report.tables for column in table.columns if column.meaning}
    return [f"- **{escape(heading(column))}**: {escape(column.meaning)}" for column in columns.values()]
