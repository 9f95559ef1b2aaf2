"""The public benchmark's commands are understood: family, side, absolute or relative, and value."""

from __future__ import annotations

import json
import re
from pathlib import Path

from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.understand import meanings_said


def test_nearly_every_command_means_its_task(lampilot_data: Path) -> None:
    files = sorted((lampilot_data / "DbLv1-dev").glob("*.json"))
    said = [(file.stem, command) for file in files for command in json.loads(file.read_text("utf-8"))["commands"]]
    wrong = [pair for pair in said if not _means(*pair)]
    assert len(said) > 200
    assert len(wrong) <= 0.07 * len(said), wrong  # the learned reader's share; the network is asked beside it


def _means(task: str, command: str) -> bool:
    said = meanings_said(command)
    return len(said) == 1 and _fits(said[0], task)


def _fits(step: Meaning, task: str) -> bool:
    family, value = re.sub(r"\d+$", "", task), re.search(r"\d+$", task)
    if value is None:
        return _manoeuvre_fits(step, family)
    change, frame, what = family.split("_")
    amount = step.amount
    if amount is None or step.manoeuvre != {"dis": "gap", "speed": "speed"}[what] or amount.bound != "exact":
        return False
    if amount.frame != {"abs": "absolute", "rel": "relative"}[frame] or amount.value != float(value[0]):
        return False
    return frame == "abs" or step.change == {"inc": 1, "dec": -1}[change]


def _manoeuvre_fits(step: Meaning, family: str) -> bool:
    if family == "pull_over":
        return step.manoeuvre == "pull_over"
    first, second = family.split("_")
    kinds = {"lc": "lane", "overtake": "overtake"}
    if second in kinds:
        return (step.manoeuvre, step.direction) == (kinds[second], first) and not step.variant
    return (step.manoeuvre, step.direction) == ("turn", second)
