"""From what was broken to points: Leaderboard 1.0's coefficients, and 2.1's as an option.

The driving score of a run is the mean of the routes' products of completion and penalty, not the product of the means.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal, get_args

from chauffeur.bench.leaderboard.criteria import Infraction, InfractionKind
from chauffeur.concept import ConfigError

Scoring = Literal["lb1.0", "lb2.1"]

KINDS: Final[tuple[InfractionKind, ...]] = get_args(InfractionKind)
"""Of the official file, in its order."""

FACTORS: Final[Mapping[InfractionKind, float]] = {
    "collisions_pedestrian": 0.50,
    "collisions_vehicle": 0.60,
    "collisions_layout": 0.65,
    "red_light": 0.70,
    "stop_infraction": 0.80,
}
"""Leaderboard 1.0: what each infraction multiplies the penalty by."""

WEIGHTS: Final[Mapping[InfractionKind, float]] = {
    "collisions_pedestrian": 1.0,
    "collisions_vehicle": 0.70,
    "collisions_layout": 0.60,
    "red_light": 0.40,
    "stop_infraction": 0.25,
}
"""Leaderboard 2.1: what each infraction adds to the sum s of the penalty 1 / (1 + s)."""


@dataclass(frozen=True, slots=True)
class RouteScore:
    """Points of a route.

    Attributes:
        route: Route completion RC, 0..100.
        penalty: Infraction penalty IP, 0..1.
        composed: Driving score DS, 0..100.
    """

    route: float
    penalty: float
    composed: float


def scoring_named(name: str) -> Scoring:
    """A scoring by name. Raises ConfigError: there is none of it."""
    for one in get_args(Scoring):
        if one == name:
            return one
    raise ConfigError(f"There is no scoring {name!r}.", hint="Take lb1.0 or lb2.1.")


def penalty(infractions: Iterable[Infraction], scoring: Scoring = "lb1.0") -> float:
    """The infraction penalty IP of a route, 0..1. Raises ConfigError for an unknown scoring."""
    scoring_named(scoring)
    product, added = 1.0, 0.0
    for one in infractions:
        if one.kind == "outside_route_lanes":
            product *= 1.0 - one.share
        elif scoring == "lb1.0":
            product *= FACTORS.get(one.kind, 1.0)
        else:
            added += WEIGHTS.get(one.kind, 0.0)
    return product / (1.0 + added)


def route_score(completion: float, infractions: Iterable[Infraction], scoring: Scoring = "lb1.0") -> RouteScore:
    """Points of a route that was completed to a share 0..1."""
    factor = penalty(infractions, scoring)
    return RouteScore(100.0 * completion, factor, max(100.0 * completion * factor, 0.0))


def mean_score(routes: Sequence[Mapping[str, Any]]) -> RouteScore:
    """Means over the rows of routes; one that was not driven counts as 0 in all three, as in the official file."""
    if not routes:
        return RouteScore(0.0, 0.0, 0.0)
    rc, ip, ds = (sum(float(row[name]) for row in routes) / len(routes) for name in ("rc", "ip", "ds"))
    return RouteScore(rc, ip, ds)


def driven_km(row: Mapping[str, Any]) -> float:
    """Length of a route, as far as it was completed, km."""
    return row["rc"] / 100.0 * row["length_m"] / 1000.0


def official_rates(routes: Sequence[Mapping[str, Any]]) -> dict[InfractionKind, float]:
    """Infractions a kilometre as the branch leaderboard-1.0 has them.

    Its faults are kept, so that files compare: routes without progress are left out, and the rates of the routes are
    summed, not averaged, so that a run of more routes has higher rates. `rates` is the corrected one.
    """
    moved = [(row, km) for row in routes if (km := driven_km(row)) > 0.0]
    return {kind: sum((row[kind] / km for row, km in moved), 0.0) for kind in KINDS}


def rates(routes: Sequence[Mapping[str, Any]]) -> dict[InfractionKind, float | None]:
    """Infractions a kilometre driven, over all routes together; None where nothing was driven."""
    km = sum(map(driven_km, routes))
    return {kind: sum(row[kind] for row in routes) / km if km > 0.0 else None for kind in KINDS}
