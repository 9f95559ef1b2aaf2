"""When a free drive is over: once what was asked for has been done, all of it, and held for a moment.

A benchmark has goals of its own, and ends the instant one is met. A passenger who says "overtake and come back" has not
been served in the left lane, nor one who wants 40 m when 38 m flash by. So a free drive is judged part by part: every
part is done in its order, the set-points (lane, speed, gap) are reached and held, and a program that still has
something to do has done it.

Sides, directions and numbers are those of the words, read by rules that see no plan (`language.wanted`); what a mood
comes to, and a number that only the plan has, are the plan's, and there judge and judged share a reading.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final, Literal

from chauffeur.concept import JudgedBy, Metric, Observation, Outcome, Plan, ProgramState, Setpoints, VehicleState
from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.drive.wish_parts import account_of
from chauffeur.language.wanted import WantedPart, read_wanted
from chauffeur.worlds.base import World

HELD_S: Final = 2.5
"""How long everything has to be as asked."""
THROUGH_S: Final = 1.0
"""The same behind a crossing: the way back is none, and the road may end."""
SETTLES_S: Final = 12.0
"""How long the set-points of a program that has ended have time to be reached."""
SPEED_MPS: Final = 0.8
"""A speed this near the one asked for is that speed (3 km/h): a vehicle far ahead already takes half of it."""
CHANGED_MPS: Final = 1.0
"""A speed without a number is another one from this change on (4 km/h), which a passenger notices."""
SET_MPS: Final = 0.3
"""A set-point that changes by more while it is held is still on its way."""
GAP_M: Final = 1.0
GAP_SHARE: Final = 0.03
"""A gap is the one asked for within 1 m, or 3 % where that is more."""
STANDING_MPS: Final = 0.6
"""Slower is standing: the highway simulator's driver rocks about a standstill by one period's braking, 0.5 m/s."""
IN_LANE_M: Final = 0.6
"""The car is in a lane once its middle is this near the lane's."""

_STEPS: Final = frozenset({"overtake", "lane"})
"""What may take several steps: a program that is still at it may have one to go, e.g. coming back."""
_SETS_SPEED: Final = _STEPS | {"turn", "pull_over", "speed", "style", "stop", "yield", "resume", "keep", "park"}
"""Parts that may write the plan's target speed; of one name, the last in a plan counts."""
_QUARTERS: Final = {"left": -1, "straight": 0, "right": 1}

Bound = Literal["exact", "at_most", "at_least"]


@dataclass(frozen=True, slots=True)
class Ask:
    """One part of what was understood.

    Attributes:
        kind: First part of its intent: `overtake`, `gap`, ...
        detail: The rest: `left`, `set`, ...
        speed_mps, gap_m, headway_s: Numbers that go with it, where words or plan name them.
        sign: +1 where the words ask for more speed or room, -1 for less, 0 where they do not say.
        returns: Whether the car is to be back in the lane where it began.
        said: Whether the words say it, too: read by rules that see no plan.
    """

    kind: str
    detail: str
    speed_mps: float | None = None
    gap_m: float | None = None
    headway_s: float | None = None
    sign: int = 0
    returns: bool = False
    said: bool = False

    @property
    def bound(self) -> Bound:
        """Whether the number is to be met or only kept to."""
        bounds: dict[str, Bound] = {"cap": "at_most", "floor": "at_least"}
        return bounds.get(self.detail, "exact")


def asked_of(plan: Plan, wish: str = "") -> tuple[Ask, ...]:
    """What is to be done, in its order: what the planner understood, as the words say it; where it does not tell, the
    words alone."""
    parts = read_wanted(wish)
    asks = _understood(plan)
    if not asks:
        asks = tuple(ask for part in parts if (ask := _alone(part)) is not None)
    elif wish and len(served := account_of(wish, plan).served) == len(asks):
        asks = tuple(ask if part is None else _as_said(ask, part) for ask, part in zip(asks, served, strict=True))
    back = any(part.act == "return" and not part.denied for part in parts)
    return tuple(replace(ask, returns=back) if ask.kind == "overtake" else ask for ask in asks)


