"""Right of way where roads cross: a command goes through only if a plan is left after it that ends well.

There are two kinds of plan: to stop, and to clear the crossing. Either is rolled on with the vehicle's own motion, and
ends well if the body never is where somebody who crosses may be by then, going straight on as fast as they can, and
does not stand in a lane that is not its own. The ego has no priority here. By induction the car is never where it can
neither stop nor clear: what was promised in one period is still there in the next.

Source: Shalev-Shwartz, Shammah, Shashua 2017, Sec. 3.5 (routes that cross); the plan that is always kept in hand is
that of Pek, Althoff, "Fail-safe motion planning for online verification", 2020.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from chauffeur.concept import Command, Lane, LaneId, Observation, VehicleState
from chauffeur.geometry import RoadGraph, wrap_to_pi
from chauffeur.safety.shield import rollout
from chauffeur.safety.shield.frame import CROSSING_RAD
from chauffeur.safety.shield.gaps import highest
from chauffeur.safety.shield.table import ShieldParameters
from chauffeur.safety.shield.traffic_arrays import TrafficArrays

Array = NDArray[np.float64]

_CLEARING_MPS2: Final = 2.0, 5.0
"""Acceleration with which the ego leaves a crossing: easily, or with the whole pedal."""
_CLEARING_MPS: Final = 8.0
"""Speed up to which it does."""
_STOP_S: Final = 2.5
_CLEAR_S: Final = 7.0
"""Horizon of a plan: by then a car at the speeds of a crossing stands, or is through."""
_AWAY_RAD: Final = math.radians(60.0)
"""A lane turned by more against the car is not the one it drives in, close as it may be."""
_ALONG: Final = math.cos(CROSSING_RAD)
_MOVING_MPS: Final = 0.1
"""Slower than this a car stands, and what is asked may bring it back."""
_FAR_M: Final = 40.0
"""Distance beyond which the way of a turning car cannot be predicted: it is ignored there."""
_BENT_M: Final = 0.1
_JOINT_M: Final = 0.5
_HALVINGS: Final = 8
_SAME_M: Final = 1e-3


@dataclass(frozen=True, slots=True)
class _Care:
    """Margins of a plan: time before another arrives, to the side of its way, and to the side of the ego's own."""

    after_s: float
    merge_s: float
    side_m: float
    room_m: float
    turn_rad: float
    followers: bool = False


DUE: Final = _Care(after_s=1.0, merge_s=1.5, side_m=0.6, room_m=2.6, turn_rad=0.7)
"""Margins that every command must leave; a body has its lane, and half a metre for cutting corners."""
KIND: Final = replace(DUE, followers=True)
"""The same, and who follows in the ego's stream could still stop behind it. That can be the follower's own doing."""
_LOST: Final = _Care(after_s=1.0, merge_s=1.5, side_m=0.6, room_m=4.5, turn_rad=2.0)
"""The same for a car that got off its way: it needs room to get back to it."""
LAST: Final = _Care(after_s=0.2, merge_s=0.6, side_m=0.2, room_m=math.inf, turn_rad=math.inf)
"""Margins of last resort, once others or tyres did what was not foreseen."""
_STAYING: Final = replace(LAST, room_m=DUE.room_m)
"""The same on the road."""
_BESIDE: Final = replace(LAST, side_m=0.05)
"""To stand beside somebody's way without touching it."""


@dataclass(frozen=True, slots=True)
class CrossingResult:
    """A command that may go through, and the rule and reason where it is another than was asked."""

    command: Command
    rule: str = ""
    reason: str = ""


@dataclass(frozen=True, slots=True)
class _Way:
    """Data of a way: the nearest point, the point beyond which nobody crosses, the place where a lead may stop."""

    at: int
    beyond: int
    hold_m: float


@dataclass(frozen=True, slots=True)
class _Line:
    """A straight lane: its first point and its direction."""

    x_m: float
    y_m: float
    heading_rad: float
    cos: float
    sin: float


