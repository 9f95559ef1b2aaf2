"""Lanes, overtaking, junctions and halting: what the road must have for them, and which side is meant."""

from __future__ import annotations

from typing import Literal

from chauffeur.planners.onboard.exemplars import Filled
from chauffeur.planners.onboard.exemplars.crossing import CROSSING
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.meaning import Meaning
from chauffeur.planners.onboard.options import USUAL_HEADWAY_S, Chosen, Declined, Options, speed_words

_STEPS: dict[str, Literal[-1, 1]] = {"left": -1, "right": 1}
_PASS_BY_MPS = {"swift": 12.0}
_PLAIN_PASS_BY_MPS = 10.0
"""Speed over the vehicle ahead at which an overtaking is planned."""
_CLEAR_M = 15.0
"""Centre-to-centre lead over the overtaken vehicle at which the overtaking is done: two car lengths between bumpers."""
_WORDS = {"left": "turn left", "right": "turn right", "straight": "go straight on"}


def choose_lane(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for a lane wish."""
    situation = options.situation
    if meaning.variant == "hold":
        return Chosen(options.filled("lane.keep", meaning.manner), "lane.keep", "stay in this lane")
    if meaning.variant == "return":
        return _back_on_the_road(meaning, options)
    if options.last_lane < 1:
        return Declined("This road has one lane in our direction; there is no other lane to change to.")
    if meaning.variant == "middle":
        return _to_lane(meaning, options.last_lane // 2, options, "the middle lane")
    side, assumed = _side(meaning, options)
    if side is None:
        return Declined("To which side shall I change lanes, left or right?")
    refused = _no_lane(side, options)
    if refused is not None:
        return refused
    if meaning.variant == "edge":
        return _to_lane(meaning, 0 if side == "left" else options.last_lane, options, f"the {side}most lane")
    if meaning.amount is not None and meaning.amount.value > 1:
        wanted = situation.lane_index + _STEPS[side] * round(meaning.amount.value)
        if not 0 <= wanted <= options.last_lane:
            return Declined(f"There are not that many lanes to the {side} of us.")
        return _to_lane(meaning, wanted, options, f"{round(meaning.amount.value)} lanes to the {side}")
    patient = meaning.condition == "safe" or meaning.manner == "gentle"
    exemplar = f"lane.{side}_patient" if patient else f"lane.{side}"
    when = "as soon as nobody there has to brake noticeably" if patient else "as soon as there is room"
    does = f"change to the {side} lane {when}"
    return Chosen(options.filled(exemplar, meaning.manner), f"lane.{side}", does, assumed, lanes_moved=_STEPS[side])


def _side(meaning: Meaning, options: Options) -> tuple[Literal["left", "right"] | None, tuple[str, ...]]:
    """The side meant; where none was named and only one is possible, that one, and the assumption in words."""
    if meaning.direction in ("left", "right"):
        return meaning.direction, ()
    possible: list[Literal["left", "right"]] = []
    if options.situation.lane_index > 0:
        possible.append("left")
    if options.situation.lane_index < options.last_lane:
        possible.append("right")
    if len(possible) != 1:
        return None, ()
    return possible[0], (f"You named no side: there is a lane on the {possible[0]} only.",)


def _no_lane(side: str, options: Options) -> Declined | None:
    index = options.situation.lane_index
    if side == "left" and index <= 0:
        return Declined("We are in the leftmost lane; there is no lane to the left of us.")
    if side == "right" and index >= options.last_lane:
        if options.situation.emergency_lane:
            return Declined("To the right of us is only the emergency lane. Say pull over if you want to stop there.")
        return Declined("We are in the rightmost lane; there is no lane to the right of us.")
    return None


def _to_lane(meaning: Meaning, index: int, options: Options, words: str) -> Chosen | Declined:
    moves = index - options.situation.lane_index
    if moves == 0:
        return Declined(f"We are in {words} already.")
    side = "left" if moves < 0 else "right"
    kind = f"lane.{side}most" if meaning.variant == "edge" else f"lane.{side}_several"
    filled = options.filled(kind, meaning.manner, moves=abs(moves))
    count = "1 lane" if abs(moves) == 1 else f"{abs(moves)} lanes"
    does = f"move to {words}: {count} to the {side}, one after the other, each when there is room"
    return Chosen(filled, f"lane.{side}", does, lanes_moved=moves)


def _back_on_the_road(meaning: Meaning, options: Options) -> Chosen | Declined:
    if not options.situation.emergency_lane or options.situation.lane_index <= options.last_lane:
        return Declined("We are on the road already, not on an emergency lane.")
    target = options.own_cap_mps
    filled = options.filled("lane.return", meaning.manner, target_speed_mps=target)
    does = f"speed up on the emergency lane and move back left, towards {speed_words(target)}"
    return Chosen(filled, "lane.left", does, (), (("target_speed_mps", round(target, 2)),), -1)


def choose_overtake(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for overtaking."""
    lead = options.situation.front
    if lead is None and options.front_known:
        return Declined("There is no vehicle ahead of us within 100 m to overtake.")
    if options.last_lane < 1:
        return Declined("This road has one lane in our direction; I do not overtake through oncoming traffic.")
    lead_speed = lead.speed_mps if lead is not None else options.speed
    target = min(
        max(lead_speed + _PASS_BY_MPS.get(meaning.manner, _PLAIN_PASS_BY_MPS), options.speed), options.pass_cap_mps
    )
    if target < lead_speed + 1.0:
        return Declined(
            f"The vehicle ahead drives {speed_words(lead_speed)}, and I may drive {speed_words(options.pass_cap_mps)}: "
            "that is not enough to overtake it."
        )
    side = meaning.direction if meaning.direction in ("left", "right") else None
    numbers = {"target_speed_mps": target, "headway_pass_s": options.headway(0.2), "clear_m": _CLEAR_M}
    settings = (("target_speed_mps", round(target, 2)),)
    does = f"at up to {speed_words(target)}, until we are {number(_CLEAR_M)} m ahead of it"
    if side is None:
        index = options.situation.lane_index
        if 0 < index < options.last_lane:
            filled = options.filled("overtake.either", meaning.manner, right_allowed=True, **numbers)
            return Chosen(filled, "overtake", f"overtake on the side that opens first, {does}", (), settings)
        side = "left" if index > 0 else "right"
    refused = _no_lane(side, options)
    if refused is not None:
        return Declined(f"I cannot overtake on the {side}. {refused.words}")
    swift = "_swift" if meaning.manner == "swift" else ""
    back = "_return" if meaning.variant == "return" else ""
    filled = options.filled(f"overtake.{side}{back or swift}", meaning.manner, **numbers)
    home = ", then come back" if back else ""
    moved = 0 if back else _STEPS[side]
    return Chosen(filled, f"overtake.{side}", f"overtake on the {side} {does}{home}", (), settings, moved)


def choose_turn(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for the way over the next junction."""
    side = meaning.direction or "straight"
    situation = options.situation
    if not situation.turns:
        if side == "straight":
            return Chosen(
                options.filled("lane.keep", meaning.manner),
                "lane.keep",
                "stay in this lane; the road goes straight on and there is no junction ahead",
            )
        tip = f" Say change to the {side} lane if you mean the lane."
        return Declined(f"There is no junction ahead where I could {_WORDS[side]}.{tip}")
    if side not in situation.turns:
        return Declined(f"At this junction one cannot {_WORDS[side]}. Possible: {_listed(situation.turns)}.")
    manner = meaning.manner
    if manner not in ("gentle", "swift"):
        return _cross(side, options)
    target, go, after = _CROSSING[side][manner]
    near, far, stop = _ROOM[side]
    numbers = {
        "target_speed_mps": target,
        "go_mps2": go,
        "exit_mps": after,
        "approach_mps": 6.5 if manner == "gentle" else 7.5 if side == "straight" else 7.0,
        "brake_mps2": 3.0 if manner == "gentle" else 5.0 if side == "straight" else 4.0,
        "stop_m": stop,
        "near_m": near,
        "far_m": far,
        "headway_turn_s": options.headway(0.01),
        "turn_cap_mps": options.cap_mps,
        "cross_ticks": 120,
    }
    filled = options.filled(f"turn.{side}_{manner}", manner, **numbers)
    seen = "from the left" if side == "right" else "from the left and from the right"
    does = f"halt at the stop sign, wait until nobody comes {seen}, and {_WORDS[side]} at {speed_words(target)}"
    return Chosen(filled, f"turn.{side}", does, (), (("target_speed_mps", target),))


def _cross(side: str, options: Options) -> Chosen:
    """The plain way over the junction."""
    numbers = CROSSING[side]
    fastest = min(numbers["MOST"], max(options.cap_mps, numbers["FLOOR"]))
    cruise = min(numbers["CROSS"], fastest)
    changed = {"HEADWAY": options.headway(0.01), "MOST": fastest, "CROSS": cruise}
    seen = "from the left" if side == "right" else "from the left and from the right"
    does = f"halt at the stop sign, wait until nobody comes {seen}, and {_WORDS[side]} at {speed_words(cruise)}"
    settings = (("target_speed_mps", round(cruise, 2)),)
    return Chosen(Filled(f"crossing.{side}", changed), f"turn.{side}", does, (), settings)


_HALTING = {"gentle": (1.8, 0.8), "smooth": (2.5, 0.85), "swift": (4.0, 1.0)}
"""Even braking to the halt, m/s2, and share of the present speed while changing lanes."""

_CROSSING: dict[str, dict[str, tuple[float, float, float]]] = {
    "straight": {"gentle": (7.0, 3.0, 7.0), "swift": (9.0, 5.0, 9.0)},
    "left": {"gentle": (7.0, 3.0, 7.0), "swift": (9.7, 5.0, 8.0)},
    "right": {"gentle": (7.0, 3.0, 7.0), "swift": (8.2, 5.0, 7.5)},
}
"""Speed over the junction, m/s, how briskly it is reached, m/s2, and speed behind it, m/s."""

_ROOM = {"straight": (40.0, 50.0, 5.0), "left": (45.0, 45.0, 5.4), "right": (50.0, 45.0, 5.4)}
"""How far traffic from the left and from the right must be away, and where we halt before the sign, m."""


def _listed(turns: tuple[str, ...]) -> str:
    return ", ".join(_WORDS[turn] for turn in turns)


def choose_pull_over(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for halting on the emergency lane."""
    situation = options.situation
    if not situation.emergency_lane:
        return Declined("There is no emergency lane here to pull over to. I can slow down if you want.")
    manner = meaning.manner if meaning.manner in ("gentle", "swift") else "smooth"
    rate, factor = _HALTING[manner]
    filled = options.filled(f"pull_over.{manner}", meaning.manner, rate_mps2=rate, factor=factor)
    moves = situation.lane_count - 1 - situation.lane_index
    way = (
        "change lanes to the right as far as the emergency lane, and halt there"
        if moves
        else "halt on this emergency lane"
    )
    does = f"{way} with an even {number(rate)} m/s2"
    return Chosen(filled, "pull_over", does, (), (("target_speed_mps", 0.0),), moves)


def choose_stop(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for halting, where the road allows it."""
    situation = options.situation
    if situation.emergency_lane:
        pulled = choose_pull_over(meaning, options)
        if isinstance(pulled, Declined):
            return pulled
        why = "I do not stop in a lane where others drive fast, but on the emergency lane."
        return Chosen(pulled.filled, pulled.intent, pulled.does, (why,), pulled.settings, pulled.lanes_moved)
    headway = options.headway(USUAL_HEADWAY_S)
    if situation.stop_sign_m is not None:
        filled = options.filled("stop.at_sign", meaning.manner, time_headway_s=headway)
        does = f"halt at the stop sign, {number(situation.stop_sign_m)} m ahead, and stay there"
        return Chosen(filled, "stop", does, (), (("target_speed_mps", 0.0),))
    if situation.world == "highway":
        return Declined(
            "I do not stop in a lane of a highway, and there is no emergency lane. I can slow down if you want."
        )
    filled = options.filled("stop.in_lane", meaning.manner, time_headway_s=headway)
    rate = number(filled.numbers["rate_mps2"])
    return Chosen(filled, "stop", f"halt here with an even {rate} m/s2", (), (("target_speed_mps", 0.0),))
