"""Reports of a route: our row, and the official results file made of rows."""

from __future__ import annotations

import json
import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from typing_extensions import TypedDict  # pydantic reads the standard library's from Python 3.12 on only

from chauffeur.bench.leaderboard.criteria import Infraction
from chauffeur.bench.leaderboard.scoring import KINDS, mean_score, official_rates, rates

NOT_DRIVEN: Final = "not driven"
"""The engine of a route that could not be set up."""
NOTE: Final = (
    "Scores with a SUMO engine use the official Leaderboard 1.0 routes, trigger points, time limits and formulae, but "
    "not CARLA: planar vehicle, SUMO traffic, no props, no perception. They compare policies with each other and must "
    "not be set beside published CARLA scores."
)

LABELS: Final = (
    "Avg. driving score",
    "Avg. route completion",
    "Avg. infraction penalty",
    "Collisions with pedestrians",
    "Collisions with vehicles",
    "Collisions with layout",
    "Red lights infractions",
    "Stop sign infractions",
    "Off-road infractions",
    "Route deviations",
    "Route timeouts",
    "Agent blocked",
)
"""Of the official file."""
_SCORES: Final = {"score_route": "rc", "score_penalty": "ip", "score_composed": "ds"}
"""Names of the official file and of our columns."""


class LeaderboardRow(TypedDict):
    """A route driven once."""

    item: str
    route: str
    town: str
    seed: int
    driver: str
    engine: str
    scenarios: str
    scoring: str
    status: str
    rc: float
    ip: float
    ds: float
    collisions_pedestrian: int
    collisions_vehicle: int
    collisions_layout: int
    red_light: int
    stop_infraction: int
    outside_route_lanes: int
    route_dev: int
    route_timeout: int
    vehicle_blocked: int
    length_m: float
    simulated_s: float
    cpu_s: float
    triggered: int
    placed: int
    unplaceable: str
    traffic: int
    traffic_speed_mps: float | None
    policy_failed: bool
    infra_failed: bool
    refused: bool
    fallback_used: bool
    interventions: int
    plans: int
    plans_driven: int
    plans_declined: int
    plans_refused: int
    plans_failed: int
    plan_latency_s: float | None
    plan_reasons: str
    detail: str


def status_of(completed: bool, infractions: Sequence[Infraction], failure: str = "") -> str:
    """The official word for how a route ended."""
    if completed:
        return "Completed"
    kinds = {one.kind for one in infractions}
    if "route_timeout" in kinds:
        failure = "Agent timed out"
    if "route_dev" in kinds:
        failure = "Agent deviated from the route"
    if "vehicle_blocked" in kinds:
        failure = "Agent got blocked"
    return f"Failed - {failure}" if failure else "Failed"


def counted(infractions: Iterable[Infraction]) -> dict[str, int]:
    """Number of infractions of each kind."""
    counts = Counter(one.kind for one in infractions)
    return {kind: counts.get(kind, 0) for kind in KINDS}


def official(rows: Sequence[Mapping[str, Any]], infractions: Mapping[str, Sequence[Infraction]]) -> dict[str, Any]:
    """The results as the official evaluator writes them (`results.json`), with the engine and its note beside.

    Args:
        rows: All rows of a run, in its order.
        infractions: Of each item.
    """
    records = [_record(row, index, infractions.get(row["item"], ())) for index, row in enumerate(rows)]
    score, summed = mean_score(rows), official_rates(rows)
    failed = [
        [record["route_id"], record["index"], record["status"]] for record in records if record["status"] != "Completed"
    ]
    spread = {
        name: statistics.stdev(float(row[column]) for row in rows) if len(rows) > 1 else "NaN"
        for name, column in _SCORES.items()
    }
    missing = any(row["infra_failed"] for row in rows)
    agent = any("Agent" in record["status"] for record in records)
    values = [score.composed, score.route, score.penalty, *(summed[kind] for kind in KINDS)]
    return {
        "_checkpoint": {
            "global_record": {
                "index": -1,
                "route_id": -1,
                "status": "Failed" if failed else "Completed",
                "infractions": dict(summed),
                "scores": dict(zip(_SCORES, (score.route, score.penalty, score.composed), strict=True)),
                "scores_std_dev": spread,
                "meta": {"exceptions": failed} if failed else {},
            },
            "progress": [len(rows), len(rows)],
            "records": records,
        },
        "eligible": not missing,
        "entry_status": (
            "Finished with missing data" if missing else "Finished with agent errors" if agent else "Finished"
        ),
        "labels": list(LABELS),
        "sensors": [],
        "values": [f"{value:.3f}" for value in values],
        "chauffeur": {
            "engines": sorted({str(row["engine"]) for row in rows}),
            "note": NOTE,
            "infractions_per_km": rates(rows),
        },
    }


def write_official(
    path: Path, rows: Sequence[Mapping[str, Any]], infractions: Mapping[str, Sequence[Infraction]]
) -> None:
    """Write the official results file."""
    path.write_text(json.dumps(official(rows, infractions), indent=4, sort_keys=True) + "\n")


def infractions_of(rows: Iterable[Mapping[str, Any]]) -> tuple[Infraction, ...]:
    """Infractions as they are stored of a drive."""
    return tuple(Infraction(**row) for row in rows)


def _record(row: Mapping[str, Any], index: int, infractions: Sequence[Infraction]) -> dict[str, Any]:
    messages: dict[str, list[str]] = {kind: [] for kind in KINDS}
    for one in infractions:
        messages[one.kind].append(one.message)
    return {
        "index": index,
        "route_id": f"RouteScenario_{row['route']}",
        "status": row["status"],
        "infractions": messages,
        "scores": {name: float(row[column]) for name, column in _SCORES.items()},
        "meta": {
            "duration_game": row["simulated_s"],
            "duration_system": row["cpu_s"],
            "route_length": row["length_m"],
            "engine": row["engine"],
        },
    }
