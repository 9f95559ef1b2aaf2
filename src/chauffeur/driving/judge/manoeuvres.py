"""Whether the car took a way, changed lanes, passed, followed, or let somebody go."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

from chauffeur.concept.utterance import Act
from chauffeur.driving.judge.conditions import begin, too_early
from chauffeur.driving.judge.references import ROAD_USERS, WAYSIDE, ahead, meant
from chauffeur.driving.judge.setpoints import GAP_M, GAP_SHARE, planned_gap
from chauffeur.driving.judge.standing import ON_M, go
from chauffeur.driving.judge.trace import ON_PATH_M, STANDS_MPS, Found, TracedDrive, path_of
from chauffeur.geometry import Pose

FOLLOWED_S, FOLLOWED_ON_S = 12.0, 40.0
"""A road user is followed once it was for 12 s and over a junction, where ways part, or for 40 s."""
BEYOND_S: Final = 1.0
"""A turn is taken when the car is so long behind the junction: the way back is none, and the road may end."""
_ALONG_M: Final = 40.0
_GAP_M: Final = 45.0
_BESIDE_M: Final = 12.0
"""How far aside a road user may be that the car comes by: three lanes."""
_U_TURN_RAD: Final = math.radians(150.0)

# Ways -----------------------------------------------------------------------------------------------------------------


def turn(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car takes a way at a junction; of "straight" after a turn: that it drives along the street there."""
    side = "straight" if act.act == "straight" else act.side
    if act.act == "straight" and not ((last or act.when or act.place) and not drive.turned(start)):
        return _along(drive, act, start)
    reference = None if act.place is None else act.place.ref
    nth = 1
    if reference is not None and reference.kind in (*WAYSIDE, "road"):
        nth = max(1, reference.ordinal or 1)
    passed = act.when.ref if act.when is not None and act.when.event == "passed" else None
    first = max(1, passed.ordinal or 1) if passed is not None and passed.kind in WAYSIDE else 0
    for passage in [one for one in drive.passages if one.enters >= start][first:]:
        if passage.way == side or side is None:
            if nth > 1 and side == "straight":
                nth -= 1
                continue
            if nth > 1:
                return Found("not_done", passage.leaves, "the car turned at an earlier junction")
            if drive.all[-1].time_s - drive.all[passage.leaves].time_s < BEYOND_S - 1e-6:
                return Found("not_done", passage.leaves, "the car is hardly out of the junction")
            late = too_early(drive, act, passage.enters, start, passage)
            return Found("not_done" if late else "done", passage.leaves, late)
        if {side, passage.way} == {"left", "right"}:
            return Found("opposite", passage.leaves, f"the car turned {passage.way}")
        if side in drive.ways(passage):
            nth -= 1
            if nth < 1:
                return Found("not_done", passage.leaves, f"the car went {passage.way}, where a way leads {side}")
    return Found("not_done", start, "the car crossed no junction" if side == "straight" else "the car did not turn")


def _along(drive: TracedDrive, act: Act, start: int) -> Found:
    found = go(drive, act, start, way_m=_ALONG_M if drive.turned(start) else ON_M)
    if drive.turned(start, found.end):
        return Found("not_done", found.end, "the car turned off")
    return found


