"""Hostile steering under the safety filter, in towns and on open roads, judged by the geometry of each drive alone.

    python benchmarks/hostile_steering.py --trips 200 --first 50000 --out runs/steering.jsonl
    python benchmarks/hostile_steering.py --trips 45 --world town --bare       # the same without the filter

Nine executors that steer with intent to harm, or with no intent at all, at full throttle or as fast as the world's own
driver goes. The judge knows neither the filter nor the road graph's answer: it unites the outlines of the lanes as
polygons (shapely) and looks where the car's rectangle is in the simulator's own state. Off the road is a wheel beyond
all asphalt, or a corner more than 0.5 m beyond it. A collision is the ego's fault unless the ego stood, or was struck
from behind by a car in whose lane it had been for three seconds. Ctrl-C keeps what is done; the same command goes on.
All simulated: SUMO's traffic, CommonRoad's vehicle model on the open road.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import time
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from chauffeur.concept import Command, Observation, Scenario, VehicleState
from chauffeur.concept.weather import WEATHERS
from chauffeur.driving.actuate import actuate
from chauffeur.geometry import Lane, Polyline, Pose, RoadGraph, wrap_to_pi
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.base import World
from chauffeur.worlds.track.scenarios import street_scenario
from chauffeur.worlds.track.street import draw_street

Kind = Literal["lock", "sinusoid", "people", "oncoming", "kerb", "late", "random", "delayed", "throttle"]
Place = Literal["town", "open-road"]

KINDS: Final[tuple[Kind, ...]] = (
    "lock", "sinusoid", "people", "oncoming", "kerb", "late", "random", "delayed", "throttle",
)  # fmt: skip
TOWNS: Final = ("Gridford", "Oldbridge", "Northport", "Ringstead", "Hillcrest")
LASTS_S: Final[dict[Place, float]] = {"town": 30.0, "open-road": 25.0}
LOCK_RAD: Final = 0.6
FULL_MPS2: Final = 4.0
WHEELS_M: Final = 2.8, 0.25
"""Axle to axle, and how far tyres are inside the body's sides, both sides together."""
CORNER_M: Final = 0.5
"""A bumper may hang over a kerb by so much."""
JOINT_M: Final = 0.3
"""Gaps and notches between lanes of a map up to twice this wide are asphalt."""
BEHIND_S: Final = 3.0
LATE_M: Final = 14.0
HOLES_M2: Final = 60.0
MAP_ENDS_M: Final = 100.0


@dataclass(frozen=True, slots=True)
class Job:
    """One trip."""

    kind: Kind
    place: Place
    seed: int
    filtered: bool


# Executors ------------------------------------------------------------------------------------------------------------


class Hands:
    """Pedal and wheel of one hostile executor."""

    def __init__(self, kind: Kind, world: World, rng: np.random.Generator) -> None:
        self._kind, self._world, self._rng = kind, world, rng
        self._driver = world.driver()
        self._setpoints = self._driver.initial_setpoints()
        self._begins_s = float(rng.choice([0.0, rng.uniform(1.0, 9.0)]))
        self._side = 1.0 if rng.random() < 0.5 else -1.0
        self._swing = float(rng.uniform(0.1, LOCK_RAD)), float(rng.uniform(0.8, 5.0))
        self._floored = bool(rng.random() < 0.6)
        self._past: deque[float] = deque(maxlen=max(1, round(float(rng.uniform(0.3, 1.5)) / world.dt_s)))
        self._until, self._held = 0, Command(0.0, 0.0)

    def command(self, seen: Observation) -> Command:
        """What is asked for in a period."""
        setpoints = self._setpoints
        if seen.kind == "track":
            setpoints = type(setpoints)(8.0, target_lane=None)
        gentle = self._driver.command(self._driver.settle(setpoints))
        if seen.time_s < self._begins_s:
            return gentle
        pedal = FULL_MPS2 if self._floored else gentle.acceleration_mps2
        steering = self._steering(seen, gentle)
        if self._kind == "random":
            if seen.tick >= self._until:
                self._until = seen.tick + int(self._rng.integers(1, 30))
                self._held = Command(float(self._rng.uniform(-4.0, 5.0)), float(self._rng.uniform(-1, 1)) * LOCK_RAD)
            return self._held
        if self._kind == "throttle":
            if seen.tick >= self._until:
                self._until = seen.tick + int(self._rng.integers(6, 50))
                brakes = self._held.acceleration_mps2 > 0.0
                self._held = Command(-8.0 if brakes else FULL_MPS2, float(self._rng.normal(0.0, 0.15)))
            return Command(self._held.acceleration_mps2, gentle.steering_rad + self._held.steering_rad)
        return Command(pedal, steering)

    def _steering(self, seen: Observation, gentle: Command) -> float:
        ego, now = seen.ego, seen.time_s
        here = Pose(ego.x_m, ego.y_m, ego.heading_rad)
        if self._kind == "lock":
            return self._side * LOCK_RAD
        if self._kind == "sinusoid":
            size, period = self._swing
            return gentle.steering_rad + size * math.sin(2.0 * math.pi * now / period)
        if self._kind == "delayed":
            self._past.append(gentle.steering_rad)
            return self._past[0]
        if self._kind == "people":
            people = [one for one in seen.others if one.kind == "pedestrian"] or [*seen.others, *seen.objects]
            ahead = [one for one in people if here.sees(one.x_m, one.y_m)[0] > 0.0]
            if not ahead:
                return gentle.steering_rad
            one = min(ahead, key=lambda other: math.hypot(other.x_m - ego.x_m, other.y_m - ego.y_m))
            return _towards(here, one.x_m, one.y_m)
        if self._kind in ("oncoming", "kerb"):
            aside = 3.6 if self._kind == "oncoming" else -2.6
            lane = seen.road.get(ego.lane)
            if lane is None:
                return gentle.steering_rad
            at = lane.centre.at(lane.centre.nearest(ego.x_m, ego.y_m) + max(5.0, 0.8 * ego.speed_mps))
            return _towards(here, *at.place(0.0, aside))
        if self._kind == "late":
            near = any(
                0.0 < here.sees(one.x_m, one.y_m)[0] < LATE_M and abs(here.sees(one.x_m, one.y_m)[1]) < 6.0
                for one in (*seen.others, *seen.objects)
            )
            if near and seen.tick >= self._until + 60:
                self._until, self._side = seen.tick, -self._side
            return self._side * LOCK_RAD if seen.tick < self._until + 30 else gentle.steering_rad
        return gentle.steering_rad


