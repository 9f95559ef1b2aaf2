"""Whether a drive did what an utterance asks: one predicate an act, over the geometry of what was driven.

The judge shares nothing with what drives but the meaning of words (`concept.utterance`) and geometry: it looks for the
road users that a reference means by attributes of its own, in the instant at which it was said, or in the whole drive
where they came into sight later. A benchmark that staged them names them instead. It judges in hindsight: that a road
user "had gone" when the car turned means that it did not come onto the car's way after that.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final, Literal

from chauffeur.concept import (
    JudgedBy,
    LaneId,
    Metric,
    Observation,
    Outcome,
    ProgramState,
    Setpoints,
    SignalState,
    VehicleState,
)
from chauffeur.concept.scene import AgentKind
from chauffeur.concept.sight import states_of
from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH
from chauffeur.concept.utterance import Act, Condition, Reference, ReferenceKind
from chauffeur.geometry import Pose, RoadGraph, named_ways, wrap_to_pi
from chauffeur.geometry.road_graph import turn_of
from chauffeur.worlds.base import World

ActResult = Literal["done", "not_done", "opposite", "not_judged"]
Referents = Mapping[Reference, tuple[int, ...]]
"""Ids of the road users that references mean, where a stage names them."""

STOOD_S: Final = 2.5
FOLLOWED_S, FOLLOWED_ON_S = 12.0, 40.0
"""A road user is followed once it was for 12 s and over a junction, where ways part, or for 40 s."""
PERIOD_S: Final = 0.1
"""Instants of a drive are looked at so often."""
_EVERY_S: Final = 1.0
_STANDS_MPS: Final = 0.15
_SIGHT_M: Final = 80.0
_ON_PATH_M: Final = 2.0
"""A road user whose middle is so near to the car's path is on it."""
_BEHIND_M: Final = 10.0
_BESIDE_M: Final = 5.0
_ASIDE_M: Final = 5.5
_NEAR_M: Final = 12.0
_GAP_M: Final = 45.0
_ON_M, _ALONG_M = 10.0, 40.0
_SLOWER, _SLOWLY, _USUAL_SHARE, _ROLLS_MPS = 0.85, 0.7, 0.6, 3.0
_PACE_MPS: Final = 1.0
_ENDED_S: Final = 6.0
_VEHICLES: Final[frozenset[AgentKind]] = frozenset({"car", "truck", "bus", "motorcycle", "bicycle"})
_MEANS: Final[dict[ReferenceKind, frozenset[AgentKind]]] = {
    "car": frozenset({"car"}), "van": frozenset({"car"}), "truck": frozenset({"truck"}), "bus": frozenset({"bus"}),
    "motorcycle": frozenset({"motorcycle"}), "bicycle": frozenset({"bicycle"}),
    "pedestrian": frozenset({"pedestrian"}), "pedestrians": frozenset({"pedestrian"}), "vehicle": _VEHICLES,
    "vehicles": _VEHICLES, "traffic": _VEHICLES, "obstacle": frozenset({"static", "obstacle"}),
    "cone": frozenset({"static"}), "barrier": frozenset({"obstacle"}),
}  # fmt: skip
_ALIKE: Final = {"silver": "grey", "grey": "silver"}


@dataclass(frozen=True, slots=True)
class DriveInstant:
    """What is kept of an instant of a drive.

    Attributes:
        time_s: Since the trip began.
        ego: The car.
        agents: Road users and things by id.
        lights: What each lane before a light was shown.
        told_to_stand: Whether the policy asked for a standstill: a car that waits at a light has not stopped there.
    """

    time_s: float
    ego: VehicleState
    agents: Mapping[int, VehicleState]
    lights: Mapping[LaneId, SignalState]
    told_to_stand: bool


@dataclass(slots=True)
class DriveTrace:
    """A drive as a sequence of instants.

    Attributes:
        road: Where it was driven.
        first: The observation in which the words were said.
        instants: Instants, in order.
    """

    road: RoadGraph
    first: Observation
    instants: list[DriveInstant] = field(default_factory=list[DriveInstant])

    def add(self, seen: Observation, *, told_to_stand: bool) -> None:
        """Keep an instant."""
        lights: dict[LaneId, SignalState] = {lane: signal.state for signal in seen.signals for lane in signal.lanes}
        agents = {one.id: one for one in (*seen.others, *seen.objects)}
        self.instants.append(DriveInstant(seen.time_s, seen.ego, agents, lights, told_to_stand))


