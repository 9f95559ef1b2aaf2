"""A report as values: what every form of it (page, Markdown) says, before anything is drawn."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from chauffeur.bench.kernel.stats import Interval
from chauffeur.concept import Context, Program, Verdict
from chauffeur.drive.recording import RecordedTrip

SIMULATED = "simulated drives"
"""Said wherever a result stands."""

Better = Literal["higher", "lower", ""]


@dataclass(frozen=True, slots=True)
class Column:
    """A column and its legend.

    Attributes:
        key: Name within its table.
        title: Head of the column.
        unit: Unit of its numbers; empty for counts and words.
        better: Which direction is better; empty where neither is.
        meaning: What it says, in one or two sentences for a reader who knows nothing of the benchmark.
        digits: Decimals shown.
        span: Ends of the axis its interval bars are drawn on; None for no bars.
    """

    key: str
    title: str
    unit: str = ""
    better: Better = ""
    meaning: str = ""
    digits: int = 0
    span: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Cell:
    """What stands in one place of a table.

    Attributes:
        text: As it is read, e.g. `98.7`; `n/a` where nothing can be said.
        interval: The number behind it, in the column's unit, where it has an interval.
        note: A few words more, e.g. `24 of 25`.
    """

    text: str
    interval: Interval | None = None
    note: str = ""

    @property
    def ends(self) -> tuple[float, float] | None:
        """Both ends of the interval, if it has them."""
        if self.interval is None or self.interval.low is None or self.interval.high is None:
            return None
        return self.interval.low, self.interval.high


NOT_KNOWN = Cell("n/a")


@dataclass(frozen=True, slots=True)
class ReportLine:
    """A row of a table.

    Attributes:
        name: What the row is about.
        cells: One a column.
        labels: What must be said beside the name.
        published: Whether the figures are the paper's own, measured by its authors.
    """

    name: str
    cells: tuple[Cell, ...]
    labels: tuple[str, ...] = ()
    published: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """Rows that belong together, under a heading of their own where it is not empty."""

    heading: str
    lines: tuple[ReportLine, ...]


@dataclass(frozen=True, slots=True)
class ReportTable:
    """A table.

    Attributes:
        id: For links, e.g. `scores`.
        title: What it shows.
        lead: A sentence or two before it.
        first: Head of the column of names.
        columns: The others.
        groups: Its rows.
        notes: What stands below it.
        simulated: Whether its figures are results of drives (then that is said in its caption).
    """

    id: str
    title: str
    first: str
    columns: tuple[Column, ...]
    groups: tuple[Group, ...]
    lead: str = ""
    notes: tuple[str, ...] = ()
    simulated: bool = True

    @property
    def caption(self) -> str:
        """Title with what must be said of the figures."""
        return f"{self.title} ({SIMULATED})" if self.simulated else self.title


@dataclass(frozen=True, slots=True)
class Flip:
    """Commands of one scene that one run completed and the other did not.

    Attributes:
        sample, family: The scene.
        gained: How many of its commands the second run completed and the first did not.
        lost: How many the first run completed and the second did not.
        command: One of them.
        first, second: What came of that one in either run, in words.
    """

    sample: str
    family: str
    gained: int
    lost: int
    command: str
    first: str
    second: str


@dataclass(frozen=True, slots=True)
class FlipList:
    """All flips between two runs, whose names carry their labels; `left_out` more scenes are not listed."""

    first: str
    second: str
    flips: tuple[Flip, ...]
    left_out: int


@dataclass(frozen=True, slots=True)
class Failure:
    """An item that was not completed, with everything needed to understand why.

    Attributes:
        run, labels: Whose it is and what must be said of it.
        item, sample, family, scenario_seed: Which item.
        command: The wish.
        goal: What the benchmark wanted to see, in words; empty when the data set was not at hand.
        outcome: As the row says, e.g. `timeout`.
        happened: What happened and why, in sentences.
        facts: Further facts as (name, value).
        siblings: How the scene's other commands fared, in words.
        elsewhere: How other runs fared with the same item, as (run, words).
        context: C in words; None where the run kept none.
        thoughts: R; empty where there is none.
        program: P; None for baselines and refusals.
        verdicts: What the checks said.
        drive: The drive, driven again with recording; None where there is none to show.
        drive_note: Why there is none, or what is to be said of it.
    """

    run: str
    labels: tuple[str, ...]
    item: str
    sample: str
    family: str
    scenario_seed: str
    command: str
    goal: str
    outcome: str
    happened: tuple[str, ...]
    facts: tuple[tuple[str, str], ...]
    siblings: str
    elsewhere: tuple[tuple[str, str], ...]
    context: Context | None
    thoughts: str
    program: Program | None
    verdicts: tuple[Verdict, ...]
    drive: RecordedTrip | None
    drive_note: str


@dataclass(frozen=True, slots=True)
class Gallery:
    """Failures of one run that were picked to be shown.

    Attributes:
        run, labels: Whose.
        failed: How many items were not completed.
        items: Of how many.
        failures: The picked ones.
    """

    run: str
    labels: tuple[str, ...]
    failed: int
    items: int
    failures: tuple[Failure, ...]


@dataclass(frozen=True, slots=True)
class Headline:
    """One thing that came out: what it is about, and the sentences."""

    subject: str
    text: str


@dataclass(frozen=True, slots=True)
class BenchReport:
    """Everything a report says.

    Attributes:
        title: What was run.
        subtitle: Runs, items, ruler.
        summary: What was run, in a sentence.
        headlines: What came out, in plain sentences.
        warnings: What a reader must know before comparing.
        tables: In reading order.
        flips: Items that went differently between runs.
        galleries: Failures, by run.
        terms: (term, definition) of every measure under this ruler.
        facts: (name, value) of where the figures come from, by run: (run, facts).
        ruler: Versioned id of the metrics.
        labels: Everything that must be said of any run in it.
    """

    title: str
    subtitle: str
    summary: str
    headlines: tuple[Headline, ...]
    warnings: tuple[str, ...]
    tables: tuple[ReportTable, ...]
    flips: tuple[FlipList, ...]
    galleries: tuple[Gallery, ...]
    terms: tuple[tuple[str, str], ...]
    facts: tuple[tuple[str, tuple[tuple[str, str], ...]], ...]
    ruler: str
    labels: tuple[str, ...] = ()

    def table(self, table_id: str) -> ReportTable | None:
        """A table by id."""
        return next((table for table in self.tables if table.id == table_id), None)
