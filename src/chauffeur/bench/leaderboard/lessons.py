"""Lessons for planners in a town: one instruction each, on a short piece of a training route, judged by the rules.

A lesson begins shortly before a manoeuvre of the route and ends behind it. It is done when the piece was driven to its
end without an infraction; else the evaluator says in words what was wrong, for the next attempt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from chauffeur.bench.leaderboard.criteria import RouteReferee
from chauffeur.bench.leaderboard.instructed import InstructedDriver, PlannerSpec, navigator_of
from chauffeur.bench.leaderboard.routes import LeaderboardRoute
from chauffeur.bench.leaderboard.ways import PlannedRoute, plan_official, track_of
from chauffeur.concept import ChauffeurError, Context, Limits, Observation, Plan, PlannerError, PlanRequest, Scenario
from chauffeur.describe import describe
from chauffeur.describe.navigation import NavigationInstruction
from chauffeur.driving.actuate import actuate
from chauffeur.driving.planning import checked
from chauffeur.geometry import LaneId, RoadGraph, Route, named_ways
from chauffeur.safety.checks import DRIVE_CHECKS
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.library import load

BEFORE_M: Final = (35.0, 110.0)
"""A lesson begins so far before its manoeuvre."""
BEHIND_M: Final = 45.0
"""It ends so far behind it..."""
CHANGE_M: Final = 90.0
"""... or so far, where lanes are to be changed."""
VEHICLES: Final = 12
LIMIT_S: Final = 100.0


@dataclass(frozen=True, slots=True)
class Lesson:
    """One instruction on a piece of a route.

    Attributes:
        id: Route, and where on it.
        town: Name of its map pack.
        route: The piece.
        said: The instruction.
        seed: Of traffic.
    """

    id: str
    town: str
    route: Route
    said: NavigationInstruction
    seed: int


@dataclass(frozen=True, slots=True)
class LessonResult:
    """Outcome of an attempt at a lesson.

    Attributes:
        done: Whether it was driven as it was said, without an infraction.
        words: What was wrong; empty where nothing was.
        seconds: Simulated time.
    """

    done: bool
    words: str
    seconds: float = 0.0


def lessons_of(route: LeaderboardRoute, seed: int) -> Iterator[Lesson]:
    """A lesson for each manoeuvre of a route. Raises ChauffeurError: the town is missing, or has no such way."""
    town = load(route.town)
    planned = plan_official(town, route)
    navigator = navigator_of(town, planned.route)
    rng = np.random.default_rng([seed, *route.id.encode()])
    last_m = 0.0
    for at_m in (*navigator.stations, navigator.length_m):
        from_m = max(last_m + 8.0, at_m - float(rng.uniform(*BEFORE_M)))
        over = navigator.changes_at(at_m)
        next_m = min((one for one in navigator.stations if one > at_m + 1.0), default=navigator.length_m)
        to_m = min(navigator.length_m - 1.0, next_m - 5.0 if over else at_m + BEHIND_M, at_m + CHANGE_M)
        last_m = at_m
        if from_m > at_m - 20.0 or to_m < from_m + 25.0 or (over and to_m < at_m + CHANGE_M):
            continue
        said = navigator.instruction(from_m, rng)
        piece = cut(town.road, planned.route, from_m, to_m)
        if not over and any(b not in town.road[a].successors for a, b in pairwise(piece.lanes)):
            continue  # the lane for it has to be changed into first: another lesson
        yield Lesson(f"{route.id}@{from_m:.0f}", route.town, piece, said, seed)


def cut(road: RoadGraph, route: Route, from_m: float, to_m: float) -> Route:
    """The part of a route between two distances along it."""
    lanes: list[LaneId] = []
    start_m = goal_m = 0.0
    at_m = -route.start_m
    for i, lane in enumerate(route.lanes):
        if i and lane in road[route.lanes[i - 1]].successors:
            at_m += road[route.lanes[i - 1]].length_m
        if at_m >= to_m:
            break
        if at_m + road[lane].length_m <= from_m:
            continue
        if not lanes:
            start_m = from_m - at_m
        lanes.append(lane)
        goal_m = min(to_m - at_m, road[lane].length_m)
    return Route(tuple(lanes), max(0.0, start_m), goal_m)


class _Once:
    """Gives one plan, once."""

    def __init__(self, plan: Plan) -> None:
        self._plan: Plan | None = plan
        self.id = self.model = plan.planner

    async def plan(self, request: PlanRequest) -> Plan:
        """The plan; afterwards none is to be had."""
        del request
        found, self._plan = self._plan, None
        if found is None:
            raise PlannerError("A lesson has one plan.")
        return found


class LessonDrive:
    """A lesson, set up: look first, then attempt it. One town a process."""

    def __init__(self, lesson: Lesson, limits: Limits) -> None:
        """Set it up. Raises ChauffeurError: the town or the engine is missing."""
        self._lesson, self._limits = lesson, limits
        self._town = load(lesson.town)
        self._planned = PlannedRoute(lesson.route, track_of(self._town.road, lesson.route))
        self._world = TownWorld(self._town)
        config = {
            "town": lesson.town,
            "start": (lesson.route.lanes[0], lesson.route.start_m),
            "vehicles": VEHICLES,
            "people": 0,
            "duration_s": LIMIT_S + 10.0,
            "contact_ends": False,
        }
        self._seen = self._world.reset(Scenario(f"lesson-{lesson.id}", "town", config, lesson.seed))

    @property
    def context(self) -> Context:
        """The situation at its beginning."""
        return describe(self._seen)

    def attempt(self, plan: Plan) -> LessonResult:
        """Drive a plan. The lesson can be attempted once."""
        refusal = checked(plan, self._seen, self._limits, DRIVE_CHECKS).refusal
        if refusal:
            self._world.close()
            return LessonResult(False, f"The program was not driven: {refusal}")
        referee = RouteReferee(self._planned.track, LIMIT_S)
        spec = PlannerSpec(plan.planner, latency_s=0.0)
        driver = InstructedDriver(
            self._world, self._planned, self._town, spec, 0, planner=_Once(plan), limits=self._limits
        )
        shield, roads, failed, chosen = shield_for(self._world), list[str](), "", set[str]()
        seen = self._seen
        try:
            referee.update(seen)
            while not referee.done:
                actuate(self._world, seen, driver.command(seen), driver.aim, shield)
                chosen.add(driver.setpoints.turn or "")
                seen = self._world.observe()
                referee.update(seen)
                lane = seen.road.get(seen.ego.lane)
                if lane is not None and lane.road and lane.road not in roads:
                    roads.append(lane.road)
            referee.finish(seen)
            failed = "; ".join(driver.tally.reasons) if not driver.tally.driven else ""
        except ChauffeurError as error:
            failed = str(error)
        finally:
            driver.close()
            self._world.close()
        words = " ".join(self._critique(seen, referee, roads, failed))
        wanted = self._lesson.said.kind.split("/")[0]
        if not words and wanted in ("left", "right") and wanted not in chosen:
            words = (
                f"The instruction asks for the way {wanted}; the program chose none, its lane happened to lead there."
            )
        return LessonResult(not words, words, seen.time_s)

    def _critique(self, seen: Observation, referee: RouteReferee, roads: Sequence[str], failed: str) -> Iterator[str]:
        if failed:
            yield f"The program failed: {failed}"
        found = {one.kind: one.message for one in referee.infractions}
        ended = {"route_dev", "vehicle_blocked", "route_timeout"} & found.keys()
        if not failed:
            yield from self._way(seen, roads, through=referee.completion.completed)
        if not referee.completion.completed:
            late = bool({"vehicle_blocked", "route_timeout"} & ended)
            why = "was not through" if late else "had left the way"
            yield f"After {seen.time_s:.0f} s the car {why}; it drove {seen.ego.speed_mps:.1f} m/s then."
        yield from (f"{message}." for kind, message in found.items() if kind not in ended)

    def _way(self, seen: Observation, roads: Sequence[str], *, through: bool) -> Iterator[str]:
        """Which way was taken, and which was meant."""
        road, lanes = seen.road, self._lesson.route.lanes
        for i, lane in enumerate(lanes[:-1]):
            if lanes[i + 1] not in road[lane].successors:
                side = "left" if (road.places_between(lane, lanes[i + 1]) or 0) < 0 else "right"
                if not any(road.places_between(seen.ego.lane or "", one) == 0 for one in lanes[i + 1 :]):
                    yield f"The instruction asks for the lane to the {side}; the car was not in it in the end."
            elif not through and road[lanes[i + 1]].junction and not road[lane].junction:
                ways = {turn: {road[way.exit].road for way in those} for turn, those in named_ways(road, lane).items()}
                meant = {road[one].road for one in lanes[i + 1 :]}
                wanted = next((turn for turn, exits in ways.items() if exits & meant), "")
                taken = next((turn for turn, exits in ways.items() if exits & set(roads) - meant), "")
                if wanted and wanted != taken and not any(exits & meant & set(roads) for exits in ways.values()):
                    yield f"The instruction asks for the way {wanted}; the car took the way {taken or 'it had'}."
                    return
