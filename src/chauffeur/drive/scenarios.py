"""Finding a scenario: a built-in one by name, an official LaMPilot sample by id, or the one that suits a wish."""

from __future__ import annotations

import difflib
import os
import re
from pathlib import Path

from chauffeur.concept import Scenario, ScenarioError
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN as ROADS
from chauffeur.worlds.parking.scenarios import BUILT_IN as LOTS

BUILT_IN = ROADS + LOTS

DATA_VARIABLE = "CHAUFFEUR_LAMPILOT"
"""Environment variable naming a DbLv1 folder, used when no folder is given."""

_CROSSING = re.compile(r"\b(intersection|crossroads?|crossing|junction|stop sign|turn|lights?)\b", re.IGNORECASE)
_STOPPING = re.compile(
    r"\b(pull(ing)? (over|up|off|in)|shoulder|emergency lane|hard shoulder|park|let me out|drop)\b", re.I
)
_FOLLOWING = re.compile(r"\b(gap|distance|room|space|behind|tailgat\w*|bumper|follow\w*|close\w*|headway)\b", re.I)
_RIGHTWARD = re.compile(r"\bright\b", re.IGNORECASE)


def find_data(folder: Path | None) -> Dataset | None:
    """The DbLv1 data set in `folder` or the environment's; None when neither is set. Raises DataError if unreadable."""
    if folder is None:
        named = os.environ.get(DATA_VARIABLE, "")
        folder = Path(named) if named else None
    return None if folder is None else load_dataset(folder)


def list_scenarios(data_dir: Path | None = None) -> tuple[Scenario, ...]:
    """Built-in scenarios, then the official samples of the data folder, if any."""
    dataset = find_data(data_dir)
    official = () if dataset is None else tuple(s for task in dataset.tasks for s in task.samples)
    return BUILT_IN + official


def find(name: str, data_dir: Path | None = None) -> Scenario:
    """A scenario by name or official id (`left_overtake_s0`; an item id such as `left_overtake_s0_c3` works too).

    Raises:
        ScenarioError: No such scenario; says which come close, and how to reach the official ones.
    """
    for scenario in BUILT_IN:
        if scenario.id == name:
            return scenario
    dataset = find_data(data_dir)
    if dataset is not None:
        scenario = dataset.scenario(name)
        if scenario is not None:
            return scenario
    known = [s.id for s in list_scenarios(data_dir)]
    near = difflib.get_close_matches(name, known, n=3)
    hint = f"Did you mean {' or '.join(near)}?" if near else "Run `chauffeur show scenarios` for the list."
    if dataset is None and re.search(r"_s\d+", name):
        hint = f"Official LaMPilot samples need their folder: --data DIR, or {DATA_VARIABLE} in the environment."
    raise ScenarioError(f"Unknown scenario {name!r}.", hint=hint)


def suiting(wish: str) -> Scenario:
    """The built-in scenario whose road lets the wish be shown: a crossing for a turn, a shoulder for a stop."""
    by_id = {scenario.id: scenario for scenario in BUILT_IN}
    if _STOPPING.search(wish):
        return by_id["emergency-lane"]
    if _CROSSING.search(wish):
        return by_id["intersection"]
    if _FOLLOWING.search(wish):
        return by_id["following"]
    if _RIGHTWARD.search(wish):
        return by_id["left-lane"]
    return by_id["overtake"]
