"""Trips that frames are taken from: the world's own driver in town, on the highway, at a crossing and in a parking lot.

Every trip is a generator of `FrameMoment`s, two a second, with what the navigation says at that moment. It says
which way at the next junction, or which lane: where the junction begins is for the eye.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from chauffeur.concept import Observation, Scenario, VehicleState
from chauffeur.concept.scene import stops_at_sign
from chauffeur.driving.actuate import actuate
from chauffeur.driving.episode import make_world
from chauffeur.foreign.waypoints import STEP_S
from chauffeur.geometry import LaneId, RoadGraph
from chauffeur.geometry.road_graph import turn_of
from chauffeur.worlds.base import EGO, World

Place = Literal["town", "highway", "crossing", "lot"]
Turn = Literal["left", "straight", "right"]
TOWNS: Final = ("Gridford", "Hillcrest", "Northport", "Ringstead")
UNSEEN_TOWN: Final = "Oldbridge"
"""Its streets are in the test split alone."""
AXLE_M: Final = 1.4
"""From the rear axle to the middle of the car, on the roads whose cars have no chassis of their own."""
COMMANDS: Final = {
    "left": "Turn left at the next junction.",
    "straight": "Go straight on at the next junction.",
    "right": "Turn right at the next junction.",
    "": "Follow the road.",
    "change left": "Change to the left lane.",
    "change right": "Change to the right lane.",
}
SEES_M: Final = 60.0
_TURNS: Final[tuple[Turn, ...]] = ("left", "straight", "right")


@dataclass(frozen=True, slots=True)
class FrameMoment:
    """A moment of a trip.

    Attributes:
        observation: What was there, y to the left.
        command: What the navigation says.
        lead_m: Gap to the vehicle ahead, at most `SEES_M`.
        lead_mps: Its speed; the ego's own where there is none.
        halt_m: Distance to a red or yellow light or a stop sign on the way, at most `SEES_M`.
        junction_m: Distance to the next junction on the way, at most `SEES_M`; 0 inside one.
    """

    observation: Observation
    command: str
    lead_m: float
    lead_mps: float
    halt_m: float
    junction_m: float


@dataclass(frozen=True, slots=True)
class TrafficTrip:
    """Configuration of a trip.

    Attributes:
        name: Unique in its set.
        place: Which world.
        town: Of a trip in town.
        seed: Of everything.
        seconds: How long, at most.
        config: The world's configuration; None has one drawn.
    """

    name: str
    place: Place
    town: str
    seed: int
    seconds: float
    config: Mapping[str, Any] | None = None


def instants(trip: TrafficTrip) -> Iterator[FrameMoment]:
    """Drive a trip; ends early at a collision, at the end of the road, or where the world has no more to say.

    Raises:
        ScenarioError: It cannot be set up.
        MissingExtraError: The town's simulator is not installed.
    """
    rng = np.random.default_rng([trip.seed, 11])
    yield from {"town": _town, "highway": _highway, "crossing": _crossing, "lot": _lot}[trip.place](trip, rng)


def _begun(trip: TrafficTrip, name: str, drawn: dict[str, Any]) -> World:
    """The trip's world, just reset; the drawn configuration counts where the trip names none."""
    scenario = Scenario(trip.name, name, drawn if trip.config is None else dict(trip.config), trip.seed)
    world = make_world(scenario)
    world.reset(scenario)
    return world


def _looks(world: World, seconds: float) -> Iterator[tuple[Observation, bool]]:
    """Instants until the world ends or the time is up, and whether each begins a half second."""
    every = round(STEP_S / world.dt_s)
    for tick in range(round(seconds / world.dt_s)):
        seen = world.observe()
        if seen.ended:
            return
        yield seen, tick % every == 0


def _town(trip: TrafficTrip, rng: np.random.Generator) -> Iterator[FrameMoment]:
    from chauffeur.worlds.town import TownWorld

    world = TownWorld()
    config = {"town": trip.town, "vehicles": int(rng.integers(15, 45)), "people": int(rng.integers(0, 20))}
    world.reset(Scenario(trip.name, "town", config, trip.seed))
    driver = world.driver()
    wishes, inside = driver.initial_setpoints(), True
    try:
        for seen, marked in _looks(world, trip.seconds):
            lane = seen.road.get(seen.ego.lane)
            now = lane is not None and bool(lane.junction)
            if inside and not now:  # a junction lies behind: another way at the next one
                wishes = replace(wishes, turn=_TURNS[int(rng.integers(3))])
            elif now and not inside:
                wishes = replace(wishes, turn=None)
            command = driver.command(driver.settle(wishes))
            inside = now
            if marked:
                turn, away = _next_turn(seen.road, driver.lanes_ahead(), seen.ego)
                yield _instant(seen, COMMANDS[turn], away, driver.lanes_ahead())
            actuate(world, seen, command, None, None)
    finally:
        world.close()


def _next_turn(road: RoadGraph, lanes: tuple[LaneId, ...], ego: VehicleState) -> tuple[Turn | Literal[""], float]:
    """Way across the junction that the ego is in or comes to next, and the distance to it, m."""
    away = 0.0
    for i, name in enumerate(lanes):
        lane = road[name]
        if lane.junction:
            last = i
            while last + 1 < len(lanes) and road[lanes[last + 1]].junction == lane.junction:
                last += 1
            turned = road[lanes[last]].centre.headings[-1] - lane.centre.headings[0]
            return turn_of(float(turned)), min(SEES_M, away)
        at = lane.centre.nearest(ego.x_m, ego.y_m) if i == 0 else 0.0
        away += lane.length_m - at
    return "", SEES_M


