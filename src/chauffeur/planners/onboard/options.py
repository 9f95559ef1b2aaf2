"""Input and result of a choice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from chauffeur.concept import Limits, Situation
from chauffeur.concept.units import M_PER_CAR_LENGTH, MPS_PER_KMH, MPS_PER_MPH, kmh, mph
from chauffeur.planners.onboard.exemplars import Filled
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.personal import Leaning
from chauffeur.programs.catalogue import vocabulary_of

USUAL_HEADWAY_S = 1.5
"""Time headway the car keeps when no one asked for another."""

API_MAX_HEADWAY_S = 2.0
"""Largest time headway the driving APIs keep."""

_STANDING_MPS = 0.5

SAFE_HEADWAY_S = 0.8
"""Smallest headway the planner chooses by itself while it follows, however low the limits are."""


@dataclass(frozen=True, slots=True)
class Chosen:
    """A step settled.

    Attributes:
        filled: Exemplar with its numbers.
        intent: Tag, e.g. `speed.set`.
        does: What the program does, as a clause after "I": "slow down to 20.0 m/s and hold it".
        assumed: What was taken for granted, full sentences.
        settings: Numbers the program relies on.
        lanes_moved: Lanes to the right (negative: left) that the step ends from where it began.
    """

    filled: Filled
    intent: str
    does: str
    assumed: tuple[str, ...] = ()
    settings: tuple[tuple[str, float], ...] = ()
    lanes_moved: int = 0


@dataclass(frozen=True, slots=True)
class Declined:
    """A refusal in words for the person."""

    words: str


@dataclass(frozen=True, slots=True)
class Options:
    """Situation, limits and leaning, with the numbers that follow from them.

    Attributes:
        situation: Where we are, moved on by earlier steps of the same wish.
        limits: Bounds for the planner's own choices.
        leaning: What the person's history says.
        front_known: False once an earlier step has changed the lane: who is ahead then shows while driving.
        wary: Whether the person says that the road is slippery or the sight bad: haste then gains nothing.
    """

    situation: Situation
    limits: Limits
    leaning: Leaning = field(default_factory=Leaning)
    front_known: bool = True
    wary: bool = False

    def with_leaning(self, leaning: Leaning) -> Options:
        """The same with another leaning."""
        return replace(self, leaning=leaning)

    def after(self, step: Chosen) -> Options:
        """The situation as it will be when a step is done."""
        speed = dict(step.settings).get("target_speed_mps", self.speed)
        stays = step.lanes_moved == 0 and not step.intent.startswith(("overtake", "turn"))
        situation = replace(
            self.situation,
            lane_index=self.situation.lane_index + step.lanes_moved,
            speed_mps=self.speed if step.intent.startswith("overtake") else speed,
            front=self.situation.front if stays else None,
            turns=() if step.intent.startswith("turn") else self.situation.turns,
        )
        return replace(self, situation=situation, front_known=self.front_known and stays)

    @property
    def speed(self) -> float:
        """Speed now, m/s."""
        return self.situation.speed_mps

    @property
    def cruise_mps(self) -> float:
        """Speed that a change is measured from, m/s: the present one; in a town, where a car stands every other minute,
        what it sets out for from there."""
        stands = self.speed < _STANDING_MPS and vocabulary_of(self.situation.world) == "town"
        return self.own_cap_mps if stands else self.speed

    @property
    def sign_mps(self) -> float:
        """Speed limit of the lane, m/s."""
        return self.situation.speed_limit_mps

    @property
    def cap_mps(self) -> float:
        """Speed the limits allow, m/s."""
        return self.limits.most_mps(self.sign_mps)

    @property
    def own_cap_mps(self) -> float:
        """Highest speed the planner chooses by itself: the sign, or the person's own cap below it."""
        return min(self.sign_mps, self.cap_mps)

    @property
    def pass_cap_mps(self) -> float:
        """Highest speed of an overtaking: the sign; more only under limits that allow more than a reading error."""
        return self.own_cap_mps if self.limits.max_over_limit_mps <= _READING_ERROR_MPS else self.cap_mps

    @property
    def last_lane(self) -> int:
        """Index of the rightmost lane that is no emergency lane."""
        return last_lane(self.situation)

    @property
    def least_gap_m(self) -> float:
        """Smallest gap that the checks allow behind the vehicle ahead, m, centre to centre, rounded up."""
        front = self.situation.front
        following_mps = self.speed if front is None else front.speed_mps
        return math.ceil(M_PER_CAR_LENGTH + self.limits.min_time_headway_s * max(following_mps, 0.0))

    def headway(self, wanted_s: float) -> float:
        """A headway of the planner's own choice, s, inside the limits."""
        low = max(self.limits.min_time_headway_s, 0.01)
        return max(low, min(wanted_s, self.limits.max_time_headway_s))

    @property
    def keep_headway_s(self) -> float:
        """Headway that does not open the present gap, s: the usual one, or less behind a vehicle that is closer."""
        front = self.situation.front
        if front is None or self.speed < 1.0:
            return self.headway(USUAL_HEADWAY_S)
        # the car keeps 6 m besides the headway, and a little of the rest is eaten by wanting more speed
        now = 0.85 * (front.distance_m - 6.0) / self.speed
        return self.headway(max(min(USUAL_HEADWAY_S, now), 0.5))

    def helpers(self, manner: str) -> dict[str, float]:
        """Numbers that helper functions of the exemplars use."""
        rate = {"gentle": 2.0, "swift": 5.0}.get(manner, 3.5)
        if self.leaning.gentle:
            rate = min(rate, 2.0)
        return {
            "headway_s": self.headway(0.01),
            "follow_s": self.headway(1.0),
            "rest_headway_s": self.headway(USUAL_HEADWAY_S),
            "keep_headway_s": self.keep_headway_s,
            "headway_lane_s": self.headway(0.5),
            "speed_cap_mps": self.cap_mps,
            "rate_mps2": rate,
        }

    def filled(self, exemplar: str, manner: str, **numbers: float) -> Filled:
        """An exemplar with its own numbers and those of the helpers."""
        values: Mapping[str, float] = {**self.helpers(manner), **numbers}
        return Filled(exemplar, values)


