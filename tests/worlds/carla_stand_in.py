"""A CARLA server that the town plays: duck-typed actors, the client library's own value classes, its own map."""

from __future__ import annotations

import fnmatch
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import carla

from chauffeur.concept import Command, Scenario, Signal, VehicleState
from chauffeur.geometry import Pose
from chauffeur.worlds.carla.frames import pose_of, transform_of
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.pack import MapPack

VERSION = "0.9.16"
KINDS = {"car": "vehicle.tesla.model3", "pedestrian": "walker.pedestrian.0001", "static": "static.prop.vendingmachine"}


@dataclass
class Blueprint:
    id: str


class Many:
    """What CARLA calls an actor list or a blueprint library."""

    def __init__(self, parts: list[Any]) -> None:
        self._parts = parts

    def __iter__(self) -> Iterator[Any]:
        return iter(self._parts)

    def __len__(self) -> int:
        return len(self._parts)

    def __getitem__(self, index: int) -> Any:
        return self._parts[index]

    def filter(self, pattern: str) -> Many:
        return Many([one for one in self._parts if fnmatch.fnmatch(getattr(one, "type_id", None) or one.id, pattern)])

    def find(self, name: str) -> Any:
        return next(one for one in self._parts if one.id == name)


class Actor:
    """Somebody of the town, as a CARLA actor."""

    def __init__(self, world: StandInWorld, number: int, type_id: str) -> None:
        self.world, self.id, self.type_id = world, number, type_id
        self.attributes: dict[str, str] = {"base_type": "car"} if type_id.startswith("vehicle") else {}
        self.asked: Any = None
        self.moved_to: Pose | None = None

    def _seen(self) -> VehicleState:
        return self.world.seen(self.id)

    @property
    def bounding_box(self) -> Any:
        one = self._seen()
        return carla.BoundingBox(carla.Location(), carla.Vector3D(one.length_m / 2.0, one.width_m / 2.0, 0.75))

    def get_transform(self) -> Any:
        one = self._seen()
        return transform_of(carla, Pose(one.x_m, one.y_m, one.heading_rad))

    def get_location(self) -> Any:
        return self.get_transform().location

    def _along(self, value: float) -> Any:
        heading = self._seen().heading_rad
        return carla.Vector3D(value * math.cos(heading), -value * math.sin(heading), 0.0)

    def get_velocity(self) -> Any:
        return self._along(self._seen().speed_mps)

    def get_acceleration(self) -> Any:
        return self._along(self._seen().acceleration_mps2)

    def get_angular_velocity(self) -> Any:
        return carla.Vector3D(0.0, 0.0, -math.degrees(self._seen().yaw_rate_radps))

    def apply_ackermann_control(self, control: Any) -> None:
        assert isinstance(control, carla.VehicleAckermannControl)
        self.asked = control

    def set_transform(self, transform: Any) -> None:
        self.moved_to = pose_of(transform)  # as on a server, it shows with the next tick
        self.world.town.drive(self.id, self.moved_to, self._seen().speed_mps)

    def set_target_velocity(self, velocity: Any) -> None:
        place = self.moved_to or pose_of(self.get_transform())
        self.world.town.drive(self.id, place, math.hypot(velocity.x, velocity.y))

    def destroy(self) -> bool:
        if self.id:
            self.world.town.remove(self.id)
        return True


@dataclass
class CollisionSensor:
    id: int = -1
    type_id: str = "sensor.other.collision"
    tell: Callable[[Any], None] | None = None

    def listen(self, tell: Callable[[Any], None]) -> None:
        self.tell = tell

    def destroy(self) -> bool:
        return True


class Light:
    """A light of the town, as a CARLA traffic light."""

    type_id = "traffic.traffic_light"

    def __init__(self, world: StandInWorld, name: str) -> None:
        self.world, self.id = world, int(name)

    def _shown(self) -> Signal:
        return next(one for one in self.world.pack.signals_at(self.world.time_s) if one.id == str(self.id))

    def get_stop_waypoints(self) -> list[Any]:
        found: list[Any] = []
        for lane in self._shown().lanes:
            end = self.world.pack.road[lane].centre.at(self.world.pack.road[lane].length_m - 1.0)
            found.append(self.world.map.get_waypoint(transform_of(carla, end).location))
        return found

    def get_state(self) -> Any:
        forced = self.world.forced.get(self.id)
        return forced or getattr(carla.TrafficLightState, self._shown().state.capitalize())

    def set_state(self, state: Any) -> None:
        self.world.forced[self.id] = state
        self.world.town.force_signal(str(self.id), str(state).lower())  # type: ignore[arg-type]

    def freeze(self, frozen: bool) -> None:
        if not frozen:
            self.world.forced.pop(self.id, None)
            self.world.town.force_signal(str(self.id), None)


