"""Road, speed limit and next junction at a position, from a map and the rules of the region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Literal

from chauffeur.concept.units import MPS_PER_KMH
from chauffeur.describe.services.maxspeed import Conditional, limit_signed
from chauffeur.describe.services.outside import quoted
from chauffeur.describe.services.readings import Position, ServiceReading, Unknown
from chauffeur.describe.services.road_map import Candidate, Match, RoadAhead, RoadMap
from chauffeur.describe.services.rules import RoadClass, Rules, Speed
from chauffeur.describe.services.units import speed_words

SURE: Final = 0.6
"""Share of the weight above which a road is taken for the one the car is on."""

_FITS: Final = 0.1
"""A road that fits worse lies four standard deviations away: it is another road than the one the car is on."""
_PLAUSIBLE: Final = 0.1
"""Roads with a smaller share are not spoken of."""


@dataclass(frozen=True, slots=True)
class ServiceRoad:
    """The road a car is on.

    Attributes:
        road_class: OSM's class of it.
        name: Its name, quoted from the map; empty where it has none.
        lanes: Lanes in all; None where the map does not say.
        oneway: Whether it goes one way only.
    """

    road_class: RoadClass
    name: str
    lanes: int | None
    oneway: bool


@dataclass(frozen=True, slots=True)
class Limit:
    """A speed limit.

    Attributes:
        speed_mps: The limit; None where none is in force.
        origin: `map` the map gives the number; `zone` the map names a kind of place, and the rules its limit;
            `default` the map gives nothing, and the rules have a limit for such roads.
        detail: What else is to be said, in our words; empty when nothing.
        conditional: Limits that hold at times.
        advisory_mps: Speed recommended where no limit is in force.
    """

    speed_mps: float | None
    origin: Literal["map", "zone", "default"]
    detail: str = ""
    conditional: tuple[Conditional, ...] = ()
    advisory_mps: float | None = None


@dataclass(frozen=True, slots=True)
class RoadPlace:
    """What a map and rules tell about a position."""

    road: ServiceReading[ServiceRoad] | Unknown
    limit: ServiceReading[Limit] | Unknown
    ahead: ServiceReading[RoadAhead] | Unknown


_WALKING_MPS: Final = 5.0 * MPS_PER_KMH
"""Walking pace where no region's rules are loaded."""
_SAID: Final = 0.95
"""Confidence in a number that the map gives: signs change before maps do."""
_BY_LAW: Final = 0.8
_BY_DEFAULT: Final = 0.5


def place_at(road_map: RoadMap, here: Position, rules: Rules | None, now_s: float, note: str = "") -> RoadPlace:
    """What a map tells about a position.

    Args:
        road_map: The map.
        here: The position; with a heading it is known which of several roads it is, and in which direction.
        rules: Rules of the region, for limits that the map leaves to the law.
        now_s: Unix time.
        note: Why the map is older than it should be.
    """
    match = road_map.match(here)
    if match is None or match.fit < _FITS:
        pointing = "" if here.heading_deg is None else " that points the same way"
        nothing = Unknown(f"the map has no road here{pointing}")
        return RoadPlace(nothing, nothing, nothing)
    age_s = None if road_map.as_of_s is None else max(0.0, now_s - road_map.as_of_s)

    best = match.best
    found = limit_on(best, rules)
    agreeing = _agreeing(match, lambda one: _key(limit_on(one, rules)), _key(found))
    limit: ServiceReading[Limit] | Unknown
    if agreeing < SURE:
        found = _disputed(road_map, match, rules)
        agreeing = SURE
    if isinstance(found, Unknown):
        limit = found
    else:
        sure = {"map": _SAID, "zone": _BY_LAW, "default": _BY_DEFAULT}[found.origin] * agreeing * match.fit
        source = road_map.source if found.origin == "map" or rules is None else f"rules of {rules.name}"
        limit = ServiceReading(found, "", source, age_s, sure, note)

    same = _agreeing(match, lambda one: (one.way.road_class, one.way.name), (best.way.road_class, best.way.name))
    if same < SURE:
        unclear = Unknown("several roads are near, and it is not clear which one this is")
        return RoadPlace(unclear, limit, unclear)
    way = best.way
    road = ServiceRoad(way.road_class, quoted(way.name) if way.name else "", way.lanes, way.oneway != 0)
    ahead = road_map.ahead(best)
    return RoadPlace(
        ServiceReading(road, "", road_map.source, age_s, same * match.fit, note),
        limit,
        Unknown("the heading is not known")
        if ahead is None
        else ServiceReading(ahead, "m", road_map.source, age_s, same * match.fit, note),
    )


