"""What the viewer's page shows, as JSON: reports of runs, their rows, a row with its conversation and its drive.

Text stays text here and is set with `textContent` there, so nothing a person or a model wrote is ever markup.
"""

from __future__ import annotations

import json
import threading
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any, Final, cast

from chauffeur.bench.kernel.metrics import AnyRow, TableSpec, missed
from chauffeur.bench.report.build import Choices, HasRulers, build_report
from chauffeur.bench.report.gallery import MakeCard, ShowsItems, choose, plain_card
from chauffeur.bench.report.model import BenchReport, Card, ShownDrive, asked_words, ending_words
from chauffeur.bench.report.runs import Run, benchmark_kind, keyed, simulated, specs_of
from chauffeur.bench.viewer.shelf import Shelf, judge_of, stamp_of
from chauffeur.bench.viewer.tables import INTERVALS, table_json
from chauffeur.concept import ChauffeurError, DataError
from chauffeur.driving.recording import read_trip
from chauffeur.hmi.page import render_page
from chauffeur.hmi.payload import program_tokens

Json = dict[str, Any]

MOST_CELL_CHARS: Final = 240
"""Of a value in the list of rows; the row itself shows all of it, up to the next."""
MOST_TEXT_CHARS: Final = 200_000
_CAUSES: Final = ("policy_failed", "infra_failed", "refused", "fallback_used")
_CONSTANT: Final = ("schema", "bench", "chauffeur", "labels")
"""Columns that say the same of every row of a run."""


@dataclass(slots=True)
class Content:
    """Answers to what the page asks for; safe to ask from several threads.

    Args:
        shelf: Where runs and trips are.
        data: Folder of the data set, for the scenes of runs that kept none.
        metrics: Name of a ruler, for benchmarks that have several; empty for that of the run.
    """

    shelf: Shelf
    data: Path | None = None
    metrics: str = ""
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _kept: dict[str, tuple[Any, Any]] = field(default_factory=dict[str, tuple[Any, Any]])

    def index(self) -> Json:
        """All runs and trips; see Shelf."""
        with self._lock:
            return self.shelf.index()

    def report(self, runs: str) -> Json:
        """Tables of one run, or of several of one benchmark (ids joined by `+`), on the items that all of them have.

        Raises:
            ConfigError, DataError: See build_report.
        """
        with self._lock:
            folders = [self.shelf.folder(name) for name in runs.split("+")]
        stamps = [stamp_of(folder) for folder in folders]
        return self._once(f"report {runs}", stamps, lambda: self._report(folders))

    def matches(self, runs: str) -> list[list[int]]:
        """Places of the rows that several runs share, in the first run's order. Raises DataError: see load_run."""
        return _matches([self._run(name) for name in runs.split("+")])

    def _report(self, folders: Sequence[Path]) -> Json:
        made = build_report(folders, Choices(self.metrics, self.data, gallery=0))
        return report_json(made)

    def rows(self, name: str) -> Json:
        """The rows of a run, in columns that the page lists, filters and sorts.

        Raises:
            DataError: See load_run.
        """
        run = self._run(name)
        return self._once(f"rows {name}", run, lambda: rows_json(run, self._answers(name, run)))

    def sample(self, name: str, place: int) -> Json:
        """A row with all that its run kept: conversation, reply, verdicts in words; `place` is its number, from 0.

        Raises:
            DataError: There is no such row, or what the run kept cannot be read.
        """
        run = self._run(name)
        if not 0 <= place < len(run.rows):
            raise DataError(f"The run has no row {place}; it has {len(run.rows):,}.", hint="Go back to its rows.")
        row = run.rows[place]
        answers = self._answers(name, run)
        systems = self._once(f"systems {name}", run, lambda: run.stage("systems", "sha256"))
        return sample_json(run, row, self._card(name, run, row), answers.get(str(row["item"]), {}), systems)

    def drive(self, name: str, place: int) -> Json:
        """The page of a row's drive, driven again or read from its recording, and what is to be said of it.

        Raises:
            DataError: See sample.
        """
        run = self._run(name)
        row = run.rows[place]
        return self._once(f"drive {name} {place}", run, lambda: _drive(self._card(name, run, row)))

    def trip(self, name: str) -> Json:
        """The page of a recorded trip. Raises DataError: see read_trip."""
        with self._lock:
            path = self.shelf.folder(name)
        recorded = read_trip(path)
        return {"page": render_page(recorded), "note": recorded.note}

    def chosen(self, name: str, limit: int) -> list[int]:
        """Places of the rows whose drives an exported page takes along: those that a report would choose."""
        run = self._run(name)
        spec, group = _judged(run)
        picked = [] if spec is None else choose(run.rows, spec, group, limit)
        places = {id(row): place for place, row in enumerate(run.rows)}
        return [places[id(row)] for row in picked]

    def _run(self, name: str) -> Run:
        with self._lock:
            run = self.shelf.run(name)
        kind = benchmark_kind(run.bench)
        if not self.metrics or not isinstance(kind, HasRulers):
            return run
        return self._once(f"rescored {name}", run, lambda: kind.rescored(run, self.metrics))

    def _answers(self, name: str, run: Run) -> dict[str, Json]:
        return self._once(f"answers {name}", run, lambda: run.stage("generate", "item"))

    def _card(self, name: str, run: Run, row: AnyRow) -> Card:
        kind = benchmark_kind(run.bench)
        if not isinstance(kind, ShowsItems):
            return _recorded(run, row, plain_card(row))
        make: MakeCard = self._once(f"cards {name}", run, lambda: kind.cards(run, self.data))
        return make(row)

    def _once(self, key: str, stamp: Any, make: Any) -> Any:
        """A value that is made anew only where what it is made of has changed; the last few are kept."""
        with self._lock:
            known = self._kept.pop(key, None)
            if known is not None and (known[0] is stamp or (not isinstance(stamp, Run) and known[0] == stamp)):
                self._kept[key] = known
                return known[1]
        value = make()
        with self._lock:
            self._kept[key] = (stamp, value)
            while len(self._kept) > _KEPT:
                del self._kept[next(iter(self._kept))]
        return value


