"""A benchmark's report as one self-contained HTML page: no script, no server, no request to anywhere.

Everything that people and models wrote is escaped, and the content security policy admits nothing but the page's own
style, by hash.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import groupby
from pathlib import Path

from chauffeur.bench.kernel.metrics import Measure
from chauffeur.bench.kernel.report import Line, ResultTable, count_text, head, value_text
from chauffeur.bench.kernel.stats import DRAWS, LEAST_CLUSTERS, Interval
from chauffeur.bench.report.model import SIMULATED, BenchReport, Card, FlipList, Gallery
from chauffeur.driving.files import publish
from chauffeur.hmi.document import asset, content_hash, fill, printable
from chauffeur.hmi.drive_svg import draw_strip
from chauffeur.hmi.payload import program_tokens
from chauffeur.hmi.stills import SYMBOLS

_STYLES = ("scene.css", "trip.css", "panels.css")
"""Of the trip page, whose look the report shares."""
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
_INTERVALS = (
    f"Brackets hold 95 % intervals: percentile bootstrap, {DRAWS:,} resamples of whole clusters (e.g. scenes, with all "
    "their commands), because items of one cluster are no independent observations. They speak of other items like "
    "these, not of other traffic models or real roads. A rate of exactly 0 or 100 % never changes under resampling; "
    "its bracket is the exact binomial interval with each cluster as one trial. No bracket stands where fewer than "
    f"{LEAST_CLUSTERS} clusters have a value, or where no resample differs. Every rate is over all items to which it "
    "applies; refusals, failed programs and failures of the machine stay in it."
)
_LOWEST_POINTS = -100.0
"""Bars end here: a few collisions in a small family bring a driving score to -500."""
_PLOTTED = 24
"""Lines of a plot; more are no picture any more."""


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
    style = "\n".join((*map(asset, _STYLES), asset("report.css", "chauffeur.bench.report")))
    real = report.simulated
    tables = [(f"t{n}", table.spec.title, _section(f"t{n}", table, real)) for n, table in enumerate(report.tables)]
    sections = [
        *tables[:1],
        *([("pairs", "Run against run", _pairs(report))] if report.pairs else []),
        *([("flips", "Items that went differently", _flips(report.flips))] if report.flips else []),
        *tables[1:],
        *([("gallery", "Not as it should be", _galleries(report.galleries))] if report.galleries else []),
        ("method", "How the figures were made", _method(report)),
    ]
    judge = f'<p class="judge"><b>Judge</b> {_text(report.judge)}</p>' if report.judge else ""
    return fill(
        asset("report.html", "chauffeur.bench.report"),
        {
            "policy": html.escape(f"default-src 'none'; style-src {content_hash(style)}"),
            "style": style,
            "title": _text(report.title),
            "heading": _text(report.title),
            "subtitle": _text(report.subtitle) + _labels(report.labels),
            "simulated": "Simulated drives; no real car moved." if real else "Answers about pictures; nothing drove.",
            "notices": judge + "".join(f'<p class="notice">{_text(text)}</p>' for text in report.notices),
            "first": sections[0][0],
            "nav": "".join(f'<a href="#{name}">{_text(title)}</a>' for name, title, _ in sections),
            "symbols": SYMBOLS,
            "sections": "\n".join(content for _, _, content in sections),
        },
    )


def _text(text: str) -> str:
    return html.escape(printable(text))


def _section(name: str, table: ResultTable, simulated: bool) -> str:
    lead = f"<p>{_text(table.spec.lead)}</p>" if table.spec.lead else ""
    return (
        f'<section id="{name}" class="card">{_heading(table.spec.title, simulated=simulated)}{lead}'
        f"{_body(table, plotted=name == 't0')}{_notes(table.notes)}{_legend(table.spec.measures)}</section>"
    )


def _body(table: ResultTable, *, plotted: bool) -> str:
    """The rows; what is printed elsewhere is for looking up: unfolded, it would bury those that the report is about."""
    own = tuple(line for line in table.lines if not line.published)
    printed = tuple(line for line in table.lines if line.published)
    shown = _table(replace(table, lines=own)) + (_plot(table) if plotted else "")
    if printed:
        bare = replace(table, lines=tuple(replace(line, group="") for line in printed))
        shown += f"<details><summary>{_text(printed[0].group)}</summary>{_table(bare)}</details>"
    return shown


def _pairs(report: BenchReport) -> str:
    parts = "".join(f"<h3>{_text(table.spec.title)}</h3>{_table(table)}" for table in report.pairs)
    heading = _heading("Run against run", simulated=report.simulated)
    return f'<section id="pairs" class="card">{heading}{parts}{_notes(report.pairs[0].notes)}</section>'


def _plot(table: ResultTable) -> str:
    """The last rate or score with a better direction: a line a run, and of what is printed the best three."""
    columns = [place for place, measure in enumerate(table.spec.measures) if measure.better and not measure.whole]
    if not columns:
        return ""
    place = columns[-1]
    measure = table.spec.measures[place]
    own = [line for line in table.lines if not line.published]
    printed = sorted(
        (line for line in table.lines if line.published),
        key=lambda line: _scaled(line.found[place], measure).value or -math.inf,
        reverse=measure.better == "higher",
    )
    shown = [line for line in (*own, *printed[:3]) if line.found[place].value is not None]
    span = _span([line.found[place] for line in shown], measure)
    if span is None or len(shown) > _PLOTTED:
        return ""
    low, high = span

    def at(value: float) -> str:
        return f"{100.0 * (min(max(value, low), high) - low) / (high - low):.2f}%"

    marks = _axis_marks(low, high)
    grid = "".join(f'<line class="grid" x1="{at(mark)}" x2="{at(mark)}" y1="0" y2="100%"/>' for mark in marks)
    rows: list[str] = []
    for line in shown:
        interval = _scaled(line.found[place], measure)
        whisker = ""
        if interval.low is not None and interval.high is not None:
            whisker = f'<line class="range" x1="{at(interval.low)}" x2="{at(interval.high)}" y1="50%" y2="50%"/>'
        name = f"{line.group}: {line.said}" if line.group and not line.published else line.said
        rows.append(
            f'<li class="{"printed" if line.published else "own"}"><span class="who">{_text(name)}</span>'
            f'<svg aria-hidden="true">{grid}{whisker}'
            f'<circle class="value" cx="{at(interval.value or 0.0)}" cy="50%" r="5"/></svg>'
            f"<b>{value_text(line, place, measure)[0]}</b></li>"
        )
    numbers = "".join(f'<text x="{at(mark)}" y="1em" text-anchor="middle">{mark:g}</text>' for mark in marks)
    caption = f"{head(measure)}; bars are 95 % intervals."
    if printed:
        caption += " Of the printed rows, measured by others on other items, the best three."
    return (
        f'<figure class="plot"><figcaption>{_text(caption)}</figcaption><ol>{"".join(rows)}'
        f'<li class="axis" aria-hidden="true"><svg>{numbers}</svg></li></ol></figure>'
    )


def _scaled(interval: Interval, measure: Measure) -> Interval:
    """An interval in the unit that is shown."""
    if measure.unit != "%" or interval.value is None:
        return interval
    low, high = (None if end is None else 100.0 * end for end in (interval.low, interval.high))
    return replace(interval, value=100.0 * interval.value, low=low, high=high)


def _span(found: Iterable[Interval], measure: Measure) -> tuple[float, float] | None:
    """An axis that holds everything; points far below nothing stand at its end."""
    scaled = [_scaled(interval, measure) for interval in found]
    ends = [end for one in scaled for end in (one.low, one.value, one.high) if end is not None]
    if not ends or all(one.low is None for one in scaled):
        return None
    full = 100.0 if measure.better == "higher" and measure.unit in ("%", "pt", "points") else 0.0
    low, high = max(min(0.0, *ends), _LOWEST_POINTS), max(full, *ends)
    return (low, high) if high > low else None


def _axis_marks(low: float, high: float) -> list[float]:
    """Round numbers on an axis, some five of them."""
    rough = (high - low) / 5.0
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(step * power for step in (1.0, 2.0, 2.5, 5.0, 10.0) if step * power >= rough)
    return [step * place for place in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _heading(title: str, *, simulated: bool = True) -> str:
    pill = f' <span class="pill">{SIMULATED}</span>' if simulated else ""
    return f"<h2>{_text(title)}{pill}</h2>"


def _notes(notes: Iterable[str]) -> str:
    return "".join(f'<p class="note">{_text(note)}</p>' for note in notes)


def _table(table: ResultTable) -> str:
    measures, (first, items) = table.spec.measures, table.spec.heads
    heads = "".join(f'<th scope="col">{_head(measure)}</th>' for measure in measures)
    spans = [_span([line.found[i] for line in table.lines if not line.form], m) for i, m in enumerate(measures)]
    bodies: list[str] = []
    for group, lines in groupby(table.lines, key=lambda line: line.group):
        mine = list(lines)
        rows = "".join(_row(line, measures, spans, items) for line in mine)
        heading = ""
        if group:
            across = f'colspan="{len(measures) + 2}" scope="rowgroup"'
            heading = f'<tr class="group"><th {across}>{_text(group)}</th></tr>'
        bodies.append(f"<tbody{' class=published' if mine[0].published else ''}>{heading}{rows}</tbody>")
    title = _text(table.spec.title)
    return (
        f'<div class="scroll" tabindex="0" role="region" aria-label="{title}"><table>'
        f'<caption class="hidden">{title}</caption>'
        f'<thead><tr><th scope="col">{_text(first)}</th><th scope="col">{_text(items)}</th>{heads}</tr></thead>'
        f"{''.join(bodies)}</table></div>"
    )


def _head(measure: Measure) -> str:
    unit = f" <small>{_text(measure.unit)}</small>" if measure.unit else ""
    return f"{_text(measure.title)}{unit}{_DIRECTIONS[measure.better]}"


def _row(line: Line, measures: Sequence[Measure], spans: Sequence[tuple[float, float] | None], items: str) -> str:
    """A row; what a cell is, is said in it too, for screens too narrow for columns."""
    cells = "".join(
        f"<td{'' if not line.form or line.found[place].value is not None else ' class=none'} "
        f'data-head="{_text(head(measure))}">{_cell(line, place, measure, spans[place])}</td>'
        for place, measure in enumerate(measures)
    )
    none = " class=none" if line.items is None else ""
    count = f'<td{none} data-head="{_text(items)}"><b>{count_text(line)}</b></td>'
    return f'<tr><th scope="row">{_text(line.name)}{_labels(line.labels)}</th>{count}{cells}</tr>'


def _labels(labels: Sequence[str]) -> str:
    return "".join(f' <span class="label">{_text(label)}</span>' for label in labels)


def _cell(line: Line, place: int, measure: Measure, span: tuple[float, float] | None) -> str:
    value, ends = (part.replace("-", "\N{MINUS SIGN}") for part in value_text(line, place, measure))
    text = f"<b>{_text(value)}</b>" if value != "n/a" else '<span class="na">n/a</span>'
    small = f"<small>{_text(ends)}</small>" if ends else ""
    return text + small + ("" if line.form or span is None else _bar(_scaled(line.found[place], measure), span))


def _bar(interval: Interval, span: tuple[float, float]) -> str:
    """The interval on the column's axis, the value as a mark on it."""
    if interval.value is None:
        return ""
    low, high = span

    def at(value: float) -> float:
        return 100.0 * (min(max(value, low), high) - low) / (high - low)

    parts = ['<path class="axis" d="M0 4H100"/>']
    if low < 0.0 < high:
        parts.append(f'<path class="zero" d="M{at(0.0):.1f} 0V8"/>')
    if interval.low is not None and interval.high is not None:
        start, end = at(interval.low), at(interval.high)
        parts.append(f'<path class="range" d="M{start:.1f} 4H{max(end, start + 0.5):.1f}"/>')
    parts.append(f'<path class="value" d="M{min(max(at(interval.value), 1.0), 99.0):.1f} 0V8"/>')
    return f'<svg class="bar" viewBox="0 0 100 8" preserveAspectRatio="none" aria-hidden="true">{"".join(parts)}</svg>'


