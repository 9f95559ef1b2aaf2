"""A short drive on open road (paper Sec. VII-C, case II): what can be asked, its features, the pattern, the ideal.

The answer says first how the words were understood, then points at a way on and at what to stop by, and then writes
waypoints: for each of `WAYPOINTS` instants a distance along that way, and the offset from the middle of the lane at
which the drive ends. One token a quantity, so digits cannot contradict one another. All of it is one pattern of one
network, so the reasons R and the policy P come from the same passes; `reference` knows what should be driven for what
was understood, and `driving_agreement` computes whether that is what was written.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from chauffeur.concept import Street, StreetMark, StreetWay
from chauffeur.planners.vilad.template import MASK, ActionSlot, ActionTemplate
from chauffeur.planners.vilad.unmasking import Decided, Predict

Array = np.ndarray[Any, Any]

NONE: Final = "-"
TURNS: Final = ("straight", "right", "left")
"""Ways on, in the order in which one is taken where nobody says which."""
MARKS: Final = ("crosswalk", "junction", "cones", "vehicle")
METRES: Final = ("10", "15", "20", "25", "30")
REACH_M: Final = 48.0
"""As far as a drive of one command leads: the paper's are of 28 to 38 m."""
STEP_M: Final = 0.5
WAYPOINTS: Final = 10
PERIOD_S: Final = 2.0
STATIONS: Final = tuple(f"{k * STEP_M:g}" for k in range(round(REACH_M / STEP_M) + 1))
ASIDE_M: Final[Mapping[str, float]] = {"=": 0.0, "r1.4": 1.4, "r2.8": 2.8}
"""Offsets to the right of the lane's middle: the lane itself, and towards the kerb."""

TEMPLATE: Final = ActionTemplate(
    (
        "turn",
        ActionSlot("turn", (NONE, "left", "straight", "right")),
        "halt",
        ActionSlot("halt", (NONE, "stop", "kerb")),
        "mark",
        ActionSlot("mark", (NONE, *MARKS)),
        "place",
        ActionSlot("place", (NONE, "before", "beside", "after")),
        "metres",
        ActionSlot("metres", (NONE, *METRES)),
        "pace",
        ActionSlot("pace", (NONE, "slow", "brisk")),
        ";",
        "way",
        ActionSlot("way", pointer=True),
        "at",
        ActionSlot("at", pointer=True),
        ";",
        *(ActionSlot(f"s{k}", STATIONS) for k in range(1, WAYPOINTS + 1)),
        ActionSlot("aside", tuple(ASIDE_M)),
        ".",
    )
)
"""19 decisions among 30 tokens. Candidate 0 says that there is no such way, or nothing to stop by."""
CRITERIA: Final = ("turn", "halt", "mark", "place", "metres", "pace")
NOTHING: Final[Mapping[str, str]] = dict.fromkeys(CRITERIA, NONE)

CRUISE_MPS: Final[Mapping[str, float]] = {"slow": 3.0, NONE: 5.0, "brisk": 7.0}
EASY_MPS2: Final = 1.0
"""Speeding up and slowing down."""
FIRM_MPS2: Final = 2.0
"""Braking beyond which there is no room for a stop."""
BEND_MPS2: Final = 0.7
"""Sideways in bends; the paper's drives reach 0.68 m/s2."""
SHIFT_M: Final = 12.0
"""Way that moving over to the kerb takes; the last 2 m are straight."""
_STRAIGHT_M: Final = 2.0
_HALF_M: Final = 2.25
"""Half a car: stations are those of its middle."""
_CLEAR_M: Final = 1.5
_BEYOND_M: Final = 1.75
_ON_M: Final = 0.5
_FREE_M: Final = 16.0
"""Default distance of a stop: soon."""
_LATER_M: Final = 8.0
"""A distance that was named is not exceeded by more than this to find room."""
_GRID_M: Final = 0.25
_WAVES_M: Final = (48.0, 24.0, 12.0, 6.0, 3.0)

