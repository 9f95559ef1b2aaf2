"""Blame for a collision: the last instant the pair was safe, who left that state, who answered properly.

Source: Shalev-Shwartz, Shammah, Shashua 2017, Def. 5 to 7 (blame time, proper response), for straight roads. A pair is
safe while there is clear room to the side, or the rear one keeps a responsibility-sensitive gap. Whoever ended that is
to blame: the one that came over to the other's side, or the rear one in a lane; and an ego that was wronged is to blame
all the same if it did not brake with all it has. Where ways cross, and where a car comes towards the ego, the others go
first: the ego is to blame for every such collision, unless it stood, and the other left its straight way to strike it.
(To stand is not enough: a car that came to a stop across the lane of the oncoming traffic was once absolved.) Whoever
rolls backwards into somebody behind is to blame for that, the ego as well as another. What was unsafe from the
beginning is nobody's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Frame, Observation, VehicleState
from chauffeur.safety.shield.frame import CROSSING_RAD, ShieldBody, ShieldLens, ShieldScene
from chauffeur.safety.shield.gaps import braking_gap_m, rss_gap_m
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, ShieldParameters

_FULL: Final = 0.9
"""Share of full braking that counts as braking with all one has."""
_STILL_MPS: Final = 0.5
_TOWARDS_MPS: Final = 0.05
_ALONG: Final = math.cos(CROSSING_RAD)


@dataclass(frozen=True, slots=True)
class Blame:
    """Cause of a collision.

    Attributes:
        who: `nobody`: there was none, or the pair was never safe.
        other: Id of the other vehicle; None without a collision.
        since_s: Blame time: when the pair was safe last; None if it never was.
        reason: In words.
    """

    who: Literal["ego", "other", "nobody"]
    other: int | None
    since_s: float | None
    reason: str


def blame(
    frames: Sequence[Frame], final: Observation, dt_s: float, parameters: ShieldParameters = LAMPILOT_SHIELD
) -> Blame:
    """Judge the end of a trip.

    Args:
        frames: Its control periods, at least the last seconds.
        final: The instant it ended with.
        dt_s: Control period.
        parameters: What each side may be trusted to do.
    """
    if not final.ego.crashed:
        return Blame("nobody", None, None, "There was no collision.")
    lens = ShieldLens()
    last = frames[-1].observation if frames else final
    other = _struck(final) or _struck(last)
    if other is None:
        return Blame("nobody", None, None, "The ego crashed, but into nobody that is seen.")
    crossed = _pair(lens.look(last, last.ego.lane), other)
    if _stands(final.ego) and _reversed(last, other):
        return Blame("other", other, last.time_s, "The other reversed into the ego, which stood.")
    if crossed is not None and (crossed[1].crosses or crossed[1].along_mps < -_STILL_MPS):
        return _at_a_crossing(frames, final, other)
    looked = ((frame, _pair(lens.look(frame.observation, frame.observation.ego.lane), other)) for frame in frames)
    seen = [(frame, pair) for frame, pair in looked if pair is not None]
    unsafe_from = len(seen)
    while unsafe_from > 0 and not _safe(seen[unsafe_from - 1][1], dt_s, parameters):
        unsafe_from -= 1
    if unsafe_from == 0:
        return Blame("nobody", other, None, "They were never seen at a safe distance.")
    frame, before = seen[unsafe_from - 1]
    since = frame.observation.time_s
    answered = _answered(seen[unsafe_from:], parameters)
    if _apart(before, parameters):
        end = _pair(lens.look(final, last.ego.lane), other)  # what was begun in the last period counts, too
        if _ego_came_over([*(pair for _, pair in seen[unsafe_from - 1 :]), *([] if end is None else [end])]):
            return Blame("ego", other, since, "The ego came over to the other's side.")
        if not answered:
            return Blame("ego", other, since, "The other came over, but the ego did not brake with all it has.")
        return Blame("other", other, since, "The other came over to the ego's side.")
    if before[1].s_m < 0.0:
        if _ego_backed_up([pair for _, pair in seen[unsafe_from - 1 :]]):
            return Blame("ego", other, since, "The ego reversed into the one behind.")
        return Blame("other", other, since, "The other followed too closely.")
    if answered:
        return Blame("other", other, since, "The other ahead braked harder than anyone may be expected to.")
    return Blame("ego", other, since, "The ego followed too closely.")


Pair = tuple[ShieldBody, ShieldBody]


def _at_a_crossing(frames: Sequence[Frame], final: Observation, other: int) -> Blame:
    begun = len(frames)
    while begun > 0 and _stands(frames[begun - 1].observation.ego):
        begun -= 1
    if begun < len(frames):
        stood = frames[begun].observation
        found = next((car for car in (*stood.others, *stood.objects) if car.id == other), None)
        if found is not None and not in_the_way(final.ego, found):
            return Blame("other", other, stood.time_s, "The ego stood clear of the way of the one that ran into it.")
    return Blame("ego", other, None, "The ego was in the way of one that crossed.")


def _stands(vehicle: VehicleState) -> bool:
    """True if a vehicle stands; one that reverses does not."""
    return abs(vehicle.speed_mps) < _STILL_MPS


def _reversed(observation: Observation, other: int) -> bool:
    """True if another, in a lane of the ego's direction, rolls backwards against its own heading, towards the ego."""
    ego = observation.ego
    car = next((car for car in observation.others if car.id == other), None)
    if car is None or car.speed_mps >= 0.0 or math.cos(car.heading_rad - ego.heading_rad) < _ALONG:
        return False
    return math.cos(car.heading_rad) * (ego.x_m - car.x_m) + math.sin(car.heading_rad) * (ego.y_m - car.y_m) < 0.0