def _legend(measures: Sequence[Measure]) -> str:
    rows = "".join(
        f"<dt>{_text(measure.title)}{f' <small>{_text(measure.unit)}</small>' if measure.unit else ''}</dt>"
        f"<dd>{_text(measure.meaning)} {_DIRECTION_WORDS[measure.better]}</dd>"
        for measure in measures
        if measure.meaning
    )
    return f'<details class="legend"><summary>What the columns mean</summary><dl>{rows}</dl></details>' if rows else ""


def _flips(flips: Sequence[FlipList]) -> str:
    parts = "".join(_flip_list(pair) for pair in flips)
    return (
        f'<section id="flips" class="card">{_heading("Items that went differently", simulated=False)}'
        "<p>As they should be in one run and not in the other; the most first.</p>"
        f"{parts}</section>"
    )


def _flip_list(pair: FlipList) -> str:
    rows = "".join(
        f'<tr><th scope="row">{_text(flip.cluster)}<small>{_text(flip.group)}</small></th>'
        f'<td data-head="Only A"><b>{flip.lost}</b></td><td data-head="Only B"><b>{flip.gained}</b></td>'
        f'<td class="words" data-head="One of them">“{_text(flip.words)}”</td>'
        f'<td class="words" data-head="A">{_text(flip.first)}</td>'
        f'<td class="words" data-head="B">{_text(flip.second)}</td></tr>'
        for flip in pair.flips
    )
    lost, gained = sum(flip.lost for flip in pair.flips), sum(flip.gained for flip in pair.flips)
    summary = f"A: {pair.first}; B: {pair.second}"
    more = f'<p class="note">{pair.left_out:,} more are not listed.</p>' if pair.left_out else ""
    heads = "".join(f'<th scope="col" class="words">{text}</th>' for text in ("One of them", "A", "B"))
    return (
        f"<details><summary>{_text(summary)} <small>listed here: {lost:,} for A, {gained:,} for B</small></summary>"
        f'<div class="scroll" tabindex="0" role="region" aria-label="{_text(summary)}"><table>'
        '<thead><tr><th scope="col">Where</th><th scope="col">Only A</th><th scope="col">Only B</th>'
        f"{heads}</tr></thead><tbody>{rows}</tbody></table></div>{more}</details>"
    )


