"""A run's plan, frozen in its folder before anything is asked or driven: `plan.json`.

It holds the whole matrix, scenes and words included, so that a run folder can be scored anew, merged and looked at
without the data set it was drawn from.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.stages import Manifest, parsed
from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, DataError, Limits, Scenario
from chauffeur.driving.trips import scenario_hash
from chauffeur.planners.prompts import Setting
from chauffeur.worlds.highway.dblv1 import Dataset, Item

BENCH_VERSION = "lampilot-bench-v2"


@dataclass(frozen=True, slots=True)
class RunConfig:
    """Options of a run; stored with it, and compared when it is continued.

    Attributes:
        planner: Planner spec, or a baseline's name.
        setting: `few-shot` or `zero-shot`, for planners that read S.
        data_sha256: Hash of the data set.
        items: Number of items drawn, 0 for all.
        seed: Seed of the draw.
        limits: Bounds for the checks.
        rehearse: Variants tried before one is driven; 0 for none.
        shield: Whether the run-time shield has the last word; LaMPilot has none.
        asked: What else decides the requests: the frozen policy repository of the human-feedback setting.
    """

    planner: str
    setting: Setting | Literal["human-feedback"]
    data_sha256: str
    items: int
    seed: int
    limits: Limits = LAMPILOT_LIMITS
    rehearse: int = 0
    asked: str = ""
    shield: bool = False


def choose_items(dataset: Dataset, count: int, seed: int) -> Sequence[Item]:
    """All items in order, or the first `count` of a permutation (NumPy's legacy generator, as LaMPilot draws them)."""
    items = dataset.items()
    if count <= 0 or count >= len(items):
        return items
    order = np.random.RandomState(seed).permutation(len(items))
    return [items[i] for i in order[:count]]


@dataclass(frozen=True)
class Frozen(Manifest[Item]):
    """A run's plan: the manifest, with the words and scenes of all its items."""

    @classmethod
    def of(
        cls, dataset: Dataset, config: RunConfig, model: str, labels: Sequence[str] = (), shard: Shard = WHOLE
    ) -> Self:
        """Plan of a run that is to begin."""
        stored = asdict(config)
        if not config.shield:
            del stored["shield"]  # as it was before there was one: such runs can be continued
        drawn = choose_items(dataset, config.items, config.seed)
        return cls.make(BENCH_VERSION, stored, drawn, model=model, labels=labels, shard=shard)

    @cached_property
    def samples(self) -> dict[str, Scenario]:
        """Scenes by id, in the order in which items first need them."""
        return {item.scenario.id: item.scenario for item in self.items}

    @cached_property
    def hashes(self) -> dict[str, str]:
        """Content hash of every scene, by its id."""
        return {name: scenario_hash(scenario) for name, scenario in self.samples.items()}

    @property
    def limits(self) -> Limits:
        """Bounds for the checks."""
        return Limits(**self.config["limits"])

    @property
    def more(self) -> dict[str, Any]:
        return {
            "facts": [[item.task, item.scenario.id, item.command] for item in self.items],
            "samples": {name: asdict(scenario) for name, scenario in self.samples.items()},
        }

    @classmethod
    def read(cls, folder: Path) -> Self:
        """The plan of a run folder.

        Raises:
            DataError: There is none, or it is damaged or of another version.
        """
        path = folder / "plan.json"
        raw = _read_json(path)
        try:
            if raw["bench"] != BENCH_VERSION:
                ours = str(raw["bench"]).startswith("lampilot-bench")
                raise DataError(
                    f"{folder} holds a run of {raw['bench']!r}; this version reads {BENCH_VERSION!r}.",
                    hint="Run the benchmark again in a new folder."
                    if ours
                    else "Its own command without --shard, with the same --out, takes over what its shards have done.",
                )
            samples = {name: Scenario(**fields) for name, fields in raw["samples"].items()}
            number, count = raw["shard"].split("/")
            return cls(
                bench=raw["bench"],
                config=raw["config"],
                model=str(raw["model"]),
                labels=tuple(raw["labels"]),
                shard=Shard(int(number), int(count)),
                items=tuple(
                    Item(name, task, command, samples[sample])
                    for name, (task, sample, command) in zip(raw["items"], raw["facts"], strict=True)
                ),
                places=tuple(raw["places"]),
                planned=int(raw["planned"]),
            )
        except (KeyError, TypeError, ValueError, AttributeError, ConfigError) as error:
            raise DataError(
                f"{path} is damaged ({type(error).__name__}: {error}).",
                hint="Delete it and run the same command: what was asked and driven is kept.",
            ) from error


def _read_json(path: Path) -> dict[str, Any]:
    try:
        return parsed(path, path.read_bytes())
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.") from error
