"""From an observation to what is drawn: the same observation, seed and conditions give the same scene."""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from chauffeur.camera.bodies import PAINTS, BodyKind, BodyShape, bodies, gait, kind_of
from chauffeur.camera.furniture import (
    LIGHTS,
    LIMIT,
    STOP,
    YIELD,
    beside_the_road,
    heading_at_line,
    put_sign,
    put_signal,
    sign_pose,
)
from chauffeur.camera.ground import stop_lines
from chauffeur.camera.place import CameraPlace, place_of
from chauffeur.camera.solids import Pile, Solids, X, Y, together
from chauffeur.concept import ScenarioError
from chauffeur.concept.paint import PAINT_RGB
from chauffeur.geometry import Pose, RoadGraph, wrap_to_pi

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chauffeur.camera.look import CameraLook
    from chauffeur.camera.weather import Conditions
    from chauffeur.concept.scene import Observation, VehicleState

    FloatArray = NDArray[np.float64]
    RowArray = NDArray[np.float32]

REACH_M: Final = 230.0
"""What is farther from the ego is not drawn."""
DETAIL_M: Final = 45.0
GLOW: Final = 14
"""Numbers a glow: place, its two half axes, colour, opacity, kind: 0 light on the ground, 1 round a lamp (half size in
the first number of an axis), 2 shadow on the ground, 3 a lamp mirrored by the road, 4 round a lamp that shines one way
(heading in the first number of the second axis)."""
_PLACES_KEPT: Final = 24
_BRAKING_MPS2: Final = -0.6
_STANDING_MPS: Final = 0.3
_DRIFT_RAD: Final = 0.03
"""Heading off the lane's from which a vehicle is taken to change lanes, and shows it."""


@dataclass(frozen=True, slots=True)
class Instance:
    """Something that has a number of its own in the pictures.

    Attributes:
        number: Its value in instance masks, from 1.
        source: Whether it is an agent or object, a traffic light, or a sign.
        id: Its id in the observation.
        kind: What it is: kind of agent, state of the light, kind of sign.
        x_m, y_m, heading_rad: Middle, in the vehicle frame of the ego (origin at its middle, x ahead, y left).
        z_m: Height of its middle.
        length_m, width_m, height_m: Of the box round it.
        speed_mps: Of agents.
    """

    number: int
    source: Literal["agent", "signal", "sign"]
    id: int | str
    kind: str
    x_m: float
    y_m: float
    heading_rad: float
    z_m: float
    length_m: float
    width_m: float
    height_m: float
    speed_mps: float = 0.0

    @property
    def distance_m(self) -> float:
        """From the middle of the ego."""
        return math.hypot(self.x_m, self.y_m)

    @property
    def corners_m(self) -> FloatArray:
        """(8, 3), in the vehicle frame."""
        pose = Pose(self.x_m, self.y_m, self.heading_rad)
        half = self.length_m / 2.0, self.width_m / 2.0, self.height_m / 2.0
        return np.array(
            [
                (*pose.place(a * half[0], b * half[1]), self.z_m + c * half[2])
                for a in (-1, 1)
                for b in (-1, 1)
                for c in (-1, 1)
            ]
        )


@dataclass(frozen=True)
class PlaceView:
    """A place round the ego, its origin moved to a fixed point near the ego so that single precision is enough.

    Attributes:
        place: The whole.
        origin_m: What was taken off.
        triangles: Ground (n, 3, 8).
        solids: What stands.
        lamps_m: Street lamps (n, 3).
    """

    place: CameraPlace
    origin_m: tuple[float, float]
    triangles: RowArray
    solids: Solids
    lamps_m: FloatArray


@dataclass(frozen=True)
class CameraScene:
    """All that a renderer needs besides cameras.

    Attributes:
        view: The static part.
        ego: Pose in the view's frame.
        ego_size_m: (length, width) of the ego.
        movable: Solids of agents, lights and signs.
        ego_solids: The ego itself: it casts a shadow, and is in no picture.
        lines: Triangles of stop lines and crossings.
        glows: Lamps' light and shadows (n, 14).
        instances: What has a number.
        tick: Of the observation; seeds what falls from the sky.
        seed: Of the place.
        time_s: Of the observation.
    """

    view: PlaceView
    ego: Pose
    ego_size_m: tuple[float, float]
    movable: Solids
    ego_solids: Solids
    lines: RowArray
    glows: RowArray
    instances: tuple[Instance, ...]
    tick: int
    seed: int
    time_s: float


