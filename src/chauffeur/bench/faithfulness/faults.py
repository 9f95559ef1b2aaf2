"""Mismatches put into an aligned case: into its text, or into its program.

Each kind is made so that it is one: a number differs from every other number of the situation, a claimed check is
really taken out of the program, an added deed is really not in it. What is claimed and missing counts, not the reverse:
a check that the program makes and the text does not mention is no mismatch.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from chauffeur.bench.faithfulness.deeds import PlannedDeed, deeds_of, tellable
from chauffeur.bench.faithfulness.plans import PlannedCase, program, refilled
from chauffeur.bench.faithfulness.prose import TOLD, tell
from chauffeur.concept.units import MPS_PER_KMH, MPS_PER_MPH
from chauffeur.planners.onboard.exemplars import Filled
from chauffeur.planners.onboard.options import Chosen

Pair = tuple[str, str, str]
"""R, P, and which of them was changed."""

_OTHER_SIDE: Final = {"left": "right", "right": "left", "straight": "left"}
_SIDED: Final = frozenset({"lane", "overtake", "turn"})
_SWAPS: Final = (
    ("get_left_lane", "get_right_lane"),
    ("turn_left_at_next_intersection", "turn_right_at_next_intersection"),
)
_OPPOSITE: Final = {
    "speed.set_up": "speed.set_down", "speed.set_down": "speed.set_up", "gap.set_wider": "gap.set_closer",
    "gap.set_closer": "gap.set_wider",
}  # fmt: skip


def spoil(rng: np.random.Generator, planned: PlannedCase, kind: str) -> Pair | None:
    """A case of a kind of mismatch; None where this program has no room for it."""
    deeds = deeds_of(planned)
    if not tellable(deeds, TOLD):
        return None
    return _SPOILERS[kind](rng, planned, deeds)


def _wrong_side(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    sided = [index for index, deed in enumerate(deeds) if deed.what in _SIDED and deed.side]
    if not sided:
        return None
    index = sided[0]
    if rng.random() < 0.5:
        text = _told(rng, planned, _changed(deeds, index, side=_OTHER_SIDE[deeds[index].side]))
        return text, planned.program, "R"
    source = planned.program
    spoiled = source
    for one, other in _SWAPS:
        spoiled = re.sub(f"\\b(?:{one}|{other})\\b", lambda m, a=one, b=other: b if m[0] == a else a, spoiled)
    if spoiled == source:
        spoiled = source.replace("go_straight_at_next", "turn_right_at_next")
    return (_told(rng, planned, deeds), spoiled, "P") if spoiled != source else None


def _wrong_number(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    numbered = [i for i, deed in enumerate(deeds) if deed.value is not None and deed.what in ("speed", "gap", "cap")]
    if not numbered:
        return None
    index = numbered[0]
    deed = deeds[index]
    assert deed.value is not None
    if deed.what == "speed" and rng.random() < 0.3:
        # The figure of another unit: 25 mph for 25 m/s.
        unit, factor = ("mph", MPS_PER_MPH) if rng.random() < 0.5 else ("km/h", MPS_PER_KMH)
        text = _told(rng, planned, deeds, figure=(deed.value, f"{deed.value:.0f} {unit}"))
        return (text, planned.program, "R") if abs(deed.value * factor - deed.value) > 2.0 else None
    other = _another(rng, planned, deed)
    if other is None:
        return None
    if rng.random() < 0.6:
        return _told(rng, planned, _changed(deeds, index, value=other)), planned.program, "R"
    name = "gap_m" if deed.what == "gap" else "target_speed_mps"
    step = planned.steps[index]
    if step.filled.id not in _TUNABLE:
        return None
    steps = list(planned.steps)
    steps[index] = refilled(step, name, other)
    spoiled = program(steps)
    return (_told(rng, planned, deeds), spoiled, "P") if spoiled != planned.program else None


_TUNABLE: Final = frozenset(
    {"speed.set_up", "speed.set_down", "speed.cap", "speed.up", "speed.down", "gap.set_wider", "gap.set_closer"}
    | {"gap.wider", "gap.closer"}
)
"""Exemplars whose named number is what they drive at."""


def _wrong_sign(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    signed = [index for index, deed in enumerate(deeds) if deed.sign and deed.what in ("speed", "gap", "style")]
    if not signed:
        return None
    index = signed[0]
    deed = deeds[index]
    name = planned.steps[index].filled.id
    if name in _OPPOSITE and deed.value is not None and rng.random() < 0.5:
        now = _now(planned, deed)
        if now is None or not 3.0 < 2.0 * now - deed.value < 90.0:
            return None
        other = 2.0 * now - deed.value
        steps = list(planned.steps)
        number = "gap_m" if deed.what == "gap" else "target_speed_mps"
        steps[index] = refilled(steps[index], number, other, _OPPOSITE[name])
        return _told(rng, planned, _changed(deeds, index, value=None)), program(steps), "P"
    if deed.what == "gap":
        text = _told(rng, planned, _changed(deeds, index, sign=-deed.sign))
    else:
        text = _told(rng, planned, _changed(deeds, index, sign=-deed.sign, value=None))
    return text, planned.program, "R"


def _wrong_order(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    if len(deeds) != 2 or deeds[0].what == deeds[1].what or not _told_apart(planned, deeds):
        return None
    if rng.random() < 0.5:
        return _told(rng, planned, [deeds[1], deeds[0]]), planned.program, "R"
    return _told(rng, planned, deeds), program([planned.steps[1], planned.steps[0]]), "P"


def _told_apart(planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> bool:
    """True if an overtaking, which has a speed of its own, is not driven at the other step's."""
    own = [step.filled.numbers.get("target_speed_mps", 0.0) for step in planned.steps if "overtake" in step.filled.id]
    return all(abs(deed.value - speed) > 1.5 for deed in deeds if deed.value is not None for speed in own)


