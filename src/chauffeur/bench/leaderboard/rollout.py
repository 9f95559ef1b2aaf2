"""One route driven in a worker: values in, JSON values out. Faults of route, map and engine become results."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from typing import Any, Final

from chauffeur.bench.leaderboard.criteria import RouteReferee
from chauffeur.bench.leaderboard.drivers import RouteDriver, make_driver
from chauffeur.bench.leaderboard.instructed import InstructedDriver, PlannerSpec, PlanningTally
from chauffeur.bench.leaderboard.results import NOT_DRIVEN, status_of
from chauffeur.bench.leaderboard.routes import LeaderboardRoute
from chauffeur.bench.leaderboard.staging import ScenarioWorld
from chauffeur.bench.leaderboard.triggers import Trigger, place
from chauffeur.bench.leaderboard.ways import plan_official
from chauffeur.concept import ChauffeurError, MissingExtraError, Scenario
from chauffeur.driving.actuate import actuate
from chauffeur.safety.shield import shield_for
from chauffeur.worlds.town import TownWorld
from chauffeur.worlds.town.library import load

ROUTE_VERSION: Final = "leaderboard-route-v5"
"""Changes whenever the same driver could come to another result."""

LEADERBOARD_CARS: Final = {
    "Town01": 120,
    "Town02": 100,
    "Town03": 120,
    "Town04": 200,
    "Town05": 120,
    "Town06": 150,
    "Town07": 110,
    "Town10": 120,
}
"""Background vehicles of Leaderboard 1.0."""
MOST_PER_LANE_KM: Final = 8.0
"""Of which so many a kilometre of lane drive here: with the official numbers SUMO's small towns jam."""
SPEED_EVERY: Final = 20
"""The traffic's mean speed is looked at every so many control periods."""


def traffic_of(town: str, lane_km: float, density: float) -> int:
    """Background vehicles of a town: the official number, bounded a kilometre of lane, times a factor."""
    return round(density * min(LEADERBOARD_CARS.get(town, 120), MOST_PER_LANE_KM * lane_km))


@dataclass(frozen=True, slots=True)
class RouteJob:
    """A route to drive.

    Attributes:
        key: Content hash of all that decides the result.
        route: The route.
        triggers: Trigger points of its town.
        driver: One of `drivers.DRIVERS`.
        seed: Of traffic and scenarios.
        density: Factor of the background traffic.
        people: On foot in the background; Leaderboard 1.0 has none.
        limit_s: Simulated time at most, under the rules' own limit; None for theirs.
        shield: Whether the safety filter has the last word on every command.
        planner: Who plans, where the driver is told instructions and knows no route; None for a driver by name.
    """

    key: str
    route: LeaderboardRoute
    triggers: tuple[Trigger, ...]
    driver: str
    seed: int
    density: float
    people: int = 0
    limit_s: float | None = None
    shield: bool = False
    planner: PlannerSpec | None = None

    @property
    def near(self) -> str:
        return self.route.town

    def run(self) -> dict[str, Any]:
        return drive_route(self)

    def spoiled(self, detail: str) -> dict[str, Any]:
        return _result(self, failure="Simulation crashed", detail=detail, infra_failed=True)


def drive_route(job: RouteJob) -> dict[str, Any]:
    """Drive a route and say what came of it; once more where the engine died on the way."""
    found = _driven(job)
    if found["infra_failed"] and found["simulated_s"] > 0.0:
        again = _driven(job)
        said = f"The engine died at {found['simulated_s']:.1f} s ({found['detail']}) and was started again."
        return again | {"detail": f"{said} {again['detail']}".rstrip()}
    return found