WIDTH: Final = 3 + 2 * len(TURNS) + len(MARKS) + 2 * (1 + 2 * len(_WAVES_M)) + 2
"""Numbers by which a candidate is described."""
TIE_M: Final = 2.0
"""A stop that is off by less is where it was meant."""


def candidates(street: Street) -> tuple[StreetWay | StreetMark | None, ...]:
    """Candidates of the pointers: nothing, the ways on, the marks."""
    return (None, *street.ways, *street.marks)


def features(street: Street) -> Array:
    """Candidates for the network, (1 + ways + marks, WIDTH), float32."""
    found = candidates(street)
    table = np.zeros((len(found), WIDTH), np.float32)
    table[:, -1] = street.speed_mps / 5.0
    for row, one in zip(table, found, strict=True):
        if one is None:
            row[0] = 1.0
            continue
        at = 3
        if isinstance(one, StreetWay):
            row[1] = 1.0
            row[at + TURNS.index(one.turn)] = 1.0
            start, end = one.bend_m or (0.0, 0.0)
            row[-2] = _bend_mps(one) / 5.0
        else:
            row[2] = 1.0
            for turn in one.ways:
                row[at + TURNS.index(turn)] = 1.0
            row[at + len(TURNS) + MARKS.index(one.kind)] = 1.0
            for way in street.ways:
                if marked(street, way, one.kind) is one:
                    row[at + len(TURNS) + len(MARKS) + TURNS.index(way.turn)] = 1.0
            start, end = one.start_m, one.end_m
        at += 2 * len(TURNS) + len(MARKS)
        row[at : at + 2] = start, end
    at = 3 + 2 * len(TURNS) + len(MARKS)
    ends = table[1:, at : at + 2].copy()
    waves = 2.0 * math.pi * ends[:, :, None] / np.array(_WAVES_M, np.float32)
    table[1:, at:-2] = np.concatenate(
        [ends[:, :, None] / REACH_M, 0.5 * np.sin(waves), 0.5 * np.cos(waves)], axis=2
    ).reshape(len(ends), -1)
    return table


def _bend_mps(way: StreetWay) -> float:
    """Speed through the junction; 0 where the way goes straight on."""
    return 0.0 if way.radius_m is None else math.sqrt(BEND_MPS2 * way.radius_m)


def marked(street: Street, way: StreetWay, kind: str) -> StreetMark | None:
    """The mark of a kind that is meant on a way: the first; behind a turn, the first after it."""
    least = -math.inf
    if way.turn != "straight" and way.bend_m is not None and kind != "junction":
        least = way.bend_m[1] - 0.1
    own = [one for one in street.marks if one.kind == kind and way.turn in one.ways and one.start_m >= least]
    return min(own, key=lambda one: one.start_m, default=None)


@dataclass(frozen=True, slots=True)
class DriveGoal:
    """The goal of a command on a street.

    Attributes:
        way: Where to drive.
        mark: What to stop by, if anything was named.
        stop_m: Station at which the middle of the car stands in the end.
        kerb: Whether at the kerb.
        halts: Whether a stop was asked for; otherwise the drive goes on to the end of what is known.
    """

    way: StreetWay
    mark: StreetMark | None
    stop_m: float
    kerb: bool
    halts: bool


