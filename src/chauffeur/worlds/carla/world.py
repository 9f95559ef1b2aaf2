"""A CARLA server as a world: synchronous, at 20 Hz, driven and observed like the town; no picture is rendered.

The road graph is read from the server's own OpenDRIVE, so lanes have the names they have in map packs of the same town.
Traffic is the server's Traffic Manager, seeded. Nothing here has been run against a real server yet: the contract is
tested against a stand-in that the town feeds and that speaks in the client library's own value classes.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, Field

from chauffeur.concept import (
    AgentKind,
    Command,
    LaneId,
    Observation,
    Scenario,
    ScenarioError,
    Signal,
    SignalState,
    VehicleState,
)
from chauffeur.control.kinematic_bicycle import LINCOLN_MKZ, KinematicBicycle
from chauffeur.geometry import LanePlace, Pose, RoadGraph, Route, plan_route
from chauffeur.geometry.opendrive import OpenDriveError, parse_opendrive
from chauffeur.worlds.base import EGO
from chauffeur.worlds.carla.frames import forward_mps, pose_of, transform_of
from chauffeur.worlds.carla.server import EGO_BLUEPRINTS, connect, library
from chauffeur.worlds.path_follower import Chassis
from chauffeur.worlds.skeleton import WorldBase, config_of, finite, set_up
from chauffeur.worlds.town.driver import TOWN_CAPABILITIES, TownDriver
from chauffeur.worlds.town.perception import TownPerception

DT_S: Final = 0.05
SEES_M: Final = 100.0
_LIFT_M: Final = 0.5
"""So far above the road cars are put in."""
_LAG_S: Final = 0.2
"""Time until pedals and wheel have answered."""
_STRAY_S: Final = 0.02
"""Offset of a stop from where a bicycle model puts it, m for every m/s: at 15 m/s as much as lanes leave this car."""
_TOUCH_S: Final = 0.2
"""A contact is told for so long after the server's last word of it."""
_STATES: Final[dict[str, SignalState]] = {"Red": "red", "Yellow": "yellow", "Green": "green"}
_BLUEPRINTS: Final[dict[AgentKind, str]] = {
    "car": "vehicle.tesla.model3",
    "truck": "vehicle.carlamotors.carlacola",
    "bus": "vehicle.mitsubishi.fusorosa",
    "motorcycle": "vehicle.yamaha.yzf",
    "bicycle": "vehicle.diamondback.century",
    "pedestrian": "walker.pedestrian.0001",
    "static": "static.prop.vendingmachine",
    "obstacle": "static.prop.constructioncone",
}