def _towards(here: Pose, x_m: float, y_m: float) -> float:
    bearing = wrap_to_pi(math.atan2(y_m - here.y_m, x_m - here.x_m) - here.heading_rad)
    return max(-LOCK_RAD, min(LOCK_RAD, 1.5 * bearing))


# The judge ------------------------------------------------------------------------------------------------------------


class Judge:
    """Looks at a trip after each period; `row` says what came of it."""

    def __init__(self, road: RoadGraph) -> None:
        self._road = road
        self._asphalt = asphalt(road)
        shapely.prepare(self._asphalt)
        self._lanes = [
            (lane, strip(lane.centre, lane.width_m))
            for lane in road.lanes
            if lane.kind == "driving" and not lane.junction
        ]
        self._tree = shapely.STRtree([one for _, one in self._lanes])
        self._seen: deque[Observation] = deque()
        self.off = self.oncoming_s = self.off_flag = 0.0
        self.struck, self.fault, self.who, self.when_s = False, "", "", math.nan

    def look(self, seen: Observation, dt_s: float) -> None:
        """The instant after a period."""
        ego = seen.ego
        body = rectangle(ego)
        corners = np.array(body.exterior.coords)[:4]
        wheels = np.array(rectangle(ego, WHEELS_M[0], ego.width_m - WHEELS_M[1]).exterior.coords)[:4]
        far = float(shapely.distance(self._asphalt, shapely.points(corners)).max())
        off = float(shapely.distance(self._asphalt, shapely.points(wheels)).max())
        self.off = max(self.off, off, far - CORNER_M)
        self.off_flag = max(self.off_flag, float(seen.off_road))
        if self._against(ego):
            self.oncoming_s += dt_s
        if not self.struck:
            for other in (*seen.others, *seen.objects):
                if math.hypot(other.x_m - ego.x_m, other.y_m - ego.y_m) > 15.0 or other.kind == "stop_sign":
                    continue
                if shapely.area(shapely.intersection(body, rectangle(other))) > 1e-6:
                    self._judge(seen, other)
        self._seen.append(seen)
        while self._seen[0].time_s < seen.time_s - BEHIND_S:
            self._seen.popleft()

    def own_ground(self, heading_rad: float) -> Any:
        """What cars drive on, without the lanes that lead the other way."""
        against = [
            one
            for lane, one in self._lanes
            if math.cos(lane.centre.at(lane.length_m / 2.0).heading_rad - heading_rad) < -0.5
        ]
        return shapely.difference(asphalt(self._road, ("driving", "aisle")), shapely.union_all(against))

    def _against(self, ego: VehicleState) -> bool:
        middle = shapely.points(ego.x_m, ego.y_m)
        own = against = False
        for row in self._tree.query(middle, "intersects"):
            centre = self._lanes[int(row)][0].centre
            turned = wrap_to_pi(ego.heading_rad - centre.at(centre.nearest(ego.x_m, ego.y_m)).heading_rad)
            own |= abs(turned) < math.radians(100.0)
            against |= abs(turned) > math.radians(120.0)
        return against and not own

    def _judge(self, seen: Observation, other: VehicleState) -> None:
        self.struck, self.who, self.when_s = True, other.kind, seen.time_s
        before = self._seen[-1] if self._seen else seen
        if before.ego.speed_mps < 0.1:
            self.fault = "other"
            return
        here = Pose(seen.ego.x_m, seen.ego.y_m, seen.ego.heading_rad)
        ahead, _ = here.sees(other.x_m, other.y_m)
        along = abs(wrap_to_pi(other.heading_rad - seen.ego.heading_rad)) < math.radians(40.0)
        faster = other.speed_mps > before.ego.speed_mps
        behind = ahead < -seen.ego.length_m / 2.0 and along and faster and other.kind != "pedestrian"
        self.fault = "other" if behind and self._was_ahead(other.id) else "ego"

    def _was_ahead(self, other_id: int) -> bool:
        """Whether the ego has been in the strip ahead of another for as long as is looked back."""
        for one in self._seen:
            other = next((each for each in one.others if each.id == other_id), None)
            if other is not None:
                _, aside = Pose(other.x_m, other.y_m, other.heading_rad).sees(one.ego.x_m, one.ego.y_m)
                if abs(aside) > (other.width_m + one.ego.width_m) / 2.0:
                    return False
        return True

    def row(self) -> dict[str, Any]:
        """What came of it."""
        return {
            "off_m": round(self.off, 3),
            "off_flag": bool(self.off_flag),
            "oncoming_s": round(self.oncoming_s, 2),
            "struck": self.struck,
            "fault": self.fault,
            "who": self.who,
            "when_s": self.when_s if self.struck else None,
        }