class Motion:
    """The ego's state with what an observation does not show: how fast it slides and turns."""

    def __init__(self, dt_s: float) -> None:
        self._dt_s = dt_s
        self._tick = -2
        self._expected = np.zeros(6)
        self._before: VehicleState | None = None

    def observe(self, observation: Observation) -> Array:
        """The state now: as foreseen under the last command, or else from the way since the last instant."""
        ego, before = observation.ego, self._before
        sliding = turning = 0.0
        if before is not None and observation.tick == self._tick + 1:
            x, y, heading, _, slides, turns = self._expected.tolist()
            turned = wrap_to_pi(ego.heading_rad - heading)
            if math.hypot(x - ego.x_m, y - ego.y_m) < _SAME_M and abs(turned) < _SAME_M:
                sliding, turning = slides, turns
            else:
                middle = before.heading_rad + wrap_to_pi(ego.heading_rad - before.heading_rad) / 2.0
                dx, dy = ego.x_m - before.x_m, ego.y_m - before.y_m
                sliding = (math.cos(middle) * dy - math.sin(middle) * dx) / self._dt_s
                turning = wrap_to_pi(ego.heading_rad - before.heading_rad) / self._dt_s
        return np.array([ego.x_m, ego.y_m, ego.heading_rad, ego.speed_mps, sliding, turning])

    def commanded(self, observation: Observation, state: Array, command: Command) -> None:
        """Remember what the vehicle was told."""
        self._tick, self._before = observation.tick, observation.ego
        self._expected = state.copy()
        rollout.move(self._expected, command.acceleration_mps2, command.steering_rad, self._dt_s)


class Junction:
    """The guard of one trip over a network whose roads cross."""

    def __init__(self, road: RoadGraph, table: ShieldParameters, dt_s: float) -> None:
        self.road = road
        self._table = table
        self._dt_s = dt_s
        self._ways: dict[tuple[LaneId, LaneId | None], list[Array]] = {}
        self._straight = {lane.id: line for lane in road.lanes if (line := _straight(lane)) is not None}
        self._line_of: dict[LaneId | None, int] = {lane: row for row, lane in enumerate(self._straight)}
        lines = [(line.x_m, line.y_m, line.heading_rad, line.cos, line.sin) for line in self._straight.values()]
        # Numbers of this kind whatever the map holds: for others, machine code would be made in the middle of a drive.
        self._lines = np.array(lines, dtype=np.float64).reshape(len(lines), 5)
        self._clear_from: dict[LaneId, Array] = {}
        self._promised: Array | None = None
        self._motion = Motion(dt_s)

    def mend(
        self,
        observation: Observation,
        around: TrafficArrays,
        lane: LaneId,
        aim: LaneId | None,
        command: Command,
        most_mps2: float,
        *,
        held_up: bool,
    ) -> CrossingResult:
        """The command, changed as little as is needed.

        Args:
            observation: The instant.
            around: Everybody at it.
            lane: Where the ego is, or where ways part the lane it steers for: every way on from it counts.
            aim: The lane it steers for: where it follows, the only way on that counts.
            command: As all other rules let it through.
            most_mps2: Hardest acceleration that they would.
            held_up: Whether a lead is so close that it has to brake for it.
        """
        outlook = self.outlook(observation, around, lane)
        ways = self.candidates(lane, aim, outlook.state)
        followed = rollout.followed(outlook.state, outlook.others)
        cares = (KIND, DUE) if followed else (DUE,)
        tries = (_mend(outlook, ways, command, most_mps2, care, held_up=held_up) for care in cares)
        found = next((one for one in tries if one is not None), None)
        if found is not None:
            mended, self._promised = found
        else:
            promised = ways[0] if self._promised is None else self._promised
            mended = _rescue(outlook, promised, command, most_mps2)
        self._motion.commanded(observation, outlook.state, mended.command)
        return mended

    def outlook(self, observation: Observation, around: TrafficArrays, lane: LaneId) -> Outlook:
        ego, line_of = observation.ego, self._line_of
        on = np.array([line_of.get(other.lane, -1) for other in around.solid[1:]], dtype=np.int64)
        others = rollout.expected(around.numbers, on, self._lines, _ALONG, _FAR_M)
        size = ego.length_m / 2.0, ego.width_m / 2.0
        return Outlook(self._motion.observe(observation), size, others, self.keep_clear(lane), self._table, self._dt_s)

    def keep_clear(self, lane: LaneId) -> Array:
        """The straight lanes nobody may stand in who is in a lane, as `rollout` wants them.

        Who is to come along its own lane, the one before it, or one that forks off where it does, comes from behind.
        """
        if lane not in self._clear_from:
            fork = self.road[lane].centre.points_m[0]
            rows = [
                (line.x_m, line.y_m, line.cos, line.sin, self.road[one].length_m)
                for one, line in self._straight.items()
                if math.dist((line.x_m, line.y_m), fork) >= _JOINT_M
                and math.dist(self.road[one].centre.points_m[-1], fork) >= _JOINT_M
            ]
            self._clear_from[lane] = np.array(rows, dtype=np.float64).reshape(len(rows), 5)
        return self._clear_from[lane]

    def candidates(self, lane: LaneId, aim: LaneId | None, state: Array) -> list[Array]:
        """The ways a command has to leave open: those from the ego's lane, unless that is another's, driven across."""
        ways = self.ways_from(lane, aim if aim in self.road[lane].successors else None)
        if self._promised is None or any(runs_along(way, state) for way in ways):
            return ways
        return [self._promised]

    def _after(self, lane: Lane) -> list[tuple[Lane] | tuple[()]]:
        """Successors of a lane, or one empty tuple."""
        return [(one,) for one in self.road.successors(lane.id)] or [()]

    def ways_from(self, lane: LaneId, onto: LaneId | None) -> list[Array]:
        """Ways on from a lane, through what follows it or only `onto` one lane: rows of (x, y, heading)."""
        if (lane, onto) not in self._ways:
            own = self.road[lane]
            ways = [
                _sampled([own, *first, *second])
                for first in (self._after(own) if onto is None else [(self.road[onto],)])
                for second in (self._after(*first) if first else [()])
            ]
            ways.sort(key=_turned)  # the straightest first: what stops, stops there
            self._ways[lane, onto] = ways
        return self._ways[lane, onto]