class CarlaConfig(BaseModel):
    """A trip on a server: the fields of the town's configuration that a server understands."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    town: str
    start: tuple[str, float] | tuple[float, float, float]
    goal: tuple[float, float] | None = None
    lanes: tuple[str, ...] = ()
    start_m: float = 0.0
    goal_m: float | None = None
    vehicles: int = Field(default=60, ge=0, le=400)
    duration_s: float = Field(default=600.0, gt=0.0, le=36_000.0)
    contact_ends: bool = True


class CarlaWorld(WorldBase[TownPerception, TownDriver]):
    """A CARLA server, stepped at 20 Hz."""

    capabilities = TOWN_CAPABILITIES
    dt_s = DT_S
    """Control period, s."""

    def __init__(self, client: Any = None) -> None:
        """Args: a `carla.Client`; by default one of the server that the environment names."""
        self._client = client
        self._actors: list[Any] = []
        self._world: Any = None
        self._before: Any = None

    @property
    def engine(self) -> str:
        """CARLA and the server's version."""
        return "carla" if self._client is None else f"carla-{self._client.get_server_version()}"

    @property
    def car(self) -> KinematicBicycle:
        """The ego, as a filter may count on it: CARLA's physics answer later than a bicycle."""
        return replace(LINCOLN_MKZ, lag_s=_LAG_S, stray_s=_STRAY_S)

    @property
    def chassis(self) -> Chassis:
        """The ego's size and axles."""
        return Chassis.of(self.car)

    def reset(self, scenario: Scenario, seed: int | None = None) -> Observation:
        """Load the town, put in ego and traffic.

        Raises:
            ScenarioError: No server answers, it lacks the town or the car, or the configuration is malformed.
            MissingExtraError: The client library is not installed.
        """
        config = config_of(CarlaConfig, scenario, "CARLA")
        self._carla, self._config = library(), config
        if self._client is None:
            self._client = connect()
        self.close()
        try:
            world = self._client.get_world()
            if not str(world.get_map().name).endswith(config.town):
                world = self._client.load_world(config.town)
            self._world = world
            self._before = world.get_settings()
            settings = world.get_settings()
            settings.synchronous_mode, settings.no_rendering_mode = True, True
            settings.fixed_delta_seconds = DT_S
            world.apply_settings(settings)
            self._road = parse_opendrive(world.get_map().to_opendrive().encode()).road
        except (RuntimeError, OpenDriveError) as error:
            raise ScenarioError(
                f"The CARLA server cannot set up {config.town!r}: {error}.", hint="See: chauffeur doctor."
            ) from error
        start, self._route = self._ways(config)
        pose = self._road[start.lane].centre.at(start.station_m)
        self._ego = self._put(EGO_BLUEPRINTS, pose)
        self._ids: dict[int, int] = {int(self._ego.id): EGO}
        self._touched: dict[int, float] = {}
        self._staged: dict[int, Any] = {}
        sensor = world.spawn_actor(
            world.get_blueprint_library().find("sensor.other.collision"), self._carla.Transform(), attach_to=self._ego
        )
        sensor.listen(self._collided)
        self._actors.append(sensor)
        self._lights = [self._light(one) for one in world.get_actors().filter("traffic.traffic_light*")]
        self._fill(config.vehicles, scenario.seed if seed is None else seed)
        self._tick, self._crashed, self._steering = 0, False, 0.0
        self._shown = None
        world.tick()
        self._driver = TownDriver(self._road, LINCOLN_MKZ, DT_S, self.observe, self._route)
        self._perception = TownPerception(self._road, self.observe, self._driver)
        self._shown = None
        return self.observe()

    def close(self) -> None:
        """Take away what was put in, and give the server its own pace back."""
        for actor in reversed(self._actors):
            actor.destroy()
        self._actors = []
        if self._world is not None and self._before is not None:
            self._world.apply_settings(self._before)
        self._before = None

    def step(self, command: Command) -> Command:
        """Advance 50 ms under `command`. Raises ScenarioError: the server died."""
        finite(command)
        asked = max(-LINCOLN_MKZ.most_braking_mps2, min(LINCOLN_MKZ.most_acceleration_mps2, command.acceleration_mps2))
        wheel = max(-LINCOLN_MKZ.most_steering_rad, min(LINCOLN_MKZ.most_steering_rad, command.steering_rad))
        speed = max(0.0, self.observe().ego.speed_mps + asked)  # where it leads within a second
        self._ego.apply_ackermann_control(
            self._carla.VehicleAckermannControl(steer=-wheel, speed=speed, acceleration=abs(asked))
        )
        try:
            self._world.tick()
        except RuntimeError as error:
            raise ScenarioError(f"The CARLA server stopped answering: {error}.", hint="Start it again.") from error
        self._tick += 1
        self._shown, self._steering = None, wheel
        return Command(asked, wheel)

    # The stage of a scenario ------------------------------------------------------------------------------------------

    def spawn(self, kind: AgentKind, pose: Pose, speed_mps: float = 0.0) -> int:
        if kind not in _BLUEPRINTS:
            raise ScenarioError(f"CARLA has no road user of the kind {kind!r}.")
        actor = self._put((_BLUEPRINTS[kind],), pose)
        number = self._number(actor)
        self._staged[number] = actor
        self.drive(number, pose, speed_mps)
        return number

    def drive(self, actor: int, pose: Pose, speed_mps: float) -> None:
        one, c = self._staged[actor], self._carla
        one.set_transform(transform_of(c, pose, float(one.get_location().z)))
        x, y = speed_mps * math.cos(pose.heading_rad), -speed_mps * math.sin(pose.heading_rad)
        one.set_target_velocity(c.Vector3D(x, y, 0.0))
        self._shown = None

    def remove(self, actor: int) -> None:
        one = self._staged.pop(actor, None)
        if one is not None:
            self._actors.remove(one)
            one.destroy()
            self._shown = None

    def force_signal(self, signal: str, state: SignalState | None) -> None:
        """See `worlds.base.Stage`. Raises KeyError for a light that is not there."""
        light = {str(one.id): one for one, _, _ in self._lights}[signal]
        if state is None:
            light.freeze(False)
        else:
            light.set_state(getattr(self._carla.TrafficLightState, state.capitalize()))
            light.freeze(True)
        self._shown = None

    # Parts ------------------------------------------------------------------------------------------------------------

    def _ways(self, config: CarlaConfig) -> tuple[LanePlace, Route | None]:
        road = self._road
        if config.lanes:
            unknown = [lane for lane in config.lanes if lane not in road]
            if unknown:
                raise ScenarioError(f"{config.town} has no lane {unknown[0]!r}, which the route names.")
            end = road[config.lanes[-1]].length_m if config.goal_m is None else config.goal_m
            return LanePlace(config.lanes[0], config.start_m, 0.0), Route(config.lanes, config.start_m, end)
        first = config.start
        start = (
            LanePlace(first[0], float(first[1]), 0.0)
            if isinstance(first[0], str)
            else _located(road, float(first[0]), first[1], float(first[-1]))
        )
        if start.lane not in road:
            raise ScenarioError(f"{config.town} has no lane {start.lane!r}.")
        if config.goal is None:
            return start, None
        route = plan_route(road, start, _located(road, *config.goal))
        if route is None:
            raise ScenarioError(f"No way leads to {config.goal} from here.")
        return start, route

    def _put(self, names: tuple[str, ...], pose: Pose) -> Any:
        """Put in the first kind of actor of these that the server has. Raises ScenarioError."""
        known = {one.id: one for one in self._world.get_blueprint_library()}
        blueprint = next((known[name] for name in names if name in known), None)
        if blueprint is None:
            raise ScenarioError(f"The CARLA server has no {names[0]}.", hint="See: chauffeur doctor.")
        height = self._world.get_map().get_waypoint(transform_of(self._carla, pose).location)
        z = _LIFT_M + (0.0 if height is None else float(height.transform.location.z))
        actor = self._world.try_spawn_actor(blueprint, transform_of(self._carla, pose, z))
        if actor is None:
            raise ScenarioError(f"There is no room for a {names[0]} at ({pose.x_m:.1f}, {pose.y_m:.1f}).")
        self._actors.append(actor)
        return actor

    def _fill(self, count: int, seed: int) -> None:
        """The server's own traffic."""
        if not count:
            return
        manager = self._client.get_trafficmanager()
        manager.set_synchronous_mode(True)
        manager.set_random_device_seed(seed % 2**31)
        cars = [one for one in self._world.get_blueprint_library().filter("vehicle.*") if one.id not in EGO_BLUEPRINTS]
        for i, place in enumerate(self._world.get_map().get_spawn_points()[:count]):
            actor = self._world.try_spawn_actor(cars[(seed + i) % len(cars)], place)
            if actor is not None:
                actor.set_autopilot(True, manager.get_port())
                self._actors.append(actor)

    def _light(self, light: Any) -> tuple[Any, tuple[LaneId, ...], tuple[tuple[float, float], tuple[float, float]]]:
        """A light, the lanes it rules, and its stop line: those of the server's stop waypoints."""
        stops = light.get_stop_waypoints()
        lanes = tuple(name for one in stops if (name := f"{one.road_id}:{one.section_id}:{one.lane_id}") in self._road)
        ends = [
            pose_of(one.transform).place(0.0, side * float(one.lane_width) / 2.0) for one in stops for side in (1, -1)
        ]
        first, last = (ends[0], ends[-1]) if ends else ((0.0, 0.0), (0.0, 0.0))
        return light, lanes, (first, last)

    def _collided(self, event: Any) -> None:
        self._touched[int(event.other_actor.id)] = self._tick * DT_S
        self._crashed = True

    def _number(self, actor: Any) -> int:
        return self._ids.setdefault(int(actor.id), len(self._ids))

    def _state(self, actor: Any) -> VehicleState:
        pose, box = pose_of(actor.get_transform()), actor.bounding_box.extent
        name = str(actor.type_id)
        kind: AgentKind = "pedestrian" if name.startswith("walker") else _kind(name, actor)
        place = None if kind == "pedestrian" else self._road.locate(pose.x_m, pose.y_m, pose.heading_rad, ("driving",))
        speed = forward_mps(actor.get_velocity(), pose.heading_rad)
        turn = actor.get_angular_velocity()
        touched = self._tick * DT_S - self._touched.get(int(actor.id), -math.inf) <= _TOUCH_S
        return VehicleState(
            self._number(actor),
            kind,
            pose.x_m,
            pose.y_m,
            pose.heading_rad,
            speed,
            2.0 * float(box.x),
            2.0 * float(box.y),
            None if place is None else place.lane,
            touched,
            forward_mps(actor.get_acceleration(), pose.heading_rad),
            -math.radians(float(turn.z)),
        )

    def _look(self) -> Observation:
        set_up(self._world)
        own = self._state(self._ego)
        off_road = self._road.ground.off_road(own.x_m, own.y_m)
        crashed = self._crashed and self._config.contact_ends
        ego = VehicleState(
            EGO,
            "car",
            own.x_m,
            own.y_m,
            own.heading_rad,
            own.speed_mps,
            own.length_m,
            own.width_m,
            own.lane,
            crashed,
            own.acceleration_mps2,
            own.yaw_rate_radps,
            self._steering,
        )
        actors = self._world.get_actors()
        around = [*actors.filter("vehicle.*"), *actors.filter("walker.*"), *actors.filter("static.prop.*")]
        near = [one for one in around if int(one.id) != int(self._ego.id) and _near(one, ego)]
        others = tuple(sorted((self._state(one) for one in near), key=lambda one: one.id))
        driver = self._driver
        sign = None if driver is None else driver.stop_sign
        return Observation(
            time_s=round(self._tick * DT_S, 6),
            tick=self._tick,
            kind="town",
            ego=ego,
            others=others,
            objects=(),
            road=self._road,
            front=None if driver is None else driver.lead,
            stop_sign_m=None if sign is None else sign[1],
            off_road=off_road,
            ended=crashed or off_road or self._tick * DT_S >= self._config.duration_s,
            signals=tuple(
                Signal(str(light.id), _STATES.get(str(light.get_state()), "off"), lanes, line)
                for light, lanes, line in self._lights
                if lanes and math.dist(line[0], (ego.x_m, ego.y_m)) < SEES_M
            ),
            signs=(),
            route=self._route if driver is None else driver.route,
        )


def _located(road: RoadGraph, x_m: float, y_m: float, heading_rad: float | None = None) -> LanePlace:
    place = road.locate(x_m, y_m, heading_rad, ("driving",))
    if place is None:
        raise ScenarioError(f"There is no lane at ({x_m}, {y_m}).")
    return place


def _near(actor: Any, ego: VehicleState) -> bool:
    place = actor.get_location()
    return math.hypot(float(place.x) - ego.x_m, -float(place.y) - ego.y_m) < SEES_M


def _kind(name: str, actor: Any) -> AgentKind:
    if name.startswith("static"):
        return "static"
    known: dict[str, AgentKind] = {"truck": "truck", "van": "car", "bus": "bus", "bicycle": "bicycle"}
    known["motorcycle"] = "motorcycle"
    return known.get(str(actor.attributes.get("base_type", "car")), "car")
