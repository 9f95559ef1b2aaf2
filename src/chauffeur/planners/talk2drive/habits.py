"""What a person's earlier trips say about parameters: what such a wish means to them, and how fast they like it then.

Only words and what was driven are used (H: command, action, evaluation). What was said last of such a wish holds. A
remark that tells what had been wanted ("I wanted you to pass that car") says what the wish means from then on; a remark
on the speed moves the speed that was driven, from trip to trip, until nobody complains.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

from chauffeur.concept import History, HistoryItem

SIGN_SETTING: Final = "speed_limit_mps"
"""Among a plan's settings: the limit where it was driven, so that speeds carry over to other roads."""

_STEP: Final = 0.35
"""Share of the driven speed by which a remark of full strength ("much") moves the next one."""
_CURVE: Final = 1.5
"""A mild remark is meant mildly: "a bit" (0.35) moves the speed by 7 %, a plain one (0.6) by 16 %."""
_SLOWEST_SHARE: Final = 0.3
"""Of the limit: below it the car would be in the way."""
_ALIKE: Final = 0.6
"""From this similarity a wish that was not understood counts as the same one said again."""

Group = Literal["brisk", "calm", "plain"]
_BRISK: Final = ("speed.increase", "speed.max", "style.hurry", "style.sporty", "overtake")
_CALM: Final = ("speed.decrease", "style.relax", "style.comfort", "style.careful", "style.eco", "yield")
_RANK: Final[dict[Group, int]] = {"calm": 0, "plain": 1, "brisk": 2}
_EXACT: Final = (
    "speed.set",
    "speed.cap",
    "speed.floor",
    "speed.limit",
    "speed.match",
    "speed.hold",
    "stop",
    "pull_over",
)
"""What names its own speed, or none."""
_UNREAD: Final = ("", "ask", "refuse", "unusable")

_MEANT: Final = re.compile(
    r"\b(?:i (?:had )?(?:wanted|expected|asked) you to|i meant|you should (?:rather )?have"
    r"|you were (?:supposed|meant) to|when i say (?:that|this|so),?)\b[:,]?\s*(?P<deed>.+)",
    re.IGNORECASE,
)
"""What was wanted follows."""
_ANOTHER_TIME: Final = re.compile(r"\b(?:next time|in future|from now on)\b,?", re.IGNORECASE)
_REPROACH: Final = re.compile(r"\b(?:why did|you should(?:n't| not) have|wrong)\b", re.IGNORECASE)
"""What was wanted follows in the next sentence."""
_NO_PARKING: Final = re.compile(
    r",?\s*\b(?:not to|do not|don't|did not want to|didn't want to|no) park(?:ing)?\b(?: yet)?,?"
    r"(?:\s*(?:just|only to)\b)?",
    re.IGNORECASE,
)
"""What is said not to be wanted, in a lot: the rest says what is."""
_SENTENCES: Final = re.compile(r"[^.!?]+[.!?]?")
_DEED: Final = re.compile(
    r"\b(?:overt\w+|pass\w*|get past|behind|follow\w*|lanes?|left|right|park\w*|spot|straight|turn\w*|stop\w*|wait\w*"
    r"|yield\w*|give way)\b",
    re.IGNORECASE,
)
"""A remark without any of these is on how it was done, not on what."""


