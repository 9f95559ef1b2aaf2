"""The study as a benchmark of the kernel: every passenger and task is an item, every trip a row."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import (
    Any,
    Final,
    NotRequired,  # pydantic reads the standard library's from Python 3.12 on only
)

from typing_extensions import TypedDict

from chauffeur.bench.kernel.benchmark import ItemOutcome, Unasked
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.personalization.figures import CARD, JUDGE, TABLES, headline, latencies
from chauffeur.bench.personalization.population import draw_passengers
from chauffeur.bench.personalization.sayings import Half, sayings_sha256
from chauffeur.bench.personalization.scenes import TASKS, scenes_of
from chauffeur.bench.personalization.study import BENCH_VERSION, StudyConfig, StudyJob, versions
from chauffeur.concept import ConfigError
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.registry import make_planner
from chauffeur.version import __version__

SIMULATED: Final = "simulated passengers in simulated drives; nobody was asked and nobody was driven"
"""Stands beside every figure."""


class TripRow(TypedDict):
    """A trip; the fields of its plan are missing where the passenger chose."""

    passenger: str
    arm: str
    task: str
    ground: str
    aim: str
    level: str
    scene: str
    trip: int
    phase: str
    place: int
    wish: str
    wanted_mps: float
    outcome: str
    seconds: float
    takeover: bool
    topic: str
    at_s: float | None
    force: str
    deviation: float
    statistics: dict[str, float | None]
    planner: str
    model: str
    half: str
    note: str
    declined: NotRequired[bool]
    refusal: NotRequired[str]
    intent: NotRequired[str]
    policy: NotRequired[dict[str, Any] | None]
    recalled: NotRequired[int]
    feedback: NotRequired[str]
    latency_s: NotRequired[float]


class StudyBenchmark(Unasked):
    """Takeover rates of simulated passengers. The planner is asked in the workers, where its memory is."""

    id = BENCH_VERSION
    row = TripRow
    tables = TABLES
    judge = JUDGE
    card = CARD

    def __init__(self, options: StudyConfig, planner_options: Mapping[str, Any] | None = None) -> None:
        """Make it.

        Args:
            options: What decides a run.
            planner_options: Of the planner, e.g. its endpoint.

        Raises:
            ConfigError: The options make no sense, or there is no such planner.
        """
        if options.trips < 0:
            raise ConfigError(f"{options.trips} trips are less than none.", hint="Learn from 0 trips or more.")
        self.options = options
        self._planner_options = tuple((planner_options or {}).items())
        self.model = make_planner(options.planner, **dict(self._planner_options)).model

    @property
    def config(self) -> Mapping[str, Any]:
        hashes = [scenario_hash(scene) for task in TASKS for scene in scenes_of(task)]
        return {
            **asdict(self.options),
            **versions(),
            "model": self.model,
            "sayings_sha256": sayings_sha256(),
            "scenes_sha256": hashlib.sha256("\n".join(hashes).encode()).hexdigest(),
            "simulated": SIMULATED,
        }

    def items(self) -> Sequence[StudyJob]:
        """See Benchmark: person by person, so that what is done at any time is a whole study."""
        return [
            StudyJob(f"{who.id}.{task}", number, task, self.options, self._planner_options)
            for number, who in enumerate(draw_passengers(self.options.passengers, self.options.seed))
            for task in TASKS
        ]

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes."""
        del folder, results
        p50, p95 = latencies(rows, "with")
        return (
            headline(rows),
            f"Chauffeur {__version__}; planner {self.options.planner}, model {self.model}; {self.id}; "
            f"{self.options.half} wordings; seed {self.options.seed}; from words to policy {1000 * p50:.0f} ms "
            f"(median), {1000 * p95:.0f} ms (95 %). {self.judge}",
        )

    def job(self, item: StudyJob, answer: Row | None) -> StudyJob:
        del answer
        return item

    def rows(self, outcome: ItemOutcome[StudyJob]) -> Sequence[Row]:
        found = outcome.result
        if found is None or found["infra_failed"]:
            return ()
        common = {
            "planner": self.options.planner,
            "model": self.model,
            "half": self.options.half,
            "note": SIMULATED,
        }
        return [{"passenger": found["passenger"], **trip, **common} for trip in found["trips"]]


def personalization(
    passengers: int = 100,
    seed: int = 1,
    planner: str = "talk2drive",
    half: Half = "test",
    trips: int = 5,
    base_url: str | None = None,
) -> StudyBenchmark:
    """Make Talk2Drive's evaluation with simulated passengers.

    Args:
        passengers: How many simulated passengers.
        seed: Seed of passengers, moods, words and order.
        planner: Who plans without and with memory, e.g. `talk2drive` or `talk2drive/openai/MODEL`.
        half: Wordings: `test`, or `tuning` to improve a planner.
        trips: Trips the memory learns from, for each task.
        base_url: OpenAI-compatible endpoint of the planner.
    """
    config = StudyConfig(passengers, seed, planner, half, trips)
    return StudyBenchmark(config, None if base_url is None else {"base_url": base_url})
