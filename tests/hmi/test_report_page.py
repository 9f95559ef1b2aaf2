"""The report's page: complete in itself, inert whatever was written, and every label where its figures stand."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from sample_trips import HOSTILE, highway_trip, intersection_trip, refused_trip

from chauffeur.bench.kernel.metrics import Measure, TableSpec
from chauffeur.bench.kernel.report import Line, ResultTable
from chauffeur.bench.kernel.stats import Interval
from chauffeur.bench.report.model import SIMULATED, BenchReport, Card, Flip, FlipList, Gallery
from chauffeur.bench.report.page import render_report, write_report_page
from chauffeur.concept import DataError, Program, Verdict
from chauffeur.driving.recording import RecordedTrip
from chauffeur.hmi.drive_svg import draw_strip

LABEL = "critic: evaluator"


class Page(HTMLParser):
    """What a browser would make of it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str, str]] = []
        self.text = ""
        self.open: list[str] = []
        self.unbalanced: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes.extend((tag, name, value or "") for name, value in attrs)
        if tag not in ("meta", "br", "img", "link", "input"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes.extend((tag, name, value or "") for name, value in attrs)

    def handle_endtag(self, tag: str) -> None:
        if not self.open or self.open.pop() != tag:
            self.unbalanced.append(tag)

    def handle_data(self, data: str) -> None:
        self.text += data


def _card(drive: RecordedTrip | None, words: str = "Go on.", note: str = "") -> Card:
    return Card(
        item=f"item {words}",
        words=words,
        ending="Ran out of time",
        bad=True,
        goal=words,
        why=(words,),
        facts=(("family", words),),
        context=words,
        thoughts=words,
        program=Program(f"def go():\n    # {words}\n    yield autopilot()\n", library=f"def help():\n    '{words}'\n"),
        verdicts=(Verdict("format-v1", False, words, 1, words),),
        drive=drive,
        drive_note=note,
        elsewhere=((words, words),),
    )


def _table(words: str, group: str = "") -> ResultTable:
    measures = (
        Measure("a", words, lambda _: None, "%", better="lower", meaning=words),
        Measure("b", words, lambda _: None, "%", meaning=words),
    )
    spec = TableSpec(words, measures, heads=(words, "items"), lead=words)
    lines = (
        Line(words, 12, (Interval(0.05, -0.02, 0.09, "bootstrap"), Interval(None)), group, (LABEL,)),
        Line("p", None, (Interval(0.0001), Interval(None)), group, (LABEL,), form="p"),
        Line(words, 98, (Interval(5.0), Interval(0.5)), f"Printed {words}", published=True),
    )
    return ResultTable(spec, lines, (words,))


def _report(words: str = "onboard", drives: tuple[RecordedTrip | None, ...] = (None,)) -> BenchReport:
    cards = tuple(_card(drive, words, note=words) for drive in drives)
    return BenchReport(
        title=words,
        subtitle=words,
        judge=words,
        notices=(words,),
        tables=(_table(words), _table(words, words)),
        pairs=(_table(words),),
        flips=(FlipList(f"{words} [{LABEL}]", words, (Flip("s", words, 1, 0, words, words, words),), 3),),
        galleries=(Gallery(words, (LABEL,), 9, 10, cards), Gallery("none", (LABEL,), 0, 10, ())),
        facts=((words, ((words, words),)),),
        labels=(LABEL,),
    )


def test_what_was_written_stays_text() -> None:
    text = render_report(_report(HOSTILE, (highway_trip(wish=HOSTILE, seconds=4.0, crash=True), None)))
    page = Page(text)
    assert page.unbalanced == [] and page.open == []
    assert not {"script", "img", "iframe", "object", "link", "form"} & set(page.tags)
    assert not [name for _, name, _ in page.attributes if name.startswith("on") or name in ("style", "src")]
    assert page.text.count("onerror=alert(1)") > 20
    text.encode("utf-8")


def test_the_page_asks_nobody_for_anything() -> None:
    text = render_report(_report(drives=(highway_trip(seconds=4.0),)))
    assert not re.search(r"https?:|//[a-z]|@import|url\(", text)
    page = Page(text)
    policy = next(value for tag, name, value in page.attributes if tag == "meta" and "default-src" in value)
    style = re.search(r"<style>(.*?)</style>", text, re.DOTALL)
    assert style is not None
    digest = base64.b64encode(hashlib.sha256(style.group(1).encode()).digest()).decode()
    assert policy == f"default-src 'none'; style-src 'sha256-{digest}'"
    assert all(value.startswith("#") for _, name, value in page.attributes if name == "href")


def test_every_link_has_its_target_once() -> None:
    drives = (highway_trip(seconds=4.0), intersection_trip(seconds=4.0), highway_trip(seconds=3.0, crash=True))
    page = Page(render_report(_report(drives=drives)))
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    wanted = {value[1:] for _, name, value in page.attributes if name == "href"}
    wanted |= {value for _, name, value in page.attributes if name == "aria-labelledby"}
    assert wanted <= set(ids)
    assert {"t0", "t1", "pairs", "flips", "gallery", "method"} <= wanted


def test_labels_judge_and_simulated_stand_where_a_result_does() -> None:
    text = render_report(_report(drives=(highway_trip(seconds=3.0),)))
    rows = re.findall(r'<tr><th scope="row">(.*?)</tr>', text)
    assert sum(LABEL in row for row in rows) == 6
    for start in ('<section id="flips"', '<section id="gallery"', '<article class="card'):
        part = text[text.index(start) : text.index(start) + 1500]
        assert LABEL in part, start
    for section in re.findall(r'<section id="(?:t0|pairs)".*?</section>', text, re.DOTALL):
        assert SIMULATED in section
    assert "Simulated drives; no real car moved." in text and "<b>Judge</b> onboard" in text
    answers = render_report(replace(_report(), simulated=False))
    assert SIMULATED not in answers and "nothing drove" in answers


def test_bars_stay_on_their_axis() -> None:
    text = render_report(_report())
    for x in re.findall(r'class="value" d="M([-\d.]+) 0V8"', text):
        assert 0.0 <= float(x) <= 100.0
    assert 'class="zero"' in text


def test_a_reader_by_ear_hears_directions_and_tables() -> None:
    text = render_report(_report())
    assert "lower is better</span>" in text
    assert "Lower is better." in text
    assert text.count("<caption") == 5
    assert re.search(r'role="region" aria-label="onboard"', text)
    assert 'tabindex="0"' in text


@pytest.mark.parametrize(
    ("trip", "lengthwise"), [(highway_trip(seconds=8.0, crash=True), True), (intersection_trip(), False)]
)
def test_a_strip_shows_the_drive(trip: RecordedTrip, lengthwise: bool) -> None:
    strip = draw_strip(trip, "d0n0")
    assert strip is not None
    assert strip.lengthwise is lengthwise
    assert 2 <= len(strip.pictures) <= 6
    times = [picture.time_s for picture in strip.pictures]
    assert times == sorted(times) and times[0] == 0.0
    assert strip.pictures[0].svg.count('<g id="d0n0">') == 1
    for picture in strip.pictures:
        assert picture.svg.count('class="ego') == 1
        assert picture.caption.startswith(f"{picture.time_s:.1f} s, ")
    assert all('<use href="#d0n0"/>' in picture.svg for picture in strip.pictures[1:])
    assert ('class="ego crashed"' in strip.pictures[-1].svg) is lengthwise
    assert strip.charts[0].caption.startswith("Speed: ")
    assert sum(len(p.svg) for p in strip.pictures) < 40_000


def test_nothing_driven_has_no_strip() -> None:
    assert draw_strip(refused_trip(), "d") is None


def test_a_folder_that_cannot_be_written_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(DataError, match="report cannot be written"):
        write_report_page(tmp_path / "file" / "report.html", _report())
    assert write_report_page(tmp_path / "deep" / "report.html", _report()).read_text().startswith("<!doctype html>")


def test_the_page_opens_with_its_table_and_one_plot() -> None:
    text = render_report(_report())
    table, plot, pairs = (text.index(part) for part in ("<table>", '<figure class="plot">', '<section id="pairs"'))
    assert table < plot < pairs
    assert text.count('<figure class="plot">') == 1
    assert "&lt; 0.001" in text


def test_every_figure_carries_the_name_of_its_column_for_narrow_screens() -> None:
    text = render_report(_report())
    cells = re.findall(r"<td[^>]*>", text)
    assert cells and all("data-head=" in cell for cell in cells)