def goal(street: Street, asked: Mapping[str, str]) -> DriveGoal | str:
    """The goal of a command; the reason in words if there is no such way, no such mark, or no room."""
    turn = asked["turn"]
    ways = {way.turn: way for way in street.ways}
    way = ways.get(turn) if turn != NONE else next((ways[one] for one in TURNS if one in ways), None)
    if way is None:
        return f"there is no way {'on' if turn == NONE else turn if turn != 'straight' else 'straight on'} here"
    if asked["halt"] == NONE:
        return DriveGoal(way, None, min(way.length_m, REACH_M) - 1.0, kerb=False, halts=False)
    kerb, mark = asked["halt"] == "kerb", None
    if kerb and way.kerb_m is None:
        return "there is no kerb to stop at"
    place = asked["place"]
    if asked["mark"] != NONE:
        mark = marked(street, way, asked["mark"])
        if mark is None:
            return f"I see {_NO[asked['mark']]} on that way"
        wanted = {
            "beside": (mark.start_m + mark.end_m) / 2.0,
            "after": mark.end_m + _HALF_M + _CLEAR_M,
        }.get(place, mark.start_m - _HALF_M - _CLEAR_M)
    elif asked["metres"] != NONE:
        wanted = float(asked["metres"])
        if turn in ("left", "right") and way.bend_m is not None:  # "turn left and stop after 20 metres"
            wanted += way.bend_m[1]
    elif turn in ("left", "right") and way.bend_m is not None:
        wanted = way.bend_m[1] + (SHIFT_M + _STRAIGHT_M if kerb else _HALF_M) + _BEYOND_M
    else:
        wanted = _FREE_M
    back = mark is not None and place == "before"
    stop = _allowed(street, way, wanted, kerb=kerb, back=back)
    least = 4.0 + (SHIFT_M if kerb else 0.0)
    if turn in ("left", "right") and way.bend_m is not None and not (mark is not None and mark.kind == "junction"):
        least = way.bend_m[1]
    if asked["metres"] != NONE and stop is not None and stop > wanted + _LATER_M:
        stop = None
    if stop is None or not max(least, street.speed_mps**2 / (2.0 * FIRM_MPS2)) <= stop <= min(way.length_m, REACH_M):
        return "there is no room to stop there"
    return DriveGoal(way, mark, stop, kerb=kerb, halts=True)


_NO: Final[Mapping[str, str]] = {
    "crosswalk": "no crosswalk",
    "junction": "no junction",
    "cones": "no cones",
    "vehicle": "no parked vehicle",
}


def _allowed(street: Street, way: StreetWay, wanted_m: float, *, kerb: bool, back: bool) -> float | None:
    """The station nearest to one on one side of it at which the car may stand: on no crosswalk, in no junction, and at
    the kerb where it is free for as long as moving over takes."""
    shift = SHIFT_M + _STRAIGHT_M
    closed: list[tuple[float, float, float, float]] = []
    for mark in street.marks:
        if way.turn not in mark.ways:
            continue
        a, b = mark.start_m, mark.end_m
        if mark.kind == "crosswalk":
            closed.append((a - _HALF_M - _ON_M, b + _HALF_M + _ON_M, a - _HALF_M - _CLEAR_M, b + _HALF_M + _CLEAR_M))
        elif mark.kind in ("cones", "vehicle") and kerb:
            reach = b + shift + _CLEAR_M
            closed.append((a - _HALF_M - 1.0, reach, a - _HALF_M - _CLEAR_M, reach))
    if way.bend_m is not None:
        a, b = way.bend_m
        reach = b + _BEYOND_M + (shift if kerb else _HALF_M)
        closed.append((a - _HALF_M, reach, a - _HALF_M - _CLEAR_M, reach))
    for _ in range(2 + len(closed)):
        inside = next((one for one in closed if one[0] < wanted_m < one[1] - 1e-6), None)
        if inside is None:
            return wanted_m
        wanted_m = inside[2] if back else inside[3]
    return None