def _galleries(galleries: Sequence[Gallery]) -> str:
    parts = "".join(_gallery(place, gallery) for place, gallery in enumerate(galleries))
    drives = any(card.drive is not None for gallery in galleries for card in gallery.cards)
    key = f"<p>{_KEY}</p>" if drives else ""
    return f'<section id="gallery">{_heading("Not as it should be", simulated=False)}{key}{parts}</section>'


def _gallery(place: int, gallery: Gallery) -> str:
    heading = f"<h3>{_text(gallery.run)}{_labels(gallery.labels)}</h3>"
    if not gallery.missed:
        return f"{heading}<p>All of {gallery.items:,} rows are as they should be.</p>"
    told = f"{gallery.missed:,} of {gallery.items:,} rows are not as they should be."
    if (shown := len(gallery.cards)) < gallery.missed:
        told += f" {shown} are shown, spread over groups and endings." if shown else " None is shown."
    cards = "".join(_card(f"d{place}n{i}", gallery, card) for i, card in enumerate(gallery.cards))
    return f"{heading}<p>{told}</p>{cards}"


def _card(name: str, gallery: Gallery, card: Card) -> str:
    others = "; ".join(f"{run}: {how}" for run, how in card.elsewhere)
    said = (("Wanted", card.goal), ("Why", " ".join(card.why)), ("Other runs", others))
    goals = "".join(f'<p class="goal"><span>{what}</span> {_text(text)}</p>' for what, text in said if text)
    facts = "".join(f" · {_text(label)} {_text(value)}" for label, value in card.facts)
    return (
        f'<article class="card failure" aria-labelledby="{name}t">'
        f'<header><h4 id="{name}t">{_text(card.words)}</h4>'
        f'<p class="outcome {"bad" if card.bad else ""}">{_text(card.ending)}</p></header>'
        f'<p class="where">{_text(gallery.run)}{_labels(gallery.labels)} · {_text(card.item)}{facts}</p>'
        f"{goals}{_drive(name, card)}"
        f'<div class="said">{_words(card)}{_verdicts(card)}</div>{_program(card)}</article>'
    )


