"""A small hand-made world for the program tests: a straight road with three lanes, cars at constant speed.

It is not a traffic simulator: it only answers a program's questions in a way that can be checked by hand.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from chauffeur.concept import Command, LaneId, Observation, Setpoints, VehicleState
from chauffeur.worlds.base import EGO

LIMIT_MPS = 31.0
LANES: tuple[LaneId, ...] = ("a-b:0", "a-b:1", "a-b:2")
CROSS: tuple[LaneId, ...] = ("w-e:0", "e-x:0")


@dataclass(frozen=True)
class Car:
    """A car or sign on the straight road; `x_m` along it, `lane` counted from the left."""

    id: int
    lane: int
    x_m: float
    speed_mps: float
    kind: str = "car"


def start_cars() -> dict[int, Car]:
    """Ego in the middle lane; a slower car ahead, one beside in front, one behind on the right, a far stop sign."""
    cars = (
        Car(EGO, 1, 100.0, 25.0),
        Car(1, 1, 145.0, 20.0),
        Car(2, 0, 190.0, 28.0),
        Car(3, 2, 60.0, 27.0),
        Car(4, 0, 40.0, 30.0),
        Car(9, 1, 400.0, 0.0, "stop_sign"),
    )
    return {car.id: car for car in cars}


class StraightRoad:
    """World, perception and driver in one."""

    dt_s = 0.1

    def __init__(self) -> None:
        self.cars = start_cars()
        self.commands = 0

    def reset(self, scenario: object, seed: int | None = None) -> Observation:
        raise NotImplementedError("the straight road has no scenarios")

    def observe(self) -> Observation:
        raise NotImplementedError("the straight road takes no pictures")

    def perception(self) -> StraightRoad:
        return self

    def driver(self) -> StraightRoad:
        return self

    def step(self, command: Command) -> Command:
        ego = self.cars[EGO]
        speed = max(0.0, ego.speed_mps + command.acceleration_mps2 * self.dt_s)
        for car in self.cars.values():
            self.cars[car.id] = replace(car, x_m=car.x_m + car.speed_mps * self.dt_s)
        lane = ego.lane if abs(command.steering_rad) < 0.5 else ego.lane + (1 if command.steering_rad > 0 else -1)
        self.cars[EGO] = replace(self.cars[EGO], speed_mps=speed, lane=lane)
        return command

    def vehicle(self, vehicle_id: int) -> VehicleState:
        car = self.cars[vehicle_id]
        lane = LANES[car.lane]
        return VehicleState(car.id, car.kind, car.x_m, -4.0 * car.lane, 0.0, car.speed_mps, 5.0, 2.0, lane)

    def has_lane(self, lane: LaneId) -> bool:
        return lane in LANES or lane in CROSS

    def lane_of(self, vehicle_id: int) -> LaneId:
        return LANES[self.cars[vehicle_id].lane]

    def adjacent_lane(self, lane: LaneId, offset: int) -> LaneId | None:
        index = LANES.index(lane) + offset
        return LANES[index] if 0 <= index < len(LANES) else None

    def speed_limit(self, lane: LaneId) -> float:
        return LIMIT_MPS

    def neighbours(self, lane: LaneId) -> tuple[int | None, int | None]:
        here = self.cars[EGO].x_m
        inside = [c for c in self.cars.values() if LANES[c.lane] == lane and c.id != EGO and c.kind == "car"]
        front = min((c for c in inside if c.x_m >= here), key=lambda c: c.x_m, default=None)
        rear = max((c for c in inside if c.x_m < here), key=lambda c: c.x_m, default=None)
        return (None if front is None else front.id, None if rear is None else rear.id)

    def distance_along(self, from_id: int, to_id: int) -> float:
        return self.cars[to_id].x_m - self.cars[from_id].x_m

    def cross_traffic_lanes(self, from_left: bool) -> tuple[LaneId, ...]:
        return CROSS[:1] if from_left else CROSS[1:]

    def stop_sign_ahead(self, served: frozenset[int]) -> tuple[int, float] | None:
        signs = [c for c in self.cars.values() if c.kind == "stop_sign" and c.id not in served]
        ahead = [c for c in signs if c.x_m > self.cars[EGO].x_m]
        return (ahead[0].id, self.distance_along(EGO, ahead[0].id)) if ahead else None

    def front_blocker(self, served: frozenset[int]) -> int | None:
        ego = self.cars[EGO]
        ahead = [c for c in self.cars.values() if c.lane == ego.lane and c.x_m > ego.x_m and c.id not in served]
        return min(ahead, key=lambda c: c.x_m).id if ahead else None

    def idm_entering(self, follower_id: int, leader_id: int, time_headway_s: float) -> float:
        follower, leader = self.cars[follower_id], self.cars[leader_id]
        gap = max(leader.x_m - follower.x_m, 0.1)
        wanted = 6.0 + time_headway_s * follower.speed_mps
        return 6.0 * (1.0 - (wanted / gap) ** 2) + (leader.speed_mps - follower.speed_mps)

    def settle(self, setpoints: Setpoints) -> Setpoints:
        ego = self.cars[EGO]
        speed = ego.speed_mps if setpoints.target_speed_mps is None else setpoints.target_speed_mps
        return replace(setpoints, target_speed_mps=speed, target_lane=setpoints.target_lane or LANES[ego.lane])

    def command(self, setpoints: Setpoints) -> Command:
        self.commands += 1
        ego = self.cars[EGO]
        assert setpoints.target_speed_mps is not None
        assert setpoints.target_lane is not None
        acceleration = max(-5.0, min(5.0, setpoints.target_speed_mps - ego.speed_mps))
        return Command(acceleration, float(LANES.index(setpoints.target_lane) - ego.lane))