@dataclass(frozen=True, slots=True)
class Meaning:
    """What a wish means to a person.

    Attributes:
        words: As a wish that can be read.
        because: Which trip says so, a full sentence.
    """

    words: str
    because: str


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a person likes it.

    Attributes:
        share: Of the speed limit.
        because: Which trip says so, a full sentence; empty where nothing was said against it.
    """

    share: float
    because: str


def meaning_of(history: History, world: str, intent: str) -> Meaning | None:
    """What a person means by a wish that was first read as `intent`; None where nothing says that it is not that.

    Args:
        history: What memory recalled.
        world: Kind of road now.
        intent: Of the present wish as it reads without memory; `ask` or `refuse` where it does not.
    """
    for item in _newest_first(history, world):
        parts = item.intent.split("+")
        again = intent in parts if intent not in _UNREAD else item.similarity >= _ALIKE
        if not again or (not item.feedback and len(parts) == 1):
            continue
        meant = meant_by(item.feedback[-1].text) if item.feedback else ""
        if meant:
            return Meaning(meant, _because(item))
        if len(parts) > 1 and parts[-1] == intent:  # it was put right before, and nothing more was said against it
            words = _again(item, parts[0])
            return Meaning(words, f'"{item.instruction[:80]}" meant that before{_day(item)}.') if words else None
        if item.feedback:
            return None
    return None


def meant_by(said: str) -> str:
    """What a remark says should have been done, as a wish; empty where it says nothing of the kind."""
    deed, reproached, moves_on = "", False, False
    for sentence in _SENTENCES.findall(said):
        found = _MEANT.search(sentence)
        told = found["deed"] if found is not None else sentence
        told_so = found is not None or reproached or _ANOTHER_TIME.search(told) is not None
        no_parking = _NO_PARKING.search(told) is not None
        told = _NO_PARKING.sub("", _ANOTHER_TIME.sub("", told)).strip(" ,:.!?").removeprefix("I ")
        if told and (no_parking or (told_so and (moves_on or _DEED.search(told)))):
            deed = told
        reproached = reproached or _REPROACH.search(sentence) is not None
        moves_on = moves_on or no_parking
    return f"{deed[0].upper()}{deed[1:]}." if deed else ""


def pace_of(history: History, world: str, intent: str, chosen_share: float) -> Pace | None:
    """The speed a person likes for wishes of this kind; None where no trip says anything.

    What was too slow at ease is too slow in a hurry, and what was too fast in a hurry is too fast at ease; a drive of
    the same kind that nobody complained about is repeated. Later words count more than earlier ones.

    Args:
        history: What memory recalled.
        world: Kind of road now.
        intent: Of the present wish.
        chosen_share: The speed that would be chosen without memory, as a share of the limit.
    """
    group = _group(intent)
    if group is None:
        return None
    share, because, known = chosen_share, "", False
    for item in reversed(_newest_first(history, world)):
        settings, of = dict(item.settings), _group(item.intent)
        sign = settings.get(SIGN_SETTING, 0.0)
        if of is None or "target_speed_mps" not in settings or sign <= 0.0 or not item.feedback:
            continue
        driven, said = settings["target_speed_mps"] / sign, item.feedback[-1]
        same = of == group and (group != "plain" or _family(item.intent) == _family(intent))
        step = _STEP * said.strength**_CURVE
        if said.speed > 0 and (same or _RANK[of] < _RANK[group]) and share < driven * (1.0 + step):
            share, because, known = driven * (1.0 + step), _because(item), True
        elif said.speed < 0 and (same or _RANK[of] > _RANK[group]) and share > driven * (1.0 - step):
            share, because, known = driven * (1.0 - step), _because(item), True
        elif not said.speed and same:
            share, because, known = driven, "", True
    return Pace(share, because) if known else None


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


_AGAIN: Final[dict[str, str]] = {
    "overtake": "Overtake the car ahead.",
    "follow": "Stay behind the car ahead.",
    "lane.left": "Change to the left lane.",
    "lane.right": "Change to the right lane.",
    "lane.keep": "Stay in this lane.",
    "turn.left": "Turn left.",
    "turn.right": "Turn right.",
    "turn.straight": "Go straight on.",
}
_PARK_AGAIN: Final[dict[str, str]] = {
    "nearest": "Park in the nearest spot.",
    "stadium": "Park near the stadium.",
    "exit": "Park near the exit.",
}


def _again(item: HistoryItem, intent: str) -> str:
    """What was done then, as a wish."""
    if intent == "park":
        place = str(_policy(item).get("route", ""))
        return _PARK_AGAIN.get(place, f"Park in spot {place}." if place else "")
    return next((words for known, words in _AGAIN.items() if intent.startswith(known)), "")


def _policy(item: HistoryItem) -> dict[str, Any]:
    try:
        found = json.loads(item.policy)
    except ValueError:
        return {}
    return found if isinstance(found, dict) else {}


def _because(item: HistoryItem) -> str:
    said = " ".join(item.feedback[-1].text.split())[:80] if item.feedback else ""
    words = f', you said "{said}"' if said else ""
    return f'After "{item.instruction[:80]}"{_day(item)}{words}; I keep to that.'


def _day(item: HistoryItem) -> str:
    return f" on {item.when[:10]}" if item.when else ""