def _drive(name: str, card: Card) -> str:
    note = f'<p class="note">{_text(card.drive_note)}</p>' if card.drive_note else ""
    strip = None if card.drive is None else draw_strip(card.drive, name)
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


def _words(card: Card) -> str:
    parts: list[str] = []
    if card.context:
        parts.append(f"<div><h5>What it was told of the scene</h5><p>{_text(card.context)}</p></div>")
    if card.thoughts:
        parts.append(f'<div><h5>Its reasoning</h5><p class="reasoning">{_text(card.thoughts)}</p></div>')
    return "".join(parts)


def _verdicts(card: Card) -> str:
    refused = [verdict for verdict in card.verdicts if not verdict.passed]
    if not refused:
        return ""
    rows = "".join(f"<li>{_text(verdict.reason)} {_text(verdict.remedy)}</li>" for verdict in refused)
    return f"<div><h5>What the checks said</h5><ul>{rows}</ul></div>"


def _program(card: Card) -> str:
    if card.program is None:
        return ""
    source = card.program.source.rstrip("\n")
    parts = _listing("Its program", source)
    if card.program.library.strip():
        parts += _listing("Functions of its policy repository", card.program.library.rstrip("\n"))
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
    runs = "".join(
        f'<h4>{_text(run)}</h4><dl class="pairs mono">'
        + "".join(f"<dt>{_text(name)}</dt><dd>{_text(value)}</dd>" for name, value in facts)
        + "</dl>"
        for run, facts in report.facts
    )
    return (
        f'<section id="method" class="card"><h2>How the figures were made</h2><p>{_text(_INTERVALS)}</p>'
        f"<details><summary>Where every run comes from: versions, seeds, hashes, machine</summary>{runs}</details>"
        "</section>"
    )
