"""A report from run folders: everything it says, ready to be drawn as a page or as Markdown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from chauffeur.bench.lampilot.metrics import ORIGIN
from chauffeur.bench.report import headlines, method, pairs, tables
from chauffeur.bench.report.failures import PICKED, failed, make_gallery
from chauffeur.bench.report.model import BenchReport, FlipList, Gallery, Headline, ReportTable
from chauffeur.bench.report.rulers import under_one_ruler
from chauffeur.bench.report.runs import Run, load_runs, on_common_items
from chauffeur.bench.report.tables import RowSampling
from chauffeur.concept import ConfigError, DataError, Scenario
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset

PICKED_IN_ALL = 24
"""Failures shown of all runs together, unless a number for each is given; every run shows at least four."""
LEAST_PICKED = 4

Progress = Callable[[str, int, int], None]
"""Called as (what, done, of how many)."""


@dataclass(frozen=True, slots=True)
class Choices:
    """What a report is asked for.

    Attributes:
        metrics: `origin` or `paper`; empty takes the ruler that the runs agree on.
        data: DbLv1 folder, for the scenes of runs that kept none.
        gallery: Failures shown of each run; None shares a page's worth among the runs.
        how: How intervals are made.
    """

    metrics: str = ""
    data: Path | None = None
    gallery: int | None = None
    how: RowSampling = field(default_factory=RowSampling)


def build_report(folders: Sequence[Path], choices: Choices, progress: Progress) -> BenchReport:
    """Read runs and say what came of them.

    Raises:
        ConfigError: No run, one twice, an unknown ruler, or rulers that disagree.
        DataError: A folder is no finished run, damaged, or cannot be scored by the wanted ruler; or the data set is not
            that of any run.
    """
    runs = under_one_ruler(load_runs(folders), choices.metrics)
    data = _load_data(choices.data, runs)
    shared = on_common_items(runs)
    warnings = [shared.note] if shared.note else []
    comparable = len(shared.runs[0].rows) > 0
    shown = shared.runs if comparable else runs
    if not comparable:
        warnings[-1] += (
            " Each run stands over its own items: no row may be compared with another, and no pair is shown."
        )
    elif shared.note:
        warnings[-1] += " All figures but the last section are over these."
    warnings.extend(_warnings(runs, data))

    made = _tables(shown, choices.how, compared=comparable and len(runs) > 1)
    if comparable and shared.note:
        made.append(_own_items(runs, choices.how))
    by_id = {table.id: table for table in made}
    return BenchReport(
        title="LaMPilot-Bench: " + ", ".join(run.name for run in runs),
        subtitle=f"{tables.number(len(shown[0].rows), 0)} items, ruler {shown[0].ruler}",
        summary=headlines.ran_words(shown),
        headlines=_headlines(shown, by_id, choices.how),
        warnings=tuple(warnings),
        tables=tuple(made),
        flips=_flips(shared.runs) if comparable and len(runs) > 1 else (),
        galleries=_galleries(runs, data, choices.gallery, progress),
        terms=method.terms(shown[0].ruler, choices.how),
        facts=tuple((run.name, method.facts(run, run.planned)) for run in runs),
        ruler=shown[0].ruler,
        labels=tuple(dict.fromkeys(label for run in runs for label in run.labels)),
    )


def _load_data(folder: Path | None, runs: Sequence[Run]) -> Dataset | None:
    if folder is None:
        return None
    data = load_dataset(folder)
    if all(run.data_sha256 != data.sha256 for run in runs):
        raise DataError(
            f"{folder} is not the data set of these runs: its hash is {data.sha256[:12]}, theirs "
            f"{', '.join(sorted({run.data_sha256[:12] or 'not recorded' for run in runs}))}.",
            hint="Give the folder that the runs were made with, or leave --data out.",
        )
    return data


def _scenes(run: Run, data: Dataset | None) -> dict[str, Scenario]:
    """A run's scenes: those it kept, or else those of its data set."""
    if run.scenes or data is None or run.data_sha256 != data.sha256:
        return run.scenes
    return {scene.id: scene for task in data.tasks for scene in task.samples}


def _warnings(runs: Sequence[Run], data: Dataset | None) -> list[str]:
    found: list[str] = []
    for run in runs:
        rows = run.rows
        if len(rows) < run.planned:
            found.append(f"{run.name}: only {len(rows):,} of the run's {run.planned:,} items, a shard of it.")
        if run.not_asked:
            found.append(
                f"{run.name}: partial. The run stopped before {run.not_asked:,} of {len(rows):,} items; they count as "
                "not completed."
            )
        found.extend(words for words in (headlines.machine_words(run),) if words)
        if any(failed(row) for row in rows) and not _scenes(run, data):
            found.append(
                f"{run.name}: an earlier version made this run and kept no scenes, so its failures are shown without "
                "drives. Name its data set with --data to see them."
            )
    return found


def _tables(runs: Sequence[Run], how: RowSampling, *, compared: bool) -> list[ReportTable]:
    origin = runs[0].ruler == ORIGIN.id
    made = [tables.score_table(runs, how, published=origin)]
    if compared:
        made.append(pairs.pair_table(runs, how))
    made += [
        tables.family_table(runs, how),
        tables.outcome_table(runs),
        tables.beside_table(runs, how),
        tables.cost_table(runs),
    ]
    if not origin:
        made.append(tables.published_table())
    return made


def _own_items(runs: Sequence[Run], how: RowSampling) -> ReportTable:
    table = tables.score_table(runs, how, published=False)
    return replace(
        table,
        id="own",
        title="Each run over all its own items",
        lead="The runs cover different items here: do not compare the rows.",
    )


def _headlines(runs: Sequence[Run], by_id: dict[str, ReportTable], how: RowSampling) -> tuple[Headline, ...]:
    lines = by_id["scores"].groups[0].lines
    found: list[Headline] = []
    for run, line in zip(runs, lines, strict=True):
        families = by_id["families"] if len(runs) == 1 else tables.family_table([run], how)
        found.append(headlines.result_words(run, line, families.groups[0].lines))
    found.append(headlines.paper_words(lines, runs[0].ruler))
    return tuple(found)


def _flips(runs: Sequence[Run]) -> tuple[FlipList, ...]:
    return tuple(found for a, b in pairs.pairs_of(runs) if (found := pairs.flip_list(a, b)).flips)


def _galleries(
    runs: Sequence[Run], data: Dataset | None, wanted: int | None, progress: Progress
) -> tuple[Gallery, ...]:
    if wanted is not None and wanted < 0:
        raise ConfigError(f"The gallery cannot show {wanted} failures.", hint="Give 0 or more.")
    each = min(PICKED, max(LEAST_PICKED, PICKED_IN_ALL // len(runs))) if wanted is None else wanted
    found: list[Gallery] = []
    for run in runs:

        def tell(done: int, total: int, name: str = run.name) -> None:
            progress(f"driving failures of {name} again", done, total)

        found.append(make_gallery(run, runs, _scenes(run, data), each, tell))
    return tuple(found)