def _driven(job: RouteJob) -> dict[str, Any]:
    began = time.process_time()
    route = job.route
    if route.fault:
        return _result(job, failure="Malformed route", detail=f"Route {route.id}: {route.fault}.")
    try:
        town = load(route.town)
        planned = plan_official(town, route)
    except ChauffeurError as error:
        return _result(job, failure="Route cannot be set up", detail=str(error))
    track = planned.track
    placed = place(track, job.triggers)
    referee = RouteReferee(track)
    if job.limit_s is not None:
        referee = RouteReferee(track, min(job.limit_s, referee.limit_s))
    lane_km = sum(lane.length_m for lane in town.road.lanes if lane.kind == "driving") / 1000.0
    cars = traffic_of(route.town, lane_km, job.density)
    way: dict[str, Any] = {
        "lanes": planned.route.lanes,
        "start_m": planned.route.start_m,
        "goal_m": planned.route.goal_m,
    }
    if job.planner is not None:  # told by words where to go: the world knows no goal
        way = {"start": (planned.route.lanes[0], planned.route.start_m)}
    scenario = Scenario(
        id=f"route-{route.id}",
        world="town",
        config={
            "town": route.town,
            **way,
            "vehicles": cars,
            "people": job.people,
            "duration_s": referee.limit_s + 10.0,
            "contact_ends": False,
        },
        seed=job.seed,
    )
    speeds: list[float] = []
    try:
        base = TownWorld(town)
        seen = base.reset(scenario)
    except MissingExtraError as error:
        return _result(job, failure="Simulation crashed", detail=str(error), infra_failed=True)
    except ChauffeurError as error:
        return _result(job, failure="Route cannot be set up", detail=str(error), length_m=track.length_m)
    world = ScenarioWorld(base, track, placed, job.seed)
    instructed: InstructedDriver | None = None
    try:
        if job.planner is not None:
            instructed = InstructedDriver(world, planned, town, job.planner, job.seed)
            driver: RouteDriver = instructed
        else:
            driver = make_driver(job.driver, world, track)
    except ChauffeurError as error:
        base.close()
        return _result(job, failure="Agent couldn't be set up", detail=str(error), length_m=track.length_m)
    shield = shield_for(base) if job.shield else None
    path: list[tuple[float, float]] = []
    interventions = 0
    detail, broken = "", False
    try:
        referee.update(seen)
        while not referee.done:
            requested = driver.command(seen)
            done = actuate(world, seen, requested, driver.aim, shield)
            interventions += bool(done.interventions)
            seen = world.observe()
            referee.update(seen)
            if seen.tick % SPEED_EVERY == 0:
                speeds.append(base.mean_traffic_mps)
                path.append((round(seen.ego.x_m, 2), round(seen.ego.y_m, 2)))
        path.append((round(seen.ego.x_m, 2), round(seen.ego.y_m, 2)))
        referee.finish(seen)
    except Exception as error:
        if not _is_of_engine(error):
            raise  # a fault of ours: the kernel says so of the whole item
        # The engine died mid-route: the route is scored as far as it came.
        detail, broken = f"{type(error).__name__}: {error}", True
        referee.finish(seen)
    finally:
        base.close()
        if instructed is not None:
            instructed.close()
    tally = PlanningTally() if instructed is None else instructed.tally
    return _result(
        job,
        failure="Simulation crashed" if broken else "",
        detail=detail,
        infra_failed=broken,
        completed=referee.completion.completed,
        completion=referee.completion.share,
        infractions=[asdict(one) for one in referee.infractions],
        status=status_of(referee.completion.completed, referee.infractions, "Simulation crashed" if broken else ""),
        engine=base.engine,
        length_m=track.length_m,
        simulated_s=seen.time_s,
        cpu_s=round(time.process_time() - began, 2),
        triggered=world.triggered,
        placed=len(placed),
        unplaceable=world.unplaceable,
        traffic=base.vehicles,
        traffic_speed_mps=sum(speeds) / len(speeds) if speeds else None,
        interventions=interventions,
        path=path,
        planning=dict(tally.row()),
        policy_failed=instructed is not None and tally.driven == 0,
        told=[] if instructed is None else [(round(at, 2), said.kind, said.text) for at, said in instructed.told],
    )


def _is_of_engine(error: Exception) -> bool:
    """True if an engine failed: its own exceptions are no class of ours."""
    return isinstance(error, ChauffeurError | OSError) or type(error).__module__.partition(".")[0] == "libsumo"


def _result(job: RouteJob, *, failure: str = "", **values: Any) -> dict[str, Any]:
    """A result; what is not said is that of a route that was never driven."""
    nothing: dict[str, Any] = {
        "key": job.key,
        "version": ROUTE_VERSION,
        "infra_failed": False,
        "undriven": bool(failure) and not values.get("simulated_s"),
        "completed": False,
        "completion": 0.0,
        "infractions": [],
        "status": f"Failed - {failure}" if failure else "Failed",
        "engine": NOT_DRIVEN,
        "length_m": 0.0,
        "simulated_s": 0.0,
        "cpu_s": 0.0,
        "triggered": [],
        "placed": 0,
        "unplaceable": [],
        "traffic": 0,
        "traffic_speed_mps": None,
        "interventions": 0,
        "path": [],
        "planning": dict(PlanningTally().row()),
        "policy_failed": False,
        "told": [],
        "detail": "",
    }
    return nothing | values
