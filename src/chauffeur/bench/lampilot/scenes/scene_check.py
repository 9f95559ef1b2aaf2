"""Any DbLv1 folder looked over: scenes that cannot be driven as asked, and words that do not say their goal.

The same checks that a suite is made with. On LaMPilot's own data they find what is known of it: gaps that would need
two cars in one place, scenes fulfilled by doing nothing, words that name another change than the scene needs.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from chauffeur.bench.kernel.store import Row
from chauffeur.bench.lampilot.families import FAMILIES, family_of
from chauffeur.bench.lampilot.scenes.annotations import Annotation, annotated
from chauffeur.bench.lampilot.scenes.feasible import feasible, start_of
from chauffeur.bench.lampilot.scenes.kinds import PAPER_FAMILIES, PAPER_ITEMS, PAPER_ROADS, PAPER_WORDS
from chauffeur.bench.lampilot.scenes.unambiguous import fault_of_goal, words_of
from chauffeur.bench.lampilot.scenes.wording_choice import form_of, normal
from chauffeur.bench.sets import Progress, spread
from chauffeur.concept import DataError, Scenario
from chauffeur.worlds.highway import HighwayWorld
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset

_SPLITS = ("train", "val", "test")
MOST_SAID = 2
"""Repetitions of a sentence allowed in a folder whose items have words of their own."""
_NO_READING = ("SequenceEval", "ChangeEval", "RefuseEval")
"""Goals whose words are not read back: several things, hints, and wishes to refuse."""


@dataclass(frozen=True, slots=True)
class Fault:
    """Something wrong with a scene or with an item's words.

    Attributes:
        what: `scene`, `words` or `repeated`.
        where: Id of the sample or item.
        why: In a few words.
        text: The instruction, for words.
    """

    what: str
    where: str
    why: str
    text: str = ""


def folders_of(path: Path) -> dict[str, Path]:
    """DbLv1 folders at a path by name: itself, or the splits and extras of a suite.

    Raises:
        DataError: There is none.
    """
    if (path / "config_list.txt").is_file():
        return {path.name: path}
    found = {name: path / name for name in _SPLITS if (path / name).is_dir()}
    extras = path / "extras"
    if extras.is_dir():
        found |= {f"extras/{folder.name}": folder for folder in sorted(extras.iterdir()) if folder.is_dir()}
    if not found:
        if (path / "plan.json").is_file():
            raise DataError(
                f"The suite in {path} is not finished.",
                hint="Run its `chauffeur bench scenes generate` again: it goes on.",
            )
        if path.is_dir() and any(path.glob("*.json")):
            return {path.name: path}
        raise DataError(
            f"{path} holds neither a DbLv1 folder (config_list.txt) nor a suite of them (train, val, test).",
            hint="Make one with: chauffeur bench scenes generate --out DIR",
        )
    return found


def check(path: Path, workers: int, progress: Progress) -> tuple[int, list[Fault]]:
    """Check every scene and every instruction at a path; returns the number of items and what is wrong.

    Raises:
        DataError: There is no readable data at the path.
    """
    held = [annotated(load_dataset(folder)) for folder in folders_of(path).values()]
    scenes = {
        sample.id: sample
        for dataset, notes in held
        for task in dataset.tasks
        for sample in task.samples
        if (note := notes.get(f"{sample.id}_c0")) is None or note.right == "drive"
    }
    faults, changes = _scenes(scenes, workers, progress)
    for dataset, notes in held:
        faults += _words(dataset, notes, changes)
    return sum(len(dataset.items()) for dataset, _ in held), faults


def _words(dataset: Dataset, notes: Mapping[str, Annotation], changes: Mapping[str, int]) -> list[Fault]:
    faults: list[Fault] = []
    readings: dict[tuple[str, str, int], str] = {}
    for item in dataset.items():
        if item.scenario.goal.get("type") in _NO_READING or ((note := notes.get(item.id)) and note.directness):
            continue
        change = changes.get(item.scenario.id, 0)
        key = item.command, str(item.scenario.goal), change
        if key not in readings:
            readings[key] = fault_of_goal(item.command, item.scenario.goal, change)
        if readings[key]:
            faults.append(Fault("words", item.id, readings[key], item.command))
    # LaMPilot says each sentence of a task over all its samples; one item a scene should have words of its own.
    if all(len(task.commands) == len(task.samples) == 1 for task in dataset.tasks):
        said = Counter(normal(item.command) for item in dataset.items())
        faults += [
            Fault("repeated", item.id, f"said {said[normal(item.command)]} times", item.command)
            for item in dataset.items()
            if said[normal(item.command)] > MOST_SAID
        ]
    return faults


def _scenes(scenes: Mapping[str, Scenario], workers: int, progress: Progress) -> tuple[list[Fault], Mapping[str, int]]:
    """Faults of scenes, in their order, and the change (+1, -1) each asks for where it names a number."""
    rows: dict[str, Row] = {}
    progress(0, len(scenes))

    def take(row: Row) -> None:
        rows[row["scene"]] = row
        progress(len(rows), len(scenes))

    spread(_look, list(scenes.values()), workers, take)
    faults = [Fault("scene", name, rows[name]["why"]) for name in scenes if rows[name]["why"]]
    return faults, {name: row["change"] for name, row in rows.items()}


def _look(scenario: Scenario) -> Row:
    """A worker's part: whether a scene is feasible, and what change its number means there."""
    start = start_of(HighwayWorld(), scenario)
    change = 0.0
    if not isinstance(start, str):
        goal = scenario.goal
        if "speed" in goal:
            change = float(goal["speed"]) - start.ego.speed_mps
        elif "distance" in goal and start.front is not None:
            change = float(goal["distance"]) - start.front.distance_m
    return {"scene": scenario.id, "why": feasible(scenario).why, "change": (change > 0) - (change < 0)}


