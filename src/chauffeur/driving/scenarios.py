"""Finding a scenario: a built-in one by name, an official LaMPilot sample by id, or the one that suits a wish."""

from __future__ import annotations

import difflib
import math
import os
import re
from dataclasses import replace
from pathlib import Path

from chauffeur.concept import Observation, Scenario, ScenarioError
from chauffeur.concept.utterance import ReferenceKind, Verb
from chauffeur.driving.episode import drive_without_program, make_world
from chauffeur.language.languages.reader import read_other
from chauffeur.language.meaning.reader import read
from chauffeur.language.quantities import measured
from chauffeur.language.tokens import tokens_of
from chauffeur.language.weather import said_weather
from chauffeur.planners.talk2drive.style import destination_of, place_of
from chauffeur.planners.vilad.parking import NOTHING
from chauffeur.planners.vilad.planner import parking_wish
from chauffeur.worlds.base import World
from chauffeur.worlds.highway.dblv1 import Dataset, load_dataset
from chauffeur.worlds.highway.scenarios import BUILT_IN as ROADS
from chauffeur.worlds.parking.scenarios import BUILT_IN as LOTS
from chauffeur.worlds.town.library import packs
from chauffeur.worlds.town.scenarios import BUILT_IN as TOWNS
from chauffeur.worlds.town.scenarios import in_pack
from chauffeur.worlds.track.scenarios import BUILT_IN as TRACKS

BUILT_IN = ROADS + LOTS + TRACKS + TOWNS

DATA_VARIABLE = "CHAUFFEUR_LAMPILOT"
"""Environment variable naming a DbLv1 folder, used when no folder is given."""

_PLACES = {"stadium": "parking-stadium", "exit": "parking-exit"}
_AMENITIES = "parking-lift"
_ROADS: dict[Verb, str] = {
    "turn": "intersection",
    "straight": "intersection",
    "pull_over": "emergency-lane",
    "stop": "emergency-lane",
    "gap": "following",
    "follow": "following",
    "yield": "following",
}
"""The road that can carry an act; what is in none of these goes to the highway with a vehicle to overtake."""
_AT_A_CROSSING: frozenset[ReferenceKind] = frozenset({"junction", "stop_sign", "light", "crosswalk"})
_LANES: frozenset[Verb] = frozenset({"lane", "pass", "keep"})