@dataclass(frozen=True, slots=True)
class JudgedAct:
    """What became of an act.

    Attributes:
        act: The act.
        result: What became of it.
        why: What is missing, in words; empty where nothing is.
    """

    act: Act
    result: ActResult
    why: str = ""


def judge(acts: Sequence[Act], trace: DriveTrace, referents: Referents | None = None) -> tuple[JudgedAct, ...]:
    """What became of each act, in their order.

    Args:
        acts: What was asked for.
        trace: What was driven so far.
        referents: Whom references mean, where that is known; looked for by attributes otherwise.
    """
    judging = _Judging(trace, referents or {})
    found: list[JudgedAct] = []
    start, missed = 0, False
    wanted = [one for one in acts if not one.purpose and one.act not in ("none", "refuse")]
    for act in wanted:
        if missed:
            found.append(JudgedAct(act, "not_done", "it was not come to"))
            continue
        result, end, why = judging.act(act, start, last=act is wanted[-1])
        found.append(JudgedAct(act, result, why))
        missed = result in ("not_done", "opposite") and not act.negated
        start = max(start, end)
    return tuple(found)


_Found = tuple[ActResult, int, str]


@dataclass(frozen=True, slots=True)
class _Passage:
    """A junction that the car drove through: first instant in it, first behind it, lane before it, way taken."""

    enters: int
    leaves: int
    before: LaneId
    way: str


