"""Distances to the vehicle ahead."""

from __future__ import annotations

from chauffeur.concept.units import M_PER_CAR_LENGTH
from chauffeur.planners.onboard.exemplars.library import number
from chauffeur.planners.onboard.meaning import BIT, MUCH, Amount, Meaning
from chauffeur.planners.onboard.options import (
    API_MAX_HEADWAY_S,
    SAFE_HEADWAY_S,
    USUAL_HEADWAY_S,
    Chosen,
    Declined,
    Options,
)

_WIDER = {BIT: (1.15, 3.0), MUCH: (1.8, 12.0)}
_PLAIN_WIDER = (1.4, 6.0)
"""Factor and least difference, m, of a wider gap without a number."""
_CLOSER = {BIT: 0.88, MUCH: 0.0}
_PLAIN_CLOSER = 0.7
_HEADWAY_STEP_S = {BIT: 0.2, MUCH: 0.7}
_PLAIN_HEADWAY_STEP_S = 0.4
_FARTHEST_M = 95.0
"""Beyond it the vehicle ahead is out of sight for the driving APIs."""

_NOBODY = "There is no vehicle ahead of us within 100 m"


def choose_gap(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for a wish about the distance to the vehicle ahead."""
    amount = meaning.amount
    if amount is not None and amount.dimension == "time":
        return _seconds(meaning, amount.value, options)
    front = options.situation.front
    if front is None and options.front_known:
        return _nobody(meaning, options)
    now = front.distance_m if front is not None else M_PER_CAR_LENGTH + USUAL_HEADWAY_S * options.speed
    if amount is None:
        if meaning.variant == "hold":
            return _chosen(meaning, options, "gap.hold", now, f"keep the {number(now)} m to the vehicle ahead")
        return _step(meaning, now, options)
    return _named(meaning, amount, now, options)


def _named(meaning: Meaning, amount: Amount, now: float, options: Options) -> Chosen:
    value = amount.value
    if amount.bound == "at_most":
        return _chosen(meaning, options, "gap.at_most", value, f"stay within {number(value)} m of the vehicle ahead")
    if amount.bound == "at_least":
        does = f"never get closer than {number(value)} m to the vehicle ahead"
        return _chosen(meaning, options, "gap.at_least", value, does)
    if amount.frame == "factor":
        gap = value * now
        exemplar = "gap.multiply_wider" if value >= 1 else "gap.multiply_closer"
        does = f"make the gap {number(value)} times what it is, about {number(gap)} m, and keep it"
        return _chosen(meaning, options, exemplar, gap, does, factor=value)
    if amount.frame == "relative":
        gap = now + meaning.change * value
        way = ("gap.wider_by", "drop back") if meaning.change > 0 else ("gap.closer_by", "close up")
        does = f"{way[1]} by {number(value)} m, to about {number(gap)} m, and keep that gap"
        return _chosen(meaning, options, way[0], gap, does, delta_m=value)
    exemplar, way = ("gap.set_wider", "drop back") if value > now else ("gap.set_closer", "close up")
    does = f"{way} from {number(now)} m to {number(value)} m behind the vehicle ahead and keep that gap"
    return _chosen(meaning, options, exemplar, value, does)


def _step(meaning: Meaning, now: float, options: Options) -> Chosen | Declined:
    """A change without a number, inside what is safe and what can be seen."""
    extra = options.leaning.headway_s * options.speed
    if meaning.change > 0:
        factor, least = _WIDER.get(meaning.degree, _PLAIN_WIDER)
        gap = max(now * factor, now + least) + max(0.0, extra)
        gap = min(max(gap, options.least_gap_m), _FARTHEST_M)
        if gap < now + 1.0:
            return Declined(
                f"The vehicle ahead is {number(now)} m away already; further back I would lose sight of it."
            )
        suffix = {BIT: "_bit", MUCH: "_much"}.get(meaning.degree, "")
        does = f"drop back from {number(now)} m to {number(gap)} m behind the vehicle ahead and keep that gap"
        return _chosen(meaning, options, f"gap.wider{suffix}", gap, does)
    front = options.situation.front
    following = front.speed_mps if front is not None else options.speed
    smallest = M_PER_CAR_LENGTH + options.headway(SAFE_HEADWAY_S) * max(following, options.speed) + 1.0
    gap = max(_CLOSER.get(meaning.degree, _PLAIN_CLOSER) * now + max(0.0, extra), smallest, 12.0)
    if gap > now - 1.0:
        return Declined(
            f"The vehicle ahead is {number(now)} m away; closer than {number(smallest)} m I do not drive by myself at "
            "this speed. Name a distance if you want another."
        )
    suffix = {BIT: "_bit", MUCH: "_much"}.get(meaning.degree, "")
    does = f"close up from {number(now)} m to {number(gap)} m behind the vehicle ahead and keep that gap"
    return _chosen(meaning, options, f"gap.closer{suffix}", gap, does)


def _seconds(meaning: Meaning, seconds: float, options: Options) -> Chosen:
    gap = M_PER_CAR_LENGTH + seconds * options.speed
    does = f"stay {number(seconds)} s behind the vehicle ahead, about {number(gap)} m at our speed"
    filled = options.filled("gap.seconds", meaning.manner, time_headway_s=seconds, **_pace(meaning))
    return Chosen(filled, meaning.family, does, (), (("time_headway_s", round(seconds, 2)),))


def _nobody(meaning: Meaning, options: Options) -> Chosen | Declined:
    if meaning.amount is not None or meaning.change == 0:
        return Declined(f"{_NOBODY}, so there is no distance to keep. Tell me again when one is there.")
    step = _HEADWAY_STEP_S.get(meaning.degree, _PLAIN_HEADWAY_STEP_S) * meaning.change
    wanted = USUAL_HEADWAY_S + step + options.leaning.headway_s
    headway = min(max(options.headway(wanted), options.headway(SAFE_HEADWAY_S)), API_MAX_HEADWAY_S)
    does = f"keep {number(headway)} s to the next vehicle we come up to"
    filled = options.filled("gap.coming", meaning.manner, time_headway_s=headway)
    return Chosen(filled, meaning.family, does, (f"{_NOBODY}.",), (("time_headway_s", round(headway, 2)),))


def choose_follow(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for staying behind the vehicle ahead."""
    headway = options.headway(USUAL_HEADWAY_S + options.leaning.headway_s)
    settings = (("time_headway_s", round(headway, 2)),)
    if meaning.variant == "no overtaking":
        filled = options.filled("follow.no_overtake", meaning.manner, time_headway_s=headway)
        return Chosen(
            filled, "follow", f"stay in this lane and overtake nobody, {number(headway)} s behind", (), settings
        )
    if options.situation.front is None and options.front_known:
        return Declined(f"{_NOBODY} to follow.")
    filled = options.filled("follow.lead", meaning.manner, time_headway_s=headway, **_pace(meaning))
    return Chosen(filled, "follow", f"follow the vehicle ahead, {number(headway)} s behind it", (), settings)


def choose_yield(meaning: Meaning, options: Options) -> Chosen | Declined:
    """Exemplar for letting somebody in or by."""
    front = options.situation.front
    if front is None:
        target = max(options.speed - 3.0, 0.5 * options.speed)
        filled = options.filled("yield.ease", meaning.manner, target_speed_mps=target)
        does = f"ease off to {number(target)} m/s for a while, so that others can go first"
        return Chosen(filled, "yield", does, (), (("target_speed_mps", round(target, 2)),))
    gap = min(max(front.distance_m + 12.0, M_PER_CAR_LENGTH + 2.0 * options.speed), _FARTHEST_M)
    does = f"open the gap ahead from {number(front.distance_m)} m to {number(gap)} m, so that there is room"
    return _chosen(meaning, options, "yield.open_gap", gap, does)


def _pace(meaning: Meaning) -> dict[str, float]:
    """Rates at which a gap may close and open, m/s."""
    close, opening = {"gentle": (2.0, 2.5), "swift": (8.0, 9.0)}.get(meaning.manner, (6.5, 5.0))
    return {"close_mps": close, "open_mps": opening}


def _chosen(meaning: Meaning, options: Options, exemplar: str, gap: float, does: str, **numbers: float) -> Chosen:
    values: dict[str, float] = {"gap_m": gap, "floor_m": min(8.0, gap), **_pace(meaning), **numbers}
    filled = options.filled(exemplar, meaning.manner, **values)
    return Chosen(filled, meaning.family, does, (), (("gap_m", round(gap, 2)),))