_MOST_OVER_SIGN = 1.25
"""Times the sign: a number that is more than that in a unit was said in another one."""
_READING_ERROR_MPS = 2.0
"""Excess over the sign that limits tolerate without meaning it as leave to speed."""


def last_lane(situation: Situation) -> int:
    """Index of the rightmost lane that is driven in."""
    return situation.lane_count - (2 if situation.emergency_lane else 1)


def speed_words(speed_mps: float) -> str:
    """A speed for people, e.g. `25.0 m/s (56 mph, 90 km/h)`."""
    return f"{number(speed_mps)} m/s ({mph(speed_mps):.0f} mph, {kmh(speed_mps):.0f} km/h)"


def unit_of_bare(value: float, situation: Situation, change: int = 0) -> tuple[str, str]:
    """The dialect's unit of a speed without one, and how that is told.

    It is the unit of the road's signs, unless only another one makes a speed of it that may be driven here, and is
    slower (`change` -1) or faster (+1) than now, as the person said.
    """
    signs, _ = _unit_of_signs(situation.speed_limit_mps)
    scales = {"km/h": ("kmh", MPS_PER_KMH), "mph": ("mph", MPS_PER_MPH), "m/s": ("", 1.0)}
    for said in dict.fromkeys((signs, *scales)):
        name, scale = scales[said]
        fits = (value * scale - situation.speed_mps) * change >= 0
        if fits and value * scale <= _MOST_OVER_SIGN * situation.speed_limit_mps:
            break
    else:
        said, name = signs, scales[signs][0]
    return name, f"You named no unit: I take {number(value)} as {said}."


def _unit_of_signs(limit_mps: float) -> tuple[str, float]:
    """Unit in which the limit of this road is a round number."""
    for unit, factor, step in (("mph", MPS_PER_MPH, 5.0), ("km/h", MPS_PER_KMH, 10.0)):
        shown = limit_mps / factor
        if abs(shown - step * round(shown / step)) < 0.05:
            return unit, factor
    return "m/s", 1.0
