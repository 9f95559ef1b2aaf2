"""What the coaching tests share: a small data set on our own scenarios, programs, and a scripted model server."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from types import ModuleType
from typing import Any

from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

IDLE = "def idle():\n    while True:\n        yield autopilot()\n"
GO_LEFT = """def go_left():
    ego = get_ego_vehicle()
    for _ in range(600):
        left = get_left_lane(ego)
        if left is not None and is_safe_enter(left):
            set_target_lane(left)
            break
        yield autopilot()
    for _ in range(30):
        yield autopilot()
"""
USE_IT = "def left_and_say_so():\n    say('Here we go.')\n    yield from go_left()\n    say('There we are.')\n"
DESCRIPTION = "The car moves into the lane on its left once that is safe. It waits for a gap up to 60 s."

COMMANDS = {"left_lc": ["Switch to the left lane.", "Change lanes to the left."], "pull_over": ["Pull over and stop."]}


def server_module() -> ModuleType:
    """The loopback chat-completions server of the planner tests."""
    path = Path(__file__).resolve().parents[1] / "planners" / "server.py"
    spec = importlib.util.spec_from_file_location("chauffeur_test_model_server", path)
    assert spec is not None and spec.loader is not None
    import sys

    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up
    spec.loader.exec_module(module)
    return module


def reply(source: str) -> str:
    return f"Thoughts: This should do.\n\n```python\n{source}```\n"


def scenario_config(name: str) -> dict[str, Any]:
    return next(s for s in BUILT_IN if s.id == name).config


def make_data(folder: Path) -> Dataset:
    """Two tasks: left lane changes with two traffic seeds, and pulling over."""
    folder.mkdir()
    left = [
        {"env": scenario_config("overtake"), "eval": {"type": "LaneChangeEval", "direction": "left"}, "seed": seed}
        for seed in (17, 18)
    ]
    over = [{"env": scenario_config("emergency-lane"), "eval": {"type": "PullOverEval"}, "seed": 9}]
    for task, samples in (("left_lc", left), ("pull_over", over)):
        (folder / f"{task}.json").write_text(json.dumps({"commands": COMMANDS[task], "samples": samples}))
    return load_dataset(folder)
