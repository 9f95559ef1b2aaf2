"""Where a drive was to lead and whom its words meant: what every map of it shows beside road and traffic.

Positions are in the frame of pictures (`view`), as `assets/drawer.js` takes them.
"""

from __future__ import annotations

import math
import re
from typing import Any, Final

from chauffeur.concept import Observation, Parameters, Program, Trip
from chauffeur.concept.utterance import Act, Reference
from chauffeur.driving.judge.references import ROAD_USERS
from chauffeur.driving.recording import RecordedTrip
from chauffeur.geometry.road_graph import TURNS
from chauffeur.hmi.road import Bounds
from chauffeur.hmi.view import instants_of, place_facing_right
from chauffeur.language.meaning.words import reference_words
from chauffeur.worlds.town.pack import places_called
from chauffeur.worlds.town.scenarios import places_of

Json = dict[str, Any]

_AHEAD_M: Final = 30
"""So far along its route, in its points of one metre, a car gets in no control period."""
_AGENT: Final = re.compile(r"\bagent\((\d{1,9})\)")
"""A call by which a program names a road user."""
_USERS_AHEAD: Final = frozenset({"pass", "follow"})
"""Acts whose target, on a road without names for it, is the vehicle ahead."""


def goal_of(trip: Trip) -> str:
    """The place that a drive leads to, in its plan's words; empty where it leads to none."""
    policy = trip.plan.policy
    return policy.route.replace("_", " ") if isinstance(policy, Parameters) and policy.route not in TURNS else ""


def wanted(recorded: RecordedTrip, sight: Bounds) -> Json:
    """Fields of the page's drive: `places`, `way`, `to_go`, `ghost` and `meant`, each as far as there is any."""
    seen = instants_of(recorded)
    found: Json = {"places": _places(recorded, seen[0], sight), "meant": _meant(recorded.trip, seen[0])}
    ghost = _ghost(recorded.trip, seen)
    found |= {"ghost": ghost} if ghost else {}
    return found | (_way(seen) if goal_of(recorded.trip) else {})


def _places(recorded: RecordedTrip, first: Observation, sight: Bounds) -> list[Json]:
    """Places of a town and landmarks of a parking lot that come into sight, and whether the drive leads there."""
    there, goal = places_of(recorded.scenario), goal_of(recorded.trip)
    meant = places_called(there, goal) if goal else ()
    named = [(place.name, place.x_m, place.y_m, place in meant) for place in there]
    named += [(name, x, y, name == goal) for name, x, y in first.lot.landmarks] if first.lot is not None else []
    found: list[Json] = []
    for name, x_m, y_m, to in named:
        x, y = place_facing_right(first, x_m, y_m)
        if sight.x0 <= x <= sight.x1 and sight.y0 <= y <= sight.y1:
            found.append({"n": name, "x": round(x, 1), "y": round(y, 1), "to": to})
    return found


def _way(seen: tuple[Observation, ...]) -> Json:
    """The route as a line, and at each instant the distance along it to its end, m; nothing without a route.

    The car's place on it is looked for from where it last was: a route may come by the same spot twice.
    """
    route = seen[0].route
    if route is None or route.length_m(seen[0].road) <= 0.0:
        return {}
    line = route.dense(seen[0].road)
    at, to_go = 0, list[float]()
    for shot in seen:
        ahead = range(at, min(at + _AHEAD_M, len(line)))
        at = min(ahead, key=lambda i: math.hypot(line[i].x_m - shot.ego.x_m, line[i].y_m - shot.ego.y_m))
        to_go.append(round(line[-1].station_m - line[at].station_m, 1))
    points = (place_facing_right(seen[0], point.x_m, point.y_m) for point in (*line[::3], line[-1]))
    return {"way": [[round(value, 1) for point in points for value in point]], "to_go": to_go}


def _ghost(trip: Trip, seen: tuple[Observation, ...]) -> Json | None:
    """The car in the parking spot that the plan names, or that it ended in; None where there is no such spot."""
    first, last = seen[0], seen[-1]
    names = (goal_of(trip), last.ego.lane)
    spots = () if first.lot is None else first.lot.spots
    spot = next((spot for name in names for spot in spots if spot.name == name), None)
    if spot is None:
        return None
    x, y = place_facing_right(first, spot.x_m, spot.y_m)
    ahead = place_facing_right(first, spot.x_m + math.cos(spot.heading_rad), spot.y_m + math.sin(spot.heading_rad))
    heading = math.atan2(ahead[1] - y, ahead[0] - x)
    size = {"l": last.ego.length_m, "w": last.ego.width_m}
    return {"x": round(x, 2), "y": round(y, 2), "h": round(heading, 3), "n": spot.name, **size}


def _meant(trip: Trip, first: Observation) -> Json:
    """Road users by id that the plan's words mean, each with these words: those that its program names, or where it
    names none, the vehicle ahead."""
    plan = trip.plan
    source = plan.policy.source if isinstance(plan.policy, Program) else ""
    numbers = list(dict.fromkeys(int(number) for number in _AGENT.findall(source)))
    references = list(dict.fromkeys(one for act in plan.acts for one in _users(act)))
    if numbers:
        told = [reference_words(one) for one in references]
        told = told if len(told) == len(numbers) else ["meant"] * len(numbers)
        return {str(number): words for number, words in zip(numbers, told, strict=True)}
    ahead = next((act.target for act in plan.acts if act.act in _USERS_AHEAD and not act.negated and act.target), None)
    return {str(first.front.vehicle): reference_words(ahead)} if ahead is not None and first.front is not None else {}


def _users(act: Act) -> list[Reference]:
    """References of an act to what has an id: not to places."""
    found = [act.target, act.place.ref if act.place else None, act.when.ref if act.when else None]
    return [one for one in found if one is not None and one.kind in ROAD_USERS]
