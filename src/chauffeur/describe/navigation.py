"""Navigation in words: what to do next on a route, said of the map as it is (paper, Sec. IV-B).

Nothing is looked up in tables of towns. A manoeuvre of the route, the kind of junction that the map has there, and the
way to refer to it (distance, ordinal, landmark, now) make the class of an instruction; each class has several wordings.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np

from chauffeur.concept import Observation, Sign, Signal
from chauffeur.describe.road import ordinal
from chauffeur.geometry import LaneId, RoadGraph, Route, named_ways
from chauffeur.geometry.road_graph import TURNS, Turn, turn_of
from chauffeur.geometry.route import Manoeuvre, Step
from chauffeur.worlds.town.pack import Place

JunctionKind = Literal["light", "stop", "tee", "crossroads", "fork"]
Reference = Literal["now", "distance", "ordinal", "landmark"]

NOW_M: Final = 15.0
"""What is closer than this is to be done now."""
TWO_STEP_M: Final = 60.0
"""A manoeuvre that follows so closely is said along."""
FAR_M: Final = 400.0
"""What is farther away is not said yet."""
LANDMARK_M: Final = 70.0
"""A place names a junction that comes at most so far behind it."""
PREPARE_M: Final = 150.0
"""Lane advice is given within this distance before a turn."""

_WHERE: Final[dict[JunctionKind, tuple[str, ...]]] = {
    "light": ("traffic light", "lights", "signal"),
    "stop": ("stop sign", "junction with the stop sign", "stop"),
    "tee": ("T-junction", "T-intersection", "junction"),
    "crossroads": ("crossroads", "intersection", "junction"),
    "fork": ("fork", "split", "exit"),
}
_DO: Final[dict[Turn, tuple[str, ...]]] = {
    "left": ("turn left", "take a left", "go left", "make a left turn"),
    "right": ("turn right", "take a right", "go right", "make a right turn"),
    "straight": ("go straight on", "carry straight on", "keep straight ahead", "continue straight"),
}
_KEEP: Final[dict[Turn, tuple[str, ...]]] = {
    "left": ("keep left", "bear left", "stay left"),
    "right": ("keep right", "bear right", "stay right"),
}
_LANE: Final[dict[Manoeuvre, tuple[str, ...]]] = {
    "change left": ("move over to the left lane", "change into the left lane", "get into the lane on your left"),
    "change right": ("move over to the right lane", "change into the right lane", "get into the lane on your right"),
}
_ARRIVE: Final = ("you have arrived", "your destination is here", "stop, this is the place")
_FOLLOW: Final = ("follow the road", "just keep to this road", "stay on this road", "continue along the road")


@dataclass(frozen=True, slots=True)
class NavigationInstruction:
    """What the passenger, or their navigation, says.

    Attributes:
        kind: Its class: manoeuvre, junction and reference, e.g. `left/light/distance`.
        text: The words.
        ahead_m: Distance to where it is to be done.
        lane: The lane that it leads into; empty where it leads into none.
        safe_to_execute: False for a misleading one: no such way is there, or it leads against the traffic.
    """

    kind: str
    text: str
    ahead_m: float
    lane: LaneId = ""
    safe_to_execute: bool = True


@dataclass(frozen=True, slots=True)
class _Step:
    manoeuvre: Manoeuvre
    at_m: float
    lane: LaneId
    before: LaneId
    junction: JunctionKind
    ways: tuple[Turn, ...]
    landmark: str
    landmark_m: float


class Navigator:
    """Instructions along a route."""

    def __init__(
        self,
        road: RoadGraph,
        route: Route,
        signals: Collection[Signal] = (),
        signs: Collection[Sign] = (),
        places: Sequence[Place] = (),
    ) -> None:
        """Read the route off the map. Raises KeyError for a lane that the road has not."""
        self._road, self._route = road, route
        self._lit = {lane for signal in signals for lane in signal.lanes}
        self._stops = {lane for sign in signs if sign.kind == "stop" for lane in sign.lanes}
        self._places = places
        steps, self.length_m = route.steps(road)
        found: list[_Step] = []
        index = 0
        for one in steps:
            index = route.lanes.index(one.lane, index)  # a route may pass a lane twice
            found.append(self._step(one, index))
        self._steps = tuple(one for one in found if len(one.ways) > 1 or one.manoeuvre in _LANE)

    @cached_property
    def _starts(self) -> dict[LaneId, list[float]]:
        """Where each lane of the route begins along it, as often as it is passed."""
        found: dict[LaneId, list[float]] = {}
        at = -self._route.start_m
        for before, lane in zip((None, *self._route.lanes), self._route.lanes, strict=False):
            if before is not None and not self._road.places_between(before, lane):
                at += self._road[before].length_m
            found.setdefault(lane, []).append(at)
        return found

    def station_of(self, observation: Observation, near_m: float = 0.0) -> float | None:
        """How far along the route the ego is, m; None where it is on none of its lanes, nor on one beside.

        A route may pass a lane twice: it is there for the time that is closest to a distance along it.
        """
        ego = observation.ego
        own = observation.road.get(ego.lane)
        if own is None:
            return None
        station = own.centre.nearest(ego.x_m, ego.y_m)
        for lane in (own, *self._road.abreast(own.id)):
            if lane.id in self._starts:
                along = station * lane.length_m / own.length_m
                return min((start + along for start in self._starts[lane.id]), key=lambda at: abs(at - near_m))
        return None

    @property
    def stations(self) -> tuple[float, ...]:
        """Where along the route its manoeuvres begin, m."""
        return tuple(one.at_m for one in self._steps)

    @property
    def junctions(self) -> tuple[tuple[float, tuple[Turn, ...], LaneId], ...]:
        """(where along the route it begins, ways on, lane before it) of the junctions with a choice of ways."""
        return tuple((one.at_m, one.ways, one.before) for one in self._steps if one.manoeuvre not in _LANE)

    def changes_at(self, station_m: float) -> bool:
        """Whether the manoeuvre that begins there is a change of lanes."""
        return any(one.manoeuvre in _LANE for one in self._steps if one.at_m == station_m)

    def stage_of(self, station_m: float) -> int:
        """Number of the manoeuvre that is to be said at a distance along the route: another one, another instruction.

        What is far ahead is not said yet.
        """
        ahead = [i for i, one in enumerate(self._steps) if one.at_m > station_m]
        near = bool(ahead) and self._steps[ahead[0]].at_m - station_m <= FAR_M
        return 2 * (ahead[0] if ahead else len(self._steps)) + near

    def _step(self, step: Step, index: int) -> _Step:
        """A manoeuvre as the map has it; a way at a junction by what it is called there."""
        at_m, lane = step.at_m, step.lane
        manoeuvre: Manoeuvre = step.manoeuvre
        lanes = self._route.lanes
        before = lanes[max(index - 1, 0)]
        named = named_ways(self._road, before)
        ways = tuple(named)
        if manoeuvre not in _LANE:
            after = next((self._road[one].road for one in lanes[index:] if not self._road[one].junction), "")
            there: list[Turn] = [
                turn for turn, those in named.items() if after in {self._road[way.exit].road for way in those}
            ]
            if there and manoeuvre not in there:
                manoeuvre = there[0]
        alike = len({turn_of(way.bend_rad) for those in named.values() for way in those}) == 1
        if before in self._lit:
            junction: JunctionKind = "light"
        elif before in self._stops:
            junction = "stop"
        elif len(ways) == 3:
            junction = "crossroads"
        elif alike or ("straight" in ways and len(ways) == 2 and not self._road.conflicts(lane)):
            junction = "fork"
        else:
            junction = "tee" if len(ways) == 2 else "crossroads"
        return _Step(manoeuvre, at_m, lane, before, junction, ways, *self._landmark(at_m))

    def _landmark(self, at_m: float) -> tuple[str, float]:
        """(name, where along the route) of the last place that the route passes before a distance along it."""
        best, name = LANDMARK_M, ""
        for place in self._places:
            for start in self._starts.get(place.lane, ()):
                behind = at_m - (start + place.station_m)
                if 0.0 <= behind <= best:
                    best, name = behind, place.name
        return name, at_m - best

    def instruction(
        self, station_m: float, rng: np.random.Generator, misleading: bool = False
    ) -> NavigationInstruction:
        """What to say at a distance along the route.

        Args:
            station_m: How far the ego has come.
            rng: Chooses reference and wording.
            misleading: Whether to ask for what cannot be done at the next junction; where everything can, the truth.
        """
        ahead = [one for one in self._steps if one.at_m > station_m]
        if misleading:
            wrong = self._misleading(ahead, station_m, rng)
            if wrong is not None:
                return wrong
        left_m = self.length_m - station_m
        if not ahead or ahead[0].at_m - station_m > FAR_M:
            if left_m <= FAR_M and not ahead:
                return self._arrival(left_m, rng)
            metres = _rounded(min(left_m, (ahead[0].at_m - station_m) if ahead else left_m))
            text = _pick(rng, (f"{_pick(rng, _FOLLOW)} for {metres} meters", _pick(rng, _FOLLOW)))
            return NavigationInstruction("follow/distance", _sentence(text), left_m)
        first = ahead[0]
        text, kind = self._said(first, ahead, station_m, rng)
        if first.manoeuvre.startswith("change"):
            then = next((one for one in ahead[1:] if not one.manoeuvre.startswith("change")), None)
        else:
            then = next((one for one in ahead[1:2] if not one.manoeuvre.startswith("change")), None)
        if then is not None and then.at_m - first.at_m <= (
            PREPARE_M if first.manoeuvre.startswith("change") else TWO_STEP_M
        ):
            turn = _pick(rng, _do(then))
            where = _pick(rng, _WHERE[then.junction])
            text += _pick(rng, (f", then {turn} at the {where}", f" and after that {turn} at the next {where}"))
            kind += f"+{then.manoeuvre}/{then.junction}"
        return NavigationInstruction(kind, _sentence(text), first.at_m - station_m, first.lane)

    def _said(self, step: _Step, ahead: Sequence[_Step], station_m: float, rng: np.random.Generator) -> tuple[str, str]:
        metres = step.at_m - station_m
        if step.manoeuvre in _LANE:
            do = _pick(rng, _LANE[step.manoeuvre])
            if metres <= NOW_M:
                return f"{do} now", f"{step.manoeuvre}/now"
            return _pick(rng, (f"in {_rounded(metres)} meters {do}", f"{do} in about {_rounded(metres)} meters")), (
                f"{step.manoeuvre}/distance"
            )
        do, where = _pick(rng, _do(step)), _pick(rng, _WHERE[step.junction])
        choices: list[Reference] = ["now"] if metres <= NOW_M else ["distance", "ordinal"]
        if step.landmark and metres > NOW_M and step.landmark_m > station_m:
            choices.append("landmark")
        reference = choices[int(rng.integers(len(choices)))]
        if reference == "now":
            text = _pick(rng, (f"{do} here", f"{do} at this {where}", f"now {do}"))
        elif reference == "distance":
            text = _pick(
                rng,
                (
                    f"in about {_rounded(metres)} meters, {do} at the {where}",
                    f"{do} at the {where} in {_rounded(metres)} meters",
                ),
            )
        elif reference == "landmark":
            text = _pick(rng, (f"{do} after {step.landmark}", f"past {step.landmark}, {do} at the {where}"))
        else:
            same = [one for one in ahead if one.junction == step.junction and not one.manoeuvre.startswith("change")]
            number = ordinal(same.index(step) + 1)
            text = _pick(rng, (f"{do} at the next {where}", f"at the {number} {where}, {do}"))
        return text, f"{step.manoeuvre}/{step.junction}/{reference}"

    def _arrival(self, left_m: float, rng: np.random.Generator) -> NavigationInstruction:
        name, _ = self._landmark(self.length_m)
        if left_m <= NOW_M:
            return NavigationInstruction("arrive/now", _sentence(_pick(rng, _ARRIVE)), left_m)
        if name:
            text = _pick(rng, (f"your destination is just past {name}", f"stop after {name}"))
            return NavigationInstruction("arrive/landmark", _sentence(text), left_m)
        metres = _rounded(left_m)
        text = _pick(
            rng, (f"your destination is in {metres} meters", f"in about {metres} meters you will have arrived")
        )
        return NavigationInstruction("arrive/distance", _sentence(text), left_m)

    def _misleading(
        self, ahead: Sequence[_Step], station_m: float, rng: np.random.Generator
    ) -> NavigationInstruction | None:
        """A turn that the next junction does not have, or a lane change off the road."""
        step = next((one for one in ahead if not one.manoeuvre.startswith("change")), None)
        if step is None:
            return None
        there = (*step.ways, _turn(step.manoeuvre))
        missing: list[Turn] = [turn for turn in TURNS if turn not in there]
        if missing:
            turn = missing[int(rng.integers(len(missing)))]
            text = f"{_pick(rng, _DO[turn])} at the {_pick(rng, _WHERE[step.junction])}"
            kind = f"misleading/{turn}/{step.junction}"
            return NavigationInstruction(kind, _sentence(text), step.at_m - station_m, "", safe_to_execute=False)
        sides: tuple[tuple[int, Manoeuvre], ...] = ((-1, "change left"), (1, "change right"))
        for side, manoeuvre in sides:
            beside = self._road.neighbour(step.before, side)
            if beside is None or self._road[beside].kind != "driving":
                text = f"{_pick(rng, _LANE[manoeuvre])} now"
                kind = f"misleading/{manoeuvre}"
                return NavigationInstruction(kind, _sentence(text), 0.0, "", safe_to_execute=False)
        return None


def _do(step: _Step) -> tuple[str, ...]:
    """Words for a turn: where the road only splits, one keeps to a side."""
    turn = _turn(step.manoeuvre)
    return _KEEP[turn] if step.junction == "fork" and turn in _KEEP else _DO[turn]


def _turn(manoeuvre: Manoeuvre) -> Turn:
    return "left" if manoeuvre == "left" else "right" if manoeuvre == "right" else "straight"


def _pick(rng: np.random.Generator, words: Sequence[str]) -> str:
    return words[int(rng.integers(len(words)))]


def _rounded(metres: float) -> int:
    """As people say distances: to 5 m below 50 m, else to 10 m."""
    step = 5 if metres < 50.0 else 10
    return max(step, round(metres / step) * step)


def _sentence(text: str) -> str:
    return text[0].upper() + text[1:] + "."
