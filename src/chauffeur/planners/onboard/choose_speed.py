"""Speeds and ways of driving."""

from __future__ import annotations

from chauffeur.planners.arbitration import PACES, within_mood
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.meaning import BIT, MUCH, Amount, Meaning
from chauffeur.planners.onboard.options import (
    API_MAX_HEADWAY_S,
    USUAL_HEADWAY_S,
    Chosen,
    Declined,
    Options,
    speed_words,
)

_STEP_MPS = {BIT: 1.5, MUCH: 6.0}
_FELT_MPS = 1.2
"""The least change upwards that a passenger notices."""
_PLAIN_STEP_MPS = 3.0
"""Own steps at highway speed; in proportion below 25 m/s."""

_SLOWEST_SHARE = 0.3
"""Share of the speed limit below which the planner does not slow down by itself: a crawl on a highway is a danger."""

_STYLES: dict[str, tuple[float, float, str]] = {
    "hurry": (1.15, 1.0, "drive faster within what is allowed and keep a shorter gap"),
    "relax": (0.85, 2.0, "ease off evenly and leave plenty of room"),
    "comfort": (0.8, 2.0, "slow down so softly that it is hardly felt, and stay far behind others"),
    "careful": (0.8, 2.0, "drive slower, leave a long gap and never pass anyone quickly"),
    "sporty": (1.2, 1.0, "get up to speed at once and keep a gap that leaves less time"),
    "eco": (0.85, 1.8, "hold a moderate speed that changes as little as possible"),
}
"""Share of the present speed, time headway in s, and words."""
_FROM_A_STAND: dict[str, str] = {
    "hurry": "set out for what is allowed and keep a shorter gap",
    "relax": "set out evenly and leave plenty of room",
    "comfort": "set out so softly that it is hardly felt, and stay far behind others",
    "careful": "set out with care, leave a long gap and never pass anyone quickly",
}
"""The words where the car stands: nothing is slowed down from."""
_WARY: tuple[float, float, str] = (
    1.0,
    2.0,
    "lose no time, but drive no faster than now and leave a long gap, for what you say of the road",
)
"""The same for a mood that quickens, where the person says that the road or the sight is bad."""