def _agreeing(match: Match, trait: Callable[[Candidate], object], wanted: object) -> float:
    """Share of the weight of roads that have what the likeliest one has."""
    return sum(one.share for one in (match.best, *match.others) if trait(one) == wanted)


def _key(limit: Limit | Unknown) -> object:
    return limit.speed_mps if isinstance(limit, Limit) else limit


def _disputed(road_map: RoadMap, match: Match, rules: Rules | None) -> Limit | Unknown:
    """Of roads with different limits: the lower one where one road goes on as the other, otherwise none."""
    others = [one for one in match.others if one.share >= _PLAUSIBLE]
    ranked = (match.best, *others)
    limits = [one for one in (limit_on(candidate, rules) for candidate in ranked) if isinstance(one, Limit)]
    speeds = sorted({one.speed_mps for one in limits if one.speed_mps is not None})
    each = " and ".join(
        [*(speed_words(speed, rules) for speed in speeds), *(["unrestricted"] if _free(limits) else [])]
    )
    going_on = all(road_map.joined(match.best, other) for other in others)
    if not (going_on and speeds and len(limits) == len(ranked)):
        listed = f" with {each}" if each else ""
        return Unknown(f"several roads{listed} are near, and it is not clear which one this is")
    lowest = min((one for one in limits if one.speed_mps is not None), key=lambda one: one.speed_mps or 0.0)
    return replace(lowest, detail=f"it changes here between {each}; the lower one is given")


def _free(limits: list[Limit]) -> bool:
    return any(one.speed_mps is None for one in limits)


def limit_on(candidate: Candidate, rules: Rules | None) -> Limit | Unknown:
    """The limit of a way, from its tags; where they leave it open, from the rules of the region."""
    signed = limit_signed(candidate.way.limits, candidate.forward)
    found, conditional = signed.limit, signed.conditional
    detail = "signs over the road may show another one" if signed.variable else ""
    if found is None:
        return _default(candidate.way.road_class, rules, conditional, detail or "the map gives none")
    match found.kind:
        case "speed":
            several = "the map gives several; this is the lowest"
            return Limit(found.speed_mps, "map", several if found.several else detail, conditional)
        case "none":
            return Limit(None, "map", detail, conditional, _advisory(rules))
        case "walk":
            pace = _WALKING_MPS if rules is None else rules.mps(rules.walking_pace)
            return Limit(pace, "map", "walking pace", conditional)
        case "signals":
            return Unknown("signs over the road show it, and the map cannot")
        case "unreadable":
            return _default(candidate.way.road_class, rules, conditional, "what the map says of it cannot be read")
        case "zone":
            law = None if rules is None else rules.zone(*found.zone)
            if rules is None or law is None:
                unknown = "the map names a kind of place that no loaded rules know"
                return _default(candidate.way.road_class, rules, conditional, unknown)
            if law == "none":
                return Limit(None, "zone", detail, conditional, _advisory(rules))
            return Limit(rules.mps(law), "zone", detail, conditional)


def _advisory(rules: Rules | None) -> float | None:
    return None if rules is None or rules.advisory is None else rules.mps(rules.advisory.speed)


def _default(
    road_class: RoadClass, rules: Rules | None, conditional: tuple[Conditional, ...], why: str
) -> Limit | Unknown:
    """The limit that the law has for such a road. Where it depends on the surroundings, the lower one."""
    if rules is None:
        return Unknown(f"{why}, and no region's rules are loaded")
    entry = rules.limits.get(road_class)
    given = () if entry is None else tuple(one for one in (entry.built_up, entry.outside) if one is not None)
    if entry is None or not given:
        return Unknown(f"{why}, and the rules of {rules.name} have none for this class of road")
    speeds = [one for one in given if isinstance(one, float)]
    if not speeds:
        return Limit(None, "default", why, conditional, _advisory(rules))
    detail = why
    if len(set(given)) > 1:
        inside, outside = (_either(one, rules) for one in (entry.built_up, entry.outside))
        detail = f"{why}; by law {inside} in built-up areas and {outside} elsewhere, the lower one is given"
    return Limit(rules.mps(min(speeds)), "default", detail, conditional)


def _either(speed: Speed | None, rules: Rules) -> str:
    return speed_words(rules.mps(speed), rules) if isinstance(speed, float) else "any speed"
