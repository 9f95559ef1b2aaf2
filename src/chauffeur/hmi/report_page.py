"""A benchmark's report as one self-contained HTML page: no script, no server, no request to anywhere.

Everything that people and models wrote is escaped, and the content security policy admits nothing but the page's own
style, by hash.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

from chauffeur.bench.report.model import (
    SIMULATED,
    BenchReport,
    Cell,
    Column,
    Failure,
    FlipList,
    Gallery,
    Group,
    ReportLine,
    ReportTable,
)
from chauffeur.bench.report.tables import number
from chauffeur.drive.files import publish
from chauffeur.hmi import words
from chauffeur.hmi.document import asset, content_hash, fill, printable
from chauffeur.hmi.drive_svg import SYMBOLS, draw_strip
from chauffeur.hmi.payload import program_tokens

_STYLES = ("trip.css", "panels.css", "report.css")
_DIRECTIONS = {
    "higher": '<span class="better" title="higher is better">↑<span class="hidden"> higher is better</span></span>',
    "lower": '<span class="better" title="lower is better">↓<span class="hidden"> lower is better</span></span>',
    "": "",
}
_DIRECTION_WORDS = {"higher": "Higher is better.", "lower": "Lower is better.", "": ""}
_KEY = (
    "The amber car is the one that was driven; the line behind it is its way so far. Pictures go from left to right, "
    "and the marks on the curves are their moments."
)
_FIRST = ("scores", "pairs")
"""Tables that the page opens with; words and the rest come after them."""
_BAD = ("collision", "off_road", "failure", "timeout")


def write_report_page(path: Path, report: BenchReport) -> Path:
    """Write the page of a report; the file appears whole or not at all.

    Args:
        path: The `.html` file; its folder is made if need be.
        report: The report.

    Raises:
        DataError: The file cannot be written.
    """
    return publish(path, render_report(report).encode(), "report")


def render_report(report: BenchReport) -> str:
    """The page of a report as text."""
    style = "\n".join(asset(name) for name in _STYLES)
    first = [table for table in report.tables if table.id in _FIRST]
    sections = [
        *((table.id, table.title, _section(table)) for table in first),
        ("words", "In words", _in_words(report)),
        *((table.id, table.title, _section(table)) for table in report.tables if table not in first),
        *([("flips", "Items that went differently", _flips(report.flips))] if report.flips else []),
        ("failures", "Failures", _galleries(report.galleries)),
        ("method", "How the figures were made", _method(report)),
    ]
    return fill(
        asset("report.html"),
        {
            "policy": html.escape(f"default-src 'none'; style-src {content_hash(style)}"),
            "style": style,
            "title": _text(report.title),
            "heading": _text(report.title),
            "subtitle": _text(report.subtitle) + _labels(report.labels),
            "simulated": _text(words.SIMULATED.replace("drive", "drives")),
            "ruler": _text(f"Ruler {report.ruler}"),
            "warnings": "".join(f'<p class="notice">{_text(warning)}</p>' for warning in report.warnings),
            "nav": "".join(f'<a href="#{name}">{_text(title)}</a>' for name, title, _ in sections),
            "symbols": SYMBOLS,
            "sections": "\n".join(content for _, _, content in sections),
        },
    )


def _text(text: str) -> str:
    return html.escape(printable(text))


def _in_words(report: BenchReport) -> str:
    items = "".join(f"<li><b>{_text(line.subject)}:</b> {_text(line.text)}</li>" for line in report.headlines)
    return (
        f'<section id="words" class="card">{_heading("In words")}'
        f'<p class="first">{_text(report.summary)}</p><ul class="headlines">{items}</ul></section>'
    )


def _section(table: ReportTable) -> str:
    lead = f"<p>{_text(table.lead)}</p>" if table.lead else ""
    # What the paper printed is for looking up: unfolded, its rows would bury those that the report is about.
    own = tuple(group for group in table.groups if not _published(group))
    printed = tuple(group for group in table.groups if _published(group))
    shown = _table(replace(table, groups=own or printed))
    if own and printed:
        shown += _plot(table) + "".join(
            f"<details><summary>{_text(group.heading)}</summary>"
            f"{_table(replace(table, groups=(replace(group, heading=''),), title=group.heading))}</details>"
            for group in printed
        )
    elif table.id == "scores":
        shown += _plot(table)
    return (
        f'<section id="{table.id}" class="card">{_heading(table.title, simulated=table.simulated)}{lead}'
        f"{shown}{_notes(table.notes)}{_legend(table.columns)}</section>"
    )


def _published(group: Group) -> bool:
    return any(line.published for line in group.lines)


def _plot(table: ReportTable) -> str:
    """The last column with an axis, which is the score: a line a run, and of the paper's the best and the human's."""
    place = max((place for place, column in enumerate(table.columns) if column.span is not None), default=None)
    if place is None:
        return ""
    column = table.columns[place]
    assert column.span is not None
    own = [line for group in table.groups for line in group.lines if not line.published]
    printed = [line for group in table.groups for line in group.lines if line.published]
    models = [line for line in printed if "," in line.name]  # a language model and its setting
    shown = [
        *own,
        *sorted(models, key=lambda line: _value(line.cells[place]))[-1:],
        *(line for line in printed if line.name == "Human driver"),
    ]
    low, high = column.span

    def at(value: float) -> str:
        return f"{100.0 * (min(max(value, low), high) - low) / (high - low):.2f}%"

    marks = _axis_marks(low, high)
    grid = "".join(f'<line class="grid" x1="{at(mark)}" x2="{at(mark)}" y1="0" y2="100%"/>' for mark in marks)
    rows: list[str] = []
    for line in shown:
        cell = line.cells[place]
        if cell.interval is None or cell.interval.value is None:
            continue
        ends = tuple(at(end) for end in cell.ends) if cell.ends is not None else ()
        whisker = f'<line class="range" x1="{ends[0]}" x2="{ends[1]}" y1="50%" y2="50%"/>' if ends else ""
        value = at(cell.interval.value)
        kind, name = ("printed", f"paper: {line.name}") if line.published else ("own", line.name)
        rows.append(
            f'<li class="{kind}"><span class="who">{_name(name, line.labels)}</span>'
            f'<svg aria-hidden="true">{grid}{whisker}<circle class="value" cx="{value}" cy="50%" r="5"/></svg>'
            f"<b>{_text(cell.text)}</b></li>"
        )
    numbers = "".join(f'<text x="{at(mark)}" y="1em" text-anchor="middle">{number(mark, 0)}</text>' for mark in marks)
    caption = f"{column.title}, {column.unit}; bars are 95 % intervals." if column.unit else column.title
    if any(line.published for line in shown):
        caption += (
            " Of the paper's rows, measured by its authors on other items, its best language model and its human."
        )
    return (
        f'<figure class="plot"><figcaption>{_text(caption)}</figcaption><ol>{"".join(rows)}'
        f'<li class="axis" aria-hidden="true"><svg>{numbers}</svg></li></ol></figure>'
    )


def _value(cell: Cell) -> float:
    return -math.inf if cell.interval is None or cell.interval.value is None else cell.interval.value


def _axis_marks(low: float, high: float) -> list[float]:
    """Round numbers on an axis, some five of them."""
    step = next((step for step in (5.0, 10.0, 20.0, 25.0, 50.0, 100.0) if (high - low) / step <= 6.0), 200.0)
    first = math.ceil(low / step)
    return [step * place for place in range(first, math.floor(high / step) + 1)]


def _heading(title: str, *, simulated: bool = True) -> str:
    pill = f' <span class="pill">{SIMULATED}</span>' if simulated else ""
    return f"<h2>{_text(title)}{pill}</h2>"


def _notes(notes: Iterable[str]) -> str:
    return "".join(f'<p class="note">{_text(note)}</p>' for note in notes)


def _table(table: ReportTable) -> str:
    heads = "".join(f'<th scope="col">{_head(column)}</th>' for column in table.columns)
    bodies: list[str] = []
    for group in table.groups:
        rows = "".join(_row(line, table.columns) for line in group.lines)
        published = ' class="published"' if any(line.published for line in group.lines) else ""
        heading = ""
        if group.heading:
            across = f'colspan="{len(table.columns) + 1}" scope="rowgroup"'
            heading = f'<tr class="group"><th {across}>{_text(group.heading)}</th></tr>'
        bodies.append(f"<tbody{published}>{heading}{rows}</tbody>")
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{_text(table.caption)}"><table>'
        f'<caption class="hidden">{_text(table.caption)}</caption>'
        f'<thead><tr><th scope="col">{_text(table.first)}</th>{heads}</tr></thead>{"".join(bodies)}</table></div>'
    )


def _head(column: Column) -> str:
    unit = f" <small>{_text(column.unit)}</small>" if column.unit else ""
    return f"{_text(column.title)}{unit}{_DIRECTIONS[column.better]}"


def _row(line: ReportLine, columns: Sequence[Column]) -> str:
    cells = "".join(
        f"<td {_column_head(column)}>{_cell(cell, column)}</td>"
        for cell, column in zip(line.cells, columns, strict=True)
    )
    return f'<tr><th scope="row">{_name(line.name, line.labels)}</th>{cells}</tr>'


def _column_head(column: Column) -> str:
    """What a cell is, said in it where the screen is too narrow for columns."""
    return f'data-head="{_text(f"{column.title} {column.unit}".strip())}"'


def _name(name: str, labels: Sequence[str]) -> str:
    return _text(name) + _labels(labels)


def _labels(labels: Sequence[str]) -> str:
    return "".join(f' <span class="label">{_text(label)}</span>' for label in labels)


def _cell(cell: Cell, column: Column) -> str:
    parts = [f"<b>{_text(cell.text)}</b>" if cell.text != "n/a" else '<span class="na">n/a</span>']
    if cell.ends is not None:
        low, high = (number(end, column.digits) for end in cell.ends)
        parts.append(f"<small>[{low}, {high}]</small>")
    if cell.note:
        parts.append(f'<small class="brief">{_text(cell.note)}</small>')
    return "".join(parts) + _bar(cell, column)


def _bar(cell: Cell, column: Column) -> str:
    """The interval on the column's axis, the value as a mark on it."""
    if column.span is None or cell.interval is None or cell.interval.value is None:
        return ""
    low, high = column.span

    def at(value: float) -> float:
        return 100.0 * (min(max(value, low), high) - low) / (high - low)

    parts = ['<path class="axis" d="M0 4H100"/>']
    if low < 0.0 < high:
        parts.append(f'<path class="zero" d="M{at(0.0):.1f} 0V8"/>')
    if cell.ends is not None:
        start, end = (at(value) for value in cell.ends)
        parts.append(f'<path class="range" d="M{start:.1f} 4H{max(end, start + 0.5):.1f}"/>')
    parts.append(f'<path class="value" d="M{min(max(at(cell.interval.value), 1.0), 99.0):.1f} 0V8"/>')
    return f'<svg class="bar" viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true">{"".join(parts)}</svg>'