def stations_of(found: Sequence[tuple[Street, Mapping[str, str], DriveGoal]]) -> Array:
    """Stations of the car at each instant, (n, WAYPOINTS), m: up to the pace, slower in bends, down to the goal."""
    at = np.arange(0.0, REACH_M + _GRID_M / 2, _GRID_M)
    stop = np.array([one.stop_m for _, _, one in found])
    start = np.array([street.speed_mps for street, _, _ in found])
    most = np.array([[CRUISE_MPS[asked["pace"]]] for _, asked, _ in found]) * np.ones_like(at)
    for row, (_, _, one) in zip(most, found, strict=True):
        if one.way.bend_m is not None and one.way.radius_m is not None:
            inside = (at >= one.way.bend_m[0]) & (at <= one.way.bend_m[1])
            row[inside] = np.minimum(row[inside], _bend_mps(one.way))
    brake = np.maximum(EASY_MPS2, start**2 / (2.0 * stop))
    left = np.maximum(stop[:, None] - at, 0.0)
    most = np.minimum(most, np.sqrt(2.0 * brake[:, None] * left))
    square = most**2
    for i in range(len(at) - 2, -1, -1):
        np.minimum(square[:, i], square[:, i + 1] + 2.0 * EASY_MPS2 * _GRID_M, out=square[:, i])
    np.maximum(square, start[:, None] ** 2 - 2.0 * np.maximum(brake, 1.5)[:, None] * at, out=square)
    square[:, 0] = start**2
    for i in range(1, len(at)):
        np.minimum(square[:, i], square[:, i - 1] + 2.0 * EASY_MPS2 * _GRID_M, out=square[:, i])
    speed = np.sqrt(np.maximum(square, 0.0))
    legs = _GRID_M / np.maximum((speed[:, 1:] + speed[:, :-1]) / 2.0, 0.05)
    times = np.concatenate([np.zeros((len(found), 1)), np.cumsum(legs, axis=1)], axis=1)
    instants = PERIOD_S * np.arange(1, WAYPOINTS + 1)
    rows = [np.interp(instants, t, at) for t in times]
    return np.minimum(np.stack(rows), stop[:, None])


def shifted_m(stations_m: Array, stop_m: float, aside_m: float) -> Array:
    """Offsets to the right, m, at stations of a drive: over to where it ends before a stop there."""
    share = np.clip((stations_m - (stop_m - SHIFT_M - _STRAIGHT_M)) / SHIFT_M, 0.0, 1.0)
    return aside_m * share**2 * (3.0 - 2.0 * share)


def references(
    found: Sequence[tuple[Street, Mapping[str, str]]],
) -> list[dict[str, str | int]]:
    """Values of the template's slots that fit commands on streets: what training learns."""
    goals = [goal(street, asked) for street, asked in found]
    fine = [
        (street, asked, one) for (street, asked), one in zip(found, goals, strict=True) if isinstance(one, DriveGoal)
    ]
    stations = iter(stations_of(fine) if fine else ())
    answers: list[dict[str, str | int]] = []
    for (street, asked), one in zip(found, goals, strict=True):
        values: dict[str, str | int] = {**asked, "way": 0, "at": 0}
        along, aside = np.zeros(WAYPOINTS), "="
        if isinstance(one, DriveGoal):
            along, aside = next(stations), "r2.8" if one.kerb else "="
            values["way"] = 1 + _place(street.ways, one.way)
            values["at"] = 0 if one.mark is None else 1 + len(street.ways) + _place(street.marks, one.mark)
        for k in range(WAYPOINTS):
            values[f"s{k + 1}"] = STATIONS[min(max(math.floor(along[k] / STEP_M + 0.5), 0), len(STATIONS) - 1)]
        values["aside"] = aside
        answers.append(values)
    return answers


def _place(found: Sequence[object], one: object) -> int:
    return next(i for i, other in enumerate(found) if other is one)


def reference(street: Street, asked: Mapping[str, str]) -> dict[str, str | int]:
    """`references` of one."""
    return references([(street, asked)])[0]


def asked_of_drive(values: Mapping[str, str | int]) -> dict[str, str]:
    """The criteria among an answer's values."""
    return {name: str(values[name]) for name in CRITERIA}


def waypoints_of(values: Mapping[str, str | int]) -> tuple[Array, float]:
    """(stations (WAYPOINTS,), offset to the right at the end) of an answer, m."""
    along = np.array([float(values[f"s{k}"]) for k in range(1, WAYPOINTS + 1)])
    return along, ASIDE_M[str(values["aside"])]


