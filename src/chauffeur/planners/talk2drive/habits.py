"""Evidence of a person's earlier trips for parameters: the meaning of such a wish to them, and the speed they like.

Only words and what was driven are used (H: command, action, evaluation). What was said last of such a wish holds. A
remark that tells what had been wanted ("I wanted you to pass that car") says what the wish means from then on; a remark
on the speed moves the speed that was driven, from trip to trip, until nobody complains.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from chauffeur.concept import Feedback, History, HistoryItem
from chauffeur.memory.feedback import PLAIN
from chauffeur.memory.remarks import sort_remark
from chauffeur.planners.onboard.personal import because

SIGN_SETTING: Final = "speed_limit_mps"
"""Among a plan's settings: the limit where it was driven, so that speeds carry over to other roads."""

_STEP: Final = 0.35
"""Share of the driven speed by which a remark of full strength ("much") moves the next one."""
_CURVE: Final = 1.5
"""A mild remark is meant mildly: "a bit" (0.35) moves the speed by 7 %, a plain one (0.6) by 16 %."""
_SLOWEST_SHARE: Final = 0.3
"""Of the limit: below it the car would be in the way."""

Group = Literal["brisk", "calm", "plain"]
_BRISK: Final = ("speed.increase", "speed.max", "style.hurry", "style.sporty", "overtake")
_CALM: Final = ("speed.decrease", "style.relax", "style.comfort", "style.careful", "style.eco", "yield")
_RANK: Final[dict[Group, int]] = {"calm": 0, "plain": 1, "brisk": 2}
_EXACT: Final = (
    "speed.set", "speed.cap", "speed.floor", "speed.limit", "speed.match", "speed.hold", "stop", "pull_over",
)  # fmt: skip
"""What names its own speed, or none."""
_UNREAD: Final = ("", "ask", "refuse", "unusable")

WANTED: Final[dict[str, str]] = {
    "no_overtake": "pass",
    "passed": "stay",
    "not_right": "right",
    "waited": "go",
    "not_waited": "yield",
    "not_parked": "park.nearest",
    "wrong_spot.nearest": "park.nearest",
    "wrong_spot.stadium": "park.stadium",
    "wrong_spot.exit": "park.exit",
    "parked/faster": "faster",
    "parked/slower": "slower",
}
"""What had been wanted, by what the drive is blamed for (`REMARK_KINDS`)."""
_DID: Final[tuple[tuple[str, str], ...]] = (
    ("overtake", "pass"),
    ("follow", "stay"),
    ("lane.keep", "stay"),
    ("lane.right", "right"),
    ("speed.increase", "faster"),
    ("speed.decrease", "slower"),
    ("style.hurry", "hurry"),
    ("style.sporty", "hurry"),
    ("style.", "calm"),
    ("yield", "yield"),
    ("turn.straight", "go"),
)
"""Deeds by the beginning of their intent."""
_SURE: Final = 0.4
"""From this share a remark is taken for what it was sorted as."""


@dataclass(frozen=True, slots=True)
class Meant:
    """The meaning of an earlier trip.

    Attributes:
        kind: As a hint is sorted, e.g. `pass`.
        corrected: Whether they said so afterwards, of a drive that had done something else.
        similarity: Of that wish to the present one, 0..1; below 0 where nothing was compared.
        because: The trip and what was said, a full sentence.
    """

    kind: str
    corrected: bool
    similarity: float
    because: str


@dataclass(frozen=True, slots=True)
class Pace:
    """The speed a person likes.

    Attributes:
        share: Of the speed limit.
        because: Which trip says so, a full sentence; empty where nothing was said against it.
        sign: 1 where it was found too slow last, -1 where too fast, 0 where nothing was said against it.
    """

    share: float
    because: str
    sign: Literal[-1, 0, 1] = 0


def meant_before(history: History, world: str) -> tuple[Meant, ...]:
    """Meanings of the recalled trips in a kind of world, the newest first.

    Args:
        history: What memory recalled.
        world: Kind of road now.
    """
    found = (_meant(item) for item in _newest_first(history, world))
    return tuple(meant for meant in found if meant is not None)


