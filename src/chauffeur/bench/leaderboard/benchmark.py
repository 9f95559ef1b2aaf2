"""Leaderboard 1.0 as a benchmark of the kernel: routes times seeds, each driven in a worker, scored when read."""

from __future__ import annotations

import hashlib
import json
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from chauffeur.bench.kernel.benchmark import ItemOutcome, Unasked
from chauffeur.bench.kernel.headline import CardPart, Headline
from chauffeur.bench.kernel.metrics import AnyRow, Measure, TableSpec, count, mean, register, share
from chauffeur.bench.kernel.stats import Array
from chauffeur.bench.kernel.store import Row
from chauffeur.bench.leaderboard.drivers import DRIVERS
from chauffeur.bench.leaderboard.instructed import SETTINGS, PlannerSpec
from chauffeur.bench.leaderboard.own_routes import own_routes
from chauffeur.bench.leaderboard.results import NOT_DRIVEN, NOTE, LeaderboardRow, counted, infractions_of
from chauffeur.bench.leaderboard.rollout import ROUTE_VERSION, RouteJob
from chauffeur.bench.leaderboard.routes import LeaderboardRoute, RouteFile, read_routes
from chauffeur.bench.leaderboard.scoring import RouteScore, Scoring, driven_km, penalty, route_score
from chauffeur.bench.leaderboard.triggers import Trigger, TriggerSet, read_triggers
from chauffeur.concept import ChauffeurError, ConfigError
from chauffeur.memory.policies import PolicyRepository
from chauffeur.planners.onboard.town import SNIPPETS
from chauffeur.planners.registry import make_planner
from chauffeur.safety.shield import SHIELD_VERSION
from chauffeur.worlds.town.library import load

BENCH: Final = "leaderboard-1.0-v1"


_SEEDS: Final = re.compile(r"[0-9]{1,4}|(?: ?[0-9]{1,9} ?,){1,999}(?: ?[0-9]{1,9} ?)?", re.ASCII)


@dataclass(frozen=True, slots=True)
class RouteItem:
    """A route driven once: its id in the file, its town, and the seed of traffic and scenarios."""

    id: str
    route: str
    town: str
    seed: int


def _number(name: str) -> Callable[[AnyRow], float | None]:
    return lambda row: None if row["infra_failed"] or row[name] is None else float(row[name])


RC: Final = mean("leaderboard-rc-v1", "RC", "points", _number("rc"), better="higher")
IP: Final = mean("leaderboard-ip-v1", "IP", "", _number("ip"), 3, "higher")
DS: Final = mean("leaderboard-ds-v1", "DS", "points", _number("ds"), better="higher")
COMPLETED: Final = share(
    "leaderboard-completed-v1", "completed", lambda row: bool(row["status"] == "Completed"), better="higher"
)


def _counted(rows: Sequence[AnyRow]) -> list[AnyRow]:
    """The rows that infrastructure did not spoil, under the engines of all of them."""
    counted = [row for row in rows if not row["infra_failed"]]
    engines = " and ".join(sorted({str(row["engine"]) for row in counted if row["engine"] != NOT_DRIVEN}))
    return [{**row, "engines": engines} for row in counted]


TABLE_V: Final = TableSpec(
    "Beside the paper's Tab. V",
    (DS, RC, replace(IP, digits=2)),
    "engines",
    cluster="route",
    heads=("engine", "drives"),
    total=False,
    over=_counted,
    published="leaderboard/table5.json",
    brackets=False,
    lead="Engines differ: the paper's rows were driven in CARLA, ours in the engine named. In ours the world's driver "
    "keeps the gap, obeys lights and yields, and a program chooses way, lane and speed; in the paper programs did "
    "more. The rows are no comparison.",
)


def _broken(row: AnyRow) -> bool:
    return any(row[name] for name in ("route_dev", "route_timeout", "vehicle_blocked"))


_COUNTED: Final = ("collisions_pedestrian", "collisions_vehicle", "collisions_layout", "red_light", "stop_infraction")