def _sampled(lanes: Sequence[Lane]) -> Array:
    line = np.array([point for lane in lanes for point in lane.centre.points_m])
    keep = np.r_[True, np.hypot(*np.diff(line, axis=0).T) > 1e-6]
    line = line[keep]
    lengths = np.r_[0.0, np.cumsum(np.hypot(*np.diff(line, axis=0).T))]
    at = np.arange(0.0, lengths[-1], rollout.STEP_M)
    x, y = np.interp(at, lengths, line[:, 0]), np.interp(at, lengths, line[:, 1])
    heading = np.arctan2(np.gradient(y), np.gradient(x))
    return np.ascontiguousarray(np.stack([x, y, heading], axis=1))


def _straight(lane: Lane) -> _Line | None:
    """A straight lane as a line; None for a bend."""
    (x, y), *rest = lane.centre.points_m
    heading = math.atan2(rest[-1][1] - y, rest[-1][0] - x)
    line = _Line(x, y, heading, math.cos(heading), math.sin(heading))
    off = max(abs(line.cos * (b - y) - line.sin * (a - x)) for a, b in rest)
    return line if off < _BENT_M else None


def _turned(way: Array) -> float:
    return float(np.abs(np.diff(np.unwrap(way[:, 2]))).sum())


def runs_along(way: Array, state: Array) -> bool:
    at = rollout.nearest(way, state[0], state[1], -1)
    return abs(wrap_to_pi(float(way[at, 2] - state[2]))) < _AWAY_RAD


_Asked = tuple[float, float, int, int, int]
"""Acceleration, steering, and which way, plan and care, all of which outlive an instant."""


