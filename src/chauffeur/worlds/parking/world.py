"""The parking-lot world: a car on slow, tight ground among parked cars, a car on its way out, and people on foot.

The ego is a kinematic bicycle that is moved on exact circles, forwards only. Collisions are overlaps of rectangles,
looked for every 25 ms. All chance comes from one seeded generator: the same scenario and seed give the same trip to the
last bit.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import (
    Capabilities,
    Command,
    LaneId,
    Lead,
    Observation,
    ParkingLot,
    Scenario,
    ScenarioError,
    VehicleState,
)
from chauffeur.geometry import Box, Polyline, Pose, overlap
from chauffeur.worlds.base import EGO
from chauffeur.worlds.corridor import Body
from chauffeur.worlds.parking.actors import LeavingCar, LotWalker
from chauffeur.worlds.parking.amenities import Bay, Place, amenities
from chauffeur.worlds.parking.driver import ParkingDriver
from chauffeur.worlds.parking.instant import Ego, pack, unpack
from chauffeur.worlds.parking.lot import AISLE_M, Lot, Spot, build_lot, way_id
from chauffeur.worlds.parking.perception import LaneMap, ParkingPerception
from chauffeur.worlds.parking.places import parked_in, spot_for
from chauffeur.worlds.parking.routes import Way, way_along, way_to_spot
from chauffeur.worlds.path_follower import Chassis
from chauffeur.worlds.skeleton import WorldBase, config_of, finite, set_up

DT_S: Final = 0.1
CHASSIS: Final = Chassis(Body(4.89, 1.895, 1.395), 2.79, 0.6, 2.0)
"""The size of Talk2Drive's car, a 2019 Lexus RX 450h, with its axles as far from its ends; turning radius 4.1 m."""
MOST_ACCELERATION_MPS2: Final = 3.0
MOST_BRAKING_MPS2: Final = 8.0
STEERING_RATE: Final = 1.2
"""Fastest change of the front wheels' angle, rad/s: a quick hand at the wheel."""
_PARTS: Final = 4
_FAR_M: Final = 6.0
"""Two cars whose middles are farther apart than this do not touch."""
_START_X_M: Final = -16.0