class _Judging:
    def __init__(self, trace: DriveTrace, referents: Referents) -> None:
        self._trace, self._given = trace, referents
        self._all = trace.instants
        self._passages = self._driven_through()

    def act(self, act: Act, start: int, *, last: bool) -> _Found:
        """(result, instant at which it was done, what is missing)."""
        if act.act == "straight" and not (last or act.negated or act.when or act.place):
            return self._along(act, start)
        if act.negated:
            return self._kept_from(act, start)
        doing: dict[str, Callable[[Act, int], _Found]] = {
            "turn": self._turn, "straight": self._turn, "stop": self._stop, "park": self._stop,
            "pull_over": self._stop, "follow": self._follow, "yield": self._yield, "wait": self._wait, "go": self._go,
            "lane": self._lane, "speed": self._speed, "avoid": self._pass, "pass": self._pass, "keep": self._go,
        }  # fmt: skip
        if act.act not in doing:
            return "not_judged", start, "no predicate knows this act"
        return doing[act.act](act, start)

    # Whom -------------------------------------------------------------------------------------------------------------

    def meant(self, reference: Reference, start: int) -> tuple[int, ...]:
        """Ids of the road users that a reference of an act may mean: in sight when it was said, or from a turn on."""
        if reference in self._given:
            return self._given[reference]
        kinds = _MEANS.get(reference.kind)
        if kinds is None:
            return ()
        first = self._trace.first
        seen = [
            one for one in (*first.others, *first.objects) if one.kind in kinds and self._away(first, one) < _SIGHT_M
        ]
        fits = self._fitting(seen, reference, first)
        turned = any(passage.leaves <= start for passage in self._passages)
        if fits and not turned:
            if reference.kind in ("vehicles", "pedestrians", "traffic"):
                return tuple(one.id for one in fits)
            if reference.ordinal is not None:
                ahead = [one for one in fits if self._sees(first.ego, one)[0] > 0.0]
                index = reference.ordinal - 1 if reference.ordinal > 0 else reference.ordinal
                return (ahead[index].id,) if -len(ahead) <= index < len(ahead) else ()
            if reference.deictic:
                return (fits[0].id,)
            return tuple(one.id for one in fits)
        later = {one.id: one for instant in self._all[start:] for one in instant.agents.values() if one.kind in kinds}
        if reference.colour is not None:
            later = {number: one for number, one in later.items() if one.colour == reference.colour}
        return tuple(later)

    def _fitting(self, seen: list[VehicleState], reference: Reference, first: Observation) -> list[VehicleState]:
        fits = seen
        if reference.kind == "van":
            fits = [one for one in fits if one.length_m > 5.2]
        if reference.colour is not None:
            exact = [one for one in fits if one.colour == reference.colour]
            fits = exact or [one for one in fits if one.colour == _ALIKE.get(reference.colour, "")]
        if reference.state is not None:
            fits = [one for one in fits if reference.state in states_of(one, first)]
        if reference.side is not None:
            sign = 1.0 if reference.side == "left" else -1.0
            fits = [one for one in fits if sign * self._sees(first.ego, one)[1] > 1.0]
        ahead = [one for one in fits if self._sees(first.ego, one)[0] > -3.0]
        return sorted(ahead or fits, key=lambda one: (self._away(first, one), one.id))

    @staticmethod
    def _sees(ego: VehicleState, one: VehicleState) -> tuple[float, float]:
        return Pose(ego.x_m, ego.y_m, ego.heading_rad).sees(one.x_m, one.y_m)

    @staticmethod
    def _away(first: Observation, one: VehicleState) -> float:
        return math.hypot(one.x_m - first.ego.x_m, one.y_m - first.ego.y_m)

    # Junctions --------------------------------------------------------------------------------------------------------

    def _driven_through(self) -> list[_Passage]:
        found: list[_Passage] = []
        road, enters = self._trace.road, -1
        for i, instant in enumerate(self._all):
            lane = road.get(instant.ego.lane)
            inside = lane is not None and bool(lane.junction)
            if inside and enters < 0 and i > 0:
                enters = i
            elif not inside and enters >= 0:
                before, behind = self._all[enters - 1].ego, instant.ego
                way = turn_of(wrap_to_pi(behind.heading_rad - before.heading_rad))
                found.append(_Passage(enters, i, before.lane or "", way))
                enters = -1
        return found

    def _turn(self, act: Act, start: int) -> _Found:
        side = "straight" if act.act == "straight" else act.side
        nth = 1
        reference = None if act.place is None else act.place.ref
        if reference is not None and reference.kind in ("junction", "road", "light"):
            nth = max(1, reference.ordinal or 1)
        if side == "straight" and any(one.leaves <= start and one.way != "straight" for one in self._passages):
            return self._along(act, start)
        for passage in self._passages:
            if passage.enters < start:
                continue
            ways = named_ways(self._trace.road, passage.before) if passage.before in self._trace.road else {}
            if passage.way == side:
                if nth > 1:
                    return "not_done", passage.leaves, "the car turned at an earlier junction"
                late = self._held(act.when, passage.enters, start, passage)
                return ("done", passage.leaves, "") if not late else ("not_done", passage.leaves, late)
            if {side, passage.way} == {"left", "right"}:
                return "opposite", passage.leaves, f"the car turned {passage.way}"
            if side in ways:
                nth -= 1
                if nth < 1:
                    return "not_done", passage.leaves, f"the car went {passage.way}, where a way leads {side}"
        return "not_done", start, "the car did not turn" if side != "straight" else "the car crossed no junction"

    def _along(self, act: Act, start: int) -> _Found:
        """Of "straight" after a turn: that the street which it leads into is driven along."""
        turned = any(one.leaves <= start and one.way != "straight" for one in self._passages)
        result, end, why = self._go(act, start, _ALONG_M if turned else _ON_M)
        if any(one.way != "straight" and start < one.leaves <= end for one in self._passages):
            return "not_done", end, "the car turned off"
        return result, end, why

    # Standing ---------------------------------------------------------------------------------------------------------

    def _stop(self, act: Act, start: int) -> _Found:
        reference = act.target if act.place is None else act.place.ref or act.target
        relation = "near" if act.place is None else act.place.rel
        users = self.meant(reference, start) if reference is not None and reference.kind in _MEANS else None
        if users == ():
            return "not_judged", start, "nothing that was meant was in sight"
        if reference is not None and users is None and reference.kind not in _PLACELESS:
            return "not_judged", start, "no predicate knows this place"
        elsewhere = -1
        for i, j in self._stands(start):
            if users is None and reference is not None and reference.kind != "me_here":
                fits = self._before_junction(i)
            else:
                fits = users is None or any(self._stands_by(i, number, relation) for number in users)
            if fits and (self._all[i].told_to_stand or self._all[j].told_to_stand):
                late = self._held(act.when, i, start, None)
                return ("done", j, "") if not late else ("not_done", j, late)
            if self._all[j].told_to_stand:
                elsewhere = j
        if elsewhere >= 0:
            return "not_done", elsewhere, "the car stood elsewhere"
        return "not_done", start, "the car did not come to a stand"

    def _stands(self, start: int) -> list[tuple[int, int]]:
        """(first instant, instant at which it has stood for long enough) of each stand from an instant on."""
        found: list[tuple[int, int]] = []
        since = -1
        for i in range(start, len(self._all)):
            if self._all[i].ego.speed_mps >= _STANDS_MPS:
                since = -1
                continue
            since = i if since < 0 else since
            long = self._all[i].time_s - self._all[since].time_s >= STOOD_S and self._all[i].told_to_stand
            if long and (not found or found[-1][0] != since):
                found.append((since, i))
        return found

    def _stands_by(self, i: int, number: int, relation: str) -> bool:
        """Whether the car stands as asked by a road user."""
        instant = self._all[i]
        agent = instant.agents.get(number)
        if agent is None:
            return False
        ego = instant.ego
        forward, leftward = self._sees(ego, agent)
        gap = abs(forward) - (ego.length_m + agent.length_m) / 2.0
        if abs(leftward) > _ASIDE_M:
            return False
        close = -1.0 < gap < _BEHIND_M
        faces_us = math.cos(agent.heading_rad - ego.heading_rad) < 0.0
        match relation:
            case "behind" | "before":
                return forward > 0.0 and close
            case "after":
                return forward < 0.0 and close
            case "in_front_of":
                person = agent.kind in ("pedestrian", "static", "obstacle")
                return close and (forward > 0.0 if person or faces_us else forward < 0.0)
            case "beside":
                return abs(forward) < _BESIDE_M or (forward > 0.0 and abs(leftward) < _ON_PATH_M and close)
            case _:
                return math.hypot(forward, leftward) < _NEAR_M

    def _before_junction(self, i: int) -> bool:
        """Whether the car stands just before a junction."""
        ego, road = self._all[i].ego, self._trace.road
        lane = road.get(ego.lane)
        if lane is None or lane.junction or not any(one.junction for one in road.successors(lane.id)):
            return False
        return lane.length_m - lane.centre.nearest(ego.x_m, ego.y_m) < _NEAR_M

    def _wait(self, act: Act, start: int) -> _Found:
        if act.when is None:
            long = next((j for i, j in self._stands(start) if self._all[i].told_to_stand), -1)
            return ("done", long, "") if long >= 0 else ("not_done", start, "the car did not stand")
        users = () if act.when.ref is None else self.meant(act.when.ref, start)
        for i in range(start, len(self._all)):
            if act.when.event in ("gone", "clear") and users:
                if any(self._is_behind(i, number) and not self._gone(number, i) for number in users):
                    return "not_done", i, "the car drove on before"
                came = all(self._gone(number, i) for number in users)
            else:
                came = not self._held(act.when, i, start, None)
            if came:
                slowest = min(one.ego.speed_mps for one in self._all[start : i + 1])
                waited = slowest < _STANDS_MPS or i == start
                return ("done", i, "") if waited else ("not_done", i, "the car did not wait")
        return "not_done", start, "what it was to wait for did not come"

    def _gone(self, number: int, i: int) -> bool:
        """Whether a road user has left the way ahead: it is on the other side, draws away, or is out of sight."""
        instant = self._all[i]
        agent = instant.agents.get(number)
        began = next((one for one in self._all if number in one.agents), None)
        if agent is None or began is None:
            return began is not None
        forward, leftward = self._sees(instant.ego, agent)
        first_forward, first_left = self._sees(began.ego, began.agents[number])
        if forward > _SIGHT_M or (first_forward < 0.0 < forward - (agent.length_m + instant.ego.length_m) / 2.0):
            return True
        if first_left * leftward < 0.0 and abs(leftward) > _ON_PATH_M:
            return True
        return self._is_behind(i, number) and agent.kind != "pedestrian"

    # Others -----------------------------------------------------------------------------------------------------------

    def _follow(self, act: Act, start: int) -> _Found:
        users = () if act.target is None else self.meant(act.target, start)
        if not users:
            return "not_judged", start, "nobody that was meant was in sight"
        best = max((self._followed(number, start) for number in users), key=lambda one: one[0])
        if best[0] > 0.0:
            return "done", best[1], ""
        return "not_done", start, "it was not followed for long enough, or not where it went"

    def _followed(self, number: int, start: int) -> tuple[float, int]:
        """(time, instant of its end) for which the car drove on the path of a road user, some way behind it; 0 where it
        was too short."""
        path: list[tuple[float, float]] = []
        longest, at, since, moved = 0.0, start, -1, 0.0
        for i in range(len(self._all)):
            agent, ego = self._all[i].agents.get(number), self._all[i].ego
            if agent is None:
                since = -1
                continue
            here = Pose(agent.x_m, agent.y_m, agent.heading_rad)
            if not path:
                path = [here.place(-float(back), 0.0) for back in range(60, -1, -1)]
            step = math.dist(path[-1], (agent.x_m, agent.y_m))
            if step > 0.5:
                path.append((agent.x_m, agent.y_m))
                moved += step
            if i < start:
                continue
            gap = math.hypot(agent.x_m - ego.x_m, agent.y_m - ego.y_m)
            on_path = min(math.dist(point, (ego.x_m, ego.y_m)) for point in path[-160:]) < _ON_PATH_M
            if not (on_path and self._sees(ego, agent)[0] > -5.0 and gap < _GAP_M):
                since, moved = -1, 0.0
                continue
            if since < 0:
                since, moved = i, 0.0
            lasted = self._all[i].time_s - self._all[since].time_s
            parted = any(since < one.enters and one.leaves <= i for one in self._passages)
            if moved > 15.0 and lasted >= (FOLLOWED_S if parted else FOLLOWED_ON_S) and lasted > longest:
                longest, at = lasted, i
        return longest, at

    def _yield(self, act: Act, start: int) -> _Found:
        if act.target is None:
            return "done", start, ""
        users = self.meant(act.target, start)
        if not users:
            return ("done", start, "") if act.target.kind in _MEANS else ("not_judged", start, "no predicate knows it")
        end = start
        for number in users:
            theirs, ours = self._meet(number)
            if theirs is not None and ours is not None:
                if ours < theirs:
                    return "opposite", ours, "the car went first"
                end = max(end, theirs)
            elif theirs is None:
                past = next((i for i in range(start, len(self._all)) if self._is_behind(i, number)), None)
                waited = self._slowed_for(number, start)
                if waited is None and act.target.kind not in ("pedestrian", "pedestrians"):
                    waited = past  # its way and ours do not meet
                if waited is None:
                    return "not_done", start, "it did not go, and the car did not wait"
                end = max(end, waited)
        return "done", end, ""

    def _meet(self, number: int) -> tuple[int | None, int | None]:
        """(when a road user was at the place where its path meets the car's, when the car was); None where they do not,
        or the car has not come there."""
        ours = [(i, one.ego.x_m, one.ego.y_m) for i, one in enumerate(self._all)][::3]
        for j, instant in enumerate(self._all):
            agent = instant.agents.get(number)
            if agent is None:
                continue
            for i, x, y in ours:
                if abs(x - agent.x_m) < _ON_PATH_M and math.hypot(x - agent.x_m, y - agent.y_m) < _ON_PATH_M:
                    return j, i
        last = self._all[-1]
        agent = last.agents.get(number)
        crossed = None
        for j, instant in enumerate(self._all):  # over the way that the car has still before it
            agent = instant.agents.get(number)
            if agent is None:
                continue
            forward, leftward = self._sees(last.ego, agent)
            if forward > 0.0 and abs(leftward) < _ON_PATH_M and forward < 30.0:
                crossed = j
        return crossed, None

    def _slowed_for(self, number: int, start: int) -> int | None:
        for i in range(start, len(self._all)):
            agent, ego = self._all[i].agents.get(number), self._all[i].ego
            if agent is not None and ego.speed_mps < _STANDS_MPS:
                forward, leftward = self._sees(ego, agent)
                if 0.0 < forward < 25.0 and abs(leftward) < 15.0 and i > start:
                    return i
        return None

    def _pass(self, act: Act, start: int) -> _Found:
        users = () if act.target is None else self.meant(act.target, start)
        if not users:
            return "not_judged", start, "nothing that was meant was in sight"
        for i in range(start, len(self._all)):
            if any(self._is_behind(i, number) for number in users):
                if self._all[i].ego.crashed:
                    return "not_done", i, "the car touched something"
                return "done", i, ""
        return "not_done", start, "the car did not come past it"

    def _is_behind(self, i: int, number: int) -> bool:
        agent, ego = self._all[i].agents.get(number), self._all[i].ego
        if agent is None:
            return False
        return self._sees(ego, agent)[0] < -(ego.length_m + agent.length_m) / 2.0

    # Driving on -------------------------------------------------------------------------------------------------------

    def _go(self, act: Act, start: int, way_m: float = _ON_M) -> _Found:
        """That the car drives on, from a stand where it stood."""
        late = "the car did not drive on"
        begins = [start, *(i for i in range(start + 1, len(self._all)) if self._sets_off(i))]
        for k, began in enumerate(begins):
            until = begins[k + 1] if k + 1 < len(begins) else len(self._all)
            late = self._held(act.when, min(began + 10, len(self._all) - 1), start, None)
            if late and k + 1 < len(begins):
                continue
            driven = 0.0
            for i in range(began + 1, len(self._all)):
                one, before = self._all[i].ego, self._all[i - 1].ego
                driven += math.hypot(one.x_m - before.x_m, one.y_m - before.y_m)
                if driven > way_m:
                    return ("done", i, "") if not late else ("not_done", i, late)
                if i >= until and act.when is not None:
                    break
        return "not_done", start, late or "the car did not drive on"

    def _sets_off(self, i: int) -> bool:
        return self._all[i].ego.speed_mps >= _STANDS_MPS > self._all[i - 1].ego.speed_mps

    def _lane(self, act: Act, start: int) -> _Found:
        side = act.side or {"leftmost": "left", "rightmost": "right"}.get(act.to or "", "")
        if not side:
            return "not_judged", start, "no predicate knows this lane"
        road = self._trace.road
        for i in range(start + 1, len(self._all)):
            before, lane = self._all[i - 1].ego.lane, self._all[i].ego.lane
            moved = None if before is None or lane is None else road.places_between(before, lane)
            if moved:
                if (moved < 0) != (side == "left"):
                    return "opposite", i, "the car changed to the other side"
                late = self._held(act.when, i, start, None)
                return ("done", i, "") if not late else ("not_done", i, late)
        return "not_done", start, "the car did not change lanes"

    def _speed(self, act: Act, start: int) -> _Found:
        if not self._all:
            return "not_done", start, "nothing was driven"
        factor = {"mph": MPS_PER_MPH, "m/s": 1.0}.get(act.unit, MPS_PER_KMH)
        abreast = None
        if act.when is not None and act.when.ref is not None and act.when.type == "while":
            abreast = self.meant(act.when.ref, start)
        if act.value is None and act.direction != "faster" and abreast is None:
            return self._slower(start)
        began, held = self._all[start].ego.speed_mps, -1
        for i in range(start, len(self._all)):
            instant = self._all[i]
            if abreast is not None and not any(self._abreast(i, number) for number in abreast):
                held = -1
                continue
            speed = instant.ego.speed_mps
            if act.value is not None:
                fits = abs(speed - act.value * factor) <= _PACE_MPS
            elif act.direction == "faster":
                fits = speed > began + _PACE_MPS
            else:
                fits = _STANDS_MPS < speed < _SLOWLY * self._limit_mps(i)
            held = -1 if not fits else i if held < 0 else held
            if fits and instant.time_s - self._all[held].time_s >= 1.0:
                return "done", i, ""
        return "not_done", start, "the speed was not reached"

    def _slower(self, start: int) -> _Found:
        """That the car drives slower than it did, or than one usually does where it has just set off."""
        began = self._all[start].ego.speed_mps
        rolls = began > _ROLLS_MPS
        first, last = (2.0, 6.0) if rolls else (4.0, 12.0)
        most = _SLOWER * max(began, _USUAL_SHARE * self._limit_mps(start))
        at = self._all[start].time_s
        window = [one for one in self._all[start:] if first <= one.time_s - at <= last]
        if not window or window[-1].time_s - at < last - 2.0 * PERIOD_S:
            return "not_done", start, "it was not driven for long enough"
        if max(one.ego.speed_mps for one in window) >= most:
            return "not_done", start, "the car did not drive slower"
        return "done", start + len(window), ""

    def _limit_mps(self, i: int) -> float:
        lane = self._trace.road.get(self._all[i].ego.lane)
        return math.inf if lane is None else lane.speed_limit_mps

    def _abreast(self, i: int, number: int) -> bool:
        agent, ego = self._all[i].agents.get(number), self._all[i].ego
        return agent is not None and abs(self._sees(ego, agent)[0]) < (ego.length_m + agent.length_m) / 2.0 + 3.0

    def _kept_from(self, act: Act, start: int) -> _Found:
        """Of what is not to be done: that the whole drive does not do it."""
        if act.act == "turn":
            taken = [one for one in self._passages if one.enters >= start]
            if any(one.way == act.side or (act.side is None and one.way != "straight") for one in taken[:1]):
                return "opposite", taken[0].leaves, "the car did it all the same"
            return ("done", start, "") if taken else ("not_done", start, "the car came to no junction")
        if act.act in ("stop", "park", "pull_over"):
            if self._stands(start):
                return "opposite", start, "the car stood"
            return self._go(Act("go"), start)
        if act.act == "lane":
            result, end, _ = self._lane(act, start)
            return ("opposite", end, "the car did it all the same") if result == "done" else self._go(Act("go"), start)
        return "not_judged", start, "no predicate knows this"

    # Events -----------------------------------------------------------------------------------------------------------

    def _held(self, when: Condition | None, begins: int, start: int, passage: _Passage | None) -> str:
        """What was too early about an act that begins at an instant; empty where nothing was."""
        if when is None or when.type in ("while", "unless", "before"):
            return ""
        begins = min(max(begins, start), len(self._all) - 1)
        match when.event:
            case "green":
                lane = (passage.before if passage is not None else self._all[begins].ego.lane) or ""
                shown = self._all[max(0, begins - 1)].lights.get(lane)
                return "" if shown == "green" else f"the light showed {shown or 'nothing'}"
            case "gone":
                users = () if when.ref is None else self.meant(when.ref, start)
                return next((why for number in users if (why := self._still_there(number, begins, start))), "")
            case "passed" if when.ref is not None and when.ref.kind in _PLACELESS:
                return "" if any(one.leaves <= begins for one in self._passages) else "it had not been passed"
            case "passed":
                users = () if when.ref is None else self.meant(when.ref, start)
                return "" if any(self._is_behind(begins, number) for number in users) else "it had not been passed"
            case "moves":
                users = () if when.ref is None else self.meant(when.ref, start)
                return "" if any(self._moved(number, begins) for number in users) else "it had not moved"
            case "stopped":
                users = () if when.ref is None else self.meant(when.ref, start)
                agents = [self._all[begins].agents.get(number) for number in users]
                return "" if any(one is not None and one.speed_mps < 0.5 for one in agents) else "it had not stopped"
            case _:
                return ""

    def _still_there(self, number: int, begins: int, start: int) -> str:
        """Why a road user had not gone when an act began: it came onto the car's way afterwards, or was coming."""
        ego = self._all[begins].ego
        agent = self._all[begins].agents.get(number)
        if agent is None:
            return ""
        ahead = [(one.ego.x_m, one.ego.y_m) for one in self._all[begins:]][::3]
        for instant in self._all[begins + 2 :]:
            later = instant.agents.get(number)
            if later is None:
                break
            forward, _ = self._sees(instant.ego, later)
            near = (math.dist(point, (later.x_m, later.y_m)) for point in ahead)
            if forward > 0.0 and later.speed_mps > 0.3 and min(near, default=math.inf) < _ON_PATH_M:
                along = math.cos(later.heading_rad - instant.ego.heading_rad) > 0.8
                if not along:
                    return "it came onto the way after that"
        moved = self._moved(number, begins)
        before = self._all[max(start, begins - 10)].agents.get(number)
        if not moved and before is not None and agent.kind == "pedestrian":
            return "it had not gone yet"
        approaching = False
        if before is not None:
            then = self._all[max(start, begins - 10)].ego
            was = math.hypot(before.x_m - then.x_m, before.y_m - then.y_m)
            now = math.hypot(agent.x_m - ego.x_m, agent.y_m - ego.y_m)
            forward, _ = self._sees(ego, agent)
            facing = math.cos(agent.heading_rad - ego.heading_rad) < -0.5
            approaching = forward > 0.0 and facing and now < was and agent.speed_mps > 1.0
        return "it was still coming" if approaching else ""

    def _moved(self, number: int, begins: int) -> bool:
        first = next((one.agents[number] for one in self._all if number in one.agents), None)
        now = self._all[begins].agents.get(number)
        return first is not None and (now is None or math.hypot(now.x_m - first.x_m, now.y_m - first.y_m) > 1.0)