@dataclass(frozen=True, slots=True)
class Outlook:
    """An instant, ready to be rolled on."""

    state: Array
    size: tuple[float, float]
    others: Array
    lanes: Array
    table: ShieldParameters
    dt_s: float
    _ways: dict[int, _Way] = field(default_factory=dict[int, _Way])
    _troubles: dict[_Asked, float] = field(default_factory=dict[_Asked, float])
    """Memo: searches come by the same plan more than once."""

    def way(self, points: Array) -> _Way:
        """Data of a way, computed once an instant."""
        way = self._ways.get(id(points))
        if way is None:
            way = self._ways[id(points)] = self._seen(points)
        return way

    def _seen(self, points: Array) -> _Way:
        at = rollout.nearest(points, self.state[0], self.state[1], -1)
        _, last, hold = rollout.stretch(points, at, self.size, self.others, self.table.others_braking_mps2)
        beyond = last + math.ceil(self.size[0] / rollout.STEP_M)
        return _Way(at, beyond, hold - self.table.margin_m)

    def trouble_s(self, command: Command, points: Array, plan: CrossingPlan, care: _Care) -> float:
        """Time until a plan after a command on a way ends badly; infinite if it ends well."""
        asked = command.acceleration_mps2, command.steering_rad, id(points), id(plan), id(care)
        found = self._troubles.get(asked)
        if found is None:
            found = self._troubles[asked] = self._foreseen(command, points, plan, care)
        return found

    def _foreseen(self, command: Command, points: Array, plan: CrossingPlan, care: _Care) -> float:
        table, way = self.table, self.way(points)
        asked = command.acceleration_mps2, command.steering_rad
        of_others = (
            table.others_acceleration_mps2, table.others_braking_mps2, table.others_response_s,
            table.others_sure_braking_mps2,
        )  # fmt: skip
        periods = round((_STOP_S if plan.mps2 < 0.0 else _CLEAR_S) / self.dt_s)
        return rollout.rollout(
            self.state, asked, plan.mps2, _CLEARING_MPS, plan.law, points, way.at, way.beyond, way.hold_m, self.size,
            self.others, self.lanes, care.room_m, care.turn_rad, care.side_m, care.after_s, care.merge_s,
            care.followers, of_others, table.braking_mps2, self.dt_s, periods,
        )[0]  # fmt: skip

    def stops(self, command: Command, ways: Sequence[Array], care: _Care) -> Array | None:
        """The first way on which the car can still stop after a command."""
        return next((way for way in ways if self._ends_well(command, way, STOPS, care)), None)

    def clears(self, command: Command, ways: Sequence[Array], care: _Care) -> Array | None:
        """The first way, if on each of them the crossing can be cleared after a command: any may be taken."""
        return ways[0] if all(self._ends_well(command, way, CLEARS, care) for way in ways) else None

    def _ends_well(self, command: Command, way: Array, plans: Sequence[CrossingPlan], care: _Care) -> bool:
        return any(self.trouble_s(command, way, plan, care) == math.inf for plan in plans)

    def wheel_rad(self, law: int, points: Array, acceleration_mps2: float) -> float:
        """Steering angle of a law."""
        return rollout.wheel(law, self.state, points, self.way(points).at, acceleration_mps2, self.dt_s)

    def beside_m(self, points: Array) -> float:
        """Lateral reach of the body from a way now, m."""
        return rollout.beside_m(self.state, points, self.way(points).at, self.size)

    def stays_s(self, command: Command, way: Array) -> float:
        """Time for which a plan to clear the crossing after a command keeps the car no farther off its way than now."""
        return max(self.trouble_s(command, way, plan, DUE) for plan in CLEARS)

    def clearing_mps2(self, most_mps2: float) -> tuple[float, ...]:
        """Accelerations that clear the crossing, as far as the other rules let them."""
        return tuple(max(self.least_mps2, min(mps2, most_mps2)) for mps2 in _CLEARING_MPS2)

    @property
    def least_mps2(self) -> float:
        """Hardest braking that does not reverse."""
        return max(-self.table.braking_mps2, -max(float(self.state[3]), 0.0) / self.dt_s)


@dataclass(frozen=True, slots=True)
class CrossingPlan:
    mps2: float
    law: int