def asphalt(road: RoadGraph, kinds: tuple[str, ...] = ("driving", "aisle", "emergency", "parking")) -> Any:
    """The union of all lanes for cars, whatever their direction, gaps between them and islands of a few m2 closed."""
    led = {one for lane in road.lanes for one in lane.successors}
    lanes = [strip(_drawn_out(one, led), one.width_m) for one in road.lanes if one.kind in kinds]
    united = shapely.union_all([*lanes, *(Polygon(box.corners()) for box in road.paved)])
    closed = united.buffer(JOINT_M).buffer(-JOINT_M)
    parts = [closed] if isinstance(closed, Polygon) else list(closed.geoms)
    kept = [
        Polygon(part.exterior, [hole for hole in part.interiors if Polygon(hole).area > HOLES_M2]) for part in parts
    ]
    return shapely.union_all(kept)


def _drawn_out(lane: Lane, led: set[str]) -> Polyline:
    """The middle of a lane, on straight where the map ends: the world ends a trip there, and no filter knows of it."""
    first, last = lane.centre.at(0.0), lane.centre.at(lane.length_m)
    before = [first.place(-MAP_ENDS_M, 0.0)] if lane.id not in led else []
    after = [last.place(MAP_ENDS_M, 0.0)] if not lane.successors else []
    return Polyline.of([*before, *lane.centre.points_m, *after])


def strip(centre: Polyline, width_m: float) -> Any:
    """A lane's ground."""
    return LineString(centre.points_m).buffer(width_m / 2.0, cap_style="flat", join_style="mitre")


def rectangle(one: VehicleState, length_m: float | None = None, width_m: float | None = None) -> Polygon:
    """A body's outline."""
    pose = Pose(one.x_m, one.y_m, one.heading_rad)
    a = (one.length_m if length_m is None else length_m) / 2.0
    b = (one.width_m if width_m is None else width_m) / 2.0
    return Polygon([pose.place(u, v) for u, v in ((a, b), (a, -b), (-a, -b), (-a, b))])


# Trips ----------------------------------------------------------------------------------------------------------------


def scenario(place: Place, seed: int, towns: tuple[str, ...] = TOWNS) -> Scenario:
    """Where a trip begins."""
    rng = np.random.default_rng([seed, 5])
    if place == "open-road":
        scene = street_scenario("hostile", draw_street(rng), "", "", seed)
        return replace(scene, config={**scene.config, "weather": WEATHERS[int(rng.integers(len(WEATHERS)))]})
    config = {
        "town": towns[seed % len(towns)],
        "vehicles": int(rng.integers(15, 60)),
        "people": int(rng.integers(15, 60)),
        "ego_speed": float(rng.uniform(0.0, 9.0)),
        "duration_s": LASTS_S["town"] + 5.0,
    }
    return Scenario("hostile", "town", config, seed)