def _legend(columns: Sequence[Column]) -> str:
    rows = "".join(
        f"<dt>{_text(column.title)}{f' <small>{_text(column.unit)}</small>' if column.unit else ''}</dt>"
        f"<dd>{_text(column.meaning)} {_DIRECTION_WORDS[column.better]}</dd>"
        for column in columns
        if column.meaning
    )
    return f'<details class="legend"><summary>What the columns mean</summary><dl>{rows}</dl></details>'


def _flips(flips: Sequence[FlipList]) -> str:
    parts = "".join(_flip_list(pair) for pair in flips)
    return (
        f'<section id="flips" class="card">{_heading("Items that went differently")}'
        "<p>Scenes whose commands one run completed and the other did not; those with the most first.</p>"
        f"{parts}</section>"
    )


def _flip_list(pair: FlipList) -> str:
    rows = "".join(
        f'<tr><th scope="row">{_text(flip.sample)}<small>{_text(flip.family)}</small></th>'
        f'<td data-head="Only A"><b>{flip.lost}</b></td><td data-head="Only B"><b>{flip.gained}</b></td>'
        f'<td class="words" data-head="One of the commands">“{_text(flip.command)}”</td>'
        f'<td class="words" data-head="A">{_text(flip.first)}</td>'
        f'<td class="words" data-head="B">{_text(flip.second)}</td></tr>'
        for flip in pair.flips
    )
    lost, gained = (sum(getattr(flip, name) for flip in pair.flips) for name in ("lost", "gained"))
    summary = f"A: {pair.first}; B: {pair.second}"
    more = f'<p class="note">{pair.left_out:,} more scenes are not listed.</p>' if pair.left_out else ""
    return (
        f"<details><summary>{_text(summary)} "
        f"<small>listed here: {lost:,} commands for A, {gained:,} for B</small></summary>"
        f'<div class="scroll" tabindex="0" role="region" aria-label="{_text(summary)}"><table>'
        '<thead><tr><th scope="col">Scene</th><th scope="col">Only A</th><th scope="col">Only B</th>'
        '<th scope="col" class="words">One of the commands</th><th scope="col" class="words">A</th>'
        f'<th scope="col" class="words">B</th></tr></thead><tbody>{rows}</tbody></table></div>{more}</details>'
    )


