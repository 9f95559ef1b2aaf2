"""What a run is about, frozen in its folder before anything is asked or driven: `plan.json`.

It holds the whole matrix, scenes and words included, so that a run folder can be scored anew, merged and looked at
without the data set it was drawn from.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np

from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.kernel.store import freeze
from chauffeur.concept import LAMPILOT_LIMITS, ConfigError, DataError, Limits, Scenario
from chauffeur.drive.session import scenario_hash
from chauffeur.planners.prompts import Setting
from chauffeur.worlds.highway.dblv1 import Dataset, Item

BENCH_VERSION = "lampilot-bench-v2"


@dataclass(frozen=True, slots=True)
class RunConfig:
    """What decides a run; stored with it, and compared when it is continued.

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
class Frozen:
    """A run's plan.

    Attributes:
        config: What decided the run, as JSON.
        model: The planner's model; empty for baselines.
        labels: What must be said wherever a row is shown.
        shard: Which part of the run this is.
        items: This part's items, in the run's order.
        places: Place of each in the whole run, from 0.
        planned: Items of the whole run.
    """

    config: dict[str, Any]
    model: str
    labels: tuple[str, ...]
    shard: Shard
    items: tuple[Item, ...]
    places: tuple[int, ...]
    planned: int

    @classmethod
    def make(
        cls, dataset: Dataset, config: RunConfig, model: str, labels: Sequence[str] = (), shard: Shard = WHOLE
    ) -> Self:
        """Plan of a run that is to begin."""
        drawn = choose_items(dataset, config.items, config.seed)
        places = tuple(place for place, item in enumerate(drawn) if shard.owns(item.id))
        stored: dict[str, Any] = json.loads(json.dumps(asdict(config)))
        if not config.shield:
            del stored["shield"]  # as it was before there was one: such runs can be continued
        return cls(stored, model, tuple(labels), shard, tuple(drawn[i] for i in places), places, len(drawn))

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
    def about(self) -> dict[str, Any]:
        """What parts of one run must have in common."""
        return {
            "bench": BENCH_VERSION,
            "config": self.config,
            "model": self.model,
            "labels": list(self.labels),
            "planned": self.planned,
        }

    def content(self) -> bytes:
        """The plan as the file's content."""
        fields = {
            **self.about,
            "shard": str(self.shard),
            "items": [item.id for item in self.items],
            "places": list(self.places),
            "facts": [[item.task, item.scenario.id, item.command] for item in self.items],
            "samples": {name: asdict(scenario) for name, scenario in self.samples.items()},
        }
        # One line a field: short enough to read with `head -c`, and not a line for every number.
        lines = (f"{json.dumps(name)}: {json.dumps(value, ensure_ascii=False)}" for name, value in fields.items())
        return ("{\n" + ",\n".join(lines) + "\n}\n").encode("utf-8", "surrogatepass")

    def freeze(self, folder: Path) -> None:
        """Store the plan, or find that it is the one stored.

        Raises:
            ConfigError: The folder holds another run.
            DataError: The stored plan is damaged or cannot be written.
        """
        path, content = folder / "plan.json", self.content()

        def same(stored: bytes) -> bool:
            return stored == content or _parsed(path, stored) == json.loads(content)

        freeze(path, content, "run's plan", same)

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
                raise DataError(
                    f"{folder} holds a run of {raw['bench']!r}; this version reads {BENCH_VERSION!r}.",
                    hint="Run the benchmark again in a new folder.",
                )
            samples = {name: Scenario(**fields) for name, fields in raw["samples"].items()}
            number, count = raw["shard"].split("/")
            return cls(
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
        return _parsed(path, path.read_bytes())
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror or error}.") from error


def _parsed(path: Path, raw: bytes) -> dict[str, Any]:
    try:
        value = json.loads(raw)
    except ValueError as error:
        raise DataError(
            f"{path} is damaged ({error}).",
            hint="Delete it and run the same command: what was asked and driven is kept.",
        ) from error
    return value if isinstance(value, dict) else {}
