"""The shield: the last word between the controllers and the world.

It changes a command as little as is needed so that full braking and steering back to the lane still end well, whatever
the others do within what `ShieldParameters` assume of them; it says what it changed and why. It knows no program, no
wish and no model, and remembers nothing from one period to the next but the lane it could steer back to, how the
vehicle moved under the last command, and at which stop lines it has stopped.

Across the road: a command that would carry the body over a line is let through only if that lane is free, ahead and
behind, by responsibility-sensitive distances; otherwise the car is steered back. Along it: no faster than still stops
behind every car in the lanes the body touches or is on its way to; no harder braking than needed while somebody follows
too closely; no reversing; not above the speed limit; over no stop line without a stop. Where roads cross,
`crossing.Junction` judges both at once.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Command, Intervention, LaneId, Limits, Observation, VehicleState
from chauffeur.geometry import RoadGraph
from chauffeur.safety.shield.crossing import Junction
from chauffeur.safety.shield.frame import ShieldBody, ShieldLens, ShieldScene, Strip
from chauffeur.safety.shield.gaps import free_gap_m, greatest_acceleration, rss_gap_m
from chauffeur.safety.shield.stop_lines import StopLines
from chauffeur.safety.shield.sweep import recovery_steering, swept, yaw_rate
from chauffeur.safety.shield.table import LAMPILOT_SHIELD, ShieldParameters
from chauffeur.safety.shield.traffic_arrays import AHEAD, BEHIND, TrafficArrays
from chauffeur.safety.words import speed_words

Span = tuple[float, float]
"""(lowest, highest) place across the road, m from the centre of the ego's lane."""

UNKNOWN: Final = "Where somebody is cannot be told."
NO_NUMBER: Final = "A command that is no number was replaced."
_CORNER_M = 0.5
_CREEP_M = 1e-3
"""Tolerance for "further over a line": with any more, the body could creep there period by period."""
_ALONE_RAD = 0.15
"""Angle to its lane that a slow car needs at most where there is one lane only."""
_SLOW_MPS = 3.0
_LANES_AT_ONCE = 2
_TOUCH_M = 0.05
"""Overlap from which a body is in the lane beyond a line."""
_LEVEL_MPS2 = 1e-6
_LEVEL_RAD = 1e-9
_SURE_M = 1.0
"""More than rounding may take from a gap."""
_SLOWING_MPS2 = 1.0
"""Braking towards the speed limit when a car is above it."""


@dataclass(frozen=True, slots=True)
class FilterResult:
    """A command that may go to the actuator, and its changes."""

    command: Command
    interventions: tuple[Intervention, ...] = ()

    @classmethod
    def replaced(cls, command: Command, safe: Command, reason: str) -> FilterResult:
        """A command that could not be judged, with what goes in its place."""
        return cls(safe, (Intervention("finite", reason, command, safe),))


@dataclass(frozen=True, slots=True)
class _Cap:
    """A bound of the acceleration, and whom it is owed to."""

    acceleration_mps2: float
    rule: str
    reason: str


@dataclass(frozen=True, slots=True)
class _Steered:
    """A command that may be steered, what the body touches on it, the lane it could come back to, what was changed."""

    command: Command
    span: Span
    back: LaneId
    said: tuple[Intervention, ...] = ()