def _as_said(ask: Ask, part: WantedPart) -> Ask:
    """A part of what was understood, with side, sign and number of the words that it serves."""
    if part.act != ask.kind:
        return replace(ask, said=part.act != "other")
    said = replace(ask, sign=part.sign, said=True)
    if part.side and ask.detail in _QUARTERS:
        return replace(said, detail=part.side)
    if part.amount is None or ask.detail != "set":
        return said
    if ask.kind == "speed" and ask.speed_mps is not None:
        return replace(said, speed_mps=part.amount.value)
    return replace(said, gap_m=part.amount.value) if ask.kind == "gap" and ask.gap_m is not None else said


def _alone(part: WantedPart) -> Ask | None:
    """What words alone ask for; None where it is not known from them when it is done."""
    value = None if part.amount is None else part.amount.value
    if part.kind != "act" or part.denied:
        return None
    match part.act:
        case "turn" | "lane" if part.side:
            return Ask(part.act, part.side, said=True)
        case "overtake" | "pull_over" | "stop":
            return Ask(part.act, part.side, said=True)
        case "speed" if value is not None or part.sign:
            return Ask("speed", "set" if value is not None else "", value, sign=part.sign, said=True)
        case "gap" if value is not None:
            return Ask("gap", "set", gap_m=value, said=True)
        case _:
            return None


def _understood(plan: Plan) -> tuple[Ask, ...]:
    """The parts of a plan's intent in their order; empty where the planner does not say what it understood."""
    tags = [tag.partition(".") for tag in plan.intent.split("+") if tag]
    numbers = dict(plan.settings)
    asks: list[Ask] = []
    for place, (kind, _, detail) in enumerate(tags):
        later = {after for after, _, _ in tags[place + 1 :]}
        speed = numbers.get("target_speed_mps") if kind in _SETS_SPEED and not later & _SETS_SPEED else None
        follows = kind in ("gap", "follow", "yield") and not later & {"gap", "follow", "yield"}
        gap, headway = (numbers.get("gap_m"), numbers.get("time_headway_s")) if follows else (None, None)
        asks.append(Ask(kind, detail, speed, gap, headway))
    return tuple(asks)


_JUDGED: Final = _SETS_SPEED | {"gap", "follow"}
"""Parts of which it is known when they are done."""


def can_be_judged(plan: Plan, wish: str = "") -> bool:
    """Whether plan or wish say what is to be done, in words of which it is known when they are done."""
    asks = asked_of(plan, wish)
    return bool(asks) and all(ask.kind in _JUDGED for ask in asks)