class LotConfig(BaseModel):
    """A lot and who is in it.

    Attributes:
        aisles, spots_a_row: Its size.
        taken: Share of the spots that somebody stands in.
        cars: Cars on their way out.
        walkers: People on foot.
        ego_speed: The ego's speed at the entrance, m/s.
        free: Spots nobody stands in, by name.
        bays: Spots that are kept for `ev`, `accessible` or `family`, by name.
        covered: Letters of the rows under a roof.
        places: Where the `lift`, the `stairs` and the pay `machine` are: m to the east and to the south.
        duration_s: Time limit.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    aisles: int = Field(default=3, ge=1, le=6)
    spots_a_row: int = Field(default=8, ge=2, le=20)
    taken: float = Field(default=0.7, ge=0.0, le=0.95)
    cars: int = Field(default=1, ge=0, le=2)
    walkers: int = Field(default=1, ge=0, le=3)
    ego_speed: float = Field(default=3.0, ge=0.0, le=4.0)
    free: tuple[str, ...] = ()
    bays: dict[str, Bay] = Field(default_factory=dict)
    covered: tuple[str, ...] = ()
    places: dict[Place, tuple[float, float]] = Field(default_factory=dict)
    duration_s: float = Field(default=180.0, gt=0.0, le=3600.0)


@dataclass(frozen=True, slots=True)
class _Ground:
    lot: Lot
    config: LotConfig
    lanes: LaneMap
    parked: tuple[VehicleState, ...]
    boxes: tuple[tuple[int, Box], ...]
    free: frozenset[str]
    offers: ParkingLot
    cars: tuple[LeavingCar, ...]
    walkers: tuple[LotWalker, ...]


class _Ego(Ego):
    """The car, as it moves."""

    __slots__ = ()

    @classmethod
    def at(cls, ego: Ego) -> _Ego:
        """A car of its own in the same state."""
        return cls(ego.rear, ego.speed_mps, ego.steering_rad, ego.crashed)

    @property
    def box(self) -> Box:
        middle, body = self.rear.ahead(CHASSIS.body.rear_to_middle_m), CHASSIS.body
        return Box(middle.x_m, middle.y_m, middle.heading_rad, body.length_m, body.width_m)

    def move(self, acceleration: float, steering: float, dt_s: float) -> None:
        """A moment on a circle; it brakes to a stand, and does not go backwards."""
        speed = max(0.0, self.speed_mps + acceleration * dt_s)
        way = (self.speed_mps + speed) / 2.0 * dt_s
        turned = way * math.tan(steering) / CHASSIS.wheelbase_m
        rear = self.rear
        # The chord of the circle, which is exact: as long as sinc of half the turn leaves of the way.
        half = turned / 2.0
        chord = way * (math.sin(half) / half if abs(half) > 1e-9 else 1.0)
        middle = rear.heading_rad + half
        x, y = rear.x_m + chord * math.cos(middle), rear.y_m + chord * math.sin(middle)
        self.rear, self.speed_mps, self.steering_rad = Pose(x, y, rear.heading_rad + turned), speed, steering


class ParkingWorld(WorldBase[ParkingPerception, ParkingDriver]):
    """A parking lot, stepped at 10 Hz."""

    engine = "parking lot 1"
    capabilities = Capabilities(
        roads=("parking",),
        policies=("parameters", "trajectory", "action_matrix"),  # a program has no way into a spot
        turns=True,
        places=True,
        horizon_s=180.0,
    )
    dt_s = DT_S
    """Control period, s."""
    chassis = CHASSIS
    """The ego's size and axles."""
    steering_rate = STEERING_RATE
    """Steering rate of the ego, rad/s."""

    def __init__(self) -> None:
        self._scene: _Ground | None = None
        self._ego = _Ego(Pose(0.0, 0.0, 0.0), 0.0)
        self._cars: list[LeavingCar] = []
        self._walkers: list[LotWalker] = []
        self._hit: set[int] = set()
        self._tick = 0

    @property
    def ground(self) -> Box:
        """The paved area. Raises ScenarioError before the first reset."""
        return self._started().lot.ground

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Paint the lot, park the cars and place the ego at the entrance.

        Raises:
            ScenarioError: The configuration is malformed.
        """
        config = config_of(LotConfig, scenario, "lot")
        drawn = np.random.SeedSequence(scenario.seed if seed is None else seed)
        rng = np.random.Generator(np.random.PCG64(drawn))
        taken = _taken(config, rng, scenario.id)
        lot = build_lot(config.aisles, config.spots_a_row, taken)
        parked = tuple(_park(lot.spots[name], i, rng) for i, name in enumerate(sorted(taken), start=1))
        lanes, boxes = LaneMap(lot), tuple((car.id, car.box) for car in parked)
        first = len(parked) + 1
        self._cars = [_leaving(lot, first + i, i, rng) for i in range(config.cars)]
        self._walkers = [_walking(lot, first + config.cars + i, rng) for i in range(config.walkers)]
        cars, walkers = tuple(car.copy() for car in self._cars), tuple(replace(walker) for walker in self._walkers)
        offers = amenities(lot, taken, config.bays, frozenset(config.covered), config.places)
        self._scene = _Ground(lot, config, lanes, parked, boxes, frozenset(lot.spots) - taken, offers, cars, walkers)
        self._ego = _Ego(Pose(_START_X_M - CHASSIS.body.rear_to_middle_m, 0.0, 0.0), config.ego_speed)
        self._hit, self._tick, self._shown = set(), 0, None
        self._perception = ParkingPerception(lot, lanes, self.observe)
        self._driver = ParkingDriver(CHASSIS, DT_S, self.observe, self._way_to_lane)
        return self.observe()

    def copy(self) -> ParkingWorld:
        """The same instant in a world of its own; its driver starts anew."""
        scene = self._started()
        twin = ParkingWorld()
        twin._scene = scene
        twin._ego = _Ego.at(self._ego)
        twin._cars = [car.copy() for car in self._cars]
        twin._walkers = [replace(walker) for walker in self._walkers]
        twin._hit, twin._tick = set(self._hit), self._tick
        twin._perception = ParkingPerception(scene.lot, scene.lanes, twin.observe)
        twin._driver = ParkingDriver(CHASSIS, DT_S, twin.observe, twin._way_to_lane)
        return twin

    def mirror(self) -> ParkingWorld:
        """A copy for another process."""
        return ParkingWorld()

    def mirrored(self) -> bytes:
        """The present instant, for a copy of this world in another process."""
        self._started()
        return pack(self._tick, self._ego, self._cars, self._walkers, self._hit)

    def adopt(self, observation: bytes) -> None:
        """Take over an instant of the same scenario and seed that was stepped elsewhere. Raises DataError if none."""
        scene = self._started()
        instant = unpack(observation, scene.cars, scene.walkers, (car.id for car in scene.parked))
        self._tick, self._ego = instant.tick, _Ego.at(instant.ego)
        self._cars, self._walkers, self._hit = list(instant.cars), list(instant.walkers), set(instant.hit)
        self._shown = None

    def step(self, command: Command) -> Command:
        """Advance 0.1 s under `command`; returns what the vehicle really applied."""
        finite(command)
        before, ego = self.observe(), self._ego
        acceleration = max(-MOST_BRAKING_MPS2, min(MOST_ACCELERATION_MPS2, command.acceleration_mps2))
        if ego.crashed:
            acceleration = -MOST_BRAKING_MPS2
        turn = STEERING_RATE * DT_S
        wheel = max(-CHASSIS.steering_rad, min(CHASSIS.steering_rad, command.steering_rad))
        wheel = max(ego.steering_rad - turn, min(ego.steering_rad + turn, wheel))
        moving = (before.ego, *before.others[len(self._started().parked) :])
        asked = [car.decide([one for one in moving if one.id != car.id]) for car in self._cars]
        cars = [one for one in moving if one.kind == "car"]
        for walker in self._walkers:
            walker.decide(cars, DT_S)
        speed = ego.speed_mps
        for _ in range(_PARTS):
            ego.move(acceleration, wheel, DT_S / _PARTS)
            for car, pedal in zip(self._cars, asked, strict=True):
                car.move(pedal, DT_S / _PARTS)
            for walker in self._walkers:
                walker.move(DT_S / _PARTS)
            self._look_for_collisions()
        self._cars = [car for car in self._cars if not car.gone]
        self._tick += 1
        self._shown = None
        return Command((ego.speed_mps - speed) / DT_S, wheel)

    def spot(self, place: str) -> Spot:
        """The free spot that is meant by a place. Raises ScenarioError, saying why there is none."""
        scene = self._started()
        return spot_for(scene.lot, scene.free, place, self._ego.rear, CHASSIS.wheelbase_m)

    def way_to(self, spot: Spot) -> Way | None:
        """The ego's way onto a spot from where it is; None where there is none."""
        return way_to_spot(self._started().lot, spot, self._ego.rear, CHASSIS.wheelbase_m)

    def way_on(self) -> Way:
        """The ego's way on along its lane, to where the lanes end."""
        return self._way_to_lane(None)

    def parked(self) -> str | None:
        """Name of the spot the ego is parked in: standing between its lines, straight."""
        found = parked_in(self._started().lot, self._ego.box, self._ego.speed_mps)
        return None if found is None else found.name

    def _started(self) -> _Ground:
        return set_up(self._scene)

    def _way_to_lane(self, lane: LaneId | None) -> Way:
        scene, box = self._started(), self._ego.box
        if lane in scene.lot.spots:
            way = way_to_spot(scene.lot, scene.lot.spots[lane], self._ego.rear, CHASSIS.wheelbase_m)
            if way is not None:
                return way
        here = scene.lanes.closest(box.x_m, box.y_m)
        return way_along(scene.lot, here, CHASSIS.body.overhang_m)

    def _look(self) -> Observation:
        scene, ego = self._started(), self._ego
        box = ego.box
        lane = scene.lanes.closest(box.x_m, box.y_m)
        own = VehicleState(
            EGO, "car", box.x_m, box.y_m, box.heading_rad, ego.speed_mps, box.length_m, box.width_m, lane, ego.crashed
        )
        parked = scene.parked
        if self._hit:
            parked = tuple(replace(car, crashed=True) if car.id in self._hit else car for car in parked)
        moving: list[VehicleState] = []
        for car in self._cars:
            state = car.state()
            moving.append(replace(state, lane=scene.lanes.closest(state.x_m, state.y_m)))
        people = tuple(walker.state() for walker in self._walkers)
        pose = np.array([[box.x_m, box.y_m, box.heading_rad]])
        off_road = bool(scene.lot.road.ground.beyond_m(pose, box.length_m, box.width_m)[0] > 0.0)
        late = self._tick * DT_S >= scene.config.duration_s
        return Observation(
            time_s=self._tick * DT_S,
            tick=self._tick,
            kind="parking",
            ego=own,
            others=(*parked, *moving, *people),
            objects=(),
            road=scene.lot.road,
            front=_front(own, moving, scene.lot.road[lane].centre),
            stop_sign_m=None,
            off_road=off_road,
            ended=ego.crashed or off_road or late,
            lot=scene.offers,
        )

    def _look_for_collisions(self) -> None:
        ego, box = self._ego, self._ego.box
        movers: list[LeavingCar | LotWalker] = [*self._cars, *self._walkers]
        for mover in movers:
            if overlap(box, mover.state().box):
                ego.crashed = mover.crashed = True
        for number, ground in self._started().boxes:
            if abs(ground.x_m - box.x_m) < _FAR_M and abs(ground.y_m - box.y_m) < _FAR_M and overlap(box, ground):
                ego.crashed = True
                self._hit.add(number)