class SceneBuilder:
    """Builds scenes; keeps the places of the roads it saw last."""

    def __init__(self) -> None:
        """Begins with none."""
        self._places: OrderedDict[tuple[int, int, int], CameraPlace] = OrderedDict()
        self._views: OrderedDict[tuple[int, int, int, int, int], PlaceView] = OrderedDict()

    def scene(self, observation: Observation, conditions: Conditions, look: CameraLook, seed: int) -> CameraScene:
        """The scene of an observation. Raises ScenarioError for one without a road graph."""
        road = observation.road
        if not road.lanes:
            raise ScenarioError(
                "This observation has no road graph, so there is nothing to render.",
                hint="Use a world whose observations have `road`.",
            )
        ego = observation.ego
        view = self._view(road, seed, look.palette, ego.x_m, ego.y_m)
        ox, oy = view.origin_m
        own = Pose(ego.x_m - ox, ego.y_m - oy, ego.heading_rad)
        world = Pose(ego.x_m, ego.y_m, ego.heading_rad)
        paints = PAINTS[look.palette % len(PAINTS)]
        instances: list[Instance] = []
        drawn: list[BodyShape] = []
        pile = Pile()
        for agent in (*observation.others, *observation.objects):
            if math.hypot(agent.x_m - ego.x_m, agent.y_m - ego.y_m) > REACH_M:
                continue
            number = len(instances) + 1
            kind = kind_of(agent.kind, agent.id, agent.length_m)
            if kind is None:
                at = beside_the_road(road, agent.x_m, agent.y_m, agent.heading_rad)
                put_sign(pile, STOP, (at[0] - ox, at[1] - oy), agent.heading_rad, number)
                instances.append(_sign(number, agent.id, "stop_sign", world, at, agent.heading_rad))
                continue
            drawn.append(_body(agent, kind, road, number, conditions, paints, (ox, oy), world))
            instances.append(_agent(number, agent, drawn[-1], world))
        lines: list[tuple[tuple[tuple[float, float], tuple[float, float]], float, bool, bool]] = []
        lights: list[tuple[tuple[float, float, float], tuple[float, float, float]]] = []
        for signal in observation.signals:
            (ax, ay), (bx, by) = signal.stop_line_m
            if math.hypot(ax - ego.x_m, ay - ego.y_m) > REACH_M:
                continue
            number = len(instances) + 1
            heading = heading_at_line(road, signal.lanes, signal.stop_line_m)
            lines.append((((ax - ox, ay - oy), (bx - ox, by - oy)), heading, False, True))
            shifted = Pile()
            lit = put_signal(shifted, road, signal, number)
            pile.take(shifted, -ox, -oy)
            if signal.state != "off":
                lights.append(((lit[0] - ox, lit[1] - oy, lit[2]), LIGHTS[signal.state]))
            at = world.sees(lit[0], lit[1])
            instances.append(
                Instance(
                    number, "signal", signal.id, signal.state, *at, wrap_to_pi(heading - ego.heading_rad), 5.27,
                    0.3, 0.78, 1.7,
                )
            )  # fmt: skip
        for sign in observation.signs:
            if math.hypot(sign.x_m - ego.x_m, sign.y_m - ego.y_m) > REACH_M:
                continue
            number = len(instances) + 1
            at, heading = sign_pose(road, sign)
            face = {"stop": STOP, "yield": YIELD}.get(sign.kind, LIMIT)
            put_sign(pile, face, (at[0] - ox, at[1] - oy), heading, number, _shown_limit(sign.value))
            instances.append(_sign(number, sign.id, sign.kind, world, at, heading))
            if sign.stop_line_m is not None:
                (ax, ay), (bx, by) = sign.stop_line_m
                way = heading_at_line(road, sign.lanes, sign.stop_line_m)
                lines.append((((ax - ox, ay - oy), (bx - ox, by - oy)), way, sign.kind == "yield", False))
        movable = together([bodies(drawn), pile.solids()])
        own_body = BodyShape("car", own.x_m, own.y_m, own.heading_rad, ego.length_m, ego.width_m, paints[0], 0)
        glows = _glows(view, drawn, lights, conditions)
        return CameraScene(
            view, own, (ego.length_m, ego.width_m), movable, bodies([own_body]), stop_lines(lines), glows,
            tuple(instances), observation.tick, seed, observation.time_s,
        )  # fmt: skip

    def _view(self, road: RoadGraph, seed: int, palette: int, x_m: float, y_m: float) -> PlaceView:
        cell = round(x_m / 50.0), round(y_m / 50.0)
        key = (id(road), seed, palette, *cell)
        found = self._views.get(key)
        if found is not None and found.place.road is road:
            self._views.move_to_end(key)
            return found
        place = self._place(road, seed, palette)
        origin = cell[0] * 50.0, cell[1] * 50.0
        near = REACH_M + 40.0
        centres = place.ground.middles
        kept = np.abs(centres - np.array(origin)).max(axis=1) < near if len(centres) else np.zeros(0, bool)
        triangles = place.ground.triangles[kept].astype(np.float64)
        triangles[:, :, 0] -= origin[0]
        triangles[:, :, 1] -= origin[1]
        rows = place.solids.rows
        solids = place.solids.chosen(np.hypot(rows[:, X] - origin[0], rows[:, Y] - origin[1]) < near)
        moved = solids.rows.copy()
        moved[:, X] -= origin[0]
        moved[:, Y] -= origin[1]
        lamps = place.lamps_m - np.array([*origin, 0.0])
        lamps = lamps[np.hypot(lamps[:, 0], lamps[:, 1]) < near]
        view = PlaceView(place, origin, triangles.astype(np.float32), Solids(moved, solids.shapes), lamps)
        self._views[key] = view
        if len(self._views) > 2 * _PLACES_KEPT:
            self._views.popitem(last=False)
        return view

    def _place(self, road: RoadGraph, seed: int, palette: int) -> CameraPlace:
        key = (id(road), seed, palette)
        found = self._places.get(key)
        # The id of a graph may be another's after it was freed: a kept place keeps its own alive.
        if found is not None and found.road is road:
            self._places.move_to_end(key)
            return found
        place = place_of(road, seed, palette)
        self._places[key] = place
        if len(self._places) > _PLACES_KEPT:
            self._places.popitem(last=False)
        return place


