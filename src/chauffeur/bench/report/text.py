"""A report as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

from chauffeur.bench.kernel.metrics import Measure
from chauffeur.bench.kernel.report import ResultTable, count_text, head, markdown, value_text
from chauffeur.bench.report.model import SIMULATED, BenchReport, FlipList, Gallery, said

_ARROWS = {"higher": " ↑", "lower": " ↓", "": ""}


def render_markdown(report: BenchReport) -> str:
    """The report as one Markdown document. What people and models wrote is escaped."""
    told = f"; {SIMULATED}" if report.simulated else ""
    parts = [f"# {escape(report.title)}", f"{escape(report.subtitle)}{told}."]
    if report.judge:
        parts.append(f"Judge: {escape(report.judge)}")
    if report.labels:
        parts.append("Said of these runs: " + "; ".join(escape(label) for label in report.labels) + ".")
    parts.extend(f"> {escape(text)}" for text in report.notices)
    first, *others = [_table(table, table.spec.title, report.simulated) for table in report.tables] or [[]]
    pairs = [_table(table, f"Run against run. {table.spec.title}", report.simulated) for table in report.pairs]
    for table in (first, *pairs, *others):
        parts.extend(table)
    if report.flips:
        parts.append("## Items that went differently")
        parts.extend(part for flips in report.flips for part in _flips(flips))
    if report.galleries:
        parts.append("## Not as it should be")
        parts.extend(part for gallery in report.galleries for part in _gallery(gallery))
    if legend := _legend(report.tables):
        parts += ["## What the columns mean", "\n".join(legend)]
    parts.append("## Where the figures come from")
    for run, facts in report.facts:
        parts.append(f"### {escape(run)}")
        parts.append("\n".join(f"- {escape(name)}: {escape(value)}" for name, value in facts))
    return "\n\n".join(parts) + "\n"


def escape(text: str) -> str:
    """Text that Markdown shows as it is, on one line."""
    flat = " ".join(text.split())
    for sign in "\\`*_[]<>|#":
        flat = flat.replace(sign, f"\\{sign}")
    return flat


def heading(measure: Measure) -> str:
    """A column's head with unit and direction: `Completion % ↑`."""
    return head(measure) + _ARROWS[measure.better]


def _table(table: ResultTable, title: str, simulated: bool) -> list[str]:
    lines: list[list[str]] = []
    group = ""
    for line in table.lines:
        if line.group not in ("", group):
            lines.append([f"**{escape(line.group)}**", *("" for _ in range(1 + len(line.found)))])
        group = line.group
        cells = (" ".join(value_text(line, i, m)).strip() for i, m in enumerate(table.spec.measures))
        lines.append([escape(line.said), count_text(line), *(cell.replace("<", "\\<") for cell in cells)])
    header = [*map(escape, table.spec.heads), *(escape(heading(measure)) for measure in table.spec.measures)]
    caption = f"## {escape(title)} ({SIMULATED})" if simulated else f"## {escape(title)}"
    parts = [caption, escape(table.spec.lead), markdown(header, lines), *map(escape, table.notes)]
    return [part for part in parts if part]


def _flips(flips: FlipList) -> list[str]:
    header = ("Where", "Group", "B gained", "B lost", "What was asked", "A", "B")
    lines = [[f.cluster, f.group, str(f.gained), str(f.lost), f.words, f.first, f.second] for f in flips.flips]
    parts = [
        f"### A: {escape(flips.first)}; B: {escape(flips.second)}",
        markdown(header, [[escape(cell) for cell in line] for line in lines], len(header)),
    ]
    return [*parts, f"{flips.left_out} more are not listed."] if flips.left_out else parts


def _gallery(gallery: Gallery) -> list[str]:
    parts = [f"### {escape(said(gallery.run, gallery.labels))}"]
    if not gallery.missed:
        return [*parts, f"All of {gallery.items:,} rows are as they should be."]
    parts.append(f"{gallery.missed:,} of {gallery.items:,} rows; {len(gallery.cards)} are shown.")
    header = ("What was asked", "Item", "What happened", "What was wanted")
    lines = [[c.words, c.item, " ".join((f"{c.ending}.", *c.why)), c.goal or "n/a"] for c in gallery.cards]
    return [*parts, markdown(header, [[escape(cell) for cell in line] for line in lines], len(header))]


def _legend(tables: Sequence[ResultTable]) -> list[str]:
    found = {measure.title: measure for table in tables for measure in table.spec.measures if measure.meaning}
    return [f"- **{escape(heading(measure))}**: {escape(measure.meaning)}" for measure in found.values()]
