"""Simulated passengers: hidden preferences over speed, gap, acceleration and lanes, drawn from a seed.

The preferences are physical quantities from the literature on drivers and passengers, drawn before any planner is
asked; none is taken from a planner's or a controller's numbers. The sources:

- Speed. Free-flow speeds at a site are normally distributed about a mean close to the limit (Deardoff, Wiesner and
  Fazio 2011, Procedia Social and Behavioral Sciences 16), with a spread of a tenth of it and more (FHWA, Speed
  Concepts: Informational Guide, Ch. 5). Passengers are taken to want a little less than drivers.
- Gap. Headways that people set for an automated lane themselves have a mean of 1.1 s (de Vos, Theeuwes, Hoekstra and
  Coemet 1997, Transportation Research Record 1573); those of individual drivers lie between 0.6 s and 3.0 s (Fancher,
  Sayer and Bareket 1996).
- Acceleration. ISO 15622 bounds adaptive cruise control, a system of comfort, by 2 m/s2 (fast) to 4 m/s2 (slow) when it
  accelerates, 3.5 m/s2 to 5 m/s2 when it brakes, and 2.5 m/s3 to 5 m/s3 of jerk; ISO 11270 bounds lane keeping by
  3 m/s2 sideways. Discomfort begins far lower (de Winkel et al. 2023, Applied Ergonomics 106: it grows with amplitude
  from 0.4 m/s2) and studies differ widely (Hoberock 1977), but people do not take over at the first discomfort.
- Crossing. A post-encroachment time of about 1.5 s parts ordinary from critical encounters in traffic-conflict studies.

What no source gives (patience, width of the tolerance, lane habits) is assumed, and said to be: see `Passenger`.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from chauffeur.concept import ConfigError

POPULATION_VERSION: Final = "passengers-simulated-v1"
"""Changes whenever the same seed gives other people."""

LaneHabit = Literal["moves", "stays"]
Talk = Literal["silent", "brief", "open"]


@dataclass(frozen=True, slots=True)
class Passenger:
    """One simulated passenger. Nothing of this is ever shown to a planner.

    Attributes:
        id: Pseudonym.
        usual_share: Speed they like on an open road, as a share of the limit.
        brisk_share, calm_share: The same when they are pressed for time, and when they want peace.
        lot_share: The same in a parking lot.
        tolerance: How far, as a share of the wanted speed, a drive may be off before they mind.
        headway_s: Time headway that is still all right for them.
        braking_mps2, accelerating_mps2, sideways_mps2: What they put up with, averaged over 1 s.
        jerk_mps3: The same of the change of acceleration within 1 s.
        encroachment_s: Time by which somebody who crosses must be missed.
        patience_s: How long they wait on a highway for the car to begin doing what they meant (assumed).
        standing_s: How long they stand at a line without somebody coming (assumed).
        walk_m: How much farther than need be they walk from a parking spot (assumed).
        lane_habit: Whether a mere hint has to bring a change of lane for them, or the pace alone is enough (assumed).
        talk: How much they say after a drive that was all right (assumed).
        noise: Spread of their mood from trip to trip, as a share of the wanted speed (assumed).
    """

    id: str
    usual_share: float
    brisk_share: float
    calm_share: float
    lot_share: float
    tolerance: float
    headway_s: float
    braking_mps2: float
    accelerating_mps2: float
    sideways_mps2: float
    jerk_mps3: float
    encroachment_s: float
    patience_s: float
    standing_s: float
    walk_m: float
    lane_habit: LaneHabit
    talk: Talk
    noise: float


def draw_passengers(count: int, seed: int) -> tuple[Passenger, ...]:
    """The first `count` people of a seed; a larger count adds people and changes none.

    Raises:
        ConfigError: There is nobody to draw.
    """
    if count < 1:
        raise ConfigError(f"{count} passengers are none.", hint="Draw at least one: --passengers 10.")
    return tuple(_draw(number, np.random.default_rng([seed, number])) for number in range(count))


def _draw(number: int, rng: np.random.Generator) -> Passenger:
    temper = rng.normal()  # what makes the same person quick on the road and quick in a lot
    usual = _within(0.92 + 0.08 * temper, 0.72, 1.05)
    return Passenger(
        id=f"p{number + 1:04d}",
        usual_share=usual,
        brisk_share=_within(usual + abs(rng.normal(0.06, 0.02)), 0.72, 1.05),
        calm_share=_within(usual - abs(rng.normal(0.12, 0.04)), 0.55, 1.0),
        lot_share=_within(0.75 + 0.14 * (0.8 * temper + 0.6 * rng.normal()), 0.40, 1.05),
        tolerance=_spread(rng, 0.10, 0.25, 0.05, 0.20),
        headway_s=_spread(rng, 0.85, 0.30, 0.50, 2.2),
        braking_mps2=_spread(rng, 4.0, 0.20, 2.5, 6.0),
        accelerating_mps2=_spread(rng, 3.5, 0.15, 2.4, 5.0),
        sideways_mps2=_spread(rng, 3.0, 0.20, 1.8, 4.5),
        jerk_mps3=_spread(rng, 5.0, 0.20, 3.0, 8.0),
        encroachment_s=_spread(rng, 1.5, 0.25, 0.8, 2.5),
        patience_s=_spread(rng, 12.0, 0.25, 6.0, 25.0),
        standing_s=_spread(rng, 6.0, 0.30, 3.0, 15.0),
        walk_m=_spread(rng, 12.0, 0.40, 4.0, 30.0),
        lane_habit="moves" if rng.random() < 0.65 else "stays",
        talk=("silent", "brief", "open")[int(rng.choice(3, p=(0.3, 0.4, 0.3)))],
        noise=_spread(rng, 0.02, 0.30, 0.01, 0.05),
    )


def _within(value: float, low: float, high: float) -> float:
    return float(min(max(value, low), high))


def _spread(rng: np.random.Generator, median: float, sigma: float, low: float, high: float) -> float:
    """A log-normal draw, kept within what is human."""
    return _within(median * float(np.exp(sigma * rng.normal())), low, high)