def _galleries(galleries: Sequence[Gallery]) -> str:
    parts = "".join(_gallery(place, gallery) for place, gallery in enumerate(galleries))
    drives = any(failure.drive is not None for gallery in galleries for failure in gallery.failures)
    key = f"<p>{_KEY}</p>" if drives else ""
    return f'<section id="failures">{_heading("Failures")}{key}{parts}</section>'


def _gallery(place: int, gallery: Gallery) -> str:
    heading = f"<h3>{_name(gallery.run, gallery.labels)}</h3>"
    if not gallery.failed:
        return f"{heading}<p>None of {gallery.items:,} items failed.</p>"
    shown = len(gallery.failures)
    told = f"{gallery.failed:,} of {gallery.items:,} items failed."
    if shown < gallery.failed:
        told += f" {shown} are shown, spread over families and kinds of failure." if shown else " None is shown."
    cards = "".join(_failure(f"d{place}n{i}", failure) for i, failure in enumerate(gallery.failures))
    return f"{heading}<p>{told}</p>{cards}"


def _failure(name: str, failure: Failure) -> str:
    tone = "bad" if failure.outcome in _BAD else ""
    goal = f'<p class="goal"><span>Wanted</span> {_text(failure.goal)}</p>' if failure.goal else ""
    why = " ".join(failure.happened[1:])
    happened = f'<p class="goal"><span>Why</span> {_text(why)}</p>' if why else ""
    others = "; ".join(f"{run}: {how}" for run, how in failure.elsewhere)
    others = f'<p class="goal"><span>Other runs</span> {_text(others)}</p>' if others else ""
    facts = " · ".join(f"{_text(label)} {_text(value)}" for label, value in failure.facts)
    label = _labels(failure.labels)
    return (
        f'<article class="card failure" aria-labelledby="{name}t">'
        f'<header><h4 id="{name}t">{_text(failure.command)}</h4>'
        f'<p class="outcome {tone}">{_text(failure.happened[0].rstrip("."))}</p></header>'
        f'<p class="where">{_text(failure.run)}{label} · {SIMULATED} · {facts}</p>'
        f"{goal}{happened}{others}{_paragraph(failure.siblings)}{_drive(name, failure)}"
        f'<div class="said">{_words(failure)}{_verdicts(failure)}</div>{_program(failure)}</article>'
    )


