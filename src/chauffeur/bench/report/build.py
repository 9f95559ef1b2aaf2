"""A report from run folders of any benchmark: everything it says, ready to be drawn as a page or as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Protocol, cast, runtime_checkable

from chauffeur.bench.kernel.metrics import TableSpec
from chauffeur.bench.kernel.report import ALL, Line, ResultTable, fill, stored_table, with_published
from chauffeur.bench.report.gallery import PICKED, make_gallery
from chauffeur.bench.report.model import BenchReport, FlipList, Gallery
from chauffeur.bench.report.pairs import flip_list, pair_table, pairs_of
from chauffeur.bench.report.runs import Run, benchmark_kind, load_runs, on_common_items, simulated, specs_of
from chauffeur.concept import ConfigError, DataError

PICKED_IN_ALL = 24
"""Cards of all runs together, unless a number for each is given; every run shows at least four."""
LEAST_PICKED = 4

Progress = Callable[[str, int, int], None]
"""Called as (what, done, of how many)."""


@runtime_checkable
class HasRulers(Protocol):
    """Optional part of a benchmark class whose stored rows can be scored in several ways."""

    @staticmethod
    def rescored(run: Run, ruler: str) -> Run:
        """The run by a ruler. Raises ConfigError: an unknown one. DataError: the run did not keep what it takes."""
        ...


@dataclass(frozen=True, slots=True)
class Choices:
    """Options of a report.

    Attributes:
        metrics: Name of a ruler, for benchmarks that have several; empty takes the one that the runs agree on.
        data: Folder of the data set, for the scenes of runs that kept none.
        gallery: Cards of each run; None shares a page's worth among the runs.
    """

    metrics: str = ""
    data: Path | None = None
    gallery: int | None = None


def read_runs(folders: Sequence[Path], metrics: str = "") -> tuple[Sequence[Run], Any]:
    """Runs of one benchmark under one ruler, and the benchmark's class; None where it is not installed.

    Raises:
        ConfigError: See load_runs; an unknown ruler, or rulers that disagree.
        DataError: See load_runs and HasRulers.
    """
    runs = load_runs(folders)
    kind = benchmark_kind(runs[0].bench)
    if metrics:
        if not isinstance(kind, HasRulers):
            raise ConfigError(f"{runs[0].bench} has one ruler only.", hint="Leave --metrics out.")
        return tuple(kind.rescored(run, metrics) for run in runs), kind
    if len({run.ruler for run in runs}) > 1:
        scored = "; ".join(f"{run.name} by {run.ruler}" for run in runs)
        raise ConfigError(
            f"The runs were scored by different rulers ({scored}), and two rulers never stand in one table.",
            hint="Score all by one: add --metrics and its name.",
        )
    return runs, kind


def untold(what: str, done: int, total: int) -> None:
    """Progress that nobody follows."""


def build_report(folders: Sequence[Path], choices: Choices, progress: Progress = untold) -> BenchReport:
    """Read runs and say what came of them.

    Raises:
        ConfigError: See read_runs.
        DataError: See read_runs; or rows that lack what the tables are made of.
    """
    runs, kind = read_runs(folders, choices.metrics)
    bench = runs[0].bench
    specs = specs_of(kind)
    common, cut = on_common_items(runs)
    comparable = len(runs) > 1 and len(common[0].rows) > 0
    notices = _notices(runs)
    if cut:
        notices.append(f"{cut} {'All tables are over these.' if comparable else 'No row compares with another.'}")
    shown = common if comparable else runs
    if not specs:
        notices.append(f"The tables of {bench} are those that the runs stored: no pairs and no gallery.")
    try:
        made = _tables(shown, specs)
        pairs, flips, galleries = _beyond(runs, common if comparable else (), specs, kind, choices, progress)
    except KeyError as error:
        raise DataError(
            f"Rows of {bench} lack {error}: an earlier version made them.",
            hint="Run the same chauffeur bench command again: it scores what is stored.",
        ) from error
    ruler = f", ruler {shown[0].ruler}" if shown[0].ruler else ""
    return BenchReport(
        title=f"{bench}: " + ", ".join(run.name for run in runs),
        subtitle=f"{len({row['item'] for row in shown[0].rows}):,} items, {len(shown[0].rows):,} rows{ruler}",
        judge=str(getattr(kind, "judge", "") or runs[0].stored.get("judge", "")),
        notices=tuple(notices),
        tables=made,
        pairs=pairs,
        flips=flips,
        galleries=galleries,
        facts=tuple((run.name, _facts(run)) for run in runs),
        labels=tuple(dict.fromkeys(label for run in runs for label in run.labels)),
        simulated=simulated(kind),
    )


def _notices(runs: Sequence[Run]) -> list[str]:
    found: list[str] = []
    for run in runs:
        done = len({row["item"] for row in run.rows})
        if done < run.planned:
            found.append(f"{run.name}: only {done:,} of the run's {run.planned:,} items.")
        if broken := sum(bool(row.get("infra_failed")) for row in run.rows):
            found.append(
                f"{run.name}: {broken:,} of {len(run.rows):,} rows failed because of endpoint, sandbox or machine, or "
                "were not asked for. They say nothing about the planner."
            )
    return found


def _tables(runs: Sequence[Run], specs: Sequence[TableSpec]) -> tuple[ResultTable, ...]:
    """The tables, filled anew; those that the runs stored where the benchmark's own are not at hand."""
    if not specs:
        stored = [(run, stored_table(table)) for run in runs for table in run.stored.get("tables", ())]
        titles = dict.fromkeys(table.spec.title for _, table in stored)
        alike = ([(run, table) for run, table in stored if table.spec.title == title] for title in titles)
        return tuple(_beside(tables[0][1].spec, tables) for tables in alike)
    made = (_beside(spec, [(run, fill(spec, run.rows)) for run in runs]) for spec in specs)
    rows = [row for run in runs for row in run.rows]
    return tuple(with_published(table, rows) for table in made if table.lines)


