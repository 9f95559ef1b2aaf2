"""Run a planner on every benchmark that it can take, into one folder: a run each beneath it, and the card."""

from __future__ import annotations

import os
import platform
import time
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from pathlib import Path
from typing import Any

from chauffeur.bench.evaluation.card import CARD, CardEntry, ScoreCard, entry_of, figures_of, read_card
from chauffeur.bench.evaluation.parts import LEFT_OUT, Evaluated, Options, PlannedPart, Profile, planned_parts
from chauffeur.bench.kernel.budget import Bill, SpendingBudget
from chauffeur.bench.kernel.pipeline import Watch
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.kernel.stages import versions
from chauffeur.concept import ChauffeurError, ConfigError

Begin = Callable[[PlannedPart, BenchRun], AbstractContextManager[Watch]]
"""Called before each benchmark; gives who watches its run."""


class Evaluation:
    """A planner, the benchmarks that it can take, and the card of them in a folder.

    Attributes:
        folder: Of the card; each benchmark's run lies beneath it, by name.
        parts: All installed benchmarks, those that are not run with the reason.
        card: As it stands.
    """

    def __init__(
        self,
        who: Evaluated,
        folder: Path,
        profile: Profile = "quick",
        options: Options | None = None,
        only: Sequence[str] = (),
    ) -> None:
        """Plan an evaluation, or go on with the one in a folder.

        Args:
            who: Who is evaluated.
            folder: Where.
            profile: `quick` for a sample of each benchmark, `full` for all items.
            options: Of benchmarks, by name, e.g. their data.
            only: Benchmarks to run now; none for all. What the card has of the others stays.

        Raises:
            ConfigError: The folder holds the card of another planner or profile, or an option is for no benchmark.
            DataError: Its card is damaged.
            ChauffeurError: The planner gives no plan at all.
        """
        self.folder = folder
        self._who = who
        known = read_card(folder) if (folder / CARD).exists() else None
        card = ScoreCard(
            who.made.id,
            who.made.model,
            profile,
            tuple(getattr(who.made, "labels", ())),
            {**versions(), "python": platform.python_version()},
            f"{platform.system()} {platform.machine()}, {os.cpu_count()} CPUs",
        )
        if known is not None and (other := _other(known, card)):
            raise ConfigError(f"{folder} holds the score card of {other}.", hint="Take another folder with --out.")
        self.parts = planned_parts(who, profile, options or {}, only)
        before = {} if known is None else {one.name: one for one in known.entries}
        self.card = replace(card, entries=tuple(_resumed(entry_of(one), before.get(one.name)) for one in self.parts))

    def run(self, begin: Begin, effort: Effort | None = None) -> ScoreCard:
        """Run each benchmark and write the card after it; what is done already is scored again, not asked or driven.

        A budget is one for all. A benchmark of which nothing can be driven does not stop the others; an endpoint that
        gives up does. Interrupting keeps everything finished.

        Args:
            begin: See Begin.
            effort: How hard to work.

        Raises:
            DataError: The card cannot be written.
        """
        work = effort or Effort()
        halted, spent = "", Bill()
        self.card.write(self.folder)
        for planned in self.parts:
            if planned.benchmark is None:
                continue
            entry = next(one for one in self.card.entries if one.name == planned.name)
            if halted and planned.benchmark.asks:
                entry = replace(entry, why=halted)
            else:
                entry, halted = self._run_one(planned, entry, begin, work, spent)
            self.card = self.card.with_entry(entry)
            self.card.write(self.folder)
        return self.card

    def _run_one(
        self, planned: PlannedPart, entry: CardEntry, begin: Begin, effort: Effort, spent: Bill
    ) -> tuple[CardEntry, str]:
        """(its entry, why nothing more is to be asked); `spent` is added to."""
        bench: Any = planned.benchmark
        assert bench is not None and planned.part is not None, planned.name
        wall_s, cpu_s = time.monotonic(), _cpu_s()

        def timed(found: CardEntry) -> CardEntry:
            return replace(
                found,
                wall_s=round(entry.wall_s + time.monotonic() - wall_s, 1),
                cpu_s=round(entry.cpu_s + _cpu_s() - cpu_s, 1),
            )

        run: BenchRun | None = None
        try:
            run = BenchRun(self.folder / planned.name, bench, self._who.made if bench.asks else None)
            with begin(planned, run) as watch:
                rows = run.run(watch, replace(effort, budget=_left(effort.budget, spent)))
        except ChauffeurError as error:
            return timed(replace(entry, state="failed", why=error.message, remedy=error.hint, figures=())), ""
        except KeyboardInterrupt:
            why = "It was interrupted; the same command goes on."
            self.card = self.card.with_entry(timed(replace(entry, state="partial", why=why)))
            self.card.write(self.folder)
            raise
        for row in run.stages.plans.rows.values():
            spent.add(Bill.read(row))
        done, planned_items = len(run.items) - run.unasked, len(run.items)
        whole = done == planned_items
        halt = "" if run.halt is None else run.halt.why
        found = replace(
            entry,
            state="done" if whole else "partial",
            why="" if whole else halt or f"{run.unasked} of {planned_items} items have not been asked.",
            remedy="" if run.halt is None else run.halt.hint,
            figures=figures_of(planned.part.headlines, rows),
            items=done,
            planned=planned_items,
        )
        return timed(found), halt


def _other(known: ScoreCard, card: ScoreCard) -> str:
    """What a folder's card is of, where that is something else; empty where it is the same."""
    pairs = ((known.planner, card.planner), (known.model, card.model), (known.profile, card.profile))
    return ", ".join(then for then, now in pairs if then != now)


def _resumed(entry: CardEntry, before: CardEntry | None) -> CardEntry:
    """An entry as it stands: what the card has of the same run, or of one that is left out now."""
    if before is None:
        return entry
    same = entry.bench and (before.bench, dict(before.config)) == (entry.bench, dict(entry.config))
    return before if same or entry.why == LEFT_OUT else entry


def _left(budget: SpendingBudget, spent: Bill) -> SpendingBudget:
    usd, requests = budget.max_usd, budget.max_requests
    return SpendingBudget(
        None if usd is None else max(0.0, usd - spent.usd),
        None if requests is None else max(0, requests - spent.requests),
    )


def _cpu_s() -> float:
    """Processor time of this process and of its workers that have ended, s."""
    found = os.times()
    return found.user + found.system + found.children_user + found.children_system