class Shield:
    """Judges and mends commands of one trip, one a control period."""

    def __init__(
        self, dt_s: float, limits: Limits | None = None, parameters: ShieldParameters = LAMPILOT_SHIELD
    ) -> None:
        self._dt_s = dt_s
        self._limits = Limits() if limits is None else limits
        self._table = parameters
        self._lens, self._aim_lens = ShieldLens(), ShieldLens()
        self._back: LaneId | None = None
        self._junction: Junction | None = None
        self._stop_lines = StopLines(parameters, dt_s)

    def filter(self, observation: Observation, command: Command, aim: LaneId | None = None) -> FilterResult:
        """The command, changed as little as needed.

        Args:
            observation: The instant the command is for; one in which a place, speed or size is no number stops the car.
            command: What the controllers ask; numbers that are none stop the car.
            aim: Lane the controllers steer for. Where ways part, the nearest lane need not be the car's own.
        """
        around = TrafficArrays.of(observation)
        line_m = self._stop_lines.ahead_m(observation) if observation.objects and around.known else math.inf
        scene = self._lens.look(observation, observation.ego.lane, around) if _known(observation.ego) else None
        if not (is_finite(command) and around.known):
            safe = self._standing_still(observation, scene)
            return FilterResult.replaced(command, safe, UNKNOWN if is_finite(command) else NO_NUMBER)
        if scene is None:
            return FilterResult(command)
        crossings = bool(observation.road.junctions)
        lane = observation.ego.lane
        assert lane is not None
        if aim is not None and _parts_from(observation.road, lane, aim):
            aimed = self._aim_lens.look(observation, aim, around)
            if aimed is not None:
                lane, scene = aim, aimed
        steered = self._across(scene, observation.ego, command, crossings)
        self._back = steered.back
        said = list(steered.said)
        mended = self._along(scene, observation, around, lane, aim, steered, line_m, said)
        return FilterResult(mended, tuple(said))

    def _standing_still(self, observation: Observation, scene: ShieldScene | None) -> Command:
        speed = observation.ego.speed_mps
        steering = 0.0
        if scene is not None:
            steering = self._back_to(scene, _own(scene), speed)
        return Command(max(-self._table.braking_mps2, -max(speed, 0.0) / self._dt_s), steering)

    def _guard_of(self, observation: Observation) -> Junction:
        if self._junction is None or self._junction.road is not observation.road:
            self._junction = Junction(observation.road, self._table, self._dt_s)
        return self._junction

    # Across -----------------------------------------------------------------------------------------------------------

    def _across(self, scene: ShieldScene, ego: VehicleState, command: Command, crossings: bool) -> _Steered:
        """The command with its steering mended, and what it touches across the road.

        A command is let through if after one period of it the car can still be steered back into a lane without
        touching anything on the way. That lane is kept: whatever the next command is, the way back to it is open.
        """
        own = _own(scene)
        if crossings:  # where roads cross, the way is judged as it bends, and as the tyres take it
            steering = self._back_to(scene, own, ego.speed_mps)
            return _Steered(command, _lanes_wide(scene, self._swept(scene, ego, steering, own)), own.lane)
        back = next((strip for strip in scene.strips if strip.lane == self._back), own)
        why = ""
        for lane in (own, back) if back is not own else (own,):
            span = self._swept(scene, ego, command.steering_rad, lane)
            reason = self._why_not(scene, own, span)
            if not reason and self._too_sharp(scene, ego.speed_mps, command.steering_rad):
                reason = "That is too sharp at this speed."
            if not reason:
                return _Steered(command, _lanes_wide(scene, span), lane.lane)
            why = why or reason
        steering = self._back_to(scene, back, ego.speed_mps)
        mended = Command(command.acceleration_mps2, steering)
        changed = abs(steering - command.steering_rad) > _LEVEL_RAD
        said = (Intervention("lane", why, command, mended),) if changed else ()
        return _Steered(mended, _lanes_wide(scene, self._swept(scene, ego, steering, back)), back.lane, said)

    def _back_to(self, scene: ShieldScene, lane: Strip, speed_mps: float) -> float:
        return recovery_steering(scene.ego, lane.centre_m, speed_mps, self._table.steering_rad, scene.curvature)

    def _swept(self, scene: ShieldScene, ego: VehicleState, steering_rad: float, lane: Strip) -> Span:
        size = ego.length_m, ego.width_m
        most_rad, dt_s = self._table.steering_rad, self._dt_s
        return swept(scene.ego, ego.speed_mps, size, steering_rad, lane.centre_m, most_rad, dt_s, scene.curvature)

    def _too_sharp(self, scene: ShieldScene, speed: float, steering_rad: float) -> bool:
        """True if a command turns the car further away from its lane than any lane change needs."""
        before = scene.ego.heading_rad
        after = before + (yaw_rate(speed, steering_rad) - scene.curvature * speed) * self._dt_s
        # With one lane there is nowhere to turn to, and a slow car's tyres carry a turn on for a while.
        steep = len(scene.strips) == 1 and speed < _SLOW_MPS and abs(after) > _ALONE_RAD
        return abs(after) > abs(before) and (steep or abs(speed * math.sin(after)) > self._table.sideways_mps)

    def _why_not(self, scene: ShieldScene, own: Strip, span: Span) -> str:
        """Reason the body must not sweep a span; empty when it may."""
        ego = scene.ego
        low, high = ego.d_m - ego.half_width_m, ego.d_m + ego.half_width_m
        # Where lanes bend and cross there is road beside them, and cars cut corners.
        verge = _CORNER_M if scene.curvature else 0.0
        left, right = scene.strips[0].high_m + verge, scene.strips[-1].low_m - verge
        over_right = span[0] < right - _TOUCH_M and span[0] < low - _CREEP_M
        over_left = span[1] > left + _TOUCH_M and span[1] > high + _CREEP_M
        if over_left or over_right:
            return "That would leave the road."
        entered = [strip for strip in scene.strips if _in(strip, span)]
        if len(entered) > _LANES_AT_ONCE and span[1] - span[0] > high - low + _TOUCH_M:
            return "That would cross more than one line at once."
        for strip in entered:
            further = span[0] < low - _CREEP_M if strip.centre_m < own.centre_m else span[1] > high + _CREEP_M
            if strip is own or not further:
                continue
            touched = _in(strip, (low, high))
            for other in scene.within((strip.low_m, strip.high_m), 0.0, self._table.drift_mps):
                reason = self._too_close(ego, other, touched)
                if reason:
                    return reason
        return ""

    def _too_close(self, ego: ShieldBody, other: ShieldBody, touched: bool) -> str:
        """Reason the ego must not come, or come further, into the lane of another; empty when it may.

        A car behind has seen it (`touched`) once it is over the line, and needs no time to respond any more.
        """
        table = self._table
        is_m = ego.gap_m(other)
        if is_m < table.margin_m:
            return "The lane is not free: a car is beside."
        if other.s_m >= 0.0:
            cap = self._greatest(max(ego.along_mps, 0.0), is_m - table.margin_m, other.along_mps)
            return (
                f"The lane is not free: a car {is_m:.0f} m ahead in it is too close."
                if cap < -table.gentle_mps2
                else ""
            )
        needed = table.entry_gap_m(other.along_mps, ego.along_mps, 0.0 if touched else table.others_response_s)
        if is_m < needed:
            return f"The lane is not free: a car {is_m:.0f} m behind in it needs {needed:.0f} m."
        return ""

    # Along ------------------------------------------------------------------------------------------------------------

    def _along(
        self,
        scene: ShieldScene,
        observation: Observation,
        around: TrafficArrays,
        lane: LaneId,
        aim: LaneId | None,
        steered: _Steered,
        line_m: float,
        said: list[Intervention],
    ) -> Command:
        """The command with its acceleration mended."""
        command, span, speed = steered.command, steered.span, observation.ego.speed_mps
        crossings = bool(observation.road.junctions)
        asked = command.acceleration_mps2
        bound = self._bound(scene, span, crossings, line_m)
        wanted = min(asked, bound.acceleration_mps2)
        rule, reason = bound.rule, bound.reason
        if wanted >= asked - _LEVEL_MPS2 and wanted < -self._table.gentle_mps2:
            spared = min(self._spared(scene, span, wanted), bound.acceleration_mps2)
            if spared > wanted:
                wanted, rule = spared, "brake"
                reason = "A car close behind could not stop for braking that hard, and nothing ahead asks for it."
        standing = -max(speed, 0.0) / self._dt_s
        if wanted < standing:
            wanted, rule, reason = standing, "reverse", "The car stands; it does not reverse."
        mended = Command(wanted, command.steering_rad)
        if crossings:
            most = bound.acceleration_mps2
            held_up = bound.rule in ("gap", "stop") and most <= 0.0
            result = self._guard_of(observation).mend(observation, around, lane, aim, mended, most, held_up=held_up)
            if result.rule:
                mended, rule, reason = result.command, result.rule, result.reason
        faster = mended.acceleration_mps2 - asked
        turned = abs(mended.steering_rad - command.steering_rad) > _LEVEL_RAD
        if abs(faster) <= _LEVEL_MPS2 and not turned:
            return command
        if turned or speed > 0.0 or faster < 0.0:
            said.append(Intervention(rule, reason, command, mended))
        return mended

    def _bound(self, scene: ShieldScene, span: Span, crossings: bool, line_m: float) -> _Cap:
        """The strictest bound of the acceleration; where roads cross, those who do are minded elsewhere."""
        table, ego = self._table, scene.ego
        speed = math.hypot(ego.along_mps, ego.across_mps)
        most = max(0.0, self._limits.most_mps(scene.speed_limit_mps))  # no number: no bound could be compared with it
        allowed = max((most - speed) / self._dt_s, -_SLOWING_MPS2)
        strictest = _Cap(min(allowed, table.acceleration_mps2), "speed", f"No faster than {speed_words(most)} here.")
        cap = self._stop_lines.most_mps2(speed, line_m)
        if cap < strictest.acceleration_mps2:
            strictest = _Cap(cap, "stop", f"A stop line is {line_m:.0f} m ahead, and the car has not stopped at it.")
        free = table.margin_m + free_gap_m(speed, table.acceleration_mps2, table.braking_mps2, self._dt_s) + _SURE_M
        for other in scene.within(span, table.side_m, table.drift_mps, AHEAD, free):
            if crossings and other.crosses:
                continue
            gap = ego.gap_m(other)
            cap = self._greatest(speed, gap - table.margin_m, other.along_mps)
            if cap < strictest.acceleration_mps2:
                strictest = _Cap(cap, "gap", f"Too close to the car {max(gap, 0.0):.0f} m ahead to ask for more.")
        return strictest

    def _greatest(self, speed: float, gap_m: float, lead_mps: float) -> float:
        table = self._table
        return greatest_acceleration(speed, gap_m, lead_mps, table.braking_mps2, table.others_braking_mps2, self._dt_s)

    def _spared(self, scene: ShieldScene, span: Span, wanted: float) -> float:
        """Braking that a car following too closely can still answer; `wanted` where nobody does."""
        table, ego = self._table, scene.ego
        for other in scene.within(span, 0.0, table.drift_mps, BEHIND):
            gap = ego.gap_m(other) - table.margin_m
            needed = rss_gap_m(
                other.along_mps, ego.along_mps, table.others_response_s, 0.0, table.others_sure_braking_mps2, -wanted
            )
            if gap < needed:
                return -table.gentle_mps2
        return wanted


