"""A whole suite: made item by item on all cores, worded as one, written as DbLv1 folders with a manifest.

What decides a suite is its plan (numbers, seed, generator version); it is stored first, and compared when a suite is
continued. Each finished item is a row on disk, so Ctrl-C and a crash lose nothing, and the same command goes on.
"""

from __future__ import annotations

import hashlib
import json
from collections import Counter
from collections.abc import Mapping, Sequence, Set
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.store import Row, RowStore
from chauffeur.bench.lampilot.scenes.annotations import FILE
from chauffeur.bench.lampilot.scenes.item_maker import Job, make_item
from chauffeur.bench.lampilot.scenes.kinds import KINDS, MAIN, plan_suite
from chauffeur.bench.lampilot.scenes.scene_check import statistics_of
from chauffeur.bench.lampilot.scenes.scripted import SOLVERS
from chauffeur.bench.lampilot.scenes.wording_choice import choose_wordings, normal
from chauffeur.bench.lampilot.scenes.writer import SceneItem, folder_of, items_of, write_folder
from chauffeur.bench.sets import Progress, claim, spread
from chauffeur.concept import ConfigError
from chauffeur.driving.files import publish
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset

_SPLITS = ("train", "val", "test")


def contents_of(
    rows: Sequence[Mapping[str, Any]], items: Sequence[SceneItem], datasets: Mapping[str, Dataset]
) -> dict[str, Any]:
    """Part of the manifest that is counted in the suite as it was written.

    Args:
        rows: Made items, in the order of the plan.
        items: The same as they were written.
        datasets: Folders as they read back, by name within the suite.
    """
    main = [datasets[name] for name in _SPLITS if name in datasets]
    return {
        "items": {name: len(dataset.items()) for name, dataset in datasets.items()},
        "statistics": asdict(statistics_of(main)),
        "phrasing": dict(sorted(Counter(item.note.phrasing or "extras" for item in items).items())),
        "right_answers": dict(sorted(Counter(item.note.right for item in items).items())),
        "units": dict(sorted(Counter(item.note.unit or "none" for item in items).items())),
        "scenes": _scenes(rows),
        "words": _words(rows),
        "sha256": {
            name: {
                "tasks": dataset.sha256,
                "annotations": hashlib.sha256((dataset.path / FILE).read_bytes()).hexdigest(),
            }
            for name, dataset in datasets.items()
        },
    }


def _scenes(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Draws and rejections: of the main suite, of the extras, and by kind."""
    names = {kind.name for kind in MAIN}
    main = [row for row in rows if row["kind"] in names]
    solvers = Counter(row["solved_by"] for row in main)
    kinds = dict.fromkeys(row["kind"] for row in rows)
    return {
        "main": {**_drawn(main), "solved_by": dict(solvers.most_common())},
        "by_kind": {kind: _drawn([row for row in rows if row["kind"] == kind]) for kind in kinds},
    }


def _drawn(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Numbers of scenes kept and drawn, and reasons for rejecting the others."""
    why = sum((Counter(row["rejected"]) for row in rows), Counter[str]())
    return {"kept": len(rows), "drawn": len(rows) + why.total(), "rejected": dict(why.most_common())}


def _words(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Wordings drawn and thrown away because they were read as something else, by family."""
    said: Counter[str] = Counter()
    misread: dict[str, Counter[str]] = {}
    for row in rows:
        family = KINDS[row["kind"]].family
        said[family] += row["said"]
        misread.setdefault(family, Counter()).update(row["misread"])
    return {
        family: {
            "drawn": said[family],
            "rejected": misread[family].total(),
            "rejected_share": round(misread[family].total() / max(1, said[family]), 4),
            "why": dict(misread[family].most_common()),
        }
        for family in said
    }


GENERATOR = "lampilot-scenes-v1"
"""Changes whenever the same seed could give other scenes or other words."""

PLAN, MANIFEST = "plan.json", "manifest.json"


@dataclass(frozen=True, slots=True)
class SuiteConfig:
    """Settings that decide a suite.

    Attributes:
        n: Items of the main suite.
        seed: Seed of everything.
        extras: Items beyond the original.
        avoid_sha256: Hash of a data set whose instructions must not come up, empty for none.
    """

    n: int
    seed: int
    extras: int
    avoid_sha256: str = ""


class Suite:
    """One suite in one folder."""

    def __init__(self, folder: Path, config: SuiteConfig, avoid: Dataset | None = None) -> None:
        """Begin or continue a suite.

        Args:
            folder: Where it is written.
            config: What decides it.
            avoid: Data set whose instructions must not come up, e.g. LaMPilot's own.

        Raises:
            ConfigError: The folder holds something else, or numbers are out of range.
            StorageError: The folder cannot be read.
        """
        if config.seed < 0:
            raise ConfigError(f"A seed is 0 or more, not {config.seed}.")
        self.folder = folder
        self.config = config
        self.slots = plan_suite(config.n, config.seed, config.extras)
        self._avoid: Set[str] = frozenset() if avoid is None else {normal(item.command) for item in avoid.items()}
        self._about: dict[str, Any] = {
            "generator": GENERATOR,
            "solvers": list(SOLVERS),
            "config": asdict(config),
            "versions": {name: version(name) for name in ("chauffeur", "numpy")},
            "engine": HighwayWorld.engine,
        }
        if not (folder / PLAN).exists() and folder.exists() and any(folder.iterdir()):
            raise ConfigError(f"{folder} is not empty and holds no suite.", hint="Choose another --out folder.")
        claim(folder, self._about, PLAN, indent=1)
        self._rows = RowStore(folder / "scenes.jsonl", "index")

    @property
    def made(self) -> int:
        """Items made so far."""
        return sum(str(slot.index) in self._rows.rows for slot in self.slots)

    def generate(self, workers: int, progress: Progress) -> Mapping[str, Any]:
        """Make what is not made yet and write the suite; returns its manifest. Interrupting keeps finished items.

        Raises:
            ScenarioError, InstructionError: An item cannot be made; a fault of the generator.
            StorageError, DataError: The disk refuses a file.
        """
        try:
            self._make(workers, progress)
        finally:
            self._rows.close()
        rows = [self._rows.rows[str(slot.index)] for slot in self.slots]
        return self._write(rows)

    def _make(self, workers: int, progress: Progress) -> None:
        jobs = [Job(self.config.seed, slot) for slot in self.slots if str(slot.index) not in self._rows.rows]
        done = len(self.slots) - len(jobs)
        progress(done, len(self.slots))
        # A spread order, so that the time left can be told from the time taken.
        jobs.sort(key=lambda job: hashlib.sha256(job.key.encode()).digest())

        def take(row: Row) -> None:
            nonlocal done
            self._rows.append(row)
            done += 1
            progress(done, len(self.slots))

        spread(make_item, jobs, workers, take)

    def _write(self, rows: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
        choices = choose_wordings(rows, self.config.seed, self._avoid)
        items = items_of(rows, choices)
        folders: dict[str, list[SceneItem]] = {}
        for item in items:
            folders.setdefault(folder_of(item), []).append(item)
        datasets: dict[str, Dataset] = {}
        for name in sorted(folders, key=lambda name: ([*_SPLITS, name].index(name), name)):
            write_folder(self.folder / name, folders[name])
            datasets[name] = load_dataset(self.folder / name)
        text = json.dumps(self._about | contents_of(rows, items, datasets), indent=1)
        publish(self.folder / MANIFEST, f"{text}\n".encode(), "manifest")
        manifest: Row = json.loads(text)
        return manifest