def _shown_limit(value_mps: float | None) -> float:
    """Number on a speed-limit sign: km/h."""
    return 0.0 if value_mps is None else float(min(127, round(value_mps * 3.6 / 5.0) * 5))


def _body(
    agent: VehicleState,
    kind: BodyKind,
    road: RoadGraph,
    number: int,
    conditions: Conditions,
    paints: tuple[tuple[float, float, float], ...],
    origin_m: tuple[float, float],
    world: Pose,
) -> BodyShape:
    paint = paints[(agent.id * 7 + 3) % len(paints)] if agent.colour is None else PAINT_RGB[agent.colour]
    moving = kind in ("car", "suv", "truck", "bus", "motorcycle", "bicycle")
    parked = moving and _parked(agent, road)
    near = math.hypot(agent.x_m - world.x_m, agent.y_m - world.y_m) < DETAIL_M
    braking = moving and not parked and (agent.acceleration_mps2 < _BRAKING_MPS2 or agent.speed_mps < _STANDING_MPS)
    return BodyShape(
        kind,
        agent.x_m - origin_m[0],
        agent.y_m - origin_m[1],
        agent.heading_rad,
        agent.length_m,
        agent.width_m,
        paint,
        number,
        braking and kind != "bicycle",
        conditions.lamps and moving and not parked,
        "both" if agent.crashed and moving else _indicator(agent, road) if moving and kind != "bicycle" else "",
        gait(agent.x_m, agent.y_m) if kind == "pedestrian" else 0.0,
        near,
    )


def _parked(agent: VehicleState, road: RoadGraph) -> bool:
    if agent.speed_mps > 0.05:
        return False
    place = road.locate(agent.x_m, agent.y_m)
    return place is not None and road[place.lane].kind == "parking"


def _indicator(agent: VehicleState, road: RoadGraph) -> Literal["", "left", "right"]:
    if agent.speed_mps > 3.0:
        place = road.locate(agent.x_m, agent.y_m, agent.heading_rad)
        if place is not None and not road[place.lane].junction:
            way = road[place.lane].centre.at(place.station_m).heading_rad
            off = wrap_to_pi(agent.heading_rad - way)
            if abs(off) < 0.5:
                return "left" if off > _DRIFT_RAD else "right" if off < -_DRIFT_RAD else ""
    if abs(agent.steering_rad) > 0.12:
        return "left" if agent.steering_rad > 0.0 else "right"
    return ""


def _agent(number: int, agent: VehicleState, body: BodyShape, world: Pose) -> Instance:
    at = world.sees(agent.x_m, agent.y_m)
    heading = wrap_to_pi(agent.heading_rad - world.heading_rad)
    return Instance(
        number, "agent", agent.id, agent.kind, *at, heading, body.height_m / 2.0, agent.length_m, agent.width_m,
        body.height_m, agent.speed_mps,
    )  # fmt: skip


