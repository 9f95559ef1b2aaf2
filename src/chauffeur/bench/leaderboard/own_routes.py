"""Routes and triggers of our own through the project's own towns, for users who have no map of CARLA's.

Drawn once from the towns' road graphs with a fixed seed, so that they are the same for everybody: three routes a town,
each through at least three junctions, with scenarios of the types 1, 3, 4 and 7 along them.
"""

from __future__ import annotations

import hashlib
import json
from functools import lru_cache
from itertools import pairwise
from typing import Final

import numpy as np

from chauffeur.bench.leaderboard.routes import LeaderboardRoute, RouteFile
from chauffeur.bench.leaderboard.track import TURNS
from chauffeur.bench.leaderboard.triggers import Trigger, TriggerSet
from chauffeur.bench.leaderboard.ways import plan_keypoints
from chauffeur.concept import ScenarioError
from chauffeur.geometry import Pose, RoadGraph
from chauffeur.worlds.town.library import OWN_TOWNS, load

SEED: Final = 1
ROUTES_A_TOWN: Final = 3
LEAST_M: Final = 350.0
LEAST_TURNS: Final = 2
TRIES: Final = 300


def own_routes(towns: tuple[str, ...] = ()) -> tuple[RouteFile, TriggerSet]:
    """The routes and their triggers.

    Args:
        towns: Names of map packs; by default the project's own towns.

    Raises:
        DataError: A town cannot be built here.
        ScenarioError: A town has too few ways.
    """
    routes: list[LeaderboardRoute] = []
    triggers: dict[str, tuple[Trigger, ...]] = {}
    for town in towns or _own_towns():
        found, marks = _drawn(town, load(town).source_hash)
        routes += found
        triggers[town] = marks
    said = json.dumps([[one.id, [[p.x_m, p.y_m] for p in one.keypoints]] for one in routes])
    return RouteFile("own", tuple(routes), hashlib.sha256(said.encode()).hexdigest()), TriggerSet(triggers, "own")


@lru_cache(maxsize=16)
def _drawn(town: str, source_hash: str) -> tuple[list[LeaderboardRoute], tuple[Trigger, ...]]:
    del source_hash  # drawn anew when the map of this name is another
    return routes_through(town, load(town).road)


def _own_towns() -> tuple[str, ...]:
    return tuple(sorted(folder.name for folder in OWN_TOWNS.iterdir() if folder.is_dir()))


def routes_through(
    town: str, road: RoadGraph, count: int = ROUTES_A_TOWN
) -> tuple[list[LeaderboardRoute], tuple[Trigger, ...]]:
    """Routes of a town, and triggers along them. Raises ScenarioError: the town has too few ways."""
    rng = np.random.default_rng([SEED, len(road.lanes)])
    starts = [one for one in road.lanes if one.kind == "driving" and not one.junction and one.length_m > 25.0]
    routes: list[LeaderboardRoute] = []
    triggers: list[Trigger] = []
    for _ in range(TRIES if starts else 0):
        if len(routes) == count:
            break
        points: list[Pose] = []
        for lane in rng.choice(len(starts), 3, replace=False):
            line = starts[int(lane)].centre
            points.append(line.at(line.length_m / 2.0))
        try:
            track = plan_keypoints(road, points).track
        except ScenarioError:
            continue
        pairs = enumerate(pairwise(track.options), start=1)
        entries = [i for i, (before, here) in pairs if here in TURNS and before not in TURNS]
        turns = sum(track.options[i] in ("left", "right") for i in entries)
        if track.length_m < LEAST_M or turns < LEAST_TURNS or len(entries) < 3:
            continue
        routes.append(LeaderboardRoute(f"{town}-{len(routes)}", town, tuple(points)))
        for i in entries:
            before = max(0, i - int(rng.integers(12, 25)))
            triggers.append(
                Trigger(int(rng.choice([4, 7] if track.options[i] != "straight" else [7])), track.poses[before])
            )
        for kind in (1, 3, 3):
            triggers.append(Trigger(kind, track.poses[int(rng.integers(20, len(track.poses) - 60))]))
    if len(routes) < count:
        raise ScenarioError(f"{town} has too few ways for {count} routes.", hint="Take a larger town.")
    return routes, tuple(triggers)
