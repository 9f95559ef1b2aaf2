"""The score card: what a planner came to on each benchmark, who judged it, and what the paper has beside it.

`card.json` is this module's values; `card.md` says them to people.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final, Literal

from pydantic import TypeAdapter, ValidationError

from chauffeur.bench.evaluation.parts import PlannedPart, Profile
from chauffeur.bench.kernel.benchmark import Benchmark
from chauffeur.bench.kernel.headline import Headline, PrintedFigure
from chauffeur.bench.kernel.metrics import AnyRow, Better
from chauffeur.bench.kernel.report import interval_text, markdown
from chauffeur.bench.kernel.run import as_json, write_results
from chauffeur.bench.kernel.stats import Interval
from chauffeur.concept import DataError

SCHEMA: Final = "chauffeur-score-card-1"
"""Changes whenever a reader of `card.json` would have to."""
CARD: Final = "card.json"
_MOST_BYTES: Final = 8_000_000
"""A card of twenty benchmarks has some 60 kB."""
_OF_WHO: Final = frozenset({"planner", "model", "driver", "readers"})
"""Entries of a configuration that name who was asked."""

State = Literal["done", "partial", "failed", "not run"]


@dataclass(frozen=True, slots=True)
class Figure:
    """A headline figure.

    Attributes:
        metric: Versioned id.
        title: In words.
        unit: As of the metric; rates are in 0..1 with the unit `%`.
        digits: Decimals shown.
        better: Which direction is better.
        found: Value with its 95 % interval.
        items: Rows behind it.
        paper: Printed figures that may stand beside it.
        caveat: What must be said of that.
    """

    metric: str
    title: str
    unit: str
    digits: int
    better: Better
    found: Interval
    items: int
    paper: tuple[PrintedFigure, ...] = ()
    caveat: str = ""

    @property
    def scale(self) -> float:
        """Factor from the stored value to the shown one."""
        return 100.0 if self.unit == "%" else 1.0

    @property
    def text(self) -> str:
        """The value with its ends, as it is shown."""
        return interval_text(self.found, self.scale, self.digits)

    @property
    def printed(self) -> str:
        """The paper's values, as they are shown; empty for none."""
        return ", ".join(f"{self.scale * one.value:.{self.digits}f}" for one in self.paper)

    @property
    def head(self) -> str:
        """Title with unit and arrow: `completion, % ↑`."""
        arrow = {"higher": " ↑", "lower": " ↓", "": ""}[self.better]
        return f"{self.title}{f', {self.unit}' if self.unit else ''}{arrow}"


@dataclass(frozen=True, slots=True)
class CardEntry:
    """A benchmark on a card.

    Attributes:
        name: As it is registered; also the folder of its run.
        bench: Versioned id; empty where it was not run.
        state: `partial` where items were not asked, `failed` where not one could be driven.
        why: Reason for any state but `done`.
        remedy: What would change it.
        figures: The headlines, the first one first.
        judge: Who judges, and what judge and judged share.
        evidence: What the figures come from: simulated or real.
        items: Items done, of `planned`.
        planned: Items of the run.
        config: All that decides the run beside planner and code: seed, hash of the data, versions, options.
        wall_s: Time that it took, over all its resumptions.
        cpu_s: Processor time of this process and its workers.
    """

    name: str
    bench: str = ""
    state: State = "not run"
    why: str = ""
    remedy: str = ""
    figures: tuple[Figure, ...] = ()
    judge: str = ""
    evidence: str = ""
    items: int = 0
    planned: int = 0
    config: Mapping[str, Any] = field(default_factory=dict[str, Any])
    wall_s: float = 0.0
    cpu_s: float = 0.0

    @property
    def basis(self) -> str:
        """Hash of benchmark, version, data and options: figures with another one are not comparable."""
        content = json.dumps([self.bench, self.planned, dict(self.config)], sort_keys=True)
        return hashlib.sha256(content.encode()).hexdigest()[:16]


@dataclass(frozen=True, slots=True)
class ScoreCard:
    """What a planner came to.

    Attributes:
        planner, model: Who was evaluated.
        profile: With how much.
        labels: What must be said wherever a figure is shown.
        versions: Of Chauffeur, Python and the libraries that decide drives.
        machine: System, architecture, processors.
        entries: A benchmark each.
        schema: Of this file.
    """

    planner: str
    model: str
    profile: Profile
    labels: tuple[str, ...]
    versions: Mapping[str, str]
    machine: str
    entries: tuple[CardEntry, ...] = ()
    schema: str = SCHEMA

    @property
    def ran(self) -> tuple[CardEntry, ...]:
        """Benchmarks with figures."""
        return tuple(one for one in self.entries if one.figures)

    @property
    def cost(self) -> tuple[float, float]:
        """(wall, processor) time of all, s."""
        return sum(one.wall_s for one in self.entries), sum(one.cpu_s for one in self.entries)

    @property
    def rows(self) -> list[dict[str, Any]]:
        """One flat row a figure; of a benchmark without figures one that says why."""
        return [row for entry in self.entries for row in _rows(self, entry)]

    def with_entry(self, entry: CardEntry) -> ScoreCard:
        """The card with an entry in place of the one of its name."""
        return replace(self, entries=tuple(entry if one.name == entry.name else one for one in self.entries))

    def write(self, folder: Path) -> None:
        """Write `card.json` and `card.md`. Raises DataError: they cannot be written."""
        stored = asdict(self)
        for entry, one in zip(stored["entries"], self.entries, strict=True):
            entry["basis"] = one.basis
        write_results(folder, {CARD: as_json(stored), "card.md": card_markdown(self)})


