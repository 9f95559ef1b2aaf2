"""A benchmark run from Python: what `chauffeur.run_benchmark` and `evaluate` do, and rows as a notebook shows them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

from chauffeur.bench.evaluation.parts import Evaluated, Options, PlannedPart, Profile
from chauffeur.bench.evaluation.run import Evaluation
from chauffeur.bench.kernel.benchmark import GROUP, asked_by, benchmark_from, takes_planner
from chauffeur.bench.kernel.pipeline import Watch
from chauffeur.bench.kernel.progress import Standing
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.kernel.stages import made_by
from chauffeur.bench.kernel.store import Row
from chauffeur.concept.registry import load_plugin
from chauffeur.hmi.notebook import library
from chauffeur.planners.base import Answerer, Planner


def run_named(name: str, planner: str | Planner | Answerer | None, *, out: Path, workers: int, **options: Any) -> Rows:
    """Run an installed benchmark; see `chauffeur.run_benchmark`."""
    make = load_plugin(GROUP, name)
    if planner is not None and takes_planner(make):
        options["planner"] = planner if isinstance(planner, str) else planner.id
    benchmark = benchmark_from(make, name, **options)
    run = BenchRun(out, benchmark, asked_by(benchmark, planner), made=made_by(name, options))
    return Rows(run.run(_unwatched, replace(Effort(), workers=workers)), run.folder)


def evaluated(
    planner: str | Planner | Answerer,
    out: Path,
    profile: Profile,
    workers: int,
    base_url: str,
    options: Options,
    only: Sequence[str],
) -> Rows:
    """Run a planner on every benchmark that it can take; see `chauffeur.evaluate`."""
    evaluation = Evaluation(Evaluated.of(planner, base_url), out, profile, options, only)
    card = evaluation.run(_begin_unwatched, replace(Effort(), workers=workers))
    return Rows(card.rows, evaluation.folder, "card.md")


def _begin_unwatched(part: PlannedPart, run: BenchRun) -> AbstractContextManager[Watch]:
    del part, run
    return nullcontext(_unwatched)


def _unwatched(standing: Standing) -> None:
    del standing


class Rows(list[Row]):
    """Rows of a benchmark run: a list, with a table for people and one for pandas.

    Attributes:
        folder: The run's folder.
    """

    def __init__(self, rows: Iterable[Row], folder: Path, table: str = "table.md") -> None:
        """Args: the rows; the folder they are stored in; the file in it that says them to people."""
        super().__init__(rows)
        self.folder = folder
        self._table = table

    def __repr__(self) -> str:
        """One line."""
        return f"<{len(self)} rows of the run in {str(self.folder)!r}>"

    def _repr_markdown_(self) -> str:
        """The run's table of results, as its file has it."""
        return (self.folder / self._table).read_text(encoding="utf-8")

    def frame(self) -> Any:
        """One row an item as a `pandas.DataFrame`; `plan.usage.requests` is the column of a nested value.

        Raises:
            MissingExtraError: pandas is not installed.
        """
        return library("pandas", "A data frame").json_normalize(list(self))
