"""LaMPilot's DbLv1 scenario files, read unchanged.

A task file holds `commands` (paraphrases of one instruction) and `samples` (road, goal, seed). An item of the benchmark
is one sample with one command; its id is `<task>_s<sample>_c<command>`.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chauffeur.concept import DataError, Scenario
from chauffeur.concept.data import parse_json


@dataclass(frozen=True, slots=True)
class Task:
    """One task file: a name, paraphrases, and the samples as scenarios (`<name>_s<i>`)."""

    name: str
    commands: tuple[str, ...]
    samples: tuple[Scenario, ...]


@dataclass(frozen=True, slots=True)
class Item:
    """One benchmark item: a scenario and the words to follow in it."""

    id: str
    task: str
    command: str
    scenario: Scenario


@dataclass(frozen=True, slots=True)
class Dataset:
    """A DbLv1 folder. `sha256` is over all task files, names included."""

    path: Path
    tasks: tuple[Task, ...]
    sha256: str

    def items(self) -> tuple[Item, ...]:
        """Every item: tasks in list order, samples outer, commands inner."""
        return tuple(
            Item(f"{sample.id}_c{c}", task.name, command, sample)
            for task in self.tasks
            for sample in task.samples
            for c, command in enumerate(task.commands)
        )

    def scenario(self, scenario_id: str) -> Scenario | None:
        """The sample with this id, or None. An item id works too."""
        wanted = scenario_id.rsplit("_c", 1)[0]
        return next((s for task in self.tasks for s in task.samples if s.id == wanted), None)


def load_dataset(folder: Path) -> Dataset:
    """Read a DbLv1 folder (`config_list.txt` gives the order; without it, all JSON files by name).

    Raises:
        DataError: The folder or a file is missing, unreadable or not of this format; names file and place.
    """
    if not folder.is_dir():
        raise DataError(
            f"No such data folder: {folder}.", hint="Give the folder that holds DbLv1's task files, e.g. --data DbLv1."
        )
    index = folder / "config_list.txt"
    names = (
        index.read_text(encoding="utf-8").split() if index.is_file() else sorted(p.name for p in folder.glob("*.json"))
    )
    if not names:
        raise DataError(f"{folder} holds no task files (*.json).", hint="Is this the right folder?")
    digest = hashlib.sha256()
    tasks: list[Task] = []
    for name in names:
        content = _read(folder / name)
        digest.update(name.encode() + b"\0" + content + b"\0")
        tasks.append(parse_task(name.removesuffix(".json"), content, folder / name))
    return Dataset(folder, tuple(tasks), digest.hexdigest())


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise DataError(f"Cannot read task file {path}: {error.strerror}.", hint="Restore it and run again.") from error


def parse_task(name: str, content: bytes, path: Path) -> Task:
    """One task file's content. Raises DataError naming the file and what is wrong in it."""
    try:
        raw: Any = parse_json(content)
        commands = tuple(str(c) for c in raw["commands"])
        samples = tuple(_sample(name, i, sample) for i, sample in enumerate(raw["samples"]))
    except (ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"{path} is not a DbLv1 task file: {type(error).__name__} {error}.",
            hint="It needs `commands` (texts) and `samples` (objects with `env`, `eval` and `seed`).",
        ) from error
    return Task(name, commands, samples)


def _sample(task: str, i: int, sample: dict[str, Any]) -> Scenario:
    return Scenario(
        id=f"{task}_s{i}",
        world="highway",
        config=dict(sample["env"]),
        seed=int(sample["seed"]),
        goal=dict(sample["eval"]),
        title=f"LaMPilot DbLv1 {task}, sample {i}",
    )