def _per_km(row: AnyRow) -> tuple[float, ...] | None:
    """(infractions, km driven)."""
    km = driven_km(row)
    return (float(sum(row[name] for name in _COUNTED)), km) if km > 0.0 else None


def _ratio(totals: Array) -> Array:
    return totals[..., 0] / totals[..., 1]


def _real_time(row: AnyRow) -> tuple[float, ...] | None:
    """(simulated s, CPU s)."""
    return (row["simulated_s"], row["cpu_s"]) if row["cpu_s"] > 0.0 else None


MEASURES: Final = (
    RC,
    IP,
    DS,
    COMPLETED,
    mean("leaderboard-people-v1", "people hit", "", _number("collisions_pedestrian"), 2),
    mean("leaderboard-vehicles-v1", "vehicles hit", "", _number("collisions_vehicle"), 2),
    mean("leaderboard-layout-v1", "layout hit", "", _number("collisions_layout"), 2),
    mean("leaderboard-red-v1", "red lights run", "", _number("red_light"), 2),
    mean("leaderboard-stop-v1", "stops run", "", _number("stop_infraction"), 2),
    register(Measure("leaderboard-per-km-v1", "infractions", _per_km, "/km", _ratio, 2)),
    count("leaderboard-ended-early-v1", "left, late or blocked", _broken),
    mean("leaderboard-vehicles-there-v1", "vehicles", "", _number("traffic"), 0),
    mean("leaderboard-traffic-v1", "traffic", "m/s", _number("traffic_speed_mps"), 1),
    register(Measure("leaderboard-real-time-v1", "x real time", _real_time, "", _ratio, 0)),
)