def kind_of(intent: str, route: str = "") -> str:
    """The kind of hint that an intent corresponds to; empty for none.

    Args:
        intent: As the planner tagged it.
        route: Of its parameters: where it parked.
    """
    first = intent.partition("+")[0]
    if first == "park":
        return f"park.{route}" if route in ("nearest", "stadium", "exit") else ""
    return next((kind for beginning, kind in _DID if first.startswith(beginning)), "")


def _meant(item: HistoryItem) -> Meant | None:
    if item.feedback:
        remark = sort_remark(item.feedback[-1].text)
        wanted = WANTED.get(remark.kind, "") if remark.share >= _SURE else ""
        if wanted:
            return Meant(wanted, True, item.similarity, because(item))
    done = kind_of(item.intent, str(_policy(item).get("route", "")))
    if item.feedback and _taken_wrongly(done, item.feedback[-1]):
        done = "faster" if done == "slower" else "slower"
    return Meant(done, False, item.similarity, because(item)) if done else None


def _taken_wrongly(done: str, said: Feedback) -> bool:
    """True if a plain complaint of the pace says that its change went the wrong way."""
    return said.strength >= PLAIN and ((done == "slower" and said.speed > 0) or (done == "faster" and said.speed < 0))


def pace_of(history: History, world: str, intent: str, chosen_share: float) -> Pace | None:
    """The speed a person likes for wishes of this kind; None where no trip says anything.

    What was too slow at ease is too slow in a hurry, and what was too fast in a hurry is too fast at ease; a drive of
    the same kind that nobody complained about is repeated. Later words count more than earlier ones. Nothing that was
    disliked makes a drive faster, unless it was found too slow.

    Args:
        history: What memory recalled.
        world: Kind of road now.
        intent: Of the present wish.
        chosen_share: The speed that would be chosen without memory, as a share of the limit.
    """
    group = _group(intent)
    if group is None:
        return None
    pace, known = Pace(chosen_share, ""), False
    for item in reversed(_newest_first(history, world)):
        settings, of = dict(item.settings), _group(item.intent)
        sign = settings.get(SIGN_SETTING, 0.0)
        if of is None or "target_speed_mps" not in settings or sign <= 0.0 or not item.feedback:
            continue
        driven, said = settings["target_speed_mps"] / sign, item.feedback[-1]
        same = of == group and (group != "plain" or _family(item.intent) == _family(intent))
        step = _STEP * said.strength**_CURVE
        if said.speed > 0 and (same or _RANK[of] < _RANK[group]) and pace.share < driven * (1.0 + step):
            pace, known = Pace(driven * (1.0 + step), because(item), 1), True
        elif said.speed < 0 and (same or _RANK[of] > _RANK[group]) and pace.share > driven * (1.0 - step):
            pace, known = Pace(driven * (1.0 - step), because(item), -1), True
        elif not said.speed and same and said.approval >= 0:
            pace, known = Pace(driven, ""), True
    return pace if known else None


def speed_for(pace: Pace, intent: str, now_mps: float, sign_mps: float, cap_mps: float) -> float | None:
    """The speed to drive, m/s; None where it would not be what the words ask for: faster, or slower, than now."""
    speed = max(_SLOWEST_SHARE * sign_mps, min(pace.share * sign_mps, sign_mps, cap_mps))
    if intent.startswith("speed.increase") and speed < now_mps + 0.1:
        return None
    if intent.startswith("speed.decrease") and speed > now_mps - 0.1:
        return None
    return round(speed, 2)


def _newest_first(history: History, world: str) -> Sequence[HistoryItem]:
    return sorted((item for item in history.items if item.world == world), key=lambda item: item.when, reverse=True)


def _group(intent: str) -> Group | None:
    first = intent.partition("+")[0]
    if first in _UNREAD or first.startswith(_EXACT):
        return None
    if first.startswith(_BRISK):
        return "brisk"
    return "calm" if first.startswith(_CALM) else "plain"


def _family(intent: str) -> str:
    return intent.partition("+")[0].partition(".")[0]


def _policy(item: HistoryItem) -> dict[str, Any]:
    try:
        found = json.loads(item.policy)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}