_KEPT: Final = 48
"""Reports, rows, answers and pages of drives; a page takes some 200 kB."""


def report_json(report: BenchReport) -> Json:
    """A report's words and tables."""
    return {
        "title": report.title,
        "subtitle": report.subtitle,
        "judge": report.judge,
        "notices": list(report.notices),
        "labels": list(report.labels),
        "simulated": report.simulated,
        "tables": [table_json(table, plotted=not place) for place, table in enumerate(report.tables)],
        "pairs": [table_json(table) for table in report.pairs],
        "intervals": INTERVALS,
        "facts": [{"run": run, "facts": [list(fact) for fact in facts]} for run, facts in report.facts],
    }


def _matches(runs: Sequence[Run]) -> list[list[int]]:
    """Places of the rows that all runs have, in the first run's order."""
    same_data = len({run.data for run in runs}) == 1
    places = [{id(row): place for place, row in enumerate(run.rows)} for run in runs]
    found = [keyed(run, same_data=same_data) for run in runs]
    common = (key for key in found[0] if all(key in rows for rows in found))
    return [[at[id(rows[key])] for rows, at in zip(found, places, strict=True)] for key in common]


def _judged(run: Run) -> tuple[TableSpec | None, str]:
    """The table whose rates say which rows are as they should be, and the column that groups rows."""
    specs = specs_of(benchmark_kind(run.bench))
    direct = [spec for spec in specs if spec.over is None]
    judged = next((spec for spec in direct if any(one.better and one.unit == "%" for one in spec.measures)), None)
    return judged, next((spec.group for spec in specs if spec.group), "")


def rows_json(run: Run, answers: Mapping[str, Json]) -> Json:
    """Rows with what every benchmark's have: words, ending, group, causes; and their own columns."""
    kind = benchmark_kind(run.bench)
    spec, group = _judged(run)
    names = list(dict.fromkeys(name for row in run.rows for name in row if name not in _CONSTANT))
    shown: list[Json] = []
    for row in run.rows:
        wrong = None if spec is None else _wrong(spec, row)
        answer = answers.get(str(row["item"]), {})
        reply = _reply(answer, row)
        shown.append(
            {
                "item": str(row["item"]),
                "words": _cut(_asked(row, answer)),
                "ending": ending_words(row, _judged_words(wrong)),
                "wrong": wrong,
                "group": str(row.get(group, "")).replace("_", " "),
                "causes": _causes(row),
                "reply": zlib.crc32(reply.encode("utf-8", "replace")),
                "cells": [_cell(row.get(name)) for name in names],
            }
        )
    return {
        "name": run.name,
        "bench": run.bench,
        "labels": list(run.labels),
        "state": run.state,
        "done": run.done,
        "planned": run.planned,
        "ruler": run.ruler,
        "simulated": simulated(kind),
        "judge": judge_of(run, kind),
        "group": group.replace("_", " "),
        "columns": names,
        "rows": shown,
    }


def _wrong(spec: TableSpec, row: AnyRow) -> bool | None:
    """True if a row is not as it should be; None where that cannot be said, also of rows of an earlier version."""
    try:
        return missed(spec.measures, row) if spec.rows(row) else None
    except (LookupError, TypeError, ValueError):
        return None


def _judged_words(wrong: bool | None) -> str:
    return "" if wrong is None else "not as it should be" if wrong else "as it should be"


def _asked(row: AnyRow, answer: Mapping[str, Any]) -> str:
    """What a row's item asked with; where the row does not tell, what the model was asked first."""
    words = asked_words(row)
    if words != str(row["item"]):
        return words
    return next((str(turn["text"]) for turn in answer.get("turns") or () if turn.get("role") == "user"), words)