IN_REACH_M = 100.0
"""So far ahead a vehicle counts as one to follow or to overtake."""
_CLOSES_MPS = 2.0
"""Faster than the vehicle ahead by this much, the car comes up to it and stays behind it."""
_LONGEST_S = {"parking": 3600.0, "town": math.inf}
"""Longest session of the worlds whose trips have an end, s: a lot allows no more (worlds.parking)."""
_TRIES = 60
STAYS_S = 40.0
"""How long a vehicle ahead stays in reach at least, on roads that keep one."""


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
    """A scenario by name or official id (`left_overtake_s0`; an item id such as `left_overtake_s0_c3` works too), or a
    town by the name or the folder of its map pack.

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
    if (town := in_pack(name)) is not None:
        return town
    known = [*(s.id for s in list_scenarios(data_dir)), *packs()]
    near = difflib.get_close_matches(name, known, n=3)
    hint = f"Did you mean {' or '.join(near)}?" if near else "Run `chauffeur show scenarios` for the list."
    if name.endswith(".xodr"):
        hint = f"Build the town first: chauffeur maps build {name}; then name it."
    elif dataset is None and re.search(r"_s\d+", name):
        hint = f"Official LaMPilot samples need their folder: --data DIR, or {DATA_VARIABLE} in the environment."
    raise ScenarioError(f"Unknown scenario {name!r}.", hint=hint)


def suiting(wish: str) -> Scenario:
    """The built-in scenario whose road lets the wish be shown: a crossing for a turn, a lot for a spot.

    A wish that a scenario is listed with is shown there. Of any other the first act decides. The road depends on the
    words alone: where what it needs is not installed, driving says what to install.
    """
    other = read_other(wish)
    if other is not None and other.english:
        wish = other.english
    for scenario in BUILT_IN:
        if _words(scenario.wish) == _words(wish):
            return scenario
    by_id = {scenario.id: scenario for scenario in BUILT_IN}
    first = next(iter(read(wish).acts), None)
    if first is None or first.style is not None:
        said = said_weather(wish) != "none"  # what the passenger knows and the camera does not see
        return by_id["track-left-turn-sunny" if said else "overtake"]
    if first.act == "goto":
        place = destination_of(wish)
        return next((town for town in TOWNS if place and destination_of(town.wish) == place), TOWNS[0])
    if first.act == "park":
        return by_id[_AMENITIES if _asks_for_amenities(wish) else _PLACES.get(place_of(wish), "parking")]
    if first.place is not None and first.place.ref is not None and first.place.ref.kind in _AT_A_CROSSING:
        return by_id["intersection"]
    if first.act in _LANES:
        return by_id["left-lane" if first.side == "right" else "overtake"]
    names_speed = first.act == "speed" or any(dimension == "speed" for dimension, _ in measured(wish))
    if names_speed and first.direction != "faster" and first.aim != "traffic":
        return by_id["cruise"]  # which needs room ahead
    return by_id[_ROADS.get(first.act, "overtake")]


def _words(text: str) -> list[str]:
    """The words of a wish, in whatever case, contracted or not, without punctuation."""
    return [token for token in tokens_of(text) if token[0].isalnum()]


def lasting(scenario: Scenario, duration_s: float) -> Scenario:
    """A scenario in a town or a lot with time for a session of that long; any other as it is."""
    longest_s = _LONGEST_S.get(scenario.world)
    if longest_s is None:
        return scenario
    return replace(scenario, config={**scenario.config, "duration_s": min(duration_s + 1.0, longest_s)})


def _asks_for_amenities(wish: str) -> bool:
    """Whether a parking wish is about what the lot with lift, chargers and roofs shows, as ViLaD reads it."""
    asked = parking_wish(wish)
    return any(asked[name] != NOTHING[name] for name in ("lift", "stairs", "machine", "bay", "covered", "apart", "end"))


def seeds_with_lead(scenario: Scenario, first: int, count: int) -> tuple[int, ...]:
    """Seeds from `first` on for drives that follow one another on this scenario's road.

    Where the scenario has a vehicle ahead, as one to overtake, every one of them has: one in reach that the car comes
    up to, since what drives as fast as the car slips out of reach while nobody wishes anything.

    Raises:
        ScenarioError: The scenario cannot be set up.
    """
    world = make_world(scenario)
    given = world.reset(scenario, scenario.seed)
    if not given.road.uninterrupted or given.front is None or given.front.distance_m > IN_REACH_M:
        return tuple(range(first, first + count))
    found: list[int] = []
    for seed in range(first, first + _TRIES * count):
        if _keeps_lead(world, world.reset(scenario, seed)):
            found.append(seed)
        if len(found) == count:
            return tuple(found)
    return tuple(range(first, first + count))


def _keeps_lead(world: World, shot: Observation) -> bool:
    """Whether a world just reset has a vehicle ahead in reach, and still has while nobody wishes anything."""
    lead = shot.front
    if lead is None or lead.distance_m > IN_REACH_M or shot.ego.speed_mps < lead.speed_mps + _CLOSES_MPS:
        return False
    episode = drive_without_program(world, None, STAYS_S, record=False)
    front = episode.final.front
    return episode.outcome == "ended" and front is not None and front.distance_m <= IN_REACH_M


def planner_for(spec: str, scenario: Scenario) -> str:
    """The planner that was named, else one that can drive there: what the world says it can be driven by; and where a
    lot has places to park near, or an open road sets no manoeuvre, the one that finds its own way."""
    apt = make_world(scenario).capabilities.policies
    if spec:
        return spec
    if scenario.config.get("places") or scenario.config.get("street"):
        return "vilad"
    return {"action_matrix": "vlm", "program": "onboard"}.get(apt[0], "talk2drive")
