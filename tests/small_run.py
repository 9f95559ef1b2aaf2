"""What the runner's tests share: a small data set on our own scenarios, recorded answers to it, and a run."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

from chauffeur.bench.kernel.calls import Patience
from chauffeur.bench.kernel.progress import Standing
from chauffeur.bench.kernel.run import Effort
from chauffeur.bench.kernel.shards import WHOLE, Shard
from chauffeur.bench.lampilot.runner import LampilotRun, RunConfig
from chauffeur.planners.registry import make_planner
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN

LEFT = """
def change():
    ego = get_ego_vehicle()
    for _ in range({patience}):
        yield autopilot()
    set_target_lane(get_left_lane(ego))
    while True:
        yield autopilot()
"""
COMMANDS = ("Go left.", "Left lane, please.", "Change to the left lane now.", "Stay where you are.", "Say no.")
SEEDS = (17, 18, 21, 22, 23, 25)

FAST = Patience(attempts=2, base_s=0.01)


def make_data(folder: Path, seeds: tuple[int, ...] = SEEDS, more: list[Any] | None = None) -> Dataset:
    """Lane changes to the left on one road with several traffic seeds, five commands each."""
    folder.mkdir(parents=True)
    road = next(s for s in BUILT_IN if s.id == "overtake").config
    goal = {"type": "LaneChangeEval", "direction": "left"}
    samples = [*({"env": road, "eval": goal, "seed": seed} for seed in seeds), *(more or [])]
    (folder / "left_lc.json").write_text(json.dumps({"commands": COMMANDS, "samples": samples}))
    return load_dataset(folder)


def recorded(path: Path) -> str:
    """Spec of a planner that answers every command, always the same and at no cost."""
    answers = {
        COMMANDS[0]: LEFT.format(patience=1),
        COMMANDS[1]: LEFT.format(patience=1),
        COMMANDS[2]: LEFT.format(patience=12),
        COMMANDS[3]: "def stay():\n    while True:\n        yield autopilot()\n",
    }
    lines = [
        {"version": 1, "instruction": words, "reply": f"Thoughts: As you wish.\n\n```python\n{source}```\n"}
        for words, source in answers.items()
    ]
    lines.append({"version": 1, "instruction": COMMANDS[4], "reply": "REFUSE: I will not."})
    path.write_text("".join(json.dumps(line) + "\n" for line in lines))
    return f"replay/{path}"


class Inline:
    """Simulates in a thread of this process: the same work, without waiting for a worker to start."""

    slots = 1

    def __init__(self, workers: int) -> None:
        self._one_at_a_time = asyncio.Lock()

    async def start(self) -> None:
        pass

    async def run(self, work: Any, job: Any, *, near: str = "", urgent: bool = False) -> Any:
        async with self._one_at_a_time:
            return await asyncio.to_thread(work, job)

    def close(self, *, now: bool) -> None:
        pass


def quiet(standing: Standing) -> None:
    """Watches without a word."""


def make_run(
    folder: Path, dataset: Dataset, spec: str, *, items: int = 0, shard: Shard = WHOLE, planner: Any = None
) -> LampilotRun:
    config = RunConfig(spec, "few-shot", dataset.sha256, items, 42)
    maker = None if spec in ("idm", "mobil") else planner or make_planner(spec)
    return LampilotRun(folder, dataset, config, maker, shard=shard)


def finish(run: LampilotRun, **effort: Any) -> bytes:
    """Run to the end, in this process if nothing else is said; the results as they were written."""
    run.run(quiet, Effort(**{"workers": 1, "patience": FAST, "engine": Inline, **effort}))
    return outcome(run.folder)


def outcome(folder: Path) -> bytes:
    """Results and table of a finished run, byte for byte."""
    return (folder / "results.jsonl").read_bytes() + (folder / "table.md").read_bytes()
