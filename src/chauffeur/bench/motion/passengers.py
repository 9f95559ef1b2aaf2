"""Simulated passengers of the three manoeuvres: how carefully they want to be driven, and when they take over.

A passenger says a wish in a style and means a place between the boldest and the most careful corner of the certified
box (`scoring.care`): the middle of the style's published range (`data/motion/styles.json`), moved by their own taste,
by how careful weather makes them, and by the day. They take over where the gains lie farther off than they put up with,
or where the drive ends in a collision or off the road. Gains are judged rather than what is felt: in a lane change and
a turn along a given path, people would feel next to nothing of what gains differ in (mean sideways jerk of 2.8 and
2.9 m/s3 from one end of the box to the other).

Temper and talk are those of `personalization.population`; taste, caution and tolerance are assumed: no source gives
them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from chauffeur.bench.motion.items import Style, style_ranges
from chauffeur.bench.personalization.population import Passenger, draw_passengers
from chauffeur.bench.personalization.sayings import Force, Topic
from chauffeur.bench.personalization.takeover import Judgement
from chauffeur.concept import ActionMatrix
from chauffeur.concept.weather import Weather
from chauffeur.safety.gain_box import care
from chauffeur.worlds.track.manoeuvres import ManoeuvreName

MANNER_VERSION: Final = "motion-passengers-v1"
"""Changes whenever the same gains could be judged differently."""

CAUTION: Final[Mapping[Weather, float]] = {"sunny": 0.0, "night": 0.05, "rain": 0.10, "fog": 0.12, "snow": 0.18}
"""By how much of the way from bold to careful the weather moves what people want (assumed)."""
_TASTE: Final = 0.09
"""Of somebody whose usual speed is one standard deviation from the mean (assumed): the quick want it bolder."""
_USUAL: Final = (0.92, 0.08)
"""Mean and spread of the usual speed in `personalization.population`."""
_MOST_TASTE: Final = 0.25
_MUCH: Final = 1.8
_BIT: Final = 1.25
"""In tolerances: beyond the one a remark is strong, below the other slight."""


@dataclass(frozen=True, slots=True)
class RidingTaste:
    """One passenger's preferences in driving.

    Attributes:
        who: Pseudonym, temper and talk.
        taste: Added to what a style means, on the scale of `care`.
        caution: Factor on what weather adds.
        tolerance: How far off gains may be before they take over.
        noise: Spread of the day.
    """

    who: Passenger
    taste: float
    caution: float
    tolerance: float
    noise: float


def draw_manners(count: int, seed: int) -> tuple[RidingTaste, ...]:
    """The first `count` passengers of a seed. Raises ConfigError: there is nobody to draw."""
    found: list[RidingTaste] = []
    for number, who in enumerate(draw_passengers(count, seed)):
        rng = np.random.default_rng([seed, number, 53])
        temper = (who.usual_share - _USUAL[0]) / _USUAL[1]
        taste = -_TASTE * temper + 0.03 * rng.normal()
        found.append(
            RidingTaste(
                who,
                float(np.clip(taste, -_MOST_TASTE, _MOST_TASTE)),
                float(np.exp(0.3 * rng.normal())),
                float(np.clip(0.17 * np.exp(0.25 * rng.normal()), 0.08, 0.30)),
                0.03,
            )
        )
    return tuple(found)


def wanted(manner: RidingTaste, style: Style, weather: Weather, day: float) -> float:
    """Caution that a passenger wants of the gains, 0 to 1. `day` is a standard normal draw."""
    moved = manner.taste + manner.caution * CAUTION[weather] + manner.noise * day
    return float(np.clip(meant()[style] + moved, 0.0, 1.0))


@cache
def meant() -> Mapping[str, float]:
    """Caution at the middle of each style's range. Raises DataError: the ranges cannot be read."""
    found: dict[str, float] = {}
    for style, ranges in style_ranges().items():
        ends = [[ranges[name][end] for name in ("kp", "ki", "kd", "wl", "wh", "ws")] for end in (0, 1)]
        corners = [care(ActionMatrix((one[0], one[1], one[2]), (one[3], one[4], one[5]))) for one in ends]
        found[style] = sum(corners) / 2.0
    return found


def judged(
    manner: RidingTaste, want: float, policy: ActionMatrix | None, outcome: str, task: ManoeuvreName
) -> Judgement:
    """A passenger's verdict on a drive: gains that are too careful deviate upwards, too bold ones downwards.

    `policy` is None where nothing was driven.
    """
    if policy is None:
        return Judgement(True, 0.0, "waited", "plain")
    if outcome not in ("ended", "success"):
        return Judgement(True, 0.0, "close_call", "plain")
    off = (care(policy) - want) / manner.tolerance
    if abs(off) <= 1.0:
        return Judgement(False, 0.0, "fine", "plain", off)
    bold: Topic = "harsh" if task == "acceleration" else "swerving"
    force: Force = "bit" if abs(off) < _BIT else "much" if abs(off) > _MUCH else "plain"
    return Judgement(True, 0.0, "too_slow" if off > 0.0 else bold, force, off)