class Fulfilment:
    """The referee of a free drive; make it right after the world was reset."""

    def __init__(self, world: World, plan: Plan, wish: str = "") -> None:
        """Args: the world; the plan that is about to be driven, one that `can_be_judged`; the words it was made of."""
        self._world = world
        self._asks = asked_of(plan, wish)
        self._start = world.observe()
        self._began = self._start
        self._done = 0
        self._lead: int | None = None
        self._passed = ""
        self._held = self._ended = 0
        self._setpoints, self._state = Setpoints(), "none"
        self._set_mps = math.nan

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the policy asks for in this control period, before it is seen what came of it."""
        self._setpoints, self._state = setpoints, state

    def observe(self) -> None:
        """Look at the instant after a control period."""
        shot = self._world.observe()
        self._mind_the_lead(shot)
        holds = self._met(self._asks[self._done], shot) and self._in_lane(shot)
        self._held = self._held + 1 if holds else 0
        self._ended = self._ended + 1 if self._state == "finished" else 0
        if self._holds and self._done < len(self._asks) - 1:
            self._done, self._held, self._began = self._done + 1, 0, shot
            self._lead, self._passed = None, ""

    @property
    def _held_s(self) -> float:
        return self._held * self._world.dt_s

    @property
    def _holds(self) -> bool:
        """Whether the part that is being done has been held for long enough."""
        return self._held_s >= (THROUGH_S if self._asks[self._done].kind == "turn" else HELD_S)

    @property
    def success(self) -> bool:
        """Whether all of it is done, and holds."""
        return self._done == len(self._asks) - 1 and self._holds

    @property
    def over(self) -> bool:
        """Whether it is done with nothing left to do, or the program has ended and it will not be done any more."""
        if self._state == "running" and any(ask.kind in _STEPS for ask in self._asks):
            return False
        return self.success or self._ended * self._world.dt_s >= SETTLES_S

    @property
    def parts_done(self) -> tuple[int, int]:
        """Parts that are done, and all of them."""
        return self._done + self._holds, len(self._asks)

    @property
    def judged_by(self) -> JudgedBy:
        """The words, where they say every part; else the plan has a share in it."""
        return "words" if all(ask.said for ask in self._asks) else "plan"

    def outcome(self) -> Outcome:
        """What came of it, collisions apart: not done by a program that ended, or not in the time there was."""
        if self.success:
            return "success"
        return "failure" if self._state == "finished" else "timeout"

    @property
    def shortfall(self) -> str:
        """What is missing, in a sentence; empty when nothing is."""
        if self.success:
            return ""
        ask, shot = self._asks[self._done], self._world.observe()
        missing = _MISSING.get(ask.kind, "The car did not settle as planned.")
        away = not self._in_lane(shot) or (ask.returns and _moved(self._began, shot) != 0)
        if ask.kind == "overtake" and self._passed and away:
            missing = "The vehicle ahead was passed, but the car is not in the lane it was to end in."
        front = shot.front
        slow = front is not None and front.distance_m < _HELD_UP_M and front.speed_mps < self._wanted_mps(ask)
        if slow and ask.kind in ("speed", "style"):
            missing = "The vehicle ahead held the car up."
        later = len(self._asks) - 1 - self._done
        return f"{missing} {later} more to do after it." if later else missing

    def metrics(self) -> tuple[Metric, ...]:
        """What was asked for in numbers, and what there was at the end."""
        shot, last = self._world.observe(), self._asks[-1]
        found: list[Metric] = []
        for ask in self._asks:
            if ask.kind in ("speed", "style", "resume") and ask.speed_mps is not None:
                found.append(Metric("asked-speed-v1", ask.speed_mps, "m/s"))
            gap = _gap_asked(ask, shot)
            if gap is not None:
                found.append(Metric("asked-gap-v1", gap, "m"))
        if not shot.road.has_parking:
            found.append(Metric("end-speed-v1", shot.ego.speed_mps, "m/s"))
        if shot.front is not None and last.kind in ("gap", "follow", "yield", "style"):
            found.append(Metric("end-gap-v1", shot.front.distance_m, "m"))
        if shot.road.uninterrupted and shot.ego.lane is not None and self._start.ego.lane is not None:
            found.append(Metric("end-lane-v1", float(_moved(self._start, shot)), "lanes"))
        return (*found, Metric("held-v1", self._held_s, "s", applies=self.success))

    # The parts ------------------------------------------------------------------------------------------------------

    def _met(self, ask: Ask, shot: Observation) -> bool:
        match ask.kind:
            case "overtake":
                passed = self._passed == (ask.detail or self._passed) != ""
                return passed and (not ask.returns or _moved(self._began, shot) == 0)
            case "lane" if ask.detail in ("left", "right"):
                return _moved(self._began, shot) * _QUARTERS[ask.detail] > 0
            case "turn":
                return self._out_of_the_crossing(shot) and self._turned(shot) == _QUARTERS.get(ask.detail)
            case "pull_over":
                return shot.ego.speed_mps < STANDING_MPS and self._on_emergency_lane(shot)
            case "stop":
                return shot.ego.speed_mps < STANDING_MPS
            case "speed":
                change = shot.ego.speed_mps - self._start.ego.speed_mps
                if ask.speed_mps is None:
                    return ask.sign == 0 or ask.sign * change >= CHANGED_MPS
                opposite = ask.sign * (ask.speed_mps - self._start.ego.speed_mps) < -SPEED_MPS
                return not opposite and _near(shot.ego.speed_mps, ask.speed_mps, SPEED_MPS, ask.bound)
            case "style":  # a mood has no number of its own: its set-point, which may follow traffic, comes to rest
                speed = self._setpoints.target_speed_mps
                return speed is None or (self._set_for(speed) and abs(shot.ego.speed_mps - speed) <= SPEED_MPS)
            case "gap" | "yield" | "follow":
                gap = _gap_asked(ask, shot)
                if gap is None or shot.front is None:
                    return gap is None or ask.gap_m is None  # a headway to whoever comes is kept while nobody does
                if ask.kind == "follow":
                    return _near(shot.front.distance_m, gap, max(GAP_M, GAP_SHARE * gap), "at_least")
                return _near(shot.front.distance_m, gap, max(GAP_M, GAP_SHARE * gap), ask.bound)
            case _:
                return True

    def _set_for(self, speed_mps: float) -> bool:
        """Whether the set-point is that from which it was last seen to move."""
        if not abs(speed_mps - self._set_mps) <= SET_MPS:  # nor is the first one, which is compared with no number
            self._set_mps = speed_mps
            return False
        return True

    def _wanted_mps(self, ask: Ask) -> float:
        return ask.speed_mps if ask.speed_mps is not None else self._setpoints.target_speed_mps or 0.0

    def _mind_the_lead(self, shot: Observation) -> None:
        """Keep an eye on whom this part is to pass, and on which side it is passed."""
        if self._asks[self._done].kind != "overtake":
            return
        if self._lead is None:
            front = self._began.front if self._began.front is not None else shot.front
            self._lead = None if front is None else front.vehicle
        lead = next((other for other in shot.others if other.id == self._lead), None)
        if lead is None or lead.lane is None or shot.ego.lane is None:
            return
        ahead = _ahead_m(shot.ego, lead)
        if ahead > 0.0:
            self._passed = ""
        elif not self._passed and ahead <= -(shot.ego.length_m + lead.length_m) / 2.0:
            beside = shot.road[shot.ego.lane].index - shot.road[lead.lane].index
            self._passed = "left" if beside < 0 else "right" if beside > 0 else ""

    def _in_lane(self, shot: Observation) -> bool:
        """Whether the car is in the lane that is its set-point, and not still on its way there."""
        lane, wanted = shot.road.get(shot.ego.lane), shot.road.get(self._setpoints.target_lane)
        if lane is None or shot.off_road:
            return False
        if wanted is not None and (lane.id != wanted.id if lane.road == wanted.road else lane.index != wanted.index):
            return False
        return shot.road.has_parking or abs(lane.centre.project(shot.ego.x_m, shot.ego.y_m)[1]) <= IN_LANE_M

    def _on_emergency_lane(self, shot: Observation) -> bool:
        lane = shot.road.get(shot.ego.lane)
        return lane is not None and lane.emergency

    def _out_of_the_crossing(self, shot: Observation) -> bool:
        """Whether the car is on a road that leads away."""
        here = shot.road.get(shot.ego.lane)
        return here is not None and not here.successors

    def _turned(self, shot: Observation) -> int:
        """Quarter turns to the right since the start."""
        turned = math.remainder(self._start.ego.heading_rad - shot.ego.heading_rad, 2.0 * math.pi)
        return round(turned / (math.pi / 2.0))


_HELD_UP_M: Final = 80.0
_MISSING: Final = {
    "overtake": "The vehicle ahead was not passed.",
    "lane": "The car is not in the lane that was asked for.",
    "turn": "The car did not come through the turn that was asked for.",
    "pull_over": "The car does not stand on the shoulder.",
    "stop": "The car does not stand.",
    "speed": "The speed was not reached.",
    "style": "The speed that was planned was not reached.",
    "gap": "The gap was not reached.",
    "yield": "The gap was not reached.",
    "follow": "The gap was not reached.",
}
"""What is missing while a part is not done."""


def _near(value: float, asked: float, within: float, bound: Bound) -> bool:
    low = value >= asked - within
    high = value <= asked + within
    return low and high if bound == "exact" else low if bound == "at_least" else high


def _gap_asked(ask: Ask, shot: Observation) -> float | None:
    """The gap that is to be kept, m, centre to centre; of a time headway, at the present speed."""
    if ask.gap_m is not None:
        return ask.gap_m
    if ask.headway_s is None or ask.kind not in ("gap", "follow"):
        return None
    return M_PER_CAR_LENGTH + ask.headway_s * shot.ego.speed_mps


def _moved(first: Observation, last: Observation) -> int:
    """Lanes to the right."""
    if first.ego.lane is None or last.ego.lane is None:
        return 0
    return last.road[last.ego.lane].index - first.road[first.ego.lane].index


def _ahead_m(ego: VehicleState, other: VehicleState) -> float:
    """Way along the ego to the middle of another, negative behind it."""
    dx, dy = other.x_m - ego.x_m, other.y_m - ego.y_m
    return dx * math.cos(ego.heading_rad) + dy * math.sin(ego.heading_rad)