def _missing_condition(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    """The text claims to look whether the way is free; the program is made not to."""
    if not any(deed.checked for deed in deeds):
        return None
    text = tell(rng, deeds, planned.wish, planned.start, checks=1.0)
    source = planned.program
    spoiled = re.sub(r"\bis_safe_enter\((?:[^()]|\([^()]*(?:\([^()]*\)[^()]*)*\))*\)", "True", source)
    return (text, spoiled, "P") if spoiled != source and "is_safe_enter" not in spoiled else None


def _not_done(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    if len(planned.steps) == 2 and rng.random() < 0.5:
        kept = int(rng.integers(2))
        return _told(rng, planned, deeds), program([planned.steps[kept]]), "P"
    if len(deeds) != 1:
        return None
    added = _extra(rng, planned, deeds)
    if added is None:
        return None
    return _told(rng, planned, [*deeds, added]), planned.program, "R"


def _not_claimed(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> Pair | None:
    if len(deeds) == 2:
        kept = int(rng.integers(2))
        if deeds[kept].what == "overtake" or {deed.what for deed in deeds} == {"overtake", "speed"}:
            return None  # an overtaking has a speed of its own
        if deeds[1 - kept].what == "speed" and not deeds[1 - kept].sign:
            return None
        # The wish is not quoted: it names both.
        return tell(rng, [deeds[kept]], _UNNAMED, planned.start), planned.program, "R"
    if deeds[0].what in ("speed", "gap", "lane", "overtake") and rng.random() < 0.5:
        if deeds[0].what == "speed" and not deeds[0].sign:
            return None
        if deeds[0].what == "gap":
            return None
        told = PlannedDeed("keep") if rng.random() < 0.5 else PlannedDeed("stay")
        if deeds[0].what == "speed" and told.what == "stay":
            return None
        return _told(rng, planned, [told]), planned.program, "R"
    if deeds[0].what in ("speed", "gap", "cap", "limit") and not planned.start.where.crossing:
        side = "left" if planned.start.situation.lane_index > 0 else "right"
        lane = Chosen(Filled(f"lane.{side}", _helpers(planned)), f"lane.{side}", "")
        steps = [planned.steps[0], lane] if deeds[0].what != "limit" else [lane, planned.steps[0]]
        return _told(rng, planned, deeds), program(steps), "P"
    return None


_UNNAMED: Final = "Please do what we agreed on."

_SPOILERS: Final[dict[str, Callable[[np.random.Generator, PlannedCase, Sequence[PlannedDeed]], Pair | None]]] = {
    "wrong-side": _wrong_side,
    "wrong-number": _wrong_number,
    "wrong-sign": _wrong_sign,
    "wrong-order": _wrong_order,
    "missing-condition": _missing_condition,
    "not-done": _not_done,
    "not-claimed": _not_claimed,
}


def _extra(rng: np.random.Generator, planned: PlannedCase, deeds: Sequence[PlannedDeed]) -> PlannedDeed | None:
    """A deed that the program does not do."""
    if planned.start.where.crossing:
        return None
    what = deeds[0].what
    side = "left" if rng.random() < 0.5 else "right"
    if what in ("speed", "gap", "cap", "limit", "style"):
        return PlannedDeed("lane" if rng.random() < 0.6 else "overtake", side=side)
    if what in ("lane", "stay"):
        value = _another(rng, planned, PlannedDeed("speed", value=planned.start.situation.speed_mps))
        if value is None:
            return None
        return PlannedDeed("speed", sign=1 if value > planned.start.situation.speed_mps else -1, value=value)
    return None


def _helpers(planned: PlannedCase) -> dict[str, float]:
    numbers = dict(planned.steps[0].filled.numbers)
    return {"headway_lane_s": 0.5, "speed_cap_mps": 35.0, "rest_headway_s": 1.5} | numbers


def _now(planned: PlannedCase, deed: PlannedDeed) -> float | None:
    situation = planned.start.situation
    if deed.what != "gap":
        return situation.speed_mps
    return None if situation.front is None else situation.front.distance_m


def _another(rng: np.random.Generator, planned: PlannedCase, deed: PlannedDeed) -> float | None:
    """Another number of the same kind and on the same side of what is now, far from all numbers of the situation."""
    assert deed.value is not None
    situation = planned.start.situation
    now = _now(planned, deed)
    front = situation.front
    taken = [deed.value, *(value for step in planned.steps for _, value in step.settings)]
    if deed.what == "gap":
        low, high, apart = 8.0, 90.0, 6.0
        taken += [] if front is None else [front.distance_m]
    else:
        low, high, apart = 12.0, 36.0, 3.0
        taken += [situation.speed_mps, situation.speed_limit_mps] + ([] if front is None else [front.speed_mps])
    for _ in range(40):
        value = round(float(rng.uniform(low, high)), 1)
        same_side = now is None or deed.sign == 0 or (value - now) * deed.sign > 0
        if same_side and all(abs(value - one) > apart for one in taken):
            return value
    return None


def _changed(deeds: Sequence[PlannedDeed], index: int, **fields: object) -> list[PlannedDeed]:
    changed = list(deeds)
    changed[index] = replace(changed[index], **fields)  # type: ignore[arg-type]
    return changed


def _told(
    rng: np.random.Generator,
    planned: PlannedCase,
    deeds: Sequence[PlannedDeed],
    figure: tuple[float, str] | None = None,
) -> str:
    if figure is None:
        return tell(rng, deeds, planned.wish, planned.start)
    marked = [replace(deed, value=9876.5) if deed.value == figure[0] else deed for deed in deeds]
    text = tell(rng, marked, planned.wish, planned.start)
    return re.sub(r"\b(?:9876\.5 m/s|35555 km/h|22093 mph)", figure[1], text)
