"""What a remark on the road means to a driver who sees the same road: passengers comment more often than they command.

"He is crawling" asks to pass, behind a slower car with a lane beside it; "people behind us want to get by" asks for the
right lane; "nobody is coming" asks to go. The same words mean nothing where the road does not fit them, and what is
forbidden stays forbidden: a remark becomes a wish that passes every check.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from chauffeur.concept import Situation
from chauffeur.planners.onboard.patterns import said
from chauffeur.planners.talk2drive.lanes import held_up, last_lane
from chauffeur.planners.talk2drive.words import WORDS

OVERTAKE: Final = "Overtake the car ahead."
STAY: Final = "Stay behind the car ahead."
MOVE_RIGHT: Final = "Change to the right lane."
GO: Final = "Go straight on."
GIVE_WAY: Final = "Let the others go first."


@dataclass(frozen=True, slots=True)
class Remark:
    """A remark as it is taken.

    Attributes:
        wish: What it asks for, in words that can be read.
        because: What it was taken for, a full sentence.
    """

    wish: str
    because: str


def taken_for(wish: str, situation: Situation) -> Remark | None:
    """What a remark asks for here; None where it is no remark on this road.

    Args:
        wish: The words.
        situation: Where the car is, and who is around it.
    """
    if situation.world == "highway":
        return _on_highway(wish, situation)
    return _at_crossing(wish) if situation.world == "intersection" else None


def misread(wish: str, intent: str, situation: Situation) -> Remark | None:
    """What words mean that were read as `intent`, though they hold nothing of it; None where they may stand as read.

    Args:
        wish: The words.
        intent: As which they were read.
        situation: Where the car is, and who is around it.
    """
    if situation.world != "highway":
        return None
    if situation.lane_index == 0 and situation.lane_index < last_lane(situation):
        left = intent.startswith("lane.left") and not _asks_for_left(wish)
        if left or (intent == "pull_over" and not situation.emergency_lane and _is("to the right", wish)):
            return Remark(MOVE_RIGHT, "I take it that you do not want to be in the left lane.")
    if situation.front is None:
        return None
    if intent.startswith("overtake") and not _is("of passing", wish) and _is("of staying", wish):
        return Remark(STAY, "I take it that nobody need be passed.")
    if situation.lane_index == 0 or _is("content", wish):
        return None
    if intent.startswith("gap.") and held_up(situation) and not _is("of the gap", wish):
        return Remark(OVERTAKE, "I take it that the car ahead is too slow for you.")
    if intent == "lane.left" and _is("goes past", wish) and not _is("no passing", wish):
        return Remark(OVERTAKE, "Who goes to the left to get past overtakes.")
    if intent == "overtake.right" and not _is("turns", wish):
        return Remark(OVERTAKE, "Others are passed on the left.")
    return None


def stands(wish: str) -> bool:
    """Whether words ask for a stop, and for nothing else."""
    return said("road.txt", "stands", WORDS).fullmatch(wish.strip(" .!")) is not None


def _on_highway(wish: str, situation: Situation) -> Remark | None:
    leftmost, last = situation.lane_index == 0, last_lane(situation)
    no_passing = _is("no passing", wish)
    if leftmost and situation.lane_index < last:
        meant = _is("left lane", wish) or _is("behind us", wish) or _is("right free", wish)
        if meant and not _asks_for_left(wish):
            return Remark(MOVE_RIGHT, "I take it that you do not want to be in the left lane.")
    if situation.lane_index < last and _is("exit", wish) and not _is("not that exit", wish):
        return Remark(MOVE_RIGHT, "Exits are on the right.")
    if situation.front is None:
        return None
    unwilling = _is("hangs behind", wish)
    if not unwilling and (no_passing or _is("stays behind", wish)):
        return Remark(STAY, "I take it that nobody need be passed.")
    if leftmost or _is("content", wish):
        return None
    slow = _is("slow others", wish) and not _is("about us", said("road.txt", "in front of us", WORDS).sub("", wish))
    if slow or unwilling or _is("detained", wish) or _is("left free", wish):
        return Remark(OVERTAKE, "I take it that the car ahead is too slow for you.")
    return None


def _at_crossing(wish: str) -> Remark | None:
    if _is("gives way", wish) and not _is("nobody", wish):
        return Remark(GIVE_WAY, "You want others to go first.")
    if _is("crosses", wish) and not _is("waits", wish) and not _is("turns", wish):
        return Remark(GO, "You want to get across.")
    if _is("when free", wish) or stands(wish):
        return None
    if _is("nobody", wish):
        return Remark(GO, "I take it that there is nobody to wait for.")
    if _is("coming", wish):
        return Remark(GIVE_WAY, "I take it that others are to go first.")
    return None


def _asks_for_left(wish: str) -> bool:
    return _is("asks for left", wish) and not _is("out of", wish)


def _is(what: str, wish: str) -> bool:
    return said("road.txt", what, WORDS).search(wish) is not None
