"""`parameters-v1`: every number and manoeuvre of a plan fits the situation. The second of the papers' safety checks.

It judges what can be known before driving: constants in API calls, settings the planner relies on, lane moves and
turns the road does not have. What only shows while driving is the shield's.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

from chauffeur.concept import (
    ActionMatrix,
    Limits,
    Observation,
    Parameters,
    Plan,
    Policy,
    Program,
    Situation,
    Thoughts,
    Trajectory,
    Verdict,
)
from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.geometry import turns_ahead
from chauffeur.programs.catalogue import vocabulary_of
from chauffeur.safety.constant_calls import TURNS, ApiUse, ProgramReading, read_program
from chauffeur.safety.format import check_trajectory_format
from chauffeur.safety.gain_box import gain_box
from chauffeur.safety.words import IN_A_HELPER, speed_words

PARAMETERS_CHECK = "parameters-v1"

_ROUNDING = 1e-6
"""Slack at every bound, so that a limit reached by way of km/h is not refused for its last bit."""

_WAYS = {-1: ("left", "turn left"), 0: ("straight", "go straight on"), 1: ("right", "turn right")}
"""Ways over a junction, as roads and people call them."""
_LOOKS = frozenset({"can_go", "get_distance_to_junction", "get_distance_to_place"})
"""A program that asks one of these may turn at a later junction."""
_SIDES = {-1: "left", 1: "right"}
_MOVES = frozenset({"lane", "change", "overtake", "pass", "merge", "move"})


@dataclass(frozen=True, slots=True)
class _Fault:
    reason: str
    remedy: str
    line: int | None = None


@dataclass(frozen=True, slots=True)
class _Road:
    """Road data that the checks need. `lanes` and `index` are 0 where the ego is on no lane of the road."""

    crossing: bool
    lanes: int
    index: int
    limit_mps: float
    following_mps: float
    turns: tuple[str, ...] = ()
    """Ways at the next junction of a town, where it is known: a turn that none of them makes is refused."""


def check_parameters(plan: Plan, observation: Observation, limits: Limits) -> Verdict:
    """Judge whether the numbers and manoeuvres that can be read from a plan fit road, situation and limits."""
    if plan.policy is None and plan.refusal:
        return Verdict(PARAMETERS_CHECK, True, "There is no policy to check.", not_compared="no-policy")
    road = _road(observation)
    faults = [*_policy_faults(plan, road, limits), *_setting_faults(plan, road, limits), *_intent_faults(plan, road)]
    if isinstance(plan.policy, Trajectory) and not faults and check_trajectory_format(plan.policy).passed:
        from chauffeur.safety.trajectories import trajectory_faults  # numpy, needed by trajectories alone

        faults = [_Fault(*fault) for fault in trajectory_faults(plan.policy, observation)]
    if not faults:
        return Verdict(PARAMETERS_CHECK, True, "Every number and manoeuvre that can be read fits the situation.")
    faults.sort(key=lambda fault: math.inf if fault.line is None else fault.line)
    reasons = list(dict.fromkeys(fault.reason for fault in faults))
    return Verdict(PARAMETERS_CHECK, False, " ".join(reasons), faults[0].line, faults[0].remedy)


def policy_findings(policy: Policy, situation: Situation, limits: Limits) -> list[str]:
    """Findings of `check_parameters` for a policy that a planner can still repair: line, reason and remedy."""
    following = situation.front.speed_mps if situation.front is not None else situation.speed_mps
    road = _Road(
        situation.world == "intersection" or bool(situation.turns),
        situation.lane_count,
        situation.lane_index,
        situation.speed_limit_mps,
        max(following, 0.0),
        situation.turns if vocabulary_of(situation.world) == "town" else (),
    )
    found = (
        f"{'' if fault.line is None else f'line {fault.line}: '}{fault.reason} {fault.remedy}"
        for fault in _policy_faults(Plan(Thoughts(""), policy), road, limits)
    )
    return list(dict.fromkeys(found))


def _road(observation: Observation) -> _Road:
    here = observation.ego.lane
    own = observation.road.abreast(here) if here is not None and here in observation.road else ()
    index = next((i for i, lane in enumerate(own) if lane.id == here), None)
    # No lane, no sign to go by: the strictest sign of the whole road holds.
    limit = observation.road.least_limit_mps if index is None else own[index].speed_limit_mps
    following = observation.front.speed_mps if observation.front is not None else observation.ego.speed_mps
    crossing, lanes = bool(observation.road.junctions), 0 if index is None else len(own)
    route = () if observation.route is None else observation.route.lanes
    known = here is not None and index is not None and vocabulary_of(observation.kind) == "town"
    turns = turns_ahead(observation.road, here, route) if known and here is not None else ()
    return _Road(crossing, lanes, index or 0, limit, max(following, 0.0), turns)


def _policy_faults(plan: Plan, road: _Road, limits: Limits) -> Iterator[_Fault]:
    match plan.policy:
        case Program(source=source, library=library):
            reading = read_program(source)
            for use in reading.uses:
                yield from _use_faults(use, road, limits)
            yield from _turn_faults(reading, road)
            yield from _move_faults(reading, road)
            for use in read_program(library).uses:
                for fault in _use_faults(use, road, limits):
                    # Lines are counted in the program; a helper is known by its reason alone.
                    yield replace(fault, reason=f"{fault.reason} {IN_A_HELPER}", line=None)
        case Parameters() as values:
            yield from _speed_faults("target speed", _number(values.target_speed_mps), road, limits)
            if values.lane in _SIDES:
                yield from _lane_faults(values.lane, road)
            if values.route in ("left", "right") and not road.crossing:
                yield _Fault(f"There is no intersection ahead to turn {values.route} at.", "Leave out the route.")
            if not _number(values.look_ahead_m) > 0:
                # A vehicle's path follower with a look-ahead of 0 m no longer stops at the end of its path.
                yield _Fault(f"A look-ahead of {values.look_ahead_m} m is none.", "Look ahead more than 0 m.")
            if not _number(values.look_ahead_ratio) >= 0:
                yield _Fault(
                    f"A look-ahead ratio of {values.look_ahead_ratio} s is negative.", "Use a ratio of 0 s or more."
                )
        case ActionMatrix(pid=pid, mpc=mpc):
            if not all(_number(value) >= 0 for value in (*pid, *mpc)):
                yield _Fault("The action matrix has a negative gain or weight.", "Use gains and weights of 0 or more.")
                return
            yield from _gain_faults(ActionMatrix(pid, mpc))
        case Trajectory() as trajectory:
            yield from _trajectory_faults(trajectory, road, limits)
        case _:
            pass


def _use_faults(use: ApiUse, road: _Road, limits: Limits) -> Iterator[_Fault]:
    if use.name in ("set_target_speed", "proceed"):
        for value in use.values:
            yield from _speed_faults("target speed", value, road, limits, use.line)
    elif use.name == "set_desired_time_headway":
        for value in use.values:
            yield from _headway_faults(value, limits, use.line)
    elif use.name in TURNS and not road.crossing:
        wish = _WAYS[TURNS[use.name]][1]
        yield _Fault(
            f"The program wants to {wish} at the next intersection, but there is no intersection ahead.",
            "Leave out the turn.",
            use.line,
        )


def _turn_faults(reading: ProgramReading, road: _Road) -> Iterator[_Fault]:
    """The first turn that a program asks for, where it asks for one only and does not look first where it can go."""
    turns = {use.name for use in reading.uses if use.name in TURNS}
    if len(turns) != 1 or not road.turns or any(use.name in _LOOKS for use in reading.uses):
        return
    (name,) = turns
    way, wish = _WAYS[TURNS[name]]
    if way not in road.turns:
        line = next(use.line for use in reading.uses if use.name == name)
        yield _Fault(
            f"The program wants to {wish} at the next junction, which only leads {' or '.join(road.turns)}.",
            "Choose a way that is there, or wait until the junction that is meant is the next one.",
            line,
        )


def _speed_faults(what: str, value: float, road: _Road, limits: Limits, line: int | None = None) -> Iterator[_Fault]:
    allowed = road.limit_mps + limits.max_over_limit_mps
    cap = math.inf if limits.max_speed_mps is None else limits.max_speed_mps
    remedy = f"Use a target speed from 0 to {speed_words(min(allowed, cap))}."
    if not math.isfinite(value):
        yield _Fault(f"The {what} is {value}, not a speed.", remedy, line)
    elif value < 0:
        yield _Fault(f"A {what} of {speed_words(value)} is negative.", remedy, line)
    elif value > allowed + _ROUNDING:
        yield _Fault(
            f"A {what} of {speed_words(value)} is more than {speed_words(limits.max_over_limit_mps)} above the speed "
            f"limit of {speed_words(road.limit_mps)} here.",
            remedy,
            line,
        )
    elif value > cap + _ROUNDING:
        yield _Fault(f"A {what} of {speed_words(value)} is above the cap of {speed_words(cap)}.", remedy, line)


def _headway_faults(value: float, limits: Limits, line: int | None = None) -> Iterator[_Fault]:
    low, high = limits.min_time_headway_s, limits.max_time_headway_s
    if not low - _ROUNDING <= value <= high + _ROUNDING:
        yield _Fault(
            f"A time headway of {value:g} s is outside {low:g} to {high:g} s.",
            f"Use a time headway from {low:g} to {high:g} s.",
            line,
        )


def _gap_faults(gap_m: float, road: _Road, limits: Limits) -> Iterator[_Fault]:
    """A gap is counted centre to centre; what is left between the bumpers must take at least the smallest headway."""
    clear_m = gap_m - M_PER_CAR_LENGTH
    needed_m = limits.min_time_headway_s * road.following_mps
    if math.isfinite(gap_m) and clear_m > 0 and clear_m >= needed_m - _ROUNDING:
        return
    yield _Fault(
        f"A gap of {gap_m:g} m centre to centre leaves {clear_m:.1f} m between the bumpers; at "
        f"{speed_words(road.following_mps)} at least {needed_m:.1f} m ({limits.min_time_headway_s:g} s) and more than "
        "0 m are needed.",
        f"Keep more than {M_PER_CAR_LENGTH + needed_m:.1f} m.",
    )


def _move_faults(reading: ProgramReading, road: _Road) -> Iterator[_Fault]:
    """Only the first lane move starts from the lane the ego is in now; later ones start from wherever that led."""
    moves = [use for use in reading.uses if use.name == "set_target_lane"]
    offsets = [use.lane_offset for use in moves]
    if not moves or offsets[0] is None or offsets[0] in reading.sides_tested:
        return
    in_order = len({use.function for use in moves}) == 1
    if in_order or len(set(offsets)) == 1:
        yield from _lane_faults(offsets[0], road, moves[0].line)


def _lane_faults(offset: int, road: _Road, line: int | None = None) -> Iterator[_Fault]:
    if offset == 0 or (road.lanes and 0 <= road.index + offset < road.lanes):
        return
    side = _SIDES[offset]
    if not road.lanes:
        reason = f"It moves to the {side}, but it is not known which lane the ego is in."
    else:
        reason = f"It moves to the {side}, but the ego is already in the {side}most lane."
    yield _Fault(reason, f"Stay in the lane, or test first that the lane to the {side} is not None.", line)


def _setting_faults(plan: Plan, road: _Road, limits: Limits) -> Iterator[_Fault]:
    for name, said in plan.settings:
        value = _number(said)
        if name == "target_speed_mps":
            yield from _speed_faults("target speed", value, road, limits)
        elif name == "time_headway_s":
            yield from _headway_faults(value, limits)
        elif name == "gap_m":
            yield from _gap_faults(value, road, limits)
        elif not math.isfinite(value):
            yield _Fault(f"The setting {name} is {said!r}, not a number.", f"Give {name} as a plain number.")


def _intent_faults(plan: Plan, road: _Road) -> Iterator[_Fault]:
    if plan.policy is None:
        return
    # Of several steps joined by "+" only the first begins where the car is now.
    tokens = re.findall(r"[a-z]+", plan.intent.lower().partition("+")[0])
    if "turn" in tokens or "straight" in tokens:
        if not road.crossing:
            yield _Fault(
                "It was understood as a turn at an intersection, but there is no intersection ahead.",
                "Ask for a lane change instead, or wait for an intersection.",
            )
    elif _MOVES.intersection(tokens):
        for offset, side in _SIDES.items():
            if tokens[-1] == side:
                yield from _lane_faults(offset, road)


def _gain_faults(policy: ActionMatrix) -> Iterator[_Fault]:
    box = gain_box()
    for name, value in box.outside(policy):
        low, high = box.low[name], box.high[name]
        yield _Fault(
            f"{name} of {value:g} is outside {low:g} to {high:g}, where the controllers are certified.",
            f"Use {name} from {low:g} to {high:g}.",
        )


def _trajectory_faults(trajectory: Trajectory, road: _Road, limits: Limits) -> Iterator[_Fault]:
    """Speed between successive waypoints, the first leg from the ego itself; the fastest leg is judged."""
    points = ((0.0, 0.0), *trajectory.waypoints_m)
    if len(points) < 2 or any(len(point) != 2 for point in points) or not _number(trajectory.period_s) > 0:
        return  # `format-v1` refuses these; there is no speed to read from them
    legs = [math.dist(a, b) / trajectory.period_s for a, b in pairwise(points)]
    yield from _speed_faults(
        "speed along the trajectory", math.nan if any(map(math.isnan, legs)) else max(legs), road, limits
    )


def _number(value: object) -> float:
    """A planner's reply may hold anything where a number should be; what is none becomes NaN and fits no bound."""
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else math.nan