def counts(faults: Sequence[Fault]) -> list[tuple[str, str, int]]:
    """(what, why, how often), the most frequent first."""
    held: Counter[tuple[str, str]] = Counter((fault.what, fault.why) for fault in faults)
    return [(what, why, times) for (what, why), times in held.most_common()]


@dataclass(frozen=True, slots=True)
class SceneStatistics:
    """Counts of Tab. III, and how much sentences repeat.

    Attributes:
        items: Number of items.
        scenes: Number of different samples.
        families: Items per family; `other` for what is not LaMPilot's.
        roads: Items per road, `highway` and `intersection`.
        words: Least, mean and greatest instruction length.
        sentences: Number of different instructions.
        forms: Number of different instructions when numbers are masked.
        most_repeated: How often the most repeated of these forms comes.
    """

    items: int
    scenes: int
    families: dict[str, int]
    roads: dict[str, int]
    words: tuple[int, float, int]
    sentences: int
    forms: int
    most_repeated: int


def statistics_of(datasets: Sequence[Dataset]) -> SceneStatistics:
    """Statistics over data sets together (the splits of a suite)."""
    items = [item for dataset in datasets for item in dataset.items()]
    families = Counter(family_of(item.task) for item in items)
    roads = Counter(
        "intersection" if item.scenario.config.get("type") == "dt-intersection-v0" else "highway" for item in items
    )
    lengths = [words_of(item.command) for item in items]
    forms = Counter(form_of(item.command) for item in items)
    return SceneStatistics(
        items=len(items),
        scenes=len({item.scenario.id for item in items}),
        families={family: families[family] for family in (*FAMILIES, "other") if families[family]},
        roads=dict(sorted(roads.items())),
        words=(min(lengths, default=0), sum(lengths) / max(1, len(lengths)), max(lengths, default=0)),
        sentences=len({normal(item.command) for item in items}),
        forms=len(forms),
        most_repeated=max(forms.values(), default=0),
    )


def table(ours: SceneStatistics) -> list[tuple[str, str, str]]:
    """Rows of Tab. III: name, here, paper."""

    def share(count: int, total: int) -> str:
        return f"{count:,} ({count / total:.1%})" if total else "0"

    rows = [("Total scenarios", share(ours.items, ours.items), share(PAPER_ITEMS, PAPER_ITEMS))]
    rows += [
        (family.capitalize(), share(ours.families.get(family, 0), ours.items), share(count, PAPER_ITEMS))
        for family, count in PAPER_FAMILIES.items()
    ]
    if ours.families.get("other"):
        rows.append(("Other", share(ours.families["other"], ours.items), "-"))
    rows += [
        (road.capitalize(), share(ours.roads.get(road, 0), ours.items), share(count, PAPER_ITEMS))
        for road, count in PAPER_ROADS.items()
    ]
    names = ("Minimum", "Average", "Maximum")
    rows += [
        (f"{name} instruction length, words", f"{value:.1f}" if name == "Average" else f"{value:.0f}", f"{paper:g}")
        for name, value, paper in zip(names, ours.words, PAPER_WORDS, strict=True)
    ]
    rows += [
        ("Different scenes", f"{ours.scenes:,}", "490"),
        ("Different instructions", f"{ours.sentences:,}", "-"),
        ("Different instructions, numbers masked", f"{ours.forms:,}", "-"),
        ("Most repeated of these", f"{ours.most_repeated:,}", "-"),
    ]
    return rows
