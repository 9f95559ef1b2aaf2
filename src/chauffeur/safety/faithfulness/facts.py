"""What a program does, as values: what reading finds in its text, and what running it on copies of a scene showed."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final, Literal

from chauffeur.concept import Observation
from chauffeur.safety.faithfulness.values import Base, Term

Deed = Literal["speed", "headway", "gap", "lane", "turn", "go", "wait", "say"]
"""What an event is: a wish for a speed, a headway, a lane or a route; a gap that is steered towards; leaving the stop
sign; time that passes; words."""


STANDING_MPS: Final = 0.5
"""A car this slow stands."""


@dataclass(frozen=True, slots=True)
class Event:
    """Something a program does.

    Attributes:
        deed: What.
        line: Program line, 1-based; None inside a helper of a library.
        terms: Alternatives of its number: m/s of a speed, s of a headway or a wait.
        sides: Of a lane: where it may lead, -1 left, 0 no change, +1 right. Of a turn: -1, 0 straight, +1.
        checked: Of a lane: the program asks whether it may enter before it does. Of leaving the stop sign: whether
            traffic that crosses was asked about.
        depends: What else it depends on: `other speed`, `gap`, `behind`, `stopped`, `sign`, ...
        times: How often it is repeated at most; 0 for as often as it goes.
        back: Of a lane: whether it leads back to one the ego has been in.
        reference: Of a speed: found as what a controller steers towards, not as a wish itself.
        open: Whether its number may be another one than those known.
    """

    deed: Deed
    line: int | None
    terms: frozenset[Term] = frozenset()
    sides: frozenset[int] = frozenset()
    checked: bool = False
    depends: frozenset[str] = frozenset()
    times: int = 1
    back: bool = False
    reference: bool = False
    open: bool = False


@dataclass(frozen=True, slots=True)
class FactMark:
    """A number that something measured is compared with, or subtracted from it: `gap < 30`, `gap - 25`."""

    base: Base
    value: float
    line: int | None
    compared: bool


@dataclass(frozen=True, slots=True)
class Facts:
    """What reading finds.

    Attributes:
        events: What the program does, in the order of its text with its functions put in where they are called.
        marks: Numbers that measured things are held against.
        spans_s: Times its loops may last, s.
        literals: Plain numbers written in the program.
        readable: Whether it was read at all; False for text that is no program, or too long.
    """

    events: tuple[Event, ...] = ()
    marks: tuple[FactMark, ...] = ()
    spans_s: tuple[float, ...] = ()
    literals: frozenset[float] = frozenset()
    readable: bool = True

    def of(self, *deeds: Deed) -> Iterator[tuple[int, Event]]:
        """Events of some kinds with their places."""
        return ((place, event) for place, event in enumerate(self.events) if event.deed in deeds)


@dataclass(frozen=True, slots=True)
class Effect:
    """What happened when a program ran: in a drive, or on a copy of the scene. Simulated.

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
        """Whether it stood still at some time."""
        return self.extremes_mps[0] < STANDING_MPS


@dataclass(frozen=True, slots=True)
class FactSurroundings:
    """Where the ego is when the program begins.

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