class StandInWorld:
    """What `carla.Client.get_world()` gives."""

    def __init__(self, pack: MapPack, vehicles: int) -> None:
        self.pack, self.vehicles, self.town = pack, vehicles, TownWorld(pack)
        self.map = carla.Map(pack.name, pack.xodr_text())
        self.settings = carla.WorldSettings()
        self.forced: dict[int, Any] = {}
        self.sensor = CollisionSensor()
        self.ego: Actor | None = None
        self.dies = False

    @property
    def time_s(self) -> float:
        return self.town.observe().time_s

    def seen(self, number: int) -> VehicleState:
        return self.town.perception().vehicle(number)

    def get_map(self) -> Any:
        return self.map

    def get_settings(self) -> Any:
        copy = carla.WorldSettings()
        copy.synchronous_mode, copy.fixed_delta_seconds = self.settings.synchronous_mode, 0.05
        return copy

    def apply_settings(self, settings: Any) -> None:
        self.settings = settings

    def get_blueprint_library(self) -> Many:
        names = ("vehicle.lincoln.mkz_2017", "sensor.other.collision", *KINDS.values())
        return Many([Blueprint(name) for name in names])

    def get_actors(self) -> Many:
        lights = [Light(self, head.id) for group in self.pack.signals for head in group.heads]
        if self.ego is None:
            return Many(list(lights))
        others = [Actor(self, one.id, KINDS.get(one.kind, KINDS["car"])) for one in self.town.observe().others]
        return Many([self.ego, *others, *lights])

    def try_spawn_actor(self, blueprint: Blueprint, transform: Any) -> Any:
        pose = pose_of(transform)
        if "lincoln" in blueprint.id:
            start = (pose.x_m, pose.y_m, pose.heading_rad)
            config = {"town": self.pack.name, "start": start, "vehicles": self.vehicles, "people": 0}
            self.town.reset(Scenario("stand-in", "town", {**config, "contact_ends": False}, 5))
            self.ego = Actor(self, 0, blueprint.id)
            return self.ego
        kind = next(kind for kind, name in KINDS.items() if name == blueprint.id)
        return Actor(self, self.town.spawn(kind, pose), blueprint.id)  # type: ignore[arg-type]

    def spawn_actor(self, blueprint: Blueprint, transform: Any, attach_to: Any) -> CollisionSensor:
        assert attach_to is self.ego
        del blueprint, transform
        return self.sensor

    def tick(self) -> int:
        if self.dies:
            raise RuntimeError("time-out of 10000ms while waiting for the simulator")
        assert self.settings.synchronous_mode
        assert self.ego is not None
        asked, speed = self.ego.asked, self.town.observe().ego.speed_mps
        if asked is not None:
            self.town.step(Command(math.copysign(asked.acceleration, asked.speed - speed), -asked.steer))
        for one in self.town.observe().others:
            if one.crashed and self.sensor.tell is not None:
                self.sensor.tell(CollisionStandIn(Actor(self, one.id, KINDS.get(one.kind, KINDS["car"]))))
        return 0


@dataclass
class CollisionStandIn:
    other_actor: Actor


@dataclass
class StandInClient:
    """What `carla.Client` is."""

    world: StandInWorld
    server_version: str = VERSION
    maps: list[str] = field(default_factory=lambda: [f"/Game/Carla/Maps/Town0{n}" for n in range(1, 7)])

    def get_client_version(self) -> str:
        return VERSION

    def get_server_version(self) -> str:
        return self.server_version

    def get_world(self) -> StandInWorld:
        return self.world

    def load_world(self, name: str) -> StandInWorld:
        raise RuntimeError(f"map {name} not found")

    def get_available_maps(self) -> list[str]:
        return self.maps