def choose_speed(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for a wish about speed."""
    if meaning.variant == "hold":
        does = f"keep our {speed_words(options.cruise_mps)}"
        return _chosen(meaning, options, "speed.hold", options.cruise_mps, does)
    if meaning.variant == "limit":
        return _limit(meaning, options)
    if meaning.variant == "match":
        return _match(meaning, options)
    if meaning.variant == "max":
        headway = options.headway(1.0 + options.leaning.headway_s)
        does = f"drive as fast as this road allows, {speed_words(options.own_cap_mps)}"
        return _chosen(meaning, options, "speed.max", options.own_cap_mps, does, headway=headway)
    if meaning.amount is not None:
        return _named(meaning, meaning.amount, options)
    return _step(meaning, options)


def _named(meaning: Meaning, amount: Amount, options: Options) -> Chosen | Declined:
    value = amount.value
    if amount.bound == "at_most":
        does = f"stay at or below {speed_words(value)}"
        return _chosen(meaning, options, "speed.cap", value, does)
    if amount.bound == "at_least":
        return _chosen(meaning, options, "speed.floor", value, f"stay at or above {speed_words(value)}")
    if amount.frame == "factor":
        target = value * options.cruise_mps
        does = f"drive at {number(value)} times our speed, about {speed_words(target)}"
        return _chosen(meaning, options, "speed.multiply", target, does, factor=value)
    if amount.frame == "relative":
        target = options.cruise_mps + meaning.change * value
        if target < 0:
            return Declined(f"We drive {speed_words(options.cruise_mps)}; we cannot go {amount.said} slower than that.")
        way = ("speed.up_by", "speed up") if meaning.change > 0 else ("speed.down_by", "slow down")
        does = f"{way[1]} by {number(value)} m/s, to about {speed_words(target)}, and hold it"
        return _chosen(meaning, options, way[0], target, does, delta_mps=value)
    exemplar, way = ("speed.set_up", "speed up") if value >= options.cruise_mps else ("speed.set_down", "slow down")
    return _chosen(meaning, options, exemplar, value, f"{way} to {speed_words(value)} and hold it")


def _limit(meaning: Meaning, options: Options) -> Chosen | Declined:
    if meaning.amount is None:
        does = f"drive at the speed limit, {speed_words(options.sign_mps)} here"
        return _chosen(meaning, options, "speed.limit", options.sign_mps, does)
    value = meaning.amount.value
    target = options.sign_mps + value
    if target < 0.0:
        return Declined(
            f"The limit here is {speed_words(options.sign_mps)}; we cannot go {meaning.amount.said} below it."
        )
    side = "above" if value > 0 else "below"
    does = f"drive {number(abs(value))} m/s {side} the limit, at {speed_words(target)}"
    return _chosen(meaning, options, "speed.over_limit", target, does)


def _match(meaning: Meaning, options: Options) -> Chosen:
    headway = options.headway(USUAL_HEADWAY_S + options.leaning.headway_s)
    front = options.situation.front
    if front is not None:
        does = f"drive at the speed of the vehicle ahead, now {speed_words(front.speed_mps)}"
        return _chosen(meaning, options, "speed.match_lead", min(front.speed_mps, options.cap_mps), does)
    does = "drive at the mean speed of the vehicles around us, not above the limit"
    return _chosen(meaning, options, "speed.match_traffic", options.own_cap_mps, does, headway=headway)


def _step(meaning: Meaning, options: Options) -> Chosen | Declined:
    """A change without a number: a step of the planner's own, inside the sign and above a crawl."""
    scale = max(0.3, min(1.0, options.cruise_mps / 25.0))
    step = _STEP_MPS.get(meaning.degree, _PLAIN_STEP_MPS) * scale
    leaning = options.leaning.speed_mps
    name = {BIT: "_bit", MUCH: "_much"}.get(meaning.degree, "")
    amount = {BIT: "a little ", MUCH: "a lot "}.get(meaning.degree, "")
    stands = options.speed < options.cruise_mps
    if meaning.change > 0 and stands:
        does = f"set out for what is allowed, {speed_words(options.own_cap_mps)}"
        return _chosen(meaning, options, f"speed.up{name}", options.own_cap_mps, does)
    if meaning.change > 0:
        target = min(options.cruise_mps + max(_FELT_MPS, step + leaning), options.own_cap_mps)
        if target < options.cruise_mps + 0.3:
            return Declined(
                f"We already drive {speed_words(options.cruise_mps)}, and {speed_words(options.own_cap_mps)} is what "
                "is allowed here. I do not go above that by myself; name a speed if you want another."
            )
        does = f"go {amount}faster, to {speed_words(target)}"
        return _chosen(meaning, options, f"speed.up{name}", target, does)
    slowest = _SLOWEST_SHARE * options.sign_mps
    target = max(options.cruise_mps - max(0.5, step - leaning), min(slowest, options.cruise_mps))
    if target > options.cruise_mps - 0.3:
        return Declined(
            f"We only drive {speed_words(options.cruise_mps)}; any slower and we are in the way of others. "
            "Shall I stop?"
        )
    if stands:
        below = speed_words(options.cruise_mps)
        does = f"set out for {speed_words(target)}, {amount}below the {below} that are allowed"
        return _chosen(meaning, options, "speed.set_up", target, does)
    does = f"go {amount}slower, to {speed_words(target)}"
    return _chosen(meaning, options, f"speed.down{name}", target, does)


def choose_style(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for a way of driving or a feeling that asks for one."""
    share, headway, words = _STYLES[meaning.variant]
    if options.speed < options.cruise_mps:
        words = _FROM_A_STAND.get(meaning.variant, words)
    if options.wary and PACES[meaning.variant] > 0:
        share, headway, words = _WARY
    wanted = options.cruise_mps * share + options.leaning.speed_mps
    if share > 1.0:
        target = min(wanted, options.own_cap_mps)  # in a hurry at the limit already, the gap is all that can be gained
    else:
        target = min(max(wanted, _SLOWEST_SHARE * options.sign_mps), options.own_cap_mps)
    target = within_mood(target, PACES[meaning.variant], options.cruise_mps, options.cap_mps)
    headway = min(options.headway(headway + options.leaning.headway_s), API_MAX_HEADWAY_S)
    headway = max(headway, options.headway(0.8))
    does = f"{words}: {speed_words(target)} and {number(headway)} s behind others"
    return _chosen(meaning, options, f"style.{meaning.variant}", target, does, headway=headway)


def choose_resume(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for leaving things as they are, or driving normally again."""
    headway = options.headway(USUAL_HEADWAY_S)
    if meaning.manoeuvre == "keep":
        does = f"change nothing: this lane, at our {speed_words(options.cruise_mps)}"
        return _chosen(meaning, options, "keep.as_is", options.cruise_mps, does)
    does = f"drive normally: at the limit of {speed_words(options.own_cap_mps)}, {number(headway)} s behind others"
    return _chosen(meaning, options, "resume.normal", options.own_cap_mps, does, headway=headway)


def _chosen(
    meaning: Meaning,
    options: Options,
    exemplar: str,
    target: float,
    does: str,
    headway: float | None = None,
    **numbers: float,
) -> Chosen:
    settings: list[tuple[str, float]] = [("target_speed_mps", round(target, 2))]
    if headway is not None:
        settings.append(("time_headway_s", round(headway, 2)))
        numbers["time_headway_s"] = headway
    filled = options.filled(exemplar, meaning.manner, target_speed_mps=target, **numbers)
    return Chosen(filled, meaning.family, does, (), tuple(settings))