class LeaderboardBenchmark(Unasked):
    """The routes of a file, driven by a driver by name, or by a planner that is told instructions."""

    id = BENCH
    row = LeaderboardRow
    tables = (
        TableSpec("CARLA Leaderboard 1.0 rules, engine as in the rows", MEASURES, "town", cluster="route"),
        TableSpec("Engines", (RC, IP, DS), "engine", cluster="route", total=False),
        TABLE_V,
    )
    judge = (
        "Our criteria in the engine that the drivers are driven in; scoring equals the official "
        "`statistics_manager.py`. Shared: every driver has the town's own "
        "control of gap, lights and right of way."
    )

    card = CardPart(
        (
            Headline("driving score", TABLE_V, DS, paper=("LLM planner, 3-shot CoT, instruction",)),
            Headline("route completion", TABLE_V, RC, paper=("LLM planner, 3-shot CoT, instruction",)),
        ),
        evidence="simulated drives (SUMO traffic in towns of our own, not CARLA)",
        quick={"limit": 4, "seeds": 1},
        drives={"cruise": ("program",)},
        extra=("town", "libsumo"),
    )

    def __init__(
        self,
        routes: str = "own",
        scenarios: str = "public",
        triggers: str = "",
        planner: str = "expert",
        seeds: int | str = 3,
        density: float = 1.0,
        people: int = 0,
        scoring: Scoring = "lb1.0",
        towns: str = "",
        limit: int = 0,
        shield: bool = False,
        setting: str = "few-shot",
        repository: str = "",
        latency_s: float | None = None,
        base_url: str = "",
    ) -> None:
        """Make it.

        Args:
            routes: A route file, or `own` for routes through the project's own towns.
            scenarios: `public` or `ten`: which trigger file is meant; `none` for empty roads' sake.
            triggers: Trigger file, or folder of them. By default looked for beside the route file, in
                `../scenarios`; the own towns bring theirs.
            planner: expert, reckless or standing; else a planner of the registry, which is told instructions.
            seeds: How often each route is driven, with seeds from 0 on; or the seeds themselves, with commas between
                (`11,12`; `11,` for one).
            density: Factor of the background traffic.
            people: On foot in the background; Leaderboard 1.0 has none.
            scoring: lb1.0 or lb2.1.
            towns: Only these, with commas between.
            limit: Only so many routes; 0 for all.
            shield: Whether the safety filter has the last word on every command.
            setting: How a planner learns its task: zero-shot, few-shot (three examples) or human-feedback.
            repository: Folder of the policy repository, for human-feedback; the programs that ship, if none is given.
            latency_s: What a plan takes in simulated time; None takes what it really took.
            base_url: Address of the planner's endpoint, where it has one.

        Raises:
            ConfigError: An option that cannot be.
            DataError: A file is missing or malformed.
        """
        spec = None if planner in DRIVERS else _planner_spec(planner, setting, repository, latency_s, base_url)
        if scenarios not in ("public", "ten", "none"):
            raise ConfigError(f"There are no scenarios {scenarios!r}.", hint="Take public, ten or none.")
        self._seeds = _seeds(seeds)
        if density < 0.0:
            raise ConfigError(f"A density of {density} makes no run.", hint="Take 0 or more.")
        penalty((), scoring)
        self._file, found = _files(routes, scenarios, triggers)
        self._driver, self._density, self._people = planner, density, people
        self._scoring: Scoring = scoring
        self._scenarios, self._shield = scenarios, shield
        self._planner = spec
        self.setting = "" if spec is None else spec.setting
        self._triggers: Mapping[str, tuple[Trigger, ...]] = found.towns
        wanted = {town.strip() for town in towns.split(",") if town.strip()}
        there = {one.town for one in self._file.routes}
        if missing := sorted(wanted - there):
            raise ConfigError(
                f"No route of {routes} is in {' or '.join(missing)}.",
                hint=f"There are routes in {', '.join(sorted(there))}; leave --towns out for all.",
            )
        chosen = [one for one in self._file.routes if not wanted or one.town in wanted]
        self._routes = {one.id: one for one in (chosen[:limit] if limit else chosen)}
        self._maps: dict[str, str] = {}
        self._config = {
            "routes": self._file.name,
            "routes_sha256": self._file.sha256,
            "scenarios": scenarios,
            "triggers_sha256": found.sha256,
            "driver": planner,
            "seeds": list(self._seeds),
            "density": density,
            "people": people,
            "scoring": scoring,
            "towns": sorted({one.town for one in self._routes.values()}),
            "limit": limit,
            "shield": SHIELD_VERSION if shield else "",
            "version": ROUTE_VERSION,
            **({} if spec is None else {"planner": list(spec.parts)}),
        }

    @property
    def config(self) -> Mapping[str, Any]:
        return self._config

    @cached_property
    def _items(self) -> tuple[RouteItem, ...]:
        return tuple(
            RouteItem(f"{route.id}-s{seed}", route.id, route.town, seed)
            for route in self._routes.values()
            for seed in self._seeds
        )

    def items(self) -> Sequence[RouteItem]:
        return self._items

    def conclude(self, folder: Path, rows: Sequence[Row], results: Mapping[str, Row | None]) -> Sequence[str]:
        """See Concludes: writes the official results and a map of each route."""
        undriven = Counter((row["infra_failed"], row["detail"]) for row in rows if row["engine"] == NOT_DRIVEN)
        said = [
            f"Not driven, {'not counted' if infra else 'counted as 0'}: {times} of {len(rows)}. {why}"
            for (infra, why), times in undriven.most_common()
        ]
        from chauffeur.bench.leaderboard.artefacts import write_artefacts  # which draws what is made here

        first, *maps = write_artefacts(folder, self, rows, results)
        said.append(f"Official results: {first}; {len(maps)} route map{'' if len(maps) == 1 else 's'} beside it.")
        return [*said, NOTE]

    def route_of(self, item: RouteItem) -> LeaderboardRoute:
        """The route of an item."""
        return self._routes[item.route]

    def _map_hash(self, town: str) -> str:
        """Hash of the source that a town was built from; empty where it is not there (yet)."""
        if town not in self._maps:
            try:
                self._maps[town] = load(town).source_hash
            except ChauffeurError:
                self._maps[town] = ""
        return self._maps[town]

    def job(self, item: RouteItem, answer: Row | None) -> RouteJob:
        del answer
        route = self.route_of(item)
        triggers = self._triggers.get(route.town, ())
        parts = [ROUTE_VERSION, _route_hash(route), self._config["triggers_sha256"], self._scenarios, self._driver]
        parts += [self._map_hash(route.town)]
        parts += [item.seed, self._density, self._people, self._config["shield"]]
        if self._planner is not None:
            parts += self._planner.parts
        key = hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:24]
        return RouteJob(
            key,
            route,
            triggers,
            self._driver,
            item.seed,
            self._density,
            self._people,
            shield=self._shield,
            planner=self._planner,
        )

    def rows(self, outcome: ItemOutcome[RouteItem]) -> Sequence[LeaderboardRow]:
        found = outcome.result
        if found is None:
            return ()
        item, broken = outcome.item, infractions_of(found["infractions"])
        score: RouteScore = route_score(found["completion"], broken, self._scoring)
        row: Any = {
            "item": item.id,
            "route": item.route,
            "town": item.town,
            "seed": item.seed,
            "driver": f"{self._driver} ({self.setting})" if self.setting else self._driver,
            "engine": found["engine"],
            "scenarios": self._scenarios,
            "scoring": self._scoring,
            "status": found["status"],
            "rc": score.route,
            "ip": score.penalty,
            "ds": score.composed,
            **counted(broken),
            **{
                name: found[name]
                for name in ("length_m", "simulated_s", "cpu_s", "placed", "traffic", "traffic_speed_mps")
            },
            "triggered": len(found["triggered"]),
            "unplaceable": "; ".join(found["unplaceable"]),
            "policy_failed": found["policy_failed"],
            **found["planning"],
            "infra_failed": found["infra_failed"],
            "refused": False,
            "fallback_used": False,
            "interventions": found["interventions"],
            "detail": found["detail"],
        }
        return (row,)