_PLACELESS: Final[frozenset[ReferenceKind]] = frozenset({"me_here", "junction", "light", "stop_sign"})


class MeaningReferee:
    """Judges a drive by the acts of an utterance."""

    def __init__(
        self, world: World, acts: Sequence[Act], judged_by: JudgedBy, referents: Referents | None = None
    ) -> None:
        """Take a task, right after the world was reset.

        Args:
            world: Where it is driven.
            acts: What was asked for.
            judged_by: Where they come from: the reading that the planner shares, or people's labels.
            referents: Whom references mean, where a stage names them.
        """
        self._world, self._acts, self._referents = world, tuple(acts), referents
        self.judged_by: JudgedBy = judged_by
        seen = world.observe()
        self._trace = DriveTrace(seen.road, seen)
        self._trace.add(seen, told_to_stand=False)
        self._found = judge(self._acts, self._trace, self._referents)
        self._told_to_stand = self._finished = False
        self._kept_s = self._judged_s = -math.inf
        self._ended_s: float | None = None
        self._done_s: float | None = None

    def follow(self, setpoints: Setpoints, state: ProgramState) -> None:
        """What the policy asks for in this period, before `observe`."""
        self._told_to_stand = setpoints.target_speed_mps is not None and setpoints.target_speed_mps <= 0.05
        self._finished = state == "finished"

    def observe(self) -> None:
        """Look at the instant after a control period."""
        seen = self._world.observe()
        if seen.time_s - self._kept_s >= PERIOD_S - 1e-6:
            self._kept_s = seen.time_s
            self._trace.add(seen, told_to_stand=self._told_to_stand)
        if self._finished and self._ended_s is None:
            self._ended_s = seen.time_s
        if seen.time_s - self._judged_s >= _EVERY_S - 1e-6 or seen.ended:
            self._judged_s = seen.time_s
            self._found = judge(self._acts, self._trace, self._referents)
            if self._all_done and self._done_s is None:
                self._done_s = seen.time_s
            elif not self._all_done:
                self._done_s = None

    @property
    def judged(self) -> tuple[JudgedAct, ...]:
        """What became of each act so far."""
        return self._found

    @property
    def _all_done(self) -> bool:
        known = [one for one in self._found if one.result != "not_judged"]
        return bool(known) and all(one.result == "done" for one in known)

    @property
    def over(self) -> bool:
        """Whether all is done and held, the opposite was done, or the program ended without."""
        now = self._kept_s
        if any(one.result == "opposite" for one in self._found):
            return True
        if self._done_s is not None and now - self._done_s >= 2.0 and not any(one.act.negated for one in self._found):
            return True
        return self._ended_s is not None and now - self._ended_s >= _ENDED_S

    @property
    def success(self) -> bool:
        """Whether every act that can be judged was done, and all can be."""
        return bool(self._found) and all(one.result == "done" for one in self._found)

    @property
    def parts_done(self) -> tuple[int, int]:
        """Acts that were done, of all."""
        return sum(one.result == "done" for one in self._found), len(self._found)

    @property
    def shortfall(self) -> str:
        """What is missing, in words; empty when nothing is."""
        missing = next((one for one in self._found if one.result != "done"), None)
        return "" if missing is None else f"{missing.act.act.replace('_', ' ').capitalize()}: {missing.why}."

    def outcome(self) -> Outcome:
        """What came of it, collisions apart."""
        if self.success:
            return "success"
        return "failure" if self._finished or any(one.result == "opposite" for one in self._found) else "timeout"

    def metrics(self) -> tuple[Metric, ...]:
        """Share of the acts that were done, and how long it took."""
        done, count = self.parts_done
        return (
            Metric("meaning-acts-v1", done / count if count else 0.0, "share", applies=count > 0),
            Metric("meaning-time-v1", self._done_s or 0.0, "s", applies=self._done_s is not None),
        )
