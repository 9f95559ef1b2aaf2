"""The public benchmark's commands are understood: family, side, absolute or relative, and value."""

from __future__ import annotations

import json
import re
from pathlib import Path

from chauffeur.planners.onboard.meaning import Meaning, Reading
from chauffeur.planners.onboard.understand import understand


def test_every_command_means_its_task(lampilot_data: Path) -> None:
    files = sorted((lampilot_data / "DbLv1-dev").glob("*.json"))
    assert files
    for file in files:
        for command in json.loads(file.read_text(encoding="utf-8"))["commands"]:
            result = understand(command)
            assert isinstance(result, Reading), command
            assert len(result.steps) == 1, command
            assert _fits(result.steps[0], file.stem), (command, result.steps[0])


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