def in_the_way(ego: VehicleState, other: VehicleState) -> bool:
    """True if the ego's body is in the strip that another covers if it goes straight on."""
    c, s = math.cos(other.heading_rad), math.sin(other.heading_rad)
    across = -s * (ego.x_m - other.x_m) + c * (ego.y_m - other.y_m)
    turned = ego.heading_rad - other.heading_rad
    wide = abs(math.sin(turned)) * ego.length_m / 2.0 + abs(math.cos(turned)) * ego.width_m / 2.0
    return abs(across) < wide + other.width_m / 2.0


def _struck(observation: Observation) -> int | None:
    """The crashed vehicle, or else the obstacle, that is nearest to the ego."""
    ego = observation.ego
    crashed = [other for other in (*observation.others, *observation.objects) if other.crashed]
    near = min(crashed, key=lambda other: (other.x_m - ego.x_m) ** 2 + (other.y_m - ego.y_m) ** 2, default=None)
    return None if near is None else near.id


def _pair(scene: ShieldScene | None, other: int) -> Pair | None:
    if scene is None:
        return None
    found = next((body for body in scene.others if body.id == other), None)
    return None if found is None else (scene.ego, found)


def _clear_m(pair: Pair) -> float:
    """Clear distance to the side; negative where they overlap across the road."""
    ego, other = pair
    return abs(other.d_m - ego.d_m) - ego.half_width_m - other.half_width_m


def _apart(pair: Pair, parameters: ShieldParameters) -> bool:
    return _clear_m(pair) >= parameters.side_m


def _safe(pair: Pair, dt_s: float, parameters: ShieldParameters) -> bool:
    if _apart(pair, parameters):
        return True
    ego, other = pair
    gap = ego.gap_m(other)
    if other.s_m >= 0.0:
        return gap >= braking_gap_m(
            max(ego.along_mps, 0.0), other.along_mps, parameters.braking_mps2, parameters.others_braking_mps2, dt_s
        )
    needed = rss_gap_m(
        other.along_mps,
        ego.along_mps,
        0.0,
        parameters.others_acceleration_mps2,
        parameters.others_sure_braking_mps2,
        parameters.braking_mps2,
    )
    # An ego that reverses is the one that closes in: it must be able to stop.
    backing = braking_gap_m(
        max(-ego.along_mps, 0.0), -other.along_mps, parameters.braking_mps2, parameters.others_braking_mps2, dt_s
    )
    return gap >= max(needed, backing)


def _ego_backed_up(pairs: Sequence[Pair]) -> bool:
    """True if the ego drove backwards at the one behind, or rolled back more of the way than that one came forwards."""
    ego_way = sum(max(0.0, -ego.along_mps - _TOWARDS_MPS) for ego, _ in pairs)
    other_way = sum(max(0.0, other.along_mps - _TOWARDS_MPS) for _, other in pairs)
    return ego_way > other_way or any(ego.along_mps < -_STILL_MPS for ego, _ in pairs)


def _ego_came_over(pairs: Sequence[Pair]) -> bool:
    """True if, until their sides met, the ego moved over rather than the other."""
    ego_way = other_way = 0.0
    for pair in pairs:
        ego, other = pair
        side = 1.0 if other.d_m >= ego.d_m else -1.0
        ego_way += max(0.0, side * ego.across_mps - _TOWARDS_MPS)
        other_way += max(0.0, -side * other.across_mps - _TOWARDS_MPS)
        if _clear_m(pair) < 0.0:
            break
    return ego_way > other_way


def _answered(seen: Sequence[tuple[Frame, Pair]], parameters: ShieldParameters) -> bool:
    """True if the ego braked with all it has whenever the other was ahead, one period for noticing aside."""
    for frame, (_, other) in seen[1:]:
        if other.s_m <= 0.0 or frame.observation.ego.speed_mps < _STILL_MPS:
            continue
        if frame.applied.acceleration_mps2 > -_FULL * parameters.braking_mps2:
            return False
    return True