def _taken(config: LotConfig, rng: np.random.Generator, scenario: str) -> frozenset[str]:
    """Draw the occupied spots: a fixed share of all, none of those that are to be free."""
    names = sorted(build_lot(config.aisles, config.spots_a_row).spots)
    unknown = [name for name in config.free if name not in names]
    if unknown:
        raise ScenarioError(
            f"Scenario {scenario!r} keeps {', '.join(unknown)} free; there is no such spot.",
            hint=f"Spots go from {names[0]} to {names[-1]}.",
        )
    order = [name for i in rng.permutation(len(names)) if (name := names[int(i)]) not in config.free]
    return frozenset(order[: round(config.taken * len(names))])


def _park(spot: Spot, number: int, rng: np.random.Generator) -> VehicleState:
    """Somebody's car in a spot, as people park."""
    length, width = rng.uniform(4.1, 4.9), rng.uniform(1.7, 1.9)
    along, across = rng.uniform(-0.2, 0.2), -rng.uniform(-0.15, 0.15)
    heading = spot.box.heading_rad - rng.uniform(-0.03, 0.03) - (math.pi if rng.uniform() < 0.2 else 0.0)
    c, s = math.cos(spot.box.heading_rad), math.sin(spot.box.heading_rad)
    x, y = spot.box.x_m + c * along - s * across, spot.box.y_m + s * along + c * across
    return VehicleState(number, "car", x, y, heading, 0.0, length, width, spot.lane)