def u_turn(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car drives the way it came."""
    del last
    began = drive.all[start].ego.heading_rad
    for i in range(start, len(drive.all)):
        if abs(math.remainder(drive.all[i].ego.heading_rad - began, 2.0 * math.pi)) > _U_TURN_RAD:
            late = too_early(drive, act, i, start)
            return Found("not_done" if late else "done", i, late)
    return Found("not_done", start, "the car did not turn round")


# Lanes ----------------------------------------------------------------------------------------------------------------


def lane(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car is in the lane that was asked for, and stays in it."""
    began, least = drive.places[start], 1
    sign = {"left": -1, "right": 1}.get(act.side or "", 0)
    if act.value is not None and act.unit in ("", "lanes"):
        least = max(1, round(act.value))
    target = meant(drive, act.target, start) if act.to == "behind target" else ()
    if act.to == "behind target" and not target:
        return Found("not_judged", start, "nobody that was meant was in sight")

    def fits(i: int) -> bool:
        moved = drive.places[i] - began
        if not drive.settled(i):
            return False
        match act.to:
            case "original":
                return drive.places[i] == 0
            case "leftmost" | "rightmost" | "middle":
                return _is_at(drive, i, act.to) and (not sign or moved * sign > 0)
            case "behind target":
                agents = (drive.all[i].agents.get(number) for number in target)
                return any(one is not None and one.lane == drive.all[i].ego.lane for one in agents)
            case _:
                return moved * sign >= least if sign else abs(moved) >= least

    done = drive.held(start, fits, last=last)
    turned = next((i for i in range(start, len(drive.all)) if (drive.places[i] - began) * sign < 0), None)
    if turned is not None and (done is None or turned < done) and act.to != "original":
        return Found("opposite", turned, "the car changed to the other side")
    if done is None:
        return Found("not_done", start, "the car is not in the lane that was asked for")
    changed = next((i for i in range(start, done + 1) if drive.places[i] == drive.places[done]), done)
    late = too_early(drive, act, changed, start)
    return Found("not_done" if late else "done", done, late)


def _is_at(drive: TracedDrive, i: int, to: str) -> bool:
    here = drive.road.get(drive.all[i].ego.lane)
    if here is None:
        return False
    lanes = [one.index for one in drive.road.abreast(here.id) if one.kind == here.kind and not one.closed]
    if to == "middle":
        return len(lanes) > 2 and min(lanes) < here.index < max(lanes)
    return here.index == (min(lanes) if to == "leftmost" else max(lanes))


def keep(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car drives on and keeps to its lane."""
    start, waits = begin(drive, act, start)
    if waits:
        return Found(*waits)
    act = replace(act, when=None)
    if act.side is not None and act.to is None:
        act = replace(act, side=None, to="leftmost" if act.side == "left" else "rightmost")
    if act.to is not None:
        return lane(drive, act, start, last=last)
    found = go(drive, act, start)
    until = len(drive.all) - 1 if last else found.end
    left = next((i for i in range(start, until + 1) if drive.places[i] != drive.places[start]), None)
    return found if left is None else Found("opposite", left, "the car left its lane")


# Others ---------------------------------------------------------------------------------------------------------------


def overtake(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That who was meant is behind the car, passed on the side that was said, and the car is settled in its lane."""
    users = meant(drive, act.target, start)
    if not users:
        return Found("not_judged", start, "nothing that was meant was in sight")
    users = tuple(number for number in users if not drive.is_behind(start, number))
    side = act.side if act.act == "pass" else None
    wrong = ""

    def fits(i: int) -> bool:
        nonlocal wrong
        for number in users:
            if drive.is_behind(i, number):
                on = _passed_on(drive, number, i)
                if on and side in (None, on):
                    return drive.settled(i)
                wrong = f"it was passed on the {on}" if on else "it went another way"
        return False

    if drive.road.uninterrupted:
        done = drive.held(start, fits, last=last)
    else:
        done = next((i for i in range(start, len(drive.all)) if fits(i)), None)
    if done is None:
        return Found("not_done", start, wrong or "the vehicle that was meant was not passed")
    if drive.all[done].ego.crashed:
        return Found("not_done", done, "the car touched something")
    passed = next(i for i in range(start, done + 1) if any(drive.is_behind(i, number) for number in users))
    late = too_early(drive, act, passed, start)
    return Found("not_done" if late else "done", done, late)


def _passed_on(drive: TracedDrive, number: int, i: int) -> str:
    """The side on which a road user that is behind now was passed; empty where the car never came by, or it was in
    another street then."""
    for j in range(i, -1, -1):
        seen = drive.sees(j, number)
        if seen is not None and seen[0] >= 0.0:
            return "" if abs(seen[1]) > _BESIDE_M else "left" if seen[1] < 0.0 else "right"
    return ""


def follow(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car drives behind who was meant, where they drive."""
    users = ahead(drive, start) if act.target is None else meant(drive, act.target, start)
    if not users:
        return Found("not_judged", start, "nobody that was meant was in sight")
    if drive.road.uninterrupted:
        return _behind(drive, act, start, users, last=last)
    best = max((_followed(drive, number, start) for number in users), key=lambda one: one[0])
    if best[0] > 0.0:
        return Found("done", best[1])
    return Found("not_done", start, "it was not followed for long enough, or not where it went")


def _behind(drive: TracedDrive, act: Act, start: int, users: tuple[int, ...], *, last: bool) -> Found:
    """Of a road that leads nowhere else: that the car keeps behind them, no nearer than the plan says."""
    del act

    def fits(i: int) -> bool:
        front, least = drive.all[i].front, planned_gap(drive, i)
        if front is None or front.vehicle not in users:
            return False
        return drive.settled(i) and (least is None or front.distance_m >= least - max(GAP_M, GAP_SHARE * least))

    done = drive.held(start, fits, last=last)
    return Found("not_done", start, "it was not followed") if done is None else Found("done", done)


def _followed(drive: TracedDrive, number: int, start: int) -> tuple[float, int]:
    """(time, instant of its end) for which the car drove on the path of a road user, some way behind it; 0 where it
    was too short."""
    path: list[tuple[float, float]] = []
    longest, at, since, moved = 0.0, start, -1, 0.0
    for i, instant in enumerate(drive.all):
        agent, ego, seen = instant.agents.get(number), instant.ego, drive.sees(i, number)
        if agent is None or seen is None:
            since = -1
            continue
        path = path or path_of(agent)
        step = math.dist(path[-1], (agent.x_m, agent.y_m))
        if step > 0.5:
            path.append((agent.x_m, agent.y_m))
            moved += step
        if i < start:
            continue
        on_path = min(math.dist(point, (ego.x_m, ego.y_m)) for point in path[-160:]) < ON_PATH_M
        if not (on_path and seen[0] > -5.0 and math.hypot(*seen) < _GAP_M):
            since, moved = -1, 0.0
            continue
        if since < 0:
            since, moved = i, 0.0
        lasted = instant.time_s - drive.all[since].time_s
        parted = any(since < one.enters and one.leaves <= i for one in drive.passages)
        if moved > 15.0 and lasted >= (FOLLOWED_S if parted else FOLLOWED_ON_S) and lasted > longest:
            longest, at = lasted, i
    return longest, at


def give_way(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That who was meant goes first."""
    if drive.road.uninterrupted:
        return _let_in(drive, start, last=last)
    if act.target is None:
        return Found("done", start)
    users = meant(drive, act.target, start)
    if not users:
        known = act.target.kind in ROAD_USERS
        return Found("done", start) if known else Found("not_judged", start, "no predicate knows it")
    end = start
    for number in users:
        theirs, ours = _meet(drive, number)
        if theirs is not None and ours is not None:
            if ours < theirs:
                return Found("opposite", ours, "the car went first")
            end = max(end, theirs)
        elif theirs is None:
            waited = _slowed_for(drive, number, start)
            if waited is None and act.target.kind not in ("pedestrian", "pedestrians"):  # its way and ours do not meet
                waited = next((i for i in range(start, len(drive.all)) if drive.is_behind(i, number)), None)
            if waited is None:
                return Found("not_done", start, "it did not go, and the car did not wait")
            end = max(end, waited)
    return Found("done", end)


def _let_in(drive: TracedDrive, start: int, *, last: bool) -> Found:
    """Of a road without crossings: that somebody came in ahead, or that the gap which the plan opens is there."""
    began = drive.all[start].front

    def fits(i: int) -> bool:
        front, asked = drive.all[i].front, drive.numbers.get("gap_m")
        if front is None:
            return False
        came_in = began is None or front.vehicle != began.vehicle
        wide = asked is not None and front.distance_m >= asked - max(GAP_M, GAP_SHARE * asked)
        return (came_in or wide) and drive.settled(i)

    done = drive.held(start, fits, last=last)
    return Found("not_done", start, "nobody was let in") if done is None else Found("done", done)


def _meet(drive: TracedDrive, number: int) -> tuple[int | None, int | None]:
    """(when a road user was at the place where its path meets the car's, when the car was); None where they do not, or
    the car has not come there."""
    ours = [(i, one.ego.x_m, one.ego.y_m) for i, one in enumerate(drive.all)][::3]
    theirs = [(j, one.agents[number]) for j, one in enumerate(drive.all) if number in one.agents]
    for j, agent in theirs:
        for i, x, y in ours:
            if abs(x - agent.x_m) < ON_PATH_M and math.hypot(x - agent.x_m, y - agent.y_m) < ON_PATH_M:
                return j, i
    here, crossed = drive.all[-1].ego, None
    for j, agent in theirs:  # over the way that the car has still before it
        forward, leftward = Pose(here.x_m, here.y_m, here.heading_rad).sees(agent.x_m, agent.y_m)
        if 0.0 < forward < 30.0 and abs(leftward) < ON_PATH_M:
            crossed = j
    return crossed, None


def _slowed_for(drive: TracedDrive, number: int, start: int) -> int | None:
    for i in range(start + 1, len(drive.all)):
        seen = drive.sees(i, number) if drive.all[i].ego.speed_mps < STANDS_MPS else None
        if seen is not None and 0.0 < seen[0] < 25.0 and abs(seen[1]) < 15.0:
            return i
    return None
