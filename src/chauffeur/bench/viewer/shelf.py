"""Runs and trips below folders: found, told in a line each, and read again only where something has changed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from chauffeur.bench.kernel.metrics import Measure
from chauffeur.bench.kernel.report import stored_table, value_text
from chauffeur.bench.kernel.stages import LIVE
from chauffeur.bench.kernel.store import is_written
from chauffeur.bench.report.runs import Run, benchmark_kind, load_run, simulated, specs_of
from chauffeur.concept import ChauffeurError, DataError
from chauffeur.driving.recording import read_head
from chauffeur.hmi import words

MOST_FOLDERS: Final = 20_000
"""Folders that are looked into; a home directory given by mistake ends the search there."""
MOST_DEPTH: Final = 8
MOST_RUN_BYTES: Final = 1 << 29
"""A larger file of a run is not opened: conversations of twenty thousand items take less."""

_PLAN: Final = "plan.json"
_FILES: Final = (_PLAN, LIVE, "results.jsonl", "report.json", "provenance.json", "generate.jsonl", "rollout.jsonl")
Kind = Literal["run", "trip"]
Json = dict[str, Any]
Stamp = tuple[tuple[int, int], ...]


@dataclass(slots=True)
class Shelf:
    """Everything below some folders.

    Attributes:
        folders: Where to look; one may be a run folder or a recording itself.
        partial: Whether there were more folders than are looked into.
    """

    folders: Sequence[Path]
    partial: bool = False
    _places: dict[str, tuple[Kind, Path]] = field(default_factory=dict[str, tuple[Kind, Path]])
    _told: dict[str, tuple[Any, Json]] = field(default_factory=dict[str, tuple[Any, Json]])
    _runs: dict[str, tuple[Any, Run]] = field(default_factory=dict[str, tuple[Any, Run]])

    def index(self) -> Json:
        """All runs and trips, newest first, a line each: what it is, and how far it got."""
        self._places = {_id(path): (kind, path) for kind, path in self._find()}
        lines = {name: self._line(name, kind, path) for name, (kind, path) in self._places.items()}
        self._told = {name: self._told[name] for name in lines}
        newest = sorted(lines.values(), key=lambda line: (-line["when"], line["where"]))
        return {
            "folders": [str(folder) for folder in self.folders],
            "runs": [line for line in newest if line["kind"] == "run"],
            "trips": [line for line in newest if line["kind"] == "trip"],
            "order": [name for name, line in lines.items() if line["kind"] == "run"],
            "partial": self.partial,
        }

    def folder(self, name: str) -> Path:
        """The folder of a run, or the file of a trip. Raises DataError: there is none (any more)."""
        if name not in self._places:
            self._places = {_id(path): (kind, path) for kind, path in self._find()}
        if name not in self._places:
            raise DataError("There is no such run or trip here.", hint="Go back to the list.")
        return self._places[name][1]

    def run(self, name: str) -> Run:
        """A run as it is now; the same value while its files stay the same. Raises DataError: see load_run."""
        folder = self.folder(name)
        stamp = stamp_of(folder)
        known = self._runs.get(name)
        if known is None or known[0] != stamp:
            known = self._runs[name] = (stamp, _read_run(folder))
        return known[1]

    def _find(self) -> Iterator[tuple[Kind, Path]]:
        looked = 0
        self.partial = False
        for top in self.folders:
            if top.suffix == ".mcap":
                yield "trip", top
                continue
            for at, folders, files in os.walk(top):
                looked += 1
                if looked > MOST_FOLDERS:
                    self.partial = True
                    return
                here = Path(at)
                deep = len(here.parts) - len(top.parts) >= MOST_DEPTH
                folders[:] = [] if deep else sorted(name for name in folders if not name.startswith("."))
                if _PLAN in files and (LIVE in files or "results.jsonl" in files or ".lock" in files):
                    yield "run", here
                for name in sorted(files):
                    if name.endswith(".mcap"):
                        yield "trip", here / name

    def _line(self, name: str, kind: Kind, path: Path) -> Json:
        stamp = stamp_of(path) if kind == "run" else _stamp((path,))
        known = self._told.get(name)
        if known is None or known[0] != stamp:
            try:
                line = self._run_line(name, path) if kind == "run" else _trip_line(path)
            except Exception as error:  # noqa: BLE001 - rows may come from anywhere; one odd run hides no other
                line = {"name": path.name, "state": "unreadable", "trouble": f"{type(error).__name__}: {error}"}
            known = (stamp, line | {"kind": kind, "id": name, "where": self._where(path), "when": _when(stamp)})
            self._told[name] = known
        return known[1]

    def _where(self, path: Path) -> str:
        """A path as it is shown: from the folder that was given, with that folder's own name."""
        for top in self.folders:
            if path.is_relative_to(top) and path != top:
                return str(Path(top.name) / path.relative_to(top))
        return path.name

    def _run_line(self, name: str, folder: Path) -> Json:
        try:
            run = self.run(name)
        except ChauffeurError as error:
            # A run that has only begun has a plan and no row.
            begun = not any((folder / name).is_file() for name in (LIVE, "results.jsonl"))
            state = "running" if is_written(folder) else "unfinished" if begun else "unreadable"
            return {"name": folder.name, "state": state, "trouble": "No row yet." if begun else error.message}
        kind = benchmark_kind(run.bench)
        return {
            "name": run.name,
            "bench": run.bench,
            "model": str(run.rows[0].get("model") or run.plan.get("model") or ""),
            "state": run.state,
            "done": run.done,
            "planned": run.planned,
            "labels": list(run.labels),
            "headline": headline(run, kind),
            "simulated": simulated(kind),
            "judge": judge_of(run, kind),
        }