def _seeds(given: int | str) -> tuple[int, ...]:
    """Read a number of seeds from 0 on, or a list of seeds with commas. Raises ConfigError: neither."""
    said = str(given).strip()
    found: tuple[int, ...] = ()
    if _SEEDS.fullmatch(said):
        listed = tuple(int(part) for part in said.split(",") if part.strip())
        found = listed if "," in said else tuple(range(listed[0]))
    if not found or len(set(found)) < len(found):
        raise ConfigError(
            f"{given!r} are no seeds.", hint="Give how many (3), or different ones with commas between (11,12)."
        )
    return found


def _planner_spec(name: str, setting: str, repository: str, latency_s: float | None, base_url: str) -> PlannerSpec:
    """Raises ConfigError: there is no such planner or setting, or no repository where one is needed."""
    if setting not in SETTINGS:
        raise ConfigError(f"There is no setting {setting!r}.", hint=f"Take {', '.join(SETTINGS)}.")
    if latency_s is not None and latency_s < 0.0:
        raise ConfigError(f"A latency of {latency_s} s is none.", hint="Give 0 s or more.")
    options = (("base_url", base_url),) if base_url else ()
    make_planner(name, **dict(options))
    digest = ""
    if setting == "human-feedback":
        repository = repository or str(SNIPPETS)
        digest = PolicyRepository(Path(repository)).digest
    elif repository:
        raise ConfigError(f"The setting {setting} uses no policy repository.", hint="Add --setting human-feedback.")
    return PlannerSpec(name, setting, repository and str(Path(repository).resolve()), digest, latency_s, options)


def _files(routes: str, scenarios: str, triggers: str) -> tuple[RouteFile, TriggerSet]:
    if routes == "own":
        file, found = own_routes()
        return file, found if scenarios != "none" else TriggerSet({}, "")
    path = Path(routes)
    file = read_routes(path)
    if scenarios == "none":
        return file, TriggerSet({}, "")
    beside = path.resolve().parent.parent / "scenarios"
    default = beside / ("ten" if scenarios == "ten" else "all_towns_traffic_scenarios_public.json")
    return file, read_triggers(Path(triggers) if triggers else default)


def _route_hash(route: LeaderboardRoute) -> str:
    return hashlib.sha256(json.dumps(asdict(route), sort_keys=True).encode()).hexdigest()