def is_finite(command: Command) -> bool:
    """True if both numbers of a command are finite."""
    return math.isfinite(command.acceleration_mps2) and math.isfinite(command.steering_rad)


def _known(vehicle: VehicleState) -> bool:
    """True if all numbers of a vehicle are finite."""
    total = vehicle.x_m + vehicle.y_m + vehicle.heading_rad + vehicle.speed_mps + vehicle.length_m + vehicle.width_m
    return math.isfinite(total)


def _parts_from(road: RoadGraph, lane: LaneId, other: LaneId) -> bool:
    """True if two lanes begin at one place and lead to different ones."""
    before = {one.id for one in road.predecessors(lane)} if lane in road else set[LaneId]()
    forks = other in road and any(one.id in before for one in road.predecessors(other))
    return forks and road.places_between(lane, other) is None


def _own(scene: ShieldScene) -> Strip:
    """The lane whose centre is nearest to the ego's."""
    return min(scene.strips, key=lambda strip: abs(strip.centre_m - scene.ego.d_m))


def _in(strip: Strip, span: Span) -> bool:
    return span[0] < strip.high_m - _TOUCH_M and span[1] > strip.low_m + _TOUCH_M


def _lanes_wide(scene: ShieldScene, span: Span) -> Span:
    """A span widened to the edges of every lane it is in."""
    lanes = [strip for strip in scene.strips if _in(strip, span)]
    return min([span[0], *(s.low_m for s in lanes)]), max([span[1], *(s.high_m for s in lanes)])
