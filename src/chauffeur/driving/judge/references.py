"""Whom a reference means, by attributes alone: the judge looks for itself, and not where the planner looked."""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept import Observation, VehicleState
from chauffeur.concept.scene import AgentKind
from chauffeur.concept.sight import seen_from, states_of
from chauffeur.concept.utterance import Reference, ReferenceKind
from chauffeur.driving.judge.trace import TracedDrive

_SIGHT_M: Final = 80.0
_VAN_M: Final = 5.2
_AHEAD_M: Final = -3.0
_SIDE_M: Final = 1.0
_VEHICLES: Final[frozenset[AgentKind]] = frozenset({"car", "truck", "bus", "motorcycle", "bicycle"})
_MEANS: Final[dict[ReferenceKind, frozenset[AgentKind]]] = {
    "car": frozenset({"car"}), "van": frozenset({"car"}), "truck": frozenset({"truck"}), "bus": frozenset({"bus"}),
    "motorcycle": frozenset({"motorcycle"}), "bicycle": frozenset({"bicycle"}),
    "pedestrian": frozenset({"pedestrian"}), "pedestrians": frozenset({"pedestrian"}), "vehicle": _VEHICLES,
    "vehicles": _VEHICLES, "traffic": _VEHICLES, "obstacle": frozenset({"static", "obstacle"}),
    "cone": frozenset({"static"}), "barrier": frozenset({"obstacle"}),
}  # fmt: skip
ROAD_USERS: Final = frozenset(_MEANS)
"""Words for what drives, walks or stands on the road."""
WAYSIDE: Final[frozenset[ReferenceKind]] = frozenset({"junction", "light", "stop_sign", "crosswalk", "end_of_road"})
"""What a junction is known by."""
_PLURALS: Final = ("vehicles", "pedestrians", "traffic")
_ALIKE: Final = {"silver": "grey", "grey": "silver"}


def meant(drive: TracedDrive, reference: Reference | None, start: int) -> tuple[int, ...]:
    """Ids of the road users that an act may be about: in sight when it was said, or from a turn on.

    On a road without junctions, where nobody says more of them than that they drive there, whoever is ahead is meant.
    """
    if reference is None:
        return ahead(drive, start)
    if reference in drive.given:
        return drive.given[reference]
    kinds = _MEANS.get(reference.kind)
    if kinds is None:
        return ()
    first = drive.first
    seen = [one for one in (*first.others, *first.objects) if one.kind in kinds and _away(first, one) < _SIGHT_M]
    told = reference.colour or reference.state or reference.side or reference.ordinal
    if drive.road.uninterrupted and not told and reference.where not in ("behind", "beside"):
        return ahead(drive, start)  # all of a motorway's vehicles are cars
    fits = _fitting(seen, reference, first)
    if fits and not any(passage.leaves <= start for passage in drive.passages):
        if reference.kind in _PLURALS:
            return tuple(one.id for one in fits)
        if reference.ordinal is not None:
            before = [one for one in fits if seen_from(first.ego, one)[0] > 0.0]
            index = reference.ordinal - 1 if reference.ordinal > 0 else reference.ordinal
            return (before[index].id,) if -len(before) <= index < len(before) else ()
        return (fits[0].id,) if reference.deictic else tuple(one.id for one in fits)
    later = {one.id: one for instant in drive.all[start:] for one in instant.agents.values() if one.kind in kinds}
    return tuple(number for number, one in later.items() if reference.colour in (None, one.colour))


def ahead(drive: TracedDrive, start: int) -> tuple[int, ...]:
    """Who was ahead in the car's lane when it was said, and who is from an instant on; nobody where nobody comes."""
    later = next((one.front for one in drive.all[start:] if one.front is not None), None)
    return tuple(dict.fromkeys(one.vehicle for one in (drive.first.front, later) if one is not None))


def _fitting(seen: list[VehicleState], reference: Reference, first: Observation) -> list[VehicleState]:
    fits = seen
    if reference.kind == "van":
        fits = [one for one in fits if one.length_m > _VAN_M]
    if reference.colour is not None:
        exact = [one for one in fits if one.colour == reference.colour]
        fits = exact or [one for one in fits if one.colour == _ALIKE.get(reference.colour, "")]
    if reference.state is not None:
        fits = [one for one in fits if reference.state in states_of(one, first)]
    if reference.side is not None:
        sign = 1.0 if reference.side == "left" else -1.0
        fits = [one for one in fits if sign * seen_from(first.ego, one)[1] > _SIDE_M]
    near = [one for one in fits if seen_from(first.ego, one)[0] > _AHEAD_M]
    return sorted(near or fits, key=lambda one: (_away(first, one), one.id))


def _away(first: Observation, one: VehicleState) -> float:
    return math.hypot(one.x_m - first.ego.x_m, one.y_m - first.ego.y_m)