def fulfils(street: Street, asked: Mapping[str, str], values: Mapping[str, str | int]) -> bool:
    """True if an answer is what was asked for: the way, the end within `TIE_M`, at the kerb or not, and the pace.

    Args:
        street: Where.
        asked: What is meant.
        values: The answer.
    """
    wanted = reference(street, asked)
    if wanted["way"] == 0 or values["way"] == 0:
        return wanted["way"] == values["way"]
    same = _same_way(street, int(wanted["way"]), int(values["way"]), waypoints_of(wanted)[0][-1])
    along, aside = waypoints_of(values)
    ideal, ideal_aside = waypoints_of(wanted)
    ends = abs(along[-1] - ideal[-1]) <= TIE_M and aside == ideal_aside
    legs, ideal_legs = (np.diff(one, prepend=0.0).max() / PERIOD_S for one in (along, ideal))
    return bool(same and ends and abs(legs - ideal_legs) <= _PACE_MPS)


_PACE_MPS: Final = 0.9


def _same_way(street: Street, one: int, two: int, end_m: float) -> bool:
    """True if two ways are one as far as a drive goes."""
    if one == two:
        return True
    if not (1 <= two <= len(street.ways)):
        return False
    bends = (street.ways[i - 1].bend_m for i in (one, two))
    return all(bend is not None and end_m <= bend[0] for bend in bends)


@dataclass(frozen=True, slots=True)
class DrivingAgreement:
    """Agreement between the parts of an answer.

    Attributes:
        pointers: Way and mark are those of what it says it understood.
        waypoints: They lead along, ever onward, to where that asks for: P does what R says.
    """

    pointers: bool
    waypoints: bool


def driving_agreement(street: Street, values: Mapping[str, str | int]) -> DrivingAgreement:
    """Internal consistency of an answer."""
    wanted = reference(street, asked_of_drive(values))
    pointers = all(wanted[name] == values[name] for name in ("way", "at"))
    (along, aside), (ideal, ideal_aside) = waypoints_of(values), waypoints_of(wanted)
    onward = bool((np.diff(along, prepend=0.0) >= 0.0).all())
    close = bool((np.abs(along - ideal) <= 2.0 * STEP_M + 1e-6).all() and abs(along[-1] - ideal[-1]) <= STEP_M + 1e-6)
    return DrivingAgreement(pointers, onward and close and aside == ideal_aside)


def verified_drive(predict: Predict, street: Street, decided: Decided) -> Decided:
    """A decision whose way and waypoints are those of what it says it understood.

    Where they are not, they are masked again and decided within a step of the ideal alone: one pass more.
    """
    values = TEMPLATE.decode(decided.row)
    agrees = driving_agreement(street, values)
    if agrees.pointers and agrees.waypoints:
        return decided
    wanted = reference(street, asked_of_drive(values))
    row = decided.row.copy()
    for slot in TEMPLATE.slots:
        if slot.name not in CRITERIA:
            row[TEMPLATE.places[slot.name]] = MASK
    scores = predict(row)
    along, _ = waypoints_of(wanted)
    last = 0
    for k in range(WAYPOINTS):
        ideal = STATIONS.index(f"{along[k]:g}")
        final = k + 1 == WAYPOINTS or along[k] >= along[-1] - 1e-6
        near = [ideal] if final else [i for i in (ideal - 1, ideal, ideal + 1) if last <= i <= along[-1] / STEP_M]
        place = TEMPLATE.places[f"s{k + 1}"]
        last = max(near or [ideal], key=lambda i: float(scores[place, TEMPLATE.ids[STATIONS[i]]]))
        wanted[f"s{k + 1}"] = STATIONS[last]
    return replace(decided, row=TEMPLATE.encode(wanted), passes=decided.passes + 1)
