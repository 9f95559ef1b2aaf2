"""Drives samples with LaMPilot's own code, for benchmarks/lampilot_speed.py.

    python benchmarks/lampilot_peer.py DIR < jobs

DIR is a checkout of LaMPilot, by its public layout: `projects/lampilot` and its own `highway_env`, which is why this
is a process of its own and imports nothing of ours. The interpreter must have what LaMPilot imports (numpy, gymnasium,
scipy, pandas, pygame, matplotlib; langchain 0.x or pydantic).

Reads one JSON job a line: {"sample": {"env", "eval", "seed"}, "program": text or "", "steps": most or null}. Answers
one a line: CPU and wall seconds of the set-up and of the drive, and how it ended. Without a program the IDM baseline
drives; a program's text is what LaMPilot executes, its last line makes `policy`.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import time
import types
import warnings
from pathlib import Path
from typing import Any


def _stand_in_for_langchain() -> None:
    """LaMPilot takes pydantic v1 from langchain 0.x, which later releases no longer hand on."""
    try:
        import langchain.pydantic_v1  # noqa: F401
    except ImportError:
        import pydantic.v1

        package = types.ModuleType("langchain")
        package.pydantic_v1 = pydantic.v1
        sys.modules.setdefault("langchain", package)
        sys.modules["langchain.pydantic_v1"] = pydantic.v1


class Clock:
    """CPU and wall time since it was made."""

    def __init__(self) -> None:
        self._cpu, self._wall = time.process_time(), time.perf_counter()

    def read(self) -> tuple[float, float]:
        return time.process_time() - self._cpu, time.perf_counter() - self._wall


def drive(job: dict[str, Any]) -> dict[str, Any]:
    """One episode, as LaMPilot's own scripts run it, without a window."""
    from projects.lampilot.dt.vehicle_dt import IDMDT, CtrlVDT
    from projects.lampilot.evaluator import get_evaluator_class

    sample, program = job["sample"], job["program"]
    most = job["steps"] or sys.maxsize
    clock = Clock()
    evaluator = get_evaluator_class(sample["eval"]["type"])(config=sample, show_window=False)
    agent = CtrlVDT() if program else IDMDT()
    agent.reset(ego_vehicle=evaluator.env.unwrapped.vehicle)
    reset = clock.read()
    clock = Clock()
    if program:
        agent.execute({"reused_code": "", "new_code": program})
    while not evaluator.ended and evaluator.frame < most:
        evaluator.step(agent)
    run = clock.read()
    vehicles = len(evaluator.env.unwrapped.road.vehicles)
    evaluator.close()
    return {
        "reset": reset,
        "run": run,
        "steps": evaluator.frame,
        "vehicles": vehicles,
        "success": bool(evaluator.success),
        "collision": bool(evaluator.collision),
    }


def main() -> None:
    folder = Path(sys.argv[1]).resolve()
    sys.path.insert(0, str(folder))
    os.chdir(folder)
    warnings.simplefilter("ignore")
    _stand_in_for_langchain()
    answers = sys.stdout
    with contextlib.redirect_stdout(sys.stderr):  # LaMPilot prints what its programs say and do wrong
        import highway_env

        if not str(highway_env.__file__).startswith(str(folder)):
            sys.exit(f"{folder} has no highway_env of its own")
        for line in sys.stdin:
            answers.write(json.dumps(drive(json.loads(line))) + "\n")
            answers.flush()


if __name__ == "__main__":
    main()
