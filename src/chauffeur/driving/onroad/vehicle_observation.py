"""What can be known of a real vehicle when somebody wishes something: as C for the planner, as bounds for the checks.

The vehicle tells its speed, and some tell a mode. Nothing here sees lanes, junctions or other road users; C says so.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Context, Lane, Limits, Observation, Parameters, Situation, VehicleState
from chauffeur.describe.services.readings import ServiceReading, Unknown
from chauffeur.describe.services.sourced import with_sources
from chauffeur.describe.services.surroundings import Surroundings
from chauffeur.driving.onroad.thoughts import speed_text
from chauffeur.geometry import Polyline, RoadGraph
from chauffeur.worlds.ros import RosVehicleState as Vehicle

WORLD: Final = "vehicle"
"""Kind of world of a real vehicle, in C and in memory."""

_LINKS: Final = {
    "dry-run": "This is a dry run: no vehicle is there, and nothing is published.",
    "up": "The way to the vehicle stands.",
}
_NO_LINK: Final = "There is no way to the vehicle now."
_LANE: Final = "vehicle"
_NO_SHAPE: Final = Polyline.of([(0.0, 0.0), (1.0, 0.0)])


@dataclass(frozen=True, slots=True)
class VehicleObservation:
    """One look at the vehicle and its place.

    Attributes:
        vehicle: What the interface tells.
        asked: Parameters of ours that are in force; None before the first.
        limits: The person's and the vehicle's bounds: `max_speed_mps` is never None.
        most_mps: Highest speed of the vehicle's file.
        place: What is known of the place, or why it is not; None where no sources were given.
        place_words: Who says where the car is.
    """

    vehicle: Vehicle
    asked: Parameters | None
    limits: Limits
    most_mps: float
    place: Surroundings | Unknown | None = None
    place_words: str = ""

    @property
    def sign_mps(self) -> float | None:
        """Speed limit of the map; None where it is not known, infinite where none is in force."""
        if self.place is None or isinstance(self.place, Unknown) or not isinstance(self.place.limit, ServiceReading):
            return None
        limit = self.place.limit.value.speed_mps
        return math.inf if limit is None else limit

    @property
    def cap_mps(self) -> float:
        """Highest speed that may be asked for: the lowest of vehicle, person and map."""
        return min(self.own_cap_mps, math.inf if self.sign_mps is None else self.sign_mps)

    @property
    def own_cap_mps(self) -> float:
        """Highest speed by vehicle and person alone."""
        person = self.limits.max_speed_mps
        return self.most_mps if person is None else min(self.most_mps, person)

    @property
    def speed_mps(self) -> float:
        """What "faster" and "slower" count from: the vehicle's speed; where it is not heard, the cap in force; NaN
        where there is neither."""
        if self.vehicle.speed_mps is not None:
            return max(0.0, self.vehicle.speed_mps)
        return math.nan if self.asked is None else self.asked.target_speed_mps

    def bounds(self, before: VehicleObservation) -> Observation:
        """What the checks go by: of two looks, before and after planning, the lower speed limit."""
        signs = [one.sign_mps for one in (self, before) if one.sign_mps is not None]
        return _observation(0.0 if math.isnan(self.speed_mps) else self.speed_mps, min(signs, default=math.inf))


def describe_vehicle(seen: VehicleObservation) -> Context:
    """C of a real vehicle."""
    finite = [one for one in (seen.sign_mps, seen.own_cap_mps) if one is not None and math.isfinite(one)]
    situation = Situation(
        world=WORLD,
        speed_mps=seen.speed_mps,
        speed_limit_mps=finite[0],
        lane_count=1,
        lane_index=0,
        emergency_lane=False,
        front=None,
        stop_sign_m=None,
    )
    sentences = (
        "I speak for a passenger to a vehicle that its own planner drives; I ask that planner for a highest speed and "
        "a look-ahead, and for nothing else.",
        _LINKS.get(seen.vehicle.link, _NO_LINK),
        _speed_words(seen),
        _mode_words(seen.vehicle),
        _asked_words(seen.asked),
        _cap_words(seen),
        "Lanes, junctions and other road users are not known here; the vehicle's own planner sees to them.",
    )
    context = Context(" ".join(one for one in sentences if one), situation)
    return context if seen.place is None else with_sources(context, seen.place, seen.place_words)


def counted_from(seen: VehicleObservation) -> str:
    """What speeds in a planner's words mean where the vehicle's own is not heard; empty where it is."""
    if seen.vehicle.speed_mps is not None or seen.asked is None:
        return ""
    return "(The vehicle's own speed is not heard; speeds are counted from what was last asked for.)"


def _speed_words(seen: VehicleObservation) -> str:
    if seen.vehicle.speed_mps is not None:
        return f"I am driving at {speed_text(seen.vehicle.speed_mps)}."
    unknown = "How fast the vehicle drives is not known: nothing was heard of it within the last second."
    return f"{unknown} {counted_from(seen)}".rstrip()


def _mode_words(vehicle: Vehicle) -> str:
    if not vehicle.mode:
        return "Whether the vehicle is engaged, it does not tell."
    # It came over the network: letters only, so that it stays a word.
    mode = "".join(c for c in vehicle.mode if c.isalpha() or c in " ,")[:40].strip()
    return f"Its mode of operation is: {mode}."


def _asked_words(asked: Parameters | None) -> str:
    if asked is None:
        return "Nothing was asked of it yet in this session."
    return (
        f"What was asked for last, and is in force: at most {speed_text(asked.target_speed_mps)}, look-ahead "
        f"{asked.look_ahead_ratio:g} s and at least {asked.look_ahead_m:g} m."
    )


def _cap_words(seen: VehicleObservation) -> str:
    by = "by the limits of vehicle and person"
    if seen.sign_mps is not None and seen.sign_mps < seen.own_cap_mps:
        by = "by the speed limit of the map"
    return f"At most {speed_text(seen.cap_mps)} may be asked for, {by}."


def _observation(speed_mps: float, sign_mps: float) -> Observation:
    """Numbers for the checks. The ego stands in no lane, and the one there is has no shape: neither is known."""
    ego = VehicleState(0, "car", 0.0, 0.0, 0.0, speed_mps, 0.0, 0.0, None)
    road = RoadGraph((Lane(_LANE, _NO_SHAPE, 0.0, sign_mps),))
    return Observation(0.0, 0, WORLD, ego, (), (), road, None, None, off_road=False, ended=False)
