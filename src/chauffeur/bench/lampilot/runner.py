"""A run of LaMPilot-Bench: the kernel's, with the labels and the ruler that its rows carry."""

from __future__ import annotations

from pathlib import Path

from chauffeur.bench.kernel.pipeline import Watch
from chauffeur.bench.kernel.run import BenchRun, Effort
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.benchmark import LampilotBenchmark
from chauffeur.bench.lampilot.frozen import Frozen, RunConfig
from chauffeur.bench.lampilot.rehearsal import label
from chauffeur.bench.lampilot.requests import PlainRequests, Requests
from chauffeur.bench.lampilot.results import about_rows, publish_results, results
from chauffeur.bench.lampilot.rollout import BASELINES
from chauffeur.bench.lampilot.scenes import annotated
from chauffeur.concept import ConfigError
from chauffeur.driving.judge.metrics import ruler_named
from chauffeur.planners.base import Planner
from chauffeur.planners.prompts import Setting
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset

EXPERT_LABEL = "scripted expert: told the goal, reads no words"
"""Caveat to show with every row of the expert."""
SHIELD_LABEL = f"{SHIELD_VERSION} has the last word"


class LampilotRun(BenchRun):
    """One run, or one shard of it, in one folder."""

    def __init__(
        self,
        folder: Path,
        dataset: Dataset,
        config: RunConfig,
        planner: Planner | None,
        *,
        shard: Shard = WHOLE,
        requests: Requests | None = None,
    ) -> None:
        """Open or continue a run.

        Args:
            folder: Where stages are stored.
            dataset: DbLv1 data.
            config: What decides the run.
            planner: Who plans; None for the baselines. A planner's `labels`, where it has them, stand in every row.
            shard: Which part of the run.
            requests: What the planner is asked; None for the plain wish under `config.setting`.

        Raises:
            ConfigError: The folder holds a run with another configuration.
            DataError: Its plan is damaged.
            StorageError: The folder cannot be used.
        """
        if planner is None and config.planner not in BASELINES:
            raise ConfigError(f"{config.planner!r} is no baseline.", hint=f"Baselines: {', '.join(BASELINES)}.")
        self.config = config
        model, labels = "" if planner is None else planner.model, _labels(config, planner, requests)
        frozen = Frozen.of(dataset, config, model, labels, shard)
        self._bench = LampilotBenchmark(frozen, requests or _plain(config))
        super().__init__(folder, self._bench, planner, manifest=frozen)

    def run(self, watch: Watch, effort: Effort | None = None, *, ruler: str = "origin") -> list[Row]:
        """See BenchRun.

        Args:
            watch: Is told where the run stands.
            effort: How hard to work.
            ruler: Short name or id of the ruler to score by.

        Raises:
            ConfigError: The ruler is unknown; or as BenchRun.
        """
        self._bench.ruler = ruler_named(ruler).id
        return super().run(watch, effort)

    @property
    def about(self) -> Row:
        return about_rows(self._bench.frozen, self._bench.ruler)

    def score(self) -> list[Row]:
        """One row per planned item, from what is stored; written to `results.jsonl`, the table to `table.md`.

        Raises:
            DataError: They cannot be written.
        """
        rows = results(self.stages, self._bench.ruler)
        publish_results(self.folder, self.stages, rows)
        return rows


def _plain(config: RunConfig) -> Requests:
    """Requests of a setting that needs nothing but words and situation. Raises ConfigError for another."""
    if config.setting == "human-feedback":
        raise ConfigError("The setting human-feedback needs the requests of a policy repository.")
    return PlainRequests.of(config.setting, config.limits)


def _labels(config: RunConfig, planner: Planner | None, requests: Requests | None) -> tuple[str, ...]:
    labels: tuple[str, ...] = (*getattr(planner, "labels", ()), *getattr(requests, "labels", ()))
    if config.planner == "expert":
        labels = (*labels, EXPERT_LABEL)
    if config.rehearse:
        if config.planner in ("idm", "mobil"):
            raise ConfigError(f"{config.planner} has no program to rehearse.", hint="Leave --rehearse out.")
        labels = (*labels, label(config.rehearse))
    return (*labels, SHIELD_LABEL) if config.shield else labels


def lampilot(
    data: str, planner: str = "onboard", setting: Setting = "few-shot", items: int = 0, seed: int = 42
) -> LampilotBenchmark:
    """The benchmark over a folder of DbLv1 task files, as its entry point gives it; arguments as in RunConfig.

    Raises:
        DataError: There are no such files, or they are damaged.
    """
    dataset, _ = annotated(load_dataset(Path(data)))
    config = RunConfig(planner, setting, dataset.sha256, items, seed)
    return LampilotBenchmark(Frozen.of(dataset, config, ""), _plain(config))
