"""Annotations that DbLv1 has no place for, item by item, in a side file that LaMPilot itself does not open.

`annotations.jsonl` stands beside `config_list.txt`; each line is keyed by the item's id. Where it gives a `goal`, that
is the condition the item is judged by; the `eval` mapping in the task file is LaMPilot's nearest.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, get_args

from chauffeur.bench.lampilot.scenes.wishes import Right
from chauffeur.concept import DataError
from chauffeur.worlds.highway.dblv1 import Dataset

FILE = "annotations.jsonl"
_RIGHTS = frozenset(get_args(Right))


@dataclass(frozen=True, slots=True)
class Annotation:
    """Facts of one item.

    Attributes:
        item: Its id, `<task>_s0_c0`.
        kind: Kind of scene, e.g. `dec_abs_dis`, `hint2_faster`, `refuse_no_lane`.
        split: `train`, `val`, `test` or `extras`.
        part: Part of the extras: `directness`, `steps`, `refusals`, `units`; empty in the main suite.
        right: What a good planner does: `drive`, `refuse` or `ask`.
        goal: Condition it is judged by.
        why: Why it is to be refused, or asked back about.
        template: Grammar template of the words.
        phrasing: `seen` when training items use the same template, `unseen` when only the test split does; empty for
            extras.
        directness: 1, 2 or 3 (paper Tab. VII); 0 where it was not varied.
        unit: Unit named in the words; empty for none.
        system: `metric`, `imperial` or `informal` (car lengths); empty for none.
        steps: What is to happen, in order.
        road: `highway` or `intersection`.
        expert_s: Simulated seconds the scripted expert took; 0 where there is nothing to drive.
    """

    item: str
    kind: str
    split: str
    part: str
    right: Right
    goal: dict[str, Any]
    why: str
    template: str
    phrasing: str
    directness: int
    unit: str
    system: str
    steps: tuple[str, ...]
    road: str
    expert_s: float

    def line(self) -> str:
        """Its line in the file."""
        return json.dumps(asdict(self), ensure_ascii=False, separators=(",", ":"))


def load_annotations(folder: Path) -> Mapping[str, Annotation]:
    """Annotations of a DbLv1 folder by item id; empty where there is no such file.

    Raises:
        DataError: A line is not an annotation; names the file and the line.
    """
    path = folder / FILE
    if not path.exists():
        return {}
    out: dict[str, Annotation] = {}
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise DataError(f"Cannot read {path}: {error.strerror}.") from error
    for number, line in enumerate(lines, start=1):
        try:
            raw: dict[str, Any] = json.loads(line)
            raw["steps"] = tuple(raw["steps"])
            one = Annotation(**raw)
        except (ValueError, TypeError, KeyError) as error:
            raise DataError(
                f"{path}, line {number}, is not an annotation: {error}.",
                hint="Generate the suite again with the same seed, or delete the file to judge by LaMPilot's goals.",
            ) from error
        if one.right not in _RIGHTS:
            raise DataError(f"{path}, line {number}: the right answer is one of {sorted(_RIGHTS)}, not {one.right!r}.")
        out[one.item] = one
    return out


def annotated(dataset: Dataset) -> tuple[Dataset, Mapping[str, Annotation]]:
    """A data set with the goals its annotations give, and the annotations; unchanged where there are none.

    The hash of the data set then covers both. Goals belong to samples, so every command of a sample must have the same.

    Raises:
        DataError: As load_annotations, or two items of one sample have different goals.
    """
    held = load_annotations(dataset.path)
    if not held:
        return dataset, held
    goals: dict[str, dict[str, Any]] = {}
    for one in held.values():
        sample = one.item.rsplit("_c", 1)[0]
        if goals.setdefault(sample, one.goal) != one.goal:
            raise DataError(f"{dataset.path / FILE}: the items of sample {sample} have different goals.")
    tasks = tuple(
        replace(task, samples=tuple(replace(s, goal=goals.get(s.id, s.goal)) for s in task.samples))
        for task in dataset.tasks
    )
    both = hashlib.sha256(f"{dataset.sha256} {hashlib.sha256((dataset.path / FILE).read_bytes()).hexdigest()}".encode())
    return replace(dataset, tasks=tasks, sha256=both.hexdigest()), held