_reader = TypeAdapter(ScoreCard)


def read_card(path: Path) -> ScoreCard:
    """A card from its folder or file.

    Raises:
        DataError: There is none, or it is damaged or of another schema.
    """
    file = path / CARD if path.is_dir() else path
    try:
        if file.stat().st_size > _MOST_BYTES:
            raise DataError(f"{file} has more than {_MOST_BYTES} bytes: it is no score card.")
        content = file.read_bytes()
    except OSError as error:
        raise DataError(f"There is no score card at {file}.", hint="Make one: chauffeur evaluate") from error
    try:
        stored: Any = json.loads(content)
        schema = stored.get("schema") if isinstance(stored, dict) else None
        if schema != SCHEMA:
            raise DataError(f"{file} has the schema {schema!r}; this version reads {SCHEMA!r}.", hint="Evaluate again.")
        return _reader.validate_python(stored)
    except (ValueError, ValidationError, RecursionError) as error:
        said = str(error).splitlines()[0]
        raise DataError(f"{file} is no score card: {said}.", hint="Evaluate again.") from error


def figures_of(headlines: Sequence[Headline], rows: Sequence[AnyRow]) -> tuple[Figure, ...]:
    """The headline figures over the rows of a run; without those that have no line."""
    found: list[Figure] = []
    for one in headlines:
        line, measure = one.found(rows), one.measure
        if line is not None:
            interval, items = line.found[one.place], line.items or 0
            about = (measure.id, one.title, measure.unit, measure.digits, measure.better)
            paper = one.printed(rows)
            found.append(Figure(*about, interval, items, paper, one.table.lead if paper else ""))
    return tuple(found)


def entry_of(planned: PlannedPart) -> CardEntry:
    """The entry of a benchmark before it is run."""
    if planned.benchmark is None:
        return CardEntry(planned.name, why=planned.why, remedy=planned.remedy)
    bench: Benchmark[Any] = planned.benchmark
    config: dict[str, Any] = json.loads(json.dumps(dict(bench.config)))
    return CardEntry(
        planned.name,
        bench.id,
        why="It has not been run yet.",
        judge=str(getattr(bench, "judge", "")) or "Not told by the benchmark.",
        evidence="" if planned.part is None else planned.part.evidence,
        config={name: value for name, value in config.items() if name not in _OF_WHO},
    )


def _rows(card: ScoreCard, entry: CardEntry) -> Iterator[dict[str, Any]]:
    common = {
        "planner": card.planner,
        "model": card.model,
        "profile": card.profile,
        "benchmark": entry.name,
        "bench": entry.bench,
        "state": entry.state,
        "evidence": entry.evidence,
        "judge": entry.judge,
        "why": entry.why,
        "basis": entry.basis,
    }
    for one in entry.figures:
        yield common | {
            "metric": one.metric,
            "figure": one.title,
            "unit": one.unit,
            "value": one.found.value,
            "low": one.found.low,
            "high": one.found.high,
            "items": one.items,
            "paper": [printed.value for printed in one.paper],
            "paper_source": sources_text(one),
        }
    if not entry.figures:
        yield common


def sources_text(figure: Figure) -> str:
    """Where the paper's figures stand, `Tab. IV: GPT-4, 3-shot`, and what must be said of them; empty for none."""
    if not figure.paper:
        return ""
    return f"{figure.paper[0].table}: {'; '.join(one.name for one in figure.paper)}. {figure.caveat}".rstrip(". ") + "."


def paper_texts(entry: CardEntry) -> tuple[str, ...]:
    """Where the printed figures beside an entry's stand, each place once."""
    return tuple(dict.fromkeys(text for one in entry.figures if (text := sources_text(one))))


def head_text(card: ScoreCard) -> str:
    """Who was evaluated, by which version."""
    wall_s, cpu_s = card.cost
    model = f", model {card.model}" if card.model else ""
    said = "".join(f"; {label}" for label in card.labels)
    return (
        f"{card.planner}{model}{said}; profile {card.profile}; Chauffeur {card.versions.get('chauffeur', '?')}; "
        f"{wall_s / 60.0:.1f} min, {cpu_s / 60.0:.1f} min of processor time."
    )


def card_markdown(card: ScoreCard) -> str:
    """The card as Markdown."""
    lines = [
        (f"{entry.name}: {one.head}", one.text, str(one.items), one.printed, sources_text(one), entry.evidence)
        for entry in card.ran
        for one in entry.figures
    ]
    head = ("figure", "value [95 %]", "items", "paper", "where printed", "from")
    judges = [f"- **{entry.name}** (`{entry.bench}`): {entry.judge}" for entry in card.ran]
    missing = [
        f"- **{entry.name}**, {entry.state}: {entry.why} {entry.remedy}".rstrip()
        for entry in card.entries
        if entry.state != "done"
    ]
    parts = ["# Score card", head_text(card), markdown(head, lines) if lines else "No figures yet.", PAPER_NOTE]
    parts += ["## Judges, and what they share with the judged", "\n".join(judges)] if judges else []
    parts += ["## Not run, or not whole", "\n".join(missing)] if missing else []
    versions = ", ".join(f"{name} {version}" for name, version in card.versions.items())
    return "\n\n".join([*parts, f"{versions}; {card.machine}."]) + "\n"


PAPER_NOTE: Final = (
    "The paper's figures are its authors' own, of other items, machines and vehicles: for reference only."
)