def _leaving(lot: Lot, number: int, place: int, rng: np.random.Generator) -> LeavingCar:
    """A car ahead of the ego on the drive, on its way round to the exit through one of the aisles."""
    aisle = int(rng.integers(1, lot.aisles + 1))
    start = rng.uniform(14.0, 22.0) + 14.0 * place
    speed = rng.uniform(2.0, 3.2)
    nodes = ["entrance", *(f"n{i}" for i in range(1, aisle + 1)), f"a{aisle}"]
    views = [lot.road[way_id(*pair)] for pair in pairwise(nodes)]
    points = [point for view in views for point in view.centre.points_m[:-1]]
    rest = way_along(lot, way_id(f"a{aisle}", f"b{aisle}"), 0.0)
    way = Way(Polyline.of([*points, *rest.path.points_m]), (AISLE_M - 2.0) / 2.0)
    return LeavingCar(number, way, start, speed, views[0].id, speed)


def _walking(lot: Lot, number: int, rng: np.random.Generator) -> LotWalker:
    """Somebody who crosses one of the aisles at its head or its end, where nobody turns into a spot, to and fro."""
    aisle = int(rng.integers(1, lot.aisles + 1))
    x = lot.aisle_x_m(aisle)
    from_head, at_head = rng.uniform(7.6, 9.2), rng.uniform() < 0.75
    y = -from_head if at_head else lot.exit_m[1] + from_head
    half = AISLE_M / 2.0 + 1.6
    pause, away = rng.uniform(4.0, 9.0), rng.uniform(0.0, 5.0)
    side = 1.0 if rng.uniform() < 0.5 else -1.0
    return LotWalker(number, (x - side * half, y), (x + side * half, y), pause, waits_s=away)


def _front(ego: VehicleState, others: Sequence[VehicleState], path: Polyline) -> Lead | None:
    """The nearest car that is ahead in the ego's lane."""
    here = path.nearest(ego.x_m, ego.y_m)
    leads = [
        Lead(other.id, path.nearest(other.x_m, other.y_m) - here, other.speed_mps)
        for other in others
        if other.lane == ego.lane
    ]
    return min((lead for lead in leads if lead.distance_m > 0.0), key=lambda lead: lead.distance_m, default=None)
