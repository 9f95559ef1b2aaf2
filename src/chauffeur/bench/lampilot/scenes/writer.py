"""Suites as DbLv1 folders: one task file an item, read by LaMPilot and by Chauffeur alike.

LaMPilot pairs every command of a task file with every sample. An item here has a scene and words of its own, so each
has its own file. Names begin with LaMPilot's task names, by which families are told; they hold no dot, and no `_c`,
at which LaMPilot cuts ids. `config_list.txt` has no newline at its end, which LaMPilot would take for a file name.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chauffeur.bench.lampilot.scenes.annotations import FILE, Annotation
from chauffeur.bench.lampilot.scenes.wishes import UNITS
from chauffeur.bench.lampilot.scenes.wording_choice import SceneChoice
from chauffeur.driving.files import publish


@dataclass(frozen=True, slots=True)
class SceneItem:
    """An item ready to be written.

    Attributes:
        task: Name of its task file, without ending.
        content: What the task file holds.
        note: Its annotation.
    """

    task: str
    content: dict[str, Any]
    note: Annotation


def items_of(rows: Sequence[Mapping[str, Any]], choices: Sequence[SceneChoice]) -> list[SceneItem]:
    """Made rows and their words as items, in order."""
    width = max(4, len(str(len(rows) - 1)))
    return [
        _item(row, choice, f"{row['stem']}_{place:0{width}d}")
        for place, (row, choice) in enumerate(zip(rows, choices, strict=True))
    ]


def _item(row: Mapping[str, Any], choice: SceneChoice, task: str) -> SceneItem:
    assert "." not in task
    assert "_c" not in task
    units = [value["unit"] for _, value in row["slots"] if isinstance(value, dict)]
    unit = units[0] if units else ""
    goal = row["goal"]
    note = Annotation(
        item=f"{task}_s0_c0",
        kind=row["kind"],
        split=row["split"],
        part=row["part"],
        right=row["right"],
        goal=goal,
        why=row["why"],
        template=choice.template,
        phrasing="" if row["split"] == "extras" else "unseen" if row["held"] else "seen",
        directness=int(row["kind"][4]) if row["part"] == "directness" else 0,
        unit=unit,
        system=UNITS[unit].system if unit else "",
        steps=tuple(step["type"] for step in goal.get("steps", ())),
        road="intersection" if row["env"]["type"] == "dt-intersection-v0" else "highway",
        expert_s=round(row["expert_ticks"] / 10, 1),
    )
    sample = {"env": row["env"], "eval": row["origin"], "seed": row["seed"]}
    return SceneItem(task, {"commands": [choice.text], "samples": [sample]}, note)


def folder_of(item: SceneItem) -> str:
    """Folder of an item within its suite."""
    return f"extras/{item.note.part}" if item.note.split == "extras" else item.note.split


def write_folder(folder: Path, items: Sequence[SceneItem]) -> None:
    """Write items as a DbLv1 folder with annotations. Raises DataError if the disk refuses a file."""
    for item in items:
        text = json.dumps(item.content, indent=1, ensure_ascii=False)
        publish(folder / f"{item.task}.json", text.encode(), "task file")
    notes = "".join(item.note.line() + "\n" for item in items)
    publish(folder / FILE, notes.encode(), "annotations")
    # Last: a folder without its list is not read as finished.
    publish(folder / "config_list.txt", "\n".join(f"{item.task}.json" for item in items).encode(), "list of tasks")
