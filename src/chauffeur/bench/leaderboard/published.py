"""The paper's Tab. V, and our row under it. Engines differ, and every table says so."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any, Final

from chauffeur.bench.leaderboard.results import NOT_DRIVEN

ENGINES_DIFFER: Final = (
    "Engines differ: the paper's rows were driven in CARLA, ours in the engine named. In ours the world's driver keeps "
    "the gap, obeys lights and yields, and a program chooses way, lane and speed; in the paper programs did more. The "
    "rows are no comparison."
)

HEADER: Final = ("method", "learning", "navigation", "engine", "routes", "DS", "RC", "IP")

PAPER: Final[tuple[tuple[str, ...], ...]] = (
    ("Roach expert", "reinforcement learning", "waypoint", "CARLA (paper)", "26", "63.4", "100.0", "0.63"),
    ("TCP expert", "reinforcement learning", "waypoint", "CARLA (paper)", "26", "68.1", "95.8", "0.71"),
    ("LLM planner", "0-shot CoT", "instruction", "CARLA (paper)", "26", "0.00", "48.7", "0.00"),
    ("LLM planner", "3-shot CoT", "instruction", "CARLA (paper)", "26", "17.3", "65.3", "0.31"),
    ("LLM planner", "human-feedback CoT", "instruction", "CARLA (paper)", "26", "65.4", "95.1", "0.68"),
)
"""Tab. V of the paper, row by row."""

_LEARNING: Final = {"zero-shot": "0-shot CoT", "few-shot": "3-shot CoT", "human-feedback": "human-feedback CoT"}


def beside_the_paper(driver: str, setting: str, rows: Sequence[Mapping[str, Any]]) -> list[tuple[str, ...]]:
    """The paper's rows and ours, with the engine of each.

    Args:
        driver: Who drove.
        setting: How a planner learned; empty for a driver that is told no instruction.
        rows: Of the benchmark; those that infrastructure spoiled do not count.
    """
    counted = [row for row in rows if not row["infra_failed"]]
    if not counted:
        return list(PAPER)
    engines = " and ".join(sorted({str(row["engine"]) for row in counted if row["engine"] != NOT_DRIVEN}))
    mean = {name: statistics.fmean(float(row[name]) for row in counted) for name in ("ds", "rc", "ip")}
    learned = _LEARNING.get(setting, "rules")
    navigation = "instruction" if setting else "route"
    routes = str(len({row["route"] for row in counted}))
    ours = (driver, learned, navigation, f"{engines} (ours)", routes)
    return [*PAPER, (*ours, f"{mean['ds']:.1f}", f"{mean['rc']:.1f}", f"{mean['ip']:.2f}")]
