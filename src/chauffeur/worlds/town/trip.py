"""Start and goal of a trip through a town: from a scenario's words and numbers to lanes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import DataError, Scenario, ScenarioError
from chauffeur.geometry import LanePlace, RoadGraph, Route, plan_route
from chauffeur.worlds.skeleton import config_of
from chauffeur.worlds.town import library
from chauffeur.worlds.town.pack import MapPack, Place, places_called
from chauffeur.worlds.town.staged import StagedActor


class TownConfig(BaseModel):
    """A trip in a town.

    Attributes:
        town: Name of a map pack, or the folder of one.
        start: Where the ego begins: lane and station, or (x, y, heading); by default somewhere, as the seed says.
        goal: Name of a place, or (x, y); by default there is none.
        lanes: The route itself, lane by lane; `start` and `goal_m` are then stations on its first and last lane.
        start_m, goal_m: Of `lanes`.
        vehicles: In the traffic; fewer where the town is full.
        people: On foot.
        stage: Road users and things that are put before the ego; what they are numbered stands in `TownWorld.staged`.
        ego_speed: At the start, m/s.
        duration_s: Time limit.
        contact_ends: Whether a collision ends the trip; a benchmark may count it and go on.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    town: str
    start: tuple[str, float] | tuple[float, float, float] | None = None
    goal: str | tuple[float, float] | None = None
    lanes: tuple[str, ...] = ()
    start_m: float = 0.0
    goal_m: float | None = None
    vehicles: int = Field(default=60, ge=0, le=400)
    people: int = Field(default=20, ge=0, le=200)
    stage: tuple[StagedActor, ...] = Field(default=(), max_length=40)
    ego_speed: float = Field(default=0.0, ge=0.0, le=30.0)
    duration_s: float = Field(default=600.0, gt=0.0, le=36_000.0)
    contact_ends: bool = True


@dataclass(frozen=True, slots=True)
class TownTrip:
    """A scenario's trip, the same in every process that is told scenario and seed.

    Attributes:
        town: Where.
        config: What the scenario says.
        start: Where the ego begins.
        route: Where it leads; None where the scenario has no goal.
        rng: What is drawn after that.
        simulator_seed: Of the traffic's simulator.
    """

    town: MapPack
    config: TownConfig
    start: LanePlace
    route: Route | None
    rng: np.random.Generator
    simulator_seed: int

    @classmethod
    def of(cls, scenario: Scenario, seed: int | None, given: MapPack | None) -> Self:
        """Args: what to drive; in place of its seed; the town, whatever the scenario says.

        Raises ScenarioError: The configuration is malformed, or a town, place or way does not exist.
        """
        config = config_of(TownConfig, scenario, "town")
        town = given or _loaded(config.town)
        drawn = np.random.SeedSequence(scenario.seed if seed is None else seed)
        rng = np.random.Generator(np.random.PCG64(drawn))
        start, route = _start(town, config, rng)
        return cls(town, config, start, route, rng, int(drawn.generate_state(1)[0]))


def _loaded(name: str) -> MapPack:
    try:
        return library.load(name)
    except DataError as error:
        raise ScenarioError(str(error), hint=error.hint) from error


def _start(town: MapPack, config: TownConfig, rng: np.random.Generator) -> tuple[LanePlace, Route | None]:
    road = town.road
    if config.lanes:
        unknown = [lane for lane in config.lanes if lane not in road]
        if unknown:
            raise ScenarioError(f"{town.name} has no lane {unknown[0]!r}, which the route names.")
        end = road[config.lanes[-1]].length_m
        goal = end if config.goal_m is None else min(config.goal_m, end)
        return LanePlace(config.lanes[0], config.start_m, 0.0), Route(config.lanes, config.start_m, goal)
    start = _somewhere(town, rng) if config.start is None else _place(town, config.start)
    if config.goal is None:
        return start, None
    route = plan_route(road, start, goal_in(town, config.goal))
    if route is None:
        raise ScenarioError(f"No way leads to {config.goal!r} from here.", hint="Choose another goal.")
    return start, route


def _place(town: MapPack, start: tuple[Any, ...]) -> LanePlace:
    road: RoadGraph = town.road
    if isinstance(start[0], str):
        if start[0] not in road:
            raise ScenarioError(f"{town.name} has no lane {start[0]!r}.")
        return LanePlace(start[0], float(start[1]), 0.0)
    x, y, heading = (float(value) for value in start)
    place = road.locate(x, y, heading, ("driving",))
    if place is None:
        raise ScenarioError(f"{town.name} has no lane at ({x}, {y}).")
    return place


def _somewhere(town: MapPack, rng: np.random.Generator) -> LanePlace:
    lanes = [
        one
        for one in town.road.lanes
        if one.kind == "driving" and not one.junction and one.length_m > 20.0 and one.successors
    ]
    if not lanes:
        raise ScenarioError(f"{town.name} has no lane to start on.")
    lane = lanes[int(rng.integers(len(lanes)))]
    return LanePlace(lane.id, lane.length_m / 2.0, 0.0)


def goal_in(town: MapPack, goal: str | tuple[float, float]) -> LanePlace:
    """The lane and station to go to. Raises ScenarioError: there is no such place, or no lane."""
    if isinstance(goal, str):
        found = place_named(town, goal)
        return LanePlace(found.lane, found.station_m, 0.0)
    place = town.road.locate(*goal, None, ("driving",))
    if place is None:
        raise ScenarioError(f"{town.name} has no lane at {goal}.")
    return place


def place_named(town: MapPack, name: str) -> Place:
    """The place of a town that a name means. Raises ScenarioError, saying what places there are."""
    found = places_called(town.places, name)
    if found:
        return found[0]
    raise ScenarioError(
        f"{town.name} has no place {name!r}.",
        hint="It has " + (", ".join(place.name for place in town.places) or "no places with names") + ".",
    )
