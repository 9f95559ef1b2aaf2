"""Whether the car stood where it was to stand, waited, and drove on."""

from __future__ import annotations

import math
from typing import Final

from chauffeur.concept.utterance import Act
from chauffeur.driving.judge.conditions import came, too_early
from chauffeur.driving.judge.references import ROAD_USERS, WAYSIDE, meant
from chauffeur.driving.judge.trace import HELD_S, ON_PATH_M, STANDS_MPS, Found, TracedDrive

_BEHIND_M: Final = 10.0
_BESIDE_M: Final = 5.0
_ASIDE_M: Final = 7.5
"""As far as across the other lane of a street: who stops "by him on the left" stops there."""
_NEAR_M: Final = 12.0
_BLOCK_M: Final = 40.0
ON_M: Final = 10.0
"""So far a car has driven that drives on."""


def stop(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car stands, at its place: on the shoulder where there is one and it was to pull over."""
    del last
    reference = act.target if act.place is None else act.place.ref or act.target
    relation = "near" if act.place is None else act.place.rel
    users = meant(drive, reference, start) if reference is not None and reference.kind in ROAD_USERS else None
    stands = [(i, j) for i, j in drive.stands(start) if _told(drive, i, j)]
    if users == ():
        return Found("not_judged", start, "nothing that was meant was in sight")
    if reference is not None and users is None and reference.kind not in (*WAYSIDE, "me_here"):
        stood = stands[0][1] if stands else start
        if not stands:
            return Found("not_done", start, "the car did not come to a stand")
        return Found("not_judged", stood, "no predicate knows this place")
    shoulder = act.act == "pull_over" and drive.road.uninterrupted and any(lane.emergency for lane in drive.road.lanes)
    for i, j in stands:
        lane = drive.road.get(drive.all[j].ego.lane)
        if shoulder:
            fits = lane is not None and lane.emergency
        elif users is None and reference is not None and reference.kind != "me_here":
            beyond = relation in ("after", "behind") and reference.kind != "end_of_road"
            fits = _just_behind_junction(drive, start, i) if beyond else drive.before_junction(i)
        else:
            fits = users is None or any(_stands_by(drive, i, number, relation) for number in users)
        if fits:
            late = too_early(drive, act, i, start)
            return Found("not_done" if late else "done", j, late)
    if stands:
        return Found("not_done", stands[-1][1], "the car stood elsewhere")
    return Found("not_done", start, "the car did not come to a stand")


def _just_behind_junction(drive: TracedDrive, start: int, i: int) -> bool:
    """Whether the car stands behind a junction that it has driven through since an act began, and in the same block."""
    last = next((one for one in reversed(drive.passages) if start <= one.enters and one.leaves <= i), None)
    if last is None:
        return False
    ego, then = drive.all[i].ego, drive.all[last.leaves].ego
    return math.hypot(ego.x_m - then.x_m, ego.y_m - then.y_m) < _BLOCK_M


def _told(drive: TracedDrive, i: int, j: int) -> bool:
    return drive.road.uninterrupted or drive.all[i].told_to_stand or drive.all[j].told_to_stand


def _stands_by(drive: TracedDrive, i: int, number: int, relation: str) -> bool:
    """Whether the car stands as asked by a road user."""
    agent, seen, gap = drive.all[i].agents.get(number), drive.sees(i, number), drive.gap_m(i, number)
    if agent is None or seen is None or gap is None or abs(seen[1]) > _ASIDE_M:
        return False
    forward, leftward = seen
    close = -1.0 < gap < _BEHIND_M
    match relation:
        case "behind" | "before":
            return forward > 0.0 and close
        case "after":
            return forward < 0.0 and close
        case "in_front_of":
            person = agent.kind in ("pedestrian", "static", "obstacle")
            faces_us = math.cos(agent.heading_rad - drive.all[i].ego.heading_rad) < 0.0
            return close and (forward > 0.0 if person or faces_us else forward < 0.0)
        case "beside":
            return abs(forward) < _BESIDE_M or (forward > 0.0 and abs(leftward) < ON_PATH_M and close)
        case _:
            return math.hypot(forward, leftward) < _NEAR_M


def wait(drive: TracedDrive, act: Act, start: int, *, last: bool) -> Found:
    """That the car stands for a while, or until what it waits for has come."""
    del last
    when = act.when
    if when is None or when.event == "time" or act.unit == "s":
        least = max(HELD_S, (act.value if when is None else when.value) or 0.0)
        for i, j in drive.stands(start):
            ends = next((k for k in range(i, len(drive.all)) if drive.all[k].ego.speed_mps >= STANDS_MPS), None)
            lasted = drive.all[-1 if ends is None else ends].time_s - drive.all[i].time_s
            if drive.all[j].told_to_stand and lasted >= least - 1.0:
                return Found("done", j if ends is None else ends)
        return Found("not_done", start, "the car did not stand for so long")
    users = () if when.ref is None else meant(drive, when.ref, start)
    for i in range(start, len(drive.all)):
        if when.event in ("gone", "clear") and users:
            if any(drive.is_behind(i, number) and not drive.gone(number, i) for number in users):
                return Found("not_done", i, "the car drove on before")
            over = all(drive.gone(number, i) for number in users)
        else:
            over = came(drive, when, i, start)
        if over:
            waited = i == start or min(one.ego.speed_mps for one in drive.all[start : i + 1]) < STANDS_MPS
            return Found("done", i) if waited else Found("not_done", i, "the car did not wait")
    return Found("not_done", start, "what it was to wait for did not come")


def go(drive: TracedDrive, act: Act, start: int, *, last: bool = False, way_m: float = ON_M) -> Found:
    """That the car drives on, from a stand where it stood."""
    del last
    late = "the car did not drive on"
    begins = [start, *(i for i in range(start + 1, len(drive.all)) if drive.sets_off(i))]
    for k, began in enumerate(begins):
        until = begins[k + 1] if k + 1 < len(begins) else len(drive.all)
        late = too_early(drive, act, min(began + 10, len(drive.all) - 1), start)
        if late and k + 1 < len(begins):
            continue
        driven = 0.0
        for i in range(began + 1, len(drive.all)):
            one, before = drive.all[i].ego, drive.all[i - 1].ego
            driven += math.hypot(one.x_m - before.x_m, one.y_m - before.y_m)
            if driven > way_m:
                return Found("not_done" if late else "done", i, late)
            if i >= until and act.when is not None:
                break
    return Found("not_done", start, late or "the car did not drive on")