def _causes(row: AnyRow) -> list[str]:
    """Causes of an ending, apart from the ending itself."""
    found = [name.replace("_", " ") for name in _CAUSES if row.get(name) is True]
    if row.get("fault"):
        found.append(f"fault: {str(row['fault']).replace('_', ' ')}")
    return found


def _cell(value: Any) -> Any:
    if value is None or isinstance(value, bool | int | float):
        return value
    return _cut(value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str))


def _cut(text: str, most: int = MOST_CELL_CHARS) -> str:
    return text if len(text) <= most else f"{text[: most - 1]}\N{HORIZONTAL ELLIPSIS}"


def _reply(answer: Mapping[str, Any], row: AnyRow) -> str:
    """What an answer says, to tell whether two are the same."""
    plan: Mapping[str, Any] = answer.get("plan") or {}
    if not plan:
        return str(answer.get("error") or row.get("program") or row.get("answer") or "")
    parts = [plan.get("raw"), plan.get("text")]
    said = next((str(part) for part in parts if part), "")
    return said or json.dumps([plan.get("thoughts"), plan.get("policy"), plan.get("refusal")], sort_keys=True)


def sample_json(run: Run, row: AnyRow, card: Card, answer: Mapping[str, Any], systems: Mapping[str, Json]) -> Json:
    """A row as the page shows it whole."""
    plan: Json = answer.get("plan") or {}
    program = card.program.source if card.program is not None else _source(plan) or str(row.get("program") or "")
    library = card.program.library if card.program is not None else ""
    thoughts = card.thoughts or str((plan.get("thoughts") or {}).get("text") or row.get("thoughts") or "")
    listed = {"thoughts", "program", *_CONSTANT}
    return {
        "item": card.item,
        "words": _cut(_asked(row, answer)),
        "ending": card.ending,
        "goal": card.goal,
        "why": list(card.why),
        "facts": [list(fact) for fact in card.facts],
        "context": card.context,
        "turns": [{**turn, "text": _cut(turn["text"], MOST_TEXT_CHARS)} for turn in run.turns(dict(answer), systems)],
        "reply": _cut(str(plan.get("raw") or plan.get("text") or ""), MOST_TEXT_CHARS),
        "error": str(answer.get("error") or ""),
        "thoughts": _cut(thoughts, MOST_TEXT_CHARS),
        "refusal": str(plan.get("refusal") or ""),
        "program": _lines(program),
        "library": _lines(library),
        "verdicts": [
            {"check": v.check, "passed": v.passed, "reason": v.reason, "remedy": v.remedy, "line": v.line}
            for v in card.verdicts
        ],
        "cost": _cost(plan),
        "row": [[name.replace("_", " "), _whole(value)] for name, value in row.items() if name not in listed],
        "drivable": card.drive is not None,
        "note": card.drive_note,
    }


def _source(plan: Json) -> str:
    policy: Any = plan.get("policy")
    return str(cast("Json", policy).get("source") or "") if isinstance(policy, dict) else ""


def _lines(source: str) -> list[list[tuple[str, str]]]:
    return program_tokens(_cut(source, MOST_TEXT_CHARS).rstrip("\n")) if source.strip() else []


def _cost(plan: Json) -> list[list[str]]:
    """Model, time and tokens of an answer, as (name, value)."""
    usage: Json = plan.get("usage") or {}
    tokens = [int(usage.get(name) or 0) for name in ("prompt_tokens", "completion_tokens")]
    found = [
        ("model", str(plan.get("model") or "")),
        ("planning time", f"{float(plan['latency_s']):.2f} s" if plan.get("latency_s") else ""),
        ("tokens", f"{tokens[0]:,} in, {tokens[1]:,} out" if any(tokens) else ""),
        ("requests", str(usage.get("requests") or "")),
        ("cost", "" if usage.get("cost_usd") is None else f"{float(usage['cost_usd']):.4f} USD"),
    ]
    return [[name, value] for name, value in found if value]


def _whole(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    return _cut(value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, default=str), 20_000)


def _recorded(run: Run, row: AnyRow, card: Card) -> Card:
    """A card with the drive that a column of its row names: an `.mcap` file in the run's folder."""
    home = run.folder.resolve()
    for value in row.values():
        if isinstance(value, str) and value.endswith(".mcap"):
            path = (home / value).resolve()
            if path.is_relative_to(home) and path.is_file():
                return replace(card, drive=partial(_read, path))
    return card


def _read(path: Path) -> ShownDrive:
    try:
        trip = read_trip(path)
    except ChauffeurError as error:
        return None, error.message
    return trip, trip.note


def _drive(card: Card) -> Json:
    if card.drive is None:
        return {"page": "", "note": card.drive_note}
    recorded, note = card.drive()
    return {"page": "" if recorded is None else render_page(recorded, embedded=True), "note": note}