STOPS: Final = tuple(CrossingPlan(-8.0, law) for law in (0, 1, 2))
CLEARS: Final = tuple(CrossingPlan(mps2, law) for law in (3, 2) for mps2 in _CLEARING_MPS2)
_YIELDS: Final = "Somebody crosses ahead, and goes first."
_CLEARS_WHY: Final = "Somebody is coming: the crossing has to be cleared."
_STRAYS: Final = "The car would leave its way, or get into that of somebody who crosses."


def _mend(
    outlook: Outlook, ways: Sequence[Array], command: Command, most_mps2: float, care: _Care, *, held_up: bool
) -> tuple[CrossingResult, Array] | None:
    """The command with its acceleration mended, if that is enough, and the way that is then promised."""
    asked, steering = command.acceleration_mps2, command.steering_rad
    way = outlook.stops(command, ways, care)
    if way is None and not held_up:  # who has to brake for a lead cannot promise to be through soon
        way = outlook.clears(command, ways, care)
    if way is not None:
        return CrossingResult(command), way
    low = outlook.least_mps2
    way = outlook.stops(Command(low, steering), ways, care) if low < asked else None
    if way is not None:
        kept = [way]
        found = highest(
            low, asked, lambda one: outlook.stops(Command(one, steering), kept, care) is not None, _HALVINGS
        )
        return CrossingResult(Command(found, steering), "yield", _YIELDS), way
    for clearing in outlook.clearing_mps2(most_mps2):
        way = outlook.clears(Command(clearing, steering), ways, care) if asked < clearing else None
        if way is not None:
            return CrossingResult(Command(clearing, steering), "clear", _CLEARS_WHY), way
    return None


def _rescue(outlook: Outlook, way: Array, command: Command, most_mps2: float) -> CrossingResult:
    """The command with steering and acceleration of the way that was promised; the least bad one if none ends well."""
    asked = command.acceleration_mps2
    least = outlook.least_mps2
    clearing = outlook.clearing_mps2(most_mps2)
    strayed = outlook.state[3] > _MOVING_MPS and outlook.beside_m(way) > DUE.room_m
    for care in (DUE, _LOST):
        # To stop comes first: the way that was promised need not be the one that is wanted. A car that is off its way,
        # or is going to be, brakes before anything: at the speed that was asked for it gets farther off.
        off = strayed or care is _LOST
        for ends_well, accelerations in (
            (outlook.stops, (least, asked) if off else (asked, least)),
            (outlook.clears, (asked, *clearing)),
        ):
            trials = (
                Command(acceleration, outlook.wheel_rad(law, way, acceleration))
                for acceleration in accelerations
                for law in range(rollout.LAWS)
            )
            good = (trial for trial in trials if ends_well(trial, [way], care) is not None)
            if off and ends_well == outlook.clears:
                found = max(good, key=lambda trial: outlook.stays_s(trial, way), default=None)
            else:
                found = next(good, None)
            if found is not None:
                return CrossingResult(found, "lane", _STRAYS)
    # Each begins with its own plan: to brake now, since it could still be cleared later, ends in the middle of it.
    begun = [
        (Command(acceleration, outlook.wheel_rad(law, way, acceleration)), plans)
        for acceleration, plans in ((least, STOPS), *((mps2, CLEARS) for mps2 in clearing))
        for law in range(rollout.LAWS)
    ]
    trials = [(trial, plan) for trial, plans in begun for plan in plans]
    troubles = [outlook.trouble_s(trial, way, plan, LAST) for trial, plan in trials]
    latest = max(troubles)
    # Of those that keep clear of others as long, the one longest on its way: a light hand may be too light.
    tied = [trial for trial, trouble in zip(trials, troubles, strict=True) if trouble == latest]
    best, _ = max(tied, key=lambda trial: outlook.trouble_s(trial[0], way, trial[1], _STAYING))
    if latest < math.inf:  # rather stand close by somebody's way than drive into it
        for law in range(rollout.LAWS):
            trial = Command(least, outlook.wheel_rad(law, way, least))
            if outlook.stops(trial, [way], _BESIDE) is not None:
                return CrossingResult(trial, "yield", _STRAYS)
    return CrossingResult(best, "yield" if best.acceleration_mps2 <= asked else "clear", _STRAYS)
