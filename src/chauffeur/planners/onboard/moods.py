"""What words that name nothing to do say of the pace: a complaint about it, haste, or a wish for peace.

Only words: who says them and where is for others to weigh. They speak where the model's reading is empty or says the
opposite; what it understood otherwise stands.
"""

from __future__ import annotations

from typing import Final, Literal

from chauffeur.planners.onboard.patterns import said

Mood = Literal["hurry", "ease", ""]
HURRY: Final = "I'm in a hurry."
EASE: Final = "Drive calmly, please."


def pace_complaint(wish: str) -> Literal[-1, 0, 1]:
    """Whether words complain of the pace: 1 wants it faster, -1 slower."""
    slow, fast = _shows("too slow", wish), _shows("too fast", wish)
    return 0 if slow == fast else 1 if slow else -1


def mood_of(wish: str) -> Mood:
    """What somebody is in who says this."""
    if _shows("asks for something else", wish):
        return ""
    relieved = _shows("no haste", wish)
    pressed = not relieved and _shows("haste", wish)
    eased = relieved or _shows("ease", wish)
    if pressed == eased:
        return ""
    return "hurry" if pressed else "ease"


def _shows(what: str, wish: str) -> bool:
    return said("moods.txt", what).search(wish) is not None