def _beside(spec: TableSpec, found: Sequence[tuple[Run, ResultTable]]) -> ResultTable:
    """One table of several runs' tables: line by line, the runs below one another."""
    notes = tuple(f"{run.name}: {note}" if len(found) > 1 else note for run, table in found for note in table.notes)
    names = dict.fromkeys(line.name for _, table in found for line in table.lines)
    order = [name.replace("_", " ") for name in spec.order]
    ordered = sorted(names, key=lambda name: (name == ALL, order.index(name) if name in order else len(order)))
    lines: list[Line] = []
    for name in ordered:
        for run, table in found:
            for line in table.lines:
                if line.name != name:
                    continue
                if len(names) == 1 and name == ALL:
                    lines.append(replace(line, name=run.name, labels=run.labels))
                elif len(found) > 1:
                    lines.append(replace(line, name=run.name, labels=run.labels, group=name))
                else:
                    lines.append(line)
    return ResultTable(spec, tuple(lines), notes)


def _beyond(
    runs: Sequence[Run], common: Sequence[Run], specs: Sequence[TableSpec], kind: Any, choices: Choices, tell: Progress
) -> tuple[tuple[ResultTable, ...], tuple[FlipList, ...], tuple[Gallery, ...]]:
    """Pairs in the columns of the first table over the rows as such; flips and galleries of rows that are not as they
    should be, as the first table with a rate of a better direction says."""
    direct = [spec for spec in specs if spec.over is None]
    if not direct:
        return (), (), ()
    judged = next((spec for spec in direct if any(one.better and one.unit == "%" for one in spec.measures)), None)
    group = next((spec.group for spec in specs if spec.group), "")
    pairs = pairs_of(common) if len(common) > 1 else []
    flips = [] if judged is None else [flip_list(a, b, judged, group) for a, b in pairs]
    found: list[Gallery] = []
    each = min(PICKED, max(LEAST_PICKED, PICKED_IN_ALL // len(runs))) if choices.gallery is None else choices.gallery
    if judged is not None:
        for run in runs:

            def told(done: int, total: int, name: str = run.name) -> None:
                tell(f"showing items of {name}", done, total)

            found.append(make_gallery(run, runs, judged, group, kind, choices.data, each, told))
    return tuple(pair_table(a, b, direct[0]) for a, b in pairs), tuple(one for one in flips if one.flips), tuple(found)


def _facts(run: Run) -> tuple[tuple[str, str], ...]:
    """Origin of a run's figures, as (name, value); what is not known is left out."""
    row, known = run.rows[0], run.provenance
    versions = cast("dict[str, Any]", known.get("versions") or {})
    found: list[tuple[str, Any]] = [
        ("run folder", run.folder.resolve().name),
        ("labels", "; ".join(run.labels)),
        ("planner", row.get("planner")),
        ("model", row.get("model") or known.get("model")),
        ("items", f"{run.planned:,}"),
        ("benchmark", run.bench),
        ("ruler", run.ruler),
        *((name.replace("_", " "), _words(value)) for name, value in run.config.items() if name != "planner"),
        ("rollout", known.get("rollout") or row.get("rollout")),
        *((f"version of {name}", value) for name, value in versions.items()),
        ("python", known.get("python")),
        ("machine", known.get("machine")),
    ]
    return tuple((name, str(value)) for name, value in found if value not in (None, ""))


def _words(value: Any) -> str:
    if isinstance(value, dict):
        named = cast("dict[str, Any]", value)
        return ", ".join(f"{name.replace('_', ' ')} {item}" for name, item in named.items() if item is not None)
    if isinstance(value, list):
        return ", ".join(str(item) for item in cast("list[Any]", value))
    return "" if value is None else str(value)