def _paragraph(text: str) -> str:
    return f'<p class="note">{_text(text)}</p>' if text else ""


def _drive(name: str, failure: Failure) -> str:
    note = _paragraph(failure.drive_note)
    strip = None if failure.drive is None else draw_strip(failure.drive, name)
    if strip is None:
        return note
    pictures = "".join(
        f"<figure>{picture.svg}<figcaption>{_text(picture.caption)}</figcaption></figure>" for picture in strip.pictures
    )
    shape = "long" if strip.lengthwise else "wide"
    charts = "".join(
        f"<figure>{chart.svg}<figcaption>{_text(chart.caption)}</figcaption></figure>" for chart in strip.charts
    )
    return f'{note}<div class="strip {shape}">{pictures}</div><div class="charts">{charts}</div>'


def _words(failure: Failure) -> str:
    parts: list[str] = []
    if failure.context is not None:
        parts.append(f"<div><h5>What it was told of the scene</h5><p>{_text(failure.context.text)}</p></div>")
    if failure.thoughts:
        parts.append(f'<div><h5>Its reasoning</h5><p class="reasoning">{_text(failure.thoughts)}</p></div>')
    return "".join(parts)


def _verdicts(failure: Failure) -> str:
    refused = [verdict for verdict in failure.verdicts if not verdict.passed]
    if not refused:
        return ""
    rows = "".join(f"<li>{_text(verdict.reason)} {_text(verdict.remedy)}</li>" for verdict in refused)
    return f"<div><h5>What the checks said</h5><ul>{rows}</ul></div>"


def _program(failure: Failure) -> str:
    if failure.program is None:
        return ""
    source = failure.program.source.rstrip("\n")
    parts = _listing("Its program", source)
    if failure.program.library.strip():
        parts += _listing("Functions of its policy repository", failure.program.library.rstrip("\n"))
    return parts


def _listing(title: str, source: str) -> str:
    lines = program_tokens(source)
    rows = "".join(
        f'<li data-n="{n}"><code>{"".join(_token(kind, text) for kind, text in line)}</code></li>'
        for n, line in enumerate(lines, start=1)
    )
    return (
        f"<details><summary>{title} <small>{len(lines)} lines</small></summary>"
        f'<div class="code" tabindex="0" role="region" aria-label="{title}"><ol>{rows}</ol></div></details>'
    )


def _token(kind: str, text: str) -> str:
    return f'<span class="{kind}">{_text(text)}</span>' if kind else _text(text)


def _method(report: BenchReport) -> str:
    terms = "".join(f"<dt>{_text(term)}</dt><dd>{_text(text)}</dd>" for term, text in report.terms)
    runs = "".join(
        f'<h4>{_text(run)}</h4><dl class="pairs mono">'
        + "".join(f"<dt>{_text(name)}</dt><dd>{_text(value)}</dd>" for name, value in facts)
        + "</dl>"
        for run, facts in report.facts
    )
    return (
        '<section id="method" class="card"><h2>How the figures were made</h2>'
        f'<details class="legend"><summary>What each measure is, exactly</summary><dl>{terms}</dl></details>'
        f"<details><summary>Where every run comes from: versions, seeds, hashes, machine</summary>{runs}</details>"
        "</section>"
    )
