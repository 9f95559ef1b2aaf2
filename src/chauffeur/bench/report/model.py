"""A report as values: what every form of it (page, Markdown, CSV) says, before anything is drawn."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from chauffeur.bench.kernel.report import ResultTable
from chauffeur.concept import Program, Verdict
from chauffeur.driving.recording import RecordedTrip

SIMULATED = "simulated drives"
"""Said wherever a result of drives stands."""


def said(name: str, labels: tuple[str, ...]) -> str:
    """A name with its labels: `onboard [critic: evaluator]`."""
    return f"{name} [{'; '.join(labels)}]" if labels else name


_ASKED = ("command", "wish", "instruction", "text", "words", "question")
_ENDED = ("outcome", "status", "answer", "topic", "chosen", "label")
_RESULTS = {"success": "done", "failure": "not done", "refused": "declined"}
"""Stored outcomes that have another word where people read."""
_SHORT = 80
"""Longest text that is a fact and no prose."""


def asked_words(row: Mapping[str, Any]) -> str:
    """Words that a row's item asked with; its id where the row has none."""
    return next((str(row[name]) for name in _ASKED if row.get(name)), str(row["item"]))


def ending_words(row: Mapping[str, Any], otherwise: str = "not as it should be") -> str:
    """Short words for a row's ending; `otherwise` where the row tells none."""
    found = (str(row[name]) for name in _ENDED if row.get(name))
    return next((_RESULTS.get(text, text.replace("_", " ")) for text in found if len(text) <= _SHORT), otherwise)


@dataclass(frozen=True, slots=True)
class Flip:
    """Rows of one cluster, e.g. commands of one scene, that are as they should be in one run and not in the other.

    Attributes:
        cluster, group: Which, and the line of the tables that it stands in.
        gained: How many are right in the second run only.
        lost: How many are right in the first run only.
        words: What was asked in one of them.
        first, second: What came of that one in either run.
    """

    cluster: str
    group: str
    gained: int
    lost: int
    words: str
    first: str
    second: str


@dataclass(frozen=True, slots=True)
class FlipList:
    """All flips between two runs, whose names carry their labels; `left_out` more clusters are not listed."""

    first: str
    second: str
    flips: tuple[Flip, ...]
    left_out: int


ShownDrive = tuple[RecordedTrip | None, str]
"""A drive and what is to be said of it; no drive, and why."""


@dataclass(frozen=True, slots=True)
class Card:
    """A row that is not as it should be, with what its run kept to understand why.

    Attributes:
        item: Which item.
        words: What was asked.
        ending: What came of it, briefly.
        bad: Whether the drive itself went wrong.
        goal: What the benchmark wanted to see; empty where that is not known.
        why: Sentences on what happened.
        facts: Further facts as (name, value).
        context: What the planner was told of the scene.
        thoughts: R; empty where there is none.
        program: P; None for baselines, refusals and answers in words.
        verdicts: What the checks said.
        drive: Gives the drive, e.g. by driving it again with recording, and what is to be said of it; None where there
            is none to show.
        drive_note: Why there is none.
        elsewhere: How other runs fared with the same item, as (run, words).
    """

    item: str
    words: str
    ending: str
    bad: bool = False
    goal: str = ""
    why: tuple[str, ...] = ()
    facts: tuple[tuple[str, str], ...] = ()
    context: str = ""
    thoughts: str = ""
    program: Program | None = None
    verdicts: tuple[Verdict, ...] = ()
    drive: Callable[[], ShownDrive] | None = None
    drive_note: str = ""
    elsewhere: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Gallery:
    """Cards of one run that were picked to be shown: `missed` of `items` rows are not as they should be."""

    run: str
    labels: tuple[str, ...]
    missed: int
    items: int
    cards: tuple[Card, ...]


@dataclass(frozen=True, slots=True)
class BenchReport:
    """Everything a report says.

    Attributes:
        title: What was run.
        subtitle: Benchmark, items, ruler.
        judge: Who judges, and what judge and judged share; empty where the benchmark does not say.
        notices: What a reader must know before comparing.
        tables: In reading order.
        pairs: Run against run.
        flips: Items that went differently between runs.
        galleries: By run.
        facts: (name, value) of where the figures come from, by run: (run, facts).
        labels: Everything that must be said of any run in it.
        simulated: Whether its figures are results of drives.
    """

    title: str
    subtitle: str
    judge: str
    notices: tuple[str, ...]
    tables: tuple[ResultTable, ...]
    pairs: tuple[ResultTable, ...]
    flips: tuple[FlipList, ...]
    galleries: tuple[Gallery, ...]
    facts: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    labels: tuple[str, ...] = ()
    simulated: bool = True