def stamp_of(folder: Path) -> Any:
    """A value that changes when a run's files do, or when the process that writes them starts or ends."""
    return (*_stamp(folder / name for name in _FILES), is_written(folder))


def _stamp(paths: Any) -> Stamp:
    found: list[tuple[int, int]] = []
    for path in paths:
        try:
            about = path.stat()
            found.append((about.st_mtime_ns, about.st_size))
        except OSError:
            found.append((0, -1))
    return tuple(found)


def _when(stamp: Any) -> float:
    """When something was last written, in seconds since 1970."""
    return max(part[0] for part in stamp if isinstance(part, tuple)) / 1e9


def _id(path: Path) -> str:
    return hashlib.sha256(os.fsencode(path.resolve())).hexdigest()[:12]


def _read_run(folder: Path) -> Run:
    for name in _FILES:
        path = folder / name
        if path.is_file() and path.stat().st_size > MOST_RUN_BYTES:
            raise DataError(f"{path} is larger than {MOST_RUN_BYTES >> 20} MB.", hint="Look at a shard of the run.")
    return load_run(folder)


def _trip_line(path: Path) -> Json:
    try:
        trip = read_head(path)
    except ChauffeurError as error:
        return {"state": "unreadable", "trouble": error.message, "name": path.name}
    _, label, tone = words.trip_words(trip.trip)
    return {
        "name": trip.trip.instruction.text,
        "state": "",
        "planner": trip.trip.plan.planner,
        "place": trip.scenario.title or trip.scenario.id,
        "outcome": label,
        "tone": tone,
        "duration": round(trip.trip.duration_s, 1),
        "simulated": words.simulated(trip.scenario.world),
    }


def judge_of(run: Run, kind: Any) -> str:
    """Who judges a run, and what judge and judged share; empty where the benchmark does not say."""
    return str(getattr(kind, "judge", "") or run.stored.get("judge", ""))


def headline(run: Run, kind: Any) -> Json | None:
    """The figure that stands for a run: of the first table that has one the last with a better direction, over all
    rows; the first table's last where none has."""
    specs = specs_of(kind)
    for judged in (True, False):
        for spec in specs:
            measures = [one for one in spec.measures if one.whole is None and (one.better or not judged)]
            rows = spec.about(run.rows) if measures else ()
            if rows:
                found = replace(measures[-1], varies=False).aggregate(rows)
                return _figure(spec.title, measures[-1], found.value)
    tables: Sequence[Mapping[str, Any]] = run.stored.get("tables") or ()
    if specs or not tables or not tables[0].get("lines"):
        return None
    table = stored_table(tables[0])
    return {
        "table": table.spec.title,
        "title": table.spec.measures[-1].title,
        "unit": table.spec.measures[-1].unit,
        "text": value_text(table.lines[-1], -1, table.spec.measures[-1])[0],
        "value": table.lines[-1].found[-1].value,
    }


def _figure(table: str, measure: Measure, value: float | None) -> Json:
    shown = "n/a" if value is None else f"{value * (100.0 if measure.unit == '%' else 1.0):.{measure.digits}f}"
    return {"table": table, "title": measure.title, "unit": measure.unit, "text": shown, "value": value}