def _sign(
    number: int, name: int | str, kind: str, world: Pose, at: tuple[float, float], heading_rad: float
) -> Instance:
    place = world.sees(*at)
    heading = wrap_to_pi(heading_rad - world.heading_rad)
    return Instance(number, "sign", name, kind, *place, heading, 2.35, 0.2, 0.95, 0.95)


def _glows(
    view: PlaceView,
    drawn: list[BodyShape],
    lights: list[tuple[tuple[float, float, float], tuple[float, float, float]]],
    conditions: Conditions,
) -> RowArray:
    """Shadows where bodies touch the ground; light of lamps on the ground and round the lamps."""
    rows: list[tuple[float, ...]] = []
    soft = 0.55 - 0.25 * conditions.night
    for body in drawn:
        c, s = math.cos(body.heading_rad), math.sin(body.heading_rad)
        a, b = body.length_m * 0.56, body.width_m * 0.62
        rows.append((body.x_m, body.y_m, 0.02, c * a, s * a, 0.0, -s * b, c * b, 0.0, 0.0, 0.0, 0.0, soft, 2.0))
    dark = conditions.night
    halo = max(0.8 * dark, 0.55 if conditions.lamps else 0.0)
    wet = conditions.wet
    if halo:
        for body in drawn:
            if body.lamps_on or body.braking:
                rows += _vehicle_light(body, halo, dark, wet)
    for place, colour in lights:
        size = 0.5 + 0.5 * halo
        rows.append((*place, size, 0, 0, 0, 0, 0, *(c * (0.35 + 0.45 * halo) for c in colour), 0.0, 1.0))
        if dark * wet:
            rows.append(_streak(place, colour, 0.5 * dark * wet))
    if dark >= 0.3:
        warm = (1.0, 0.80, 0.50)
        for x, y, z in view.lamps_m.tolist():
            rows.append((x, y, z, 1.1, 0, 0, 0, 0, 0, *(0.75 * dark * c for c in warm), 0.0, 1.0))
            rows.append((x, y, 0.03, 11.0, 0, 0, 0, 11.0, 0, *(0.20 * dark * c for c in warm), 0.0, 0.0))
            if wet:
                rows.append(_streak((x, y, z), warm, 0.25 * dark * wet))
    return np.array(rows, np.float32).reshape(-1, GLOW)


def _streak(
    place: tuple[float, float, float], colour: tuple[float, float, float], strength: float
) -> tuple[float, ...]:
    """A lamp mirrored by a wet road; the renderer lays it towards the camera (kind 3)."""
    return (*place, 0.35, 0, 0, 0, 0, 0, *(c * strength for c in colour), 0.0, 3.0)


def _vehicle_light(body: BodyShape, halo: float, dark: float, wet: float) -> list[tuple[float, ...]]:
    pose = Pose(body.x_m, body.y_m, body.heading_rad)
    height = 0.95 if body.kind in ("truck", "bus") else 0.72
    sides = (0.0,) if body.kind in ("motorcycle", "bicycle") else (-0.36, 0.36)
    rows: list[tuple[float, ...]] = []
    red, white = (1.0, 0.12, 0.08), (1.0, 0.96, 0.86)
    for side in sides:
        rear = (*pose.place(-body.length_m / 2.0 - 0.05, side * body.width_m), height)
        strength = (0.75 if body.braking else 0.4) * halo
        size = 0.45 if body.braking else 0.32
        rows.append((*rear, size, 0, 0, body.heading_rad + math.pi, 0, 0, *(c * strength for c in red), 0.0, 4.0))
        if wet * dark:
            rows.append(_streak(rear, red, strength * 0.6 * wet))
        if body.lamps_on:
            front = (*pose.place(body.length_m / 2.0 + 0.05, side * body.width_m), height - 0.06)
            light = [c * 0.85 * halo for c in white]
            rows.append((*front, 0.55, 0, 0, body.heading_rad, 0, 0, *light, 0.0, 4.0))
            if wet * dark:
                rows.append(_streak(front, white, 0.3 * wet))
    if body.lamps_on and dark >= 0.3:
        x, y = pose.place(body.length_m / 2.0 + 9.0, 0.0)
        c, s = math.cos(body.heading_rad), math.sin(body.heading_rad)
        rows.append((x, y, 0.03, c * 10, s * 10, 0, -s * 2.6, c * 2.6, 0, *(0.28 * dark * v for v in white), 0.0, 0.0))
    return rows
