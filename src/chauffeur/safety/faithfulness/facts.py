"""Facts of a program to hold an explanation against, and effects of running it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Observation

DeedKind = Literal["speed", "headway", "gap", "lane", "turn", "go", "wait"]
"""A set-point for speed, headway, lane or route; a gap that is steered towards; leaving the stop sign; time
that passes."""
Base = Literal["", "ego", "other", "limit", "gap", "past", "behind", "headway", "sign", "per speed"]
"""Base of a number: nothing; the ego's speed; another vehicle's; the limit; the gap ahead; the lead over one
that was passed; the gap behind; the headway; the way to the stop sign; a way divided by the ego's speed."""

PERIOD_S: Final = 0.1
"""Time between two yields in the highway worlds."""
STANDING_MPS: Final = 0.5
"""A car this slow stands."""


@dataclass(frozen=True, slots=True, order=True)
class Term:
    """One alternative of a number: `factor * base + offset`, SI; `bound` for an argument of min or max."""

    base: Base
    factor: float
    offset: float
    bound: bool = False


@dataclass(frozen=True, slots=True)
class Deed:
    """Something a program does.

    Attributes:
        kind: What.
        line: Program line, 1-based; None inside a library.
        terms: Alternatives of its number, in order; empty where it cannot be told.
        sides: Of a lane or a turn: -1 left, 0 its own or straight on, +1 right; empty where it cannot be told.
        back: Of a lane: it leads to one the ego has been in.
        times: How often it may be done; 0 for as often as it goes.
        aimed: Of a speed: what a controller steers towards, not the set-point itself.
        bounds: Least and most that `verify` allows for the number.
    """

    kind: DeedKind
    line: int | None
    terms: tuple[Term, ...] = ()
    sides: frozenset[int] = frozenset()
    back: bool = False
    times: int = 1
    aimed: bool = False
    bounds: tuple[float, float] = (float("-inf"), float("inf"))

    @property
    def stops(self) -> bool:
        """True if it is a set-point for standing still."""
        still = any(not t.factor and abs(t.offset) < 0.05 and not t.bound for t in self.terms)
        return self.kind == "speed" and not self.aimed and still


@dataclass(frozen=True, slots=True)
class Facts:
    """Facts that reading finds.

    Attributes:
        deeds: In the order of the text, functions put in where they are called.
        marks: What measured things are compared with, or what is taken off them: (base, number).
        spans_s: How long its loops may last.
        asks_free: Whether it asks if a lane may be entered.
        readable: Whether it was read at all.
    """

    deeds: tuple[Deed, ...] = ()
    marks: frozenset[tuple[Base, float]] = frozenset()
    spans_s: frozenset[float] = frozenset()
    asks_free: bool = False
    readable: bool = True

    def of(self, *kinds: DeedKind) -> list[tuple[int, Deed]]:
        """Deeds of some kinds with their places."""
        return [(place, deed) for place, deed in enumerate(self.deeds) if deed.kind in kinds]


@dataclass(frozen=True, slots=True)
class Effect:
    """Effect of running a program. Simulated.

    Attributes:
        lanes_moved: Lanes to the right (negative: left) between start and end.
        leftmost, rightmost: The farthest it was on either side of the start, in lanes.
        speeds_mps: Speed at the start, and the mean of the last second.
        extremes_mps: The lowest and the highest speed.
        gaps_m: Way along the ego to the vehicle that was ahead at the start, then and at the end, negative once it is
            behind; None where there was none, or it is out of sight.
        turned: Quarter turns to the right (negative: left) between start and end.
        failed: Whether the program failed.
        cut: Whether it was ended before it was through: its goal was reached, or something happened to the car. What
            it had not done by then, it might still have done.
    """

    lanes_moved: int
    leftmost: int
    rightmost: int
    speeds_mps: tuple[float, float]
    extremes_mps: tuple[float, float]
    gaps_m: tuple[float | None, float | None] = (None, None)
    turned: int = 0
    failed: bool = False
    cut: bool = False

    @property
    def stood(self) -> bool:
        """True if it stood still at some time."""
        return self.extremes_mps[0] < STANDING_MPS

    @property
    def sides(self) -> frozenset[int]:
        """Sides to which it was out of its first lane."""
        return frozenset(side for side, out in ((-1, self.leftmost < 0), (1, self.rightmost > 0)) if out)


@dataclass(frozen=True, slots=True)
class FactSurroundings:
    """Surroundings of the ego when the program begins.

    Attributes:
        speed_mps: Its speed.
        limit_mps: The limit of its lane.
        gap_m: Distance to the vehicle ahead, centre to centre.
        other_mps: Speed of that vehicle.
        sign_m: Distance to the stop sign ahead.
        crossing: Whether this is an intersection.
    """

    speed_mps: float | None = None
    limit_mps: float | None = None
    gap_m: float | None = None
    other_mps: float | None = None
    sign_m: float | None = None
    crossing: bool = False

    @classmethod
    def of(cls, observation: Observation) -> FactSurroundings:
        """Those of an observation."""
        front = observation.front
        lane = observation.road.get(observation.ego.lane)
        return cls(
            speed_mps=observation.ego.speed_mps,
            limit_mps=None if lane is None else lane.speed_limit_mps,
            gap_m=None if front is None else front.distance_m,
            other_mps=None if front is None else front.speed_mps,
            sign_m=observation.stop_sign_m,
            crossing=bool(observation.road.junctions),
        )

    def worth(self, term: Term) -> float | None:
        """A number where this is, SI; None where what it counts from is not known."""
        known = {"ego": self.speed_mps, "limit": self.limit_mps, "other": self.other_mps, "gap": self.gap_m}
        if not term.factor:
            return term.offset
        base = known.get(term.base)
        return None if base is None else term.factor * base + term.offset
