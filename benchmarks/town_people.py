"""People on crossings: seeded encounters in our own towns, who went first, and whose fault each strike was.

    python benchmarks/town_people.py --encounters 500 --out runs/people.jsonl
    python benchmarks/town_people.py --encounters 500 --driver throttle --shield   # full throttle, the filter decides
    python benchmarks/town_people.py --encounters 100 --driver throttle            # the same without it

A car comes to a crossing whose light is green for it, and somebody walks over the crossing regardless, setting out so
as to be in front of the car: a draw of where the car begins, of the pace, of the side, and of the time that they miss
each other by. Nobody on foot looks, or waits. A strike is the ego's fault where, when the person set foot on the
roadway, it could have stopped before them (reaction 0.5 s, 6 m/s2), or where it stood and then drove into them; it is
the other's where they walk into the side of a car, or step out closer than that. Everything is simulated (SUMO). Ctrl-C
keeps what is done; the same command goes on.
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections import Counter
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np

from chauffeur.concept import Command, Scenario
from chauffeur.driving.actuate import actuate
from chauffeur.geometry import LaneId, Polyline, Pose
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.library import OWN_TOWNS, load
from chauffeur.worlds.town.pack import Crossing, MapPack

DRIVERS: Final = ("expert", "throttle")
LONGEST_S: Final = 25.0
REACTION_S: Final = 0.5
BRAKING_MPS2: Final = 6.0
WALKS_MPS: Final = 0.8, 2.2
STARTS_M: Final = 28.0, 60.0
"""Where the ego begins, before the crossing."""
MISSES_S: Final = -1.5, 2.5
"""By how much the person is early (negative), or late, for a car that keeps its speed."""
APPROACH_MPS: Final = 8.0
KERB_M: Final = 1.2


@dataclass(frozen=True, slots=True)
class Spot:
    """Where a lane meets a crossing: stations on both."""

    town: str
    crossing: Crossing
    lane: LaneId
    lane_m: float
    over_m: float


@cache
def town_of(name: str) -> MapPack:
    """One of our own towns."""
    return load(name)


@cache
def spots() -> tuple[Spot, ...]:
    """All of our own towns, where the ego has room to begin."""
    found: list[Spot] = []
    for folder in sorted(OWN_TOWNS.iterdir()):
        if not folder.is_dir():
            continue
        town = town_of(folder.name)
        for crossing in town.crossings:
            over = Polyline.of(crossing.centre_m)
            for lane in crossing.lanes:
                own = town.road.get(lane)
                if own is None or own.kind != "driving" or own.junction or not own.successors:
                    continue
                found += [
                    Spot(folder.name, crossing, lane, own_m, over_m)
                    for own_m, over_m in own.centre.crossings(over)
                    if own_m > STARTS_M[0] + 5.0
                ]
    return tuple(found)


def meet(seed: int, driver: str, shielded: bool) -> dict[str, Any]:
    """One encounter; a row."""
    rng = np.random.default_rng([seed, 29])
    spot = spots()[int(rng.integers(len(spots())))]
    town = town_of(spot.town)
    away = float(rng.uniform(STARTS_M[0], min(STARTS_M[1], spot.lane_m - 2.0)))
    pace, misses = float(rng.uniform(*WALKS_MPS)), float(rng.uniform(*MISSES_S))
    over = Polyline.of(spot.crossing.centre_m)
    side = bool(rng.random() < 0.5)
    line, to_lane = (over.reversed(), over.length_m - spot.over_m) if side else (over, spot.over_m)
    line_starts = -KERB_M
    sets_out_s = away / APPROACH_MPS + misses - (to_lane - line_starts) / pace

    world = TownWorld(town)
    seen = world.reset(
        Scenario(
            f"people-{seed}",
            "town",
            {
                "town": spot.town,
                "start": (spot.lane, spot.lane_m - away),
                "vehicles": 0,
                "people": 0,
                "ego_speed": APPROACH_MPS,
                "duration_s": LONGEST_S + 5.0,
                "contact_ends": False,
            },
            seed,
        )
    )
    if (light := town.group_of_lane.get(spot.lane)) is not None:
        world.force_signal(light[0].heads[light[1]].id, "green")
    walked = line_starts + max(0.0, -sets_out_s) * pace  # under way already
    actor = world.spawn("pedestrian", _at(line, walked), 0.0)
    wheel, shield = world.driver(), shield_for(world) if shielded else None
    wishes = wheel.initial_setpoints()
    row: dict[str, Any] = {
        "seed": seed,
        "driver": driver,
        "shield": shielded,
        "town": spot.town,
        "engine": world.engine,
    }
    could_stop, struck, closest = True, "", math.inf
    ego_first: bool | None = None
    interventions = 0
    while seen.time_s < LONGEST_S and walked < line.length_m + KERB_M:
        moving = seen.time_s >= sets_out_s
        before, walked = walked, walked + (pace * world.dt_s if moving else 0.0)
        world.drive(actor, _at(line, walked), pace if moving else 0.0)
        ego = seen.ego
        nose = town.road[spot.lane].centre.nearest(ego.x_m, ego.y_m) + ego.length_m / 2.0
        passed = ego.lane != spot.lane or nose > spot.lane_m
        if before <= 0.0 < walked:  # sets foot on the roadway
            needed = ego.speed_mps * REACTION_S + ego.speed_mps**2 / (2.0 * BRAKING_MPS2)
            could_stop = not passed and spot.lane_m - spot.crossing.width_m / 2.0 - nose > needed
        if ego_first is None and (passed or walked > to_lane + ego.width_m / 2.0):
            ego_first = passed
        wanted = wheel.command(wheel.settle(wishes))
        asked = Command(4.0, wanted.steering_rad) if driver == "throttle" else wanted
        speed = ego.speed_mps
        done = actuate(world, seen, asked, None, shield)
        interventions += bool(done.interventions)
        seen = world.observe()
        person = next((one for one in seen.others if one.id == actor), None)
        if person is None:
            continue
        ahead, aside = Pose(seen.ego.x_m, seen.ego.y_m, seen.ego.heading_rad).sees(person.x_m, person.y_m)
        closest = min(closest, math.hypot(ahead, aside))
        if person.crashed and not struck:
            into_side = ahead < seen.ego.length_m / 2.0 - 0.5 or speed < 0.1
            struck = "other" if into_side or not could_stop else "ego"
    world.close()
    return row | {
        "struck": struck,
        "yielded": ego_first is False and not struck,
        "went_first": bool(ego_first),
        "closest_m": round(closest, 2),
        "pace_mps": round(pace, 2),
        "interventions": interventions,
        "could_stop": could_stop,
    }


def _at(line: Polyline, station_m: float) -> Pose:
    return line.at(0.0).ahead(station_m) if station_m < 0.0 else line.at(station_m)


def table(rows: list[dict[str, Any]]) -> str:
    """Markdown: one line a driver."""
    lines = [
        "| driver | filter | encounters | could still stop | let them pass | went first | struck, fault of ego / other "
        "| filter acted |",
        "|---|---|---:|---:|---:|---:|---:|---:|",
    ]
    for driver, shielded in sorted({(row["driver"], row["shield"]) for row in rows}):
        some = [row for row in rows if (row["driver"], row["shield"]) == (driver, shielded)]
        faults = Counter(row["struck"] for row in some)
        counts = [sum(row[name] for row in some) for name in ("could_stop", "yielded", "went_first")]
        acted = sum(row["interventions"] > 0 for row in some)
        lines.append(
            f"| {driver} | {'yes' if shielded else 'no'} | {len(some)} | {counts[0]} | {counts[1]} | {counts[2]} "
            f"| {faults['ego']} / {faults['other']} | {acted} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Drive the encounters that are not done yet, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--encounters", type=int, default=500)
    parser.add_argument("--driver", choices=DRIVERS, default="expert")
    parser.add_argument("--shield", action="store_true", help="whether the safety filter has the last word")
    parser.add_argument("--out", type=Path, default=Path("runs/people.jsonl"))
    args = parser.parse_args()
    args.out.parent.mkdir(parents=True, exist_ok=True)
    rows = [json.loads(line) for line in args.out.read_text().splitlines()] if args.out.is_file() else []
    done = {(row["seed"], row["driver"], row["shield"]) for row in rows}
    began = time.process_time()
    try:
        with args.out.open("a") as book:
            for seed in range(args.encounters):
                if (seed, args.driver, args.shield) not in done:
                    rows.append(meet(seed, args.driver, args.shield))
                    book.write(json.dumps(rows[-1]) + "\n")
                    book.flush()
    except KeyboardInterrupt:
        print(f"Stopped after {len(rows)}.")
    print(table(rows))
    print(f"{time.process_time() - began:.0f} CPU-seconds.")


if __name__ == "__main__":
    main()