def _instant(seen: Observation, command: str, junction_m: float, way: tuple[LaneId, ...] = ()) -> FrameMoment:
    ego, lead = seen.ego, seen.front
    halts = [SEES_M] if seen.stop_sign_m is None else [SEES_M, max(0.0, seen.stop_sign_m)]
    for signal in seen.signals:
        if signal.state in ("red", "yellow") and any(lane in way for lane in signal.lanes):
            (ax, ay), (bx, by) = signal.stop_line_m
            halts.append(math.hypot((ax + bx) / 2.0 - ego.x_m, (ay + by) / 2.0 - ego.y_m))
    return FrameMoment(
        seen,
        command,
        SEES_M if lead is None else min(SEES_M, max(0.0, lead.distance_m)),
        ego.speed_mps if lead is None or lead.distance_m > SEES_M else lead.speed_mps,
        min(halts),
        junction_m,
    )


def _highway(trip: TrafficTrip, rng: np.random.Generator) -> Iterator[FrameMoment]:
    lanes = int(rng.integers(3, 6))
    ego = {"speed": 25, "start_lane_index": ["a", "b", int(rng.integers(1, lanes))], "start_position": [105, 0]}
    config: dict[str, Any] = {
        "type": "dt-highway-v0",
        "num_lanes": lanes,
        "vehicles_count": int(rng.integers(14, 40)),
        "vehicles_density": float(rng.uniform(0.8, 2.0)),
        "stage_length": [2000],
        "ego_vehicle": ego,
        "redraw_unfit": True,
    }
    world = _begun(trip, "highway", config)
    driver, perception = world.driver(), world.perception()
    wishes, said, until = driver.initial_setpoints(), "", 0.0
    for seen, marked in _looks(world, trip.seconds):
        if marked:
            if seen.time_s >= until:
                said = ""
                if rng.random() < 0.15:
                    side = int(rng.choice((-1, 1)))
                    lane = perception.adjacent_lane(perception.lane_of(EGO), side)
                    if lane is not None and all(
                        one is None or abs(perception.distance_along(EGO, one)) > _CLEAR_M
                        for one in perception.neighbours(lane)
                    ):
                        wishes = replace(wishes, target_lane=lane)
                        said, until = ("change left", "change right")[side > 0], seen.time_s + 3.0
            yield _instant(seen, COMMANDS[said], SEES_M)
        wishes = driver.settle(wishes)
        actuate(world, seen, driver.command(wishes), None, None)


def _lot(trip: TrafficTrip, rng: np.random.Generator) -> Iterator[FrameMoment]:
    drawn = {
        "aisles": int(rng.integers(2, 5)),
        "spots_a_row": int(rng.integers(6, 14)),
        "taken": float(rng.uniform(0.4, 0.9)),
        "cars": int(rng.integers(0, 3)),
        "walkers": int(rng.integers(0, 3)),
    }
    world = _begun(trip, "parking", drawn)
    driver = world.driver()
    wishes = driver.initial_setpoints()
    for seen, marked in _looks(world, trip.seconds):
        if marked:
            if rng.random() < _OTHERWISE:  # to another speed, or a halt
                wishes = replace(wishes, target_speed_mps=float(max(0.0, rng.uniform(-2.0, 6.0))))
            yield _instant(seen, COMMANDS[""], SEES_M)
        wishes = driver.settle(wishes)
        actuate(world, seen, driver.command(wishes), None, None)


_OTHERWISE: Final = 0.15
"""Probability, each half second, that the driver in a lot is given another speed."""
_WAITS_S: Final = 1.0
_CLEAR_M: Final = 25.0
"""A lane is free to change to where no vehicle is nearer than this."""


def _crossing(trip: TrafficTrip, rng: np.random.Generator) -> Iterator[FrameMoment]:
    cars = {"num_vehicles_left": int(rng.integers(0, 4)), "num_vehicles_right": int(rng.integers(0, 4))}
    world = _begun(trip, "highway", {"type": "dt-intersection-v0", **cars, "redraw_unfit": True})
    driver, perception = world.driver(), world.perception()
    turn = _TURNS[int(rng.integers(3))]
    wishes = replace(driver.initial_setpoints(), turn=turn, target_speed_mps=float(rng.uniform(8.0, 12.0)))
    stood_s = 0.0
    for seen, marked in _looks(world, trip.seconds):
        sign = perception.stop_sign_ahead(wishes.served_stops)
        stops = sign is not None and stops_at_sign(seen.ego.speed_mps, sign[1])
        stood_s = stood_s + world.dt_s if stops else 0.0
        if sign is not None and stood_s > _WAITS_S:
            wishes = replace(wishes, served_stops=wishes.served_stops | {sign[0]})
        if marked:
            yield _instant(seen, COMMANDS[turn], SEES_M if sign is None else min(SEES_M, sign[1]))
        wishes = driver.settle(wishes)
        actuate(world, seen, driver.command(wishes), None, None)