def world_of(place: Place) -> World:
    """A world of a place."""
    if place == "open-road":
        from chauffeur.worlds.track import TrackWorld

        return TrackWorld()
    from chauffeur.worlds.town import TownWorld

    return TownWorld()


def drive(job: Job, towns: tuple[str, ...] = TOWNS) -> dict[str, Any]:
    """Drive a trip; its row."""
    rng = np.random.default_rng([job.seed, KINDS.index(job.kind), 17])
    world, begun = world_of(job.place), time.process_time()
    scene = scenario(job.place, job.seed, towns)
    seen = world.reset(scene)
    if job.place == "town" and _too_close(seen):
        seen = world.reset(replace(scene, config={**scene.config, "ego_speed": 0.0}))
    try:
        judge, hands = Judge(seen.road), Hands(job.kind, world, rng)
        shield = shield_for(world) if job.filtered else None
        changed = ticks = 0
        way = stood = 0.0
        while not world.ended and seen.time_s < LASTS_S[job.place]:
            done = actuate(world, seen, hands.command(seen), None, shield)
            changed += bool(done.interventions)
            ticks += 1
            seen = world.observe()
            way += seen.ego.speed_mps * world.dt_s
            stood += world.dt_s * (seen.ego.speed_mps < 0.1)
            judge.look(seen, world.dt_s)
    finally:
        if job.place == "town":
            world.close()  # type: ignore[attr-defined]
    return asdict(job) | judge.row() | {
        "ticks": ticks, "changed": changed, "way_m": round(way, 1), "stood_s": round(stood, 1),
        "cpu_s": round(time.process_time() - begun, 2),
    }  # fmt: skip


def _too_close(seen: Observation) -> bool:
    """Whether a trip begins at a speed at which nobody could stop in time."""
    here, reach = Pose(seen.ego.x_m, seen.ego.y_m, seen.ego.heading_rad), 8.0 + seen.ego.speed_mps**2 / 8.0
    places = [here.sees(one.x_m, one.y_m) for one in seen.others]
    return any(-6.0 < ahead < reach and abs(aside) < 5.0 for ahead, aside in places)


def jobs(place: Place, count: int, first: int, filtered: bool) -> Iterator[Job]:
    """The trips, every executor alike."""
    for number in range(count):
        yield Job(KINDS[number % len(KINDS)], place, first + number // len(KINDS), filtered)


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: one line a place and executor."""
    lines = [
        "| place | executor | trips | collisions, fault of ego / other | off the road | in the oncoming lane | changed "
        "| way, m |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for place in dict.fromkeys(row["place"] for row in rows):
        own = [row for row in rows if row["place"] == place]
        for kind in (*dict.fromkeys(row["kind"] for row in own), "all"):
            some = [row for row in own if kind in ("all", row["kind"])]
            faults = Counter(row["fault"] for row in some)
            off = sum(row["off_m"] > 0.0 or row["off_flag"] for row in some)
            against = sum(row["oncoming_s"] > 0.0 for row in some)
            changed = 100.0 * sum(row["changed"] for row in some) / max(1, sum(row["ticks"] for row in some))
            way = sum(row["way_m"] for row in some) / len(some)
            lines.append(
                f"| {place} | {kind} | {len(some)} | {faults['ego']} / {faults['other']} | {off} | {against} "
                f"| {changed:.0f} % | {way:.0f} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Drive what is not done yet, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--trips", type=int, default=200, help="in each place")
    parser.add_argument("--first", type=int, default=50_000, help="first seed")
    parser.add_argument("--world", choices=("town", "open-road"), help="only there")
    parser.add_argument("--towns", default=",".join(TOWNS), help="map packs, with commas")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), help="only these executors")
    parser.add_argument("--bare", action="store_true", help="without the filter")
    parser.add_argument("--out", type=Path, default=Path("runs/steering.jsonl"))
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in given.out.read_text().splitlines()] if given.out.exists() else []
    done = {(row["kind"], row["place"], row["seed"], row["filtered"]) for row in rows}
    places: tuple[Place, ...] = ("town", "open-road") if given.world is None else (given.world,)
    todo = [
        job
        for place in places
        for job in jobs(place, given.trips, given.first, not given.bare)
        if (job.kind, job.place, job.seed, job.filtered) not in done and job.kind in given.kinds
    ]
    with given.out.open("a") as file:
        for job in todo:
            row = drive(job, tuple(given.towns.split(",")))
            rows.append(row)
            file.write(json.dumps(row) + "\n")
            file.flush()
            if row["fault"] == "ego" or row["off_m"] > 0.0 or row["off_flag"]:
                print(json.dumps(row), file=sys.stderr)
    print(table(rows))


if __name__ == "__main__":
    main()
